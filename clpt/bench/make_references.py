"""Render the references of the picture benchmark to data/references.npz; run by hand.

    python -m clpt.bench.make_references [SCENE...]

takes four minutes of processor time; unnamed scenes stay as they are in the file. Use a well-tested
device, and look at its pictures. Each scene is rendered RENDERS times, with seeds that no
measurement uses.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from clpt import device
from clpt.bench.pictures import FILE, Reference, film_class, film_digest, references, regions
from clpt.bench.scenes import BENCHMARK_VERSION, PICTURES, SIZES, Size, picture
from clpt.render.renderer import Renderer

RENDERS = 64  # an even number: the degrees of freedom are odd
FIRST_SEED = 1000
SIZE, SAMPLES = "quick", 32  # of a render


def main(names: Sequence[str]) -> None:
    """Render scenes, and write the file after each of them."""
    on = device.choose()
    kept = dict(references()) if FILE.exists() else {}
    for name in names or PICTURES:
        kept[name] = render(on, name)
        sys.stdout.write(f"{name}: mean {kept[name].mean[-1]}\n")
        sys.stdout.flush()
        write(kept, on.info.label)


def render(on: device.Device, name: str) -> Reference:
    """Render the reference of a scene."""
    scene, renders = picture(name, SIZE), []
    with Renderer(scene, on) as renderer:
        renderer.run(SIZES[SIZE].samples)
        films = {SIZE: film_digest(renderer), "class": film_class(renderer)}
        for number in range(RENDERS):
            renderer.update(scene=dataclasses.replace(scene, seed=FIRST_SEED + number))
            renderer.run(SAMPLES)
            renders.append(regions(renderer.image()))
    samples = Size(SIZES[SIZE].side, SAMPLES).all_samples
    return Reference(np.mean(renders, 0), np.std(renders, 0, ddof=1), RENDERS, samples, films)


def write(kept: dict[str, Reference], label: str) -> None:
    """Write references to the file; label: of their device."""
    arrays: dict[str, Any] = {}
    scenes: dict[str, dict[str, object]] = {}
    for name, reference in kept.items():
        arrays[f"{name}_mean"] = reference.mean.astype(np.float32)
        arrays[f"{name}_deviation"] = reference.deviation.astype(np.float32)
        scenes[name] = {
            "count": reference.count, "samples": reference.samples, "films": reference.films,
        }  # fmt: skip
    about = {"version": BENCHMARK_VERSION, "device": label, "scenes": scenes}
    np.savez_compressed(FILE, about=np.array(json.dumps(about)), **arrays)


if __name__ == "__main__":
    main(sys.argv[1:])
