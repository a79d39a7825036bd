"""Passes of a renderer over a file.

`python -m bench.media.one RENDERER FILE MODE SPP SECONDS OUT`

RENDERER is clpt or an integrator of Mitsuba. Passes of SPP samples with different seeds are made
until they took SECONDS of processor time; the first, which compiles, does not count. OUT (.npz)
gets `passes` (n, h, w, 3) float32 and `seconds`, of a pass.
"""

from __future__ import annotations

import dataclasses
import os
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Pass = Callable[[int], NDArray[np.float32]]
FEWEST = 3


def _clpt(file: str, mode: Any, spp: int) -> Pass:
    import clpt

    scene = clpt.load(file)
    scene.film = dataclasses.replace(scene.film, mode=mode)
    renderer = clpt.Renderer(scene, threads=1)

    def render(seed: int) -> NDArray[np.float32]:
        renderer.reset(seed=seed)
        renderer.run(spp)
        return np.asarray(renderer.image(), np.float32)[..., :3]

    return render


def _mitsuba(file: str, mode: str, spp: int, integrator: str) -> Pass:
    import drjit
    import mitsuba

    from bench.workers import find_llvm

    find_llvm()
    mitsuba.set_variant(f"llvm_ad_{mode}")
    drjit.set_thread_count(1)
    scene = mitsuba.load_file(file, integrator=integrator)
    return lambda seed: np.array(mitsuba.render(scene, spp=spp, seed=seed))[..., :3]


def main(renderer: str, file: str, mode: str, spp: str, seconds: str, out: str) -> None:
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    ours = renderer == "clpt"
    count = int(spp)
    render = _clpt(file, mode, count) if ours else _mitsuba(file, mode, count, renderer)
    render(0)
    passes: list[NDArray[np.float32]] = []
    begin = time.process_time()
    while len(passes) < FEWEST or time.process_time() - begin < float(seconds):
        passes.append(render(1 + len(passes)))
    took = (time.process_time() - begin) / len(passes)
    np.savez(out, passes=np.array(passes), seconds=took)


if __name__ == "__main__":
    main(*sys.argv[1:])
