"""Many random pictures in one process: what each takes of the host, of the processor, of memory.

`python -m bench.many_pictures --count 200`. A scene has 4 to 8 objects of four meshes and three
materials over a floor; 128 x 96 pixels, 8 samples, depth 5, and ground truth of depth, normals and
instances. The host's time is that of the thread that asks; threads of OpenCL's device on the same
processor count in the whole. The hash is of all pictures and their truth, and may not change.
`--beside DIR` renders each picture by the code of another checkout too, in turn.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
import trimesh

from clpt import dataset
from clpt import transforms as tf
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Path as PathTracing

BODIES = [
    trimesh.creation.icosphere(3),
    trimesh.creation.torus(1, 0.3),
    trimesh.creation.cylinder(0.5, 1.5),
    trimesh.creation.box((1, 1, 1)),
]
ARRAYS = [
    (np.asarray(body.vertices, np.float32), np.asarray(body.faces, np.uint32)) for body in BODIES
]
FLOOR = shapes.Rectangle(to_world=tf.scale(6), material=materials.Diffuse(reflectance=0.5))
PAGE = 4096 / 2**20  # [MiB]


def material(rng: np.random.Generator) -> materials.Material:
    """Return a matt, a plastic or a golden surface."""
    color, alpha = tuple(rng.uniform(0.1, 0.9, 3)), float(rng.uniform(0.05, 0.4))
    return (
        materials.Diffuse(reflectance=color),
        materials.RoughPlastic(diffuse_reflectance=color, alpha=alpha),
        materials.RoughConductor(metal="gold", alpha=alpha),
    )[rng.integers(3)]


def scene(index: int, rng: np.random.Generator) -> Scene:
    """Return a scene of random objects, camera and lamps."""
    parts: list[shapes.Shape] = [FLOOR]
    for number in range(int(rng.integers(4, 9))):
        vertices, faces = ARRAYS[rng.integers(len(ARRAYS))]
        place = tf.translate([*rng.uniform(-2, 2, 2), 0.6])
        turn = tf.rotate([0, 0, 1], float(rng.uniform(0, 360)))
        matrix = place @ turn @ tf.scale(float(rng.uniform(0.3, 0.7)))
        parts.append(
            shapes.Mesh(
                vertices=vertices, faces=faces, to_world=matrix, material=material(rng),
                name=f"object.{number:03d}",
            )
        )  # fmt: skip
    eye = [6 * np.cos(index), 6 * np.sin(index), float(rng.uniform(2, 5))]
    sun = (1.0, float(rng.uniform(-1, 1)), -1.0)
    return Scene(
        camera=cameras.Perspective(to_world=tf.look_at(eye, [0, 0, 0.5], [0, 0, 1])),
        shapes=parts,
        lights=[
            lights.Constant(radiance=float(rng.uniform(0.2, 1))),
            lights.Directional(direction=sun, irradiance=2.0),
        ],
        film=Film(size=(128, 96), mode="rgb"),
        integrator=PathTracing(max_depth=5),
    )


def resident() -> float:
    """Return the memory of this process [MiB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE


def digest(picture: dataset.Picture) -> str:
    """Return a hash of a picture and of its truth."""
    whole = hashlib.sha256(np.ascontiguousarray(picture.image).tobytes())
    truth = picture.truth
    if truth is not None:
        for values in (truth.instances, truth.depth, truth.normal, truth.position, truth.poses,
                       truth.sizes, truth.visible):  # fmt: skip
            whole.update(np.ascontiguousarray(values).tobytes())
    return whole.hexdigest()[:16]


def serve(truth: str) -> None:
    """Render the pictures whose numbers come on standard input; print a line of JSON for each."""
    times = [0.0, 0.0]

    def numbers() -> Iterator[int]:
        for line in sys.stdin:
            times[:] = time.thread_time(), time.process_time()
            yield int(line)

    for picture in dataset.pictures(scene, numbers(), spp=8, truth=truth):  # type: ignore[arg-type]
        host, whole = time.thread_time() - times[0], time.process_time() - times[1]
        row = {"host": host, "whole": whole, "memory": resident(), "hash": digest(picture)}
        print(json.dumps(row), flush=True)


def worker(checkout: Path, truth: str) -> subprocess.Popen[str]:
    """Begin a process that serves pictures by the code of a checkout."""
    paths = {"PYTHONPATH": str(checkout)}
    return subprocess.Popen(
        [sys.executable, "-P", __file__, "--serve", "--truth", truth],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, **paths},
    )  # fmt: skip


def asked(process: subprocess.Popen[str], index: int) -> dict[str, Any]:
    """Return the row of a picture. Raises RuntimeError where its process has ended."""
    assert process.stdin is not None and process.stdout is not None
    process.stdin.write(f"{index}\n")
    process.stdin.flush()
    line = process.stdout.readline()
    if not line:
        raise RuntimeError(f"the process of picture {index} has ended")
    return json.loads(line)


def report(name: str, rows: list[dict[str, Any]], first: int) -> None:
    """Print the figures of a checkout's pictures, without the first, which compile."""
    for part in ("host", "whole"):
        times = np.array([row[part] for row in rows[first:]])
        at = np.quantile(times, [0.5, 0.9, 0.99, 1.0])
        slowest = first + int(times.argmax())
        print(f"{name} {part}: mean {times.mean():.4f}, median, 90 %, 99 %, most {at.round(4)} s")
        print(f"  slowest: picture {slowest}")
    marks = [row["memory"] for row in rows][:: max(1, len(rows) // 8)]
    print(f"{name} memory: {np.round([*marks, rows[-1]['memory']], 1)} MiB")


@click.command(help=__doc__)
@click.option("--count", default=100, show_default=True)
@click.option("--warm", "warmed", default=0, help="pictures whose programs are compiled before")
@click.option("--skip", default=10, show_default=True, help="pictures that do not count")
@click.option("--truth", default="visible", show_default=True)
@click.option("--beside", type=click.Path(path_type=Path, exists=True))
@click.option(
    "--rows", "rows_file", type=click.Path(path_type=Path), help="JSON lines, as they come"
)
@click.option("--serve", "serves", is_flag=True, hidden=True)
def main(
    count: int, warmed: int, skip: int, truth: str, beside: Path | None, rows_file: Path | None,
    serves: bool,
) -> None:  # fmt: skip
    if serves:
        serve(truth)
        return
    if warmed:
        start = time.process_time()
        compiled = dataset.warm(scene, range(warmed), spp=8, truth=truth)  # type: ignore[arg-type]
        print(f"warm: {compiled} programs, {time.process_time() - start:.1f} s")
    checkouts = [Path(__file__).parents[1], *([beside] if beside else [])]
    workers = [worker(checkout, truth) for checkout in checkouts]
    rows: list[list[dict[str, Any]]] = [[] for _ in workers]
    with contextlib.nullcontext() if rows_file is None else rows_file.open("w") as written:
        for index in range(count):
            order = range(len(workers)) if index % 2 else reversed(range(len(workers)))
            for which in order:
                rows[which].append(asked(workers[which], index))
            if written is not None:  # a run that ends early keeps what it has measured
                written.write(json.dumps(rows[0][-1]) + "\n")
                written.flush()
    for process, checkout, of_one in zip(workers, checkouts, rows, strict=True):
        assert process.stdin is not None
        process.stdin.close()
        process.wait()
        report(str(checkout), of_one, skip)
    whole = "".join(row["hash"] for row in rows[0])
    print("hash of all pictures:", hashlib.sha256(whole.encode()).hexdigest()[:16])
    if beside:
        same = [a["hash"] == b["hash"] for a, b in zip(*rows, strict=True)]
        print(f"pictures that are the same to the bit: {sum(same)} of {count}")


if __name__ == "__main__":
    main()
