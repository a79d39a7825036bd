"""Renderers in processes of their own, each held to the same cores and threads.

A worker is a process that has a scene open and renders it on demand. How many threads an OpenCL
runtime or Mitsuba uses is settled before it is loaded, so nothing here imports either at its top.
"""

from __future__ import annotations

import glob
import multiprocessing
import os
import re
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

_open: Any = None  # what this process renders


@dataclass(frozen=True)
class Shot:
    """A picture: (h, w, 3) float32, and the seconds from the call to the picture on the host.

    cpu: processor time of the process meanwhile, which other work on the machine hardly moves.
    """

    image: np.ndarray
    seconds: float
    cpu: float


class Worker:
    """A renderer in its own process with a scene open.

    renderer: "clpt" or "mitsuba"; sampler: by the name that the renderer gives it; cores: those it
    may run on, as many threads.
    """

    def __init__(
        self, renderer: str, scene: Path, mode: str, sampler: str, cores: Sequence[int]
    ) -> None:
        self.renderer, self.sampler = renderer, sampler
        self._pool = ProcessPoolExecutor(
            1, multiprocessing.get_context("spawn"), _begin, (tuple(cores),)
        )
        opener = {"clpt": Clpt, "mitsuba": Mitsuba}[renderer]
        self.about: str = self._pool.submit(_start, opener, scene, mode, sampler).result()

    def render(self, spp: int, number: int) -> Shot:
        """A picture; of different numbers, with independent samples."""
        return self._pool.submit(_render, spp, number).result()

    def stages(self, spp: int) -> dict[str, Any]:
        """Milliseconds by kernel and rays of a render of its own, of clpt alone."""
        return self._pool.submit(_stages, spp).result()

    def close(self) -> None:
        """End the process."""
        self._pool.shutdown()


class Clpt:
    """Renders with clpt; new numbers are further samples of the same sequence."""

    def __init__(self, scene: Path, mode: str, sampler: str):
        import dataclasses

        import clpt
        from clpt.scene import kinds

        self.scene = clpt.load(scene)
        self.scene.film = dataclasses.replace(self.scene.film, mode=mode)
        self.scene.sampler = kinds("sampler")[sampler]()
        self.renderer = clpt.Renderer(self.scene)
        info = self.renderer.device.info
        self.about = f"clpt, {info.label}, {info.version}"

    def render(self, spp: int, number: int) -> np.ndarray:
        self.renderer.reset(first_sample=number * spp)
        self.renderer.run(spp)
        return self.renderer.image()

    def stages(self, spp: int) -> dict[str, Any]:
        import clpt

        renderer = clpt.Renderer(self.scene, profiling=True, looped=False)
        renderer.run(spp)
        wavefront = renderer._wavefront
        timings = wavefront.timings.collect()
        return {
            "milliseconds": {name: round(t.seconds * 1e3, 2) for name, t in timings.items()},
            "rays": {"closest": wavefront.counts.closest, "shadow": wavefront.counts.shadow},
            "layout": wavefront.scene.strategy.layout,
            "lanes": wavefront.lanes,
            "slots": wavefront.paths.slots,
        }


class Mitsuba:
    """Renders with a variant of Mitsuba's for LLVM."""

    def __init__(self, scene: Path, mode: str, sampler: str):
        find_llvm()
        import drjit
        import mitsuba

        self.mitsuba = mitsuba
        mitsuba.set_variant(f"llvm_ad_{mode}")
        drjit.set_thread_count(len(os.sched_getaffinity(0)))
        mitsuba.set_log_level(mitsuba.LogLevel.Error)
        self.scene = mitsuba.load_file(str(scene), sampler=sampler)
        self.about = f"Mitsuba {mitsuba.__version__} {mitsuba.variant()}"

    def render(self, spp: int, number: int) -> np.ndarray:
        return np.array(self.mitsuba.render(self.scene, spp=spp, seed=number))


def find_llvm() -> None:
    """Point Mitsuba at the newest LLVM there is, unless DRJIT_LIBLLVM_PATH is set.

    It takes the library of that name without a version by itself. LLVM 14 fails; so does LLVM 15 on
    a processor with AVX-512 ("Cannot select: fminimum"), and the process aborts.
    """
    libraries = [
        path
        for folder in ("/usr/lib/*-linux-gnu", "/usr/lib/llvm-*/lib", "/usr/local/lib")
        for path in glob.glob(f"{folder}/libLLVM*.so*")
    ]

    def version(path: str) -> tuple[int, ...]:
        return tuple(int(n) for n in re.findall(r"\d+", Path(path).name))

    if libraries and "DRJIT_LIBLLVM_PATH" not in os.environ:
        newest = max(libraries, key=version)
        os.environ["DRJIT_LIBLLVM_PATH"] = newest
        if version(newest) < (16,):
            print(f"{newest}: Mitsuba may abort; install LLVM 16 or newer, such as libllvm19")


def _begin(cores: tuple[int, ...]) -> None:
    os.sched_setaffinity(0, cores)
    os.environ["POCL_MAX_PTHREAD_COUNT"] = str(len(cores))


def _start(opener: Any, scene: Path, mode: str, sampler: str) -> str:
    global _open
    _open = opener(scene, mode, sampler)
    return _open.about


def _render(spp: int, number: int) -> Shot:
    start, cpu = time.perf_counter(), time.process_time()
    image = _open.render(spp, number)
    return Shot(image, time.perf_counter() - start, time.process_time() - cpu)


def _stages(spp: int) -> dict[str, Any]:
    return _open.stages(spp)
