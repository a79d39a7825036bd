"""clpt beside Cycles, with path guiding (OpenPGL) and without, at equal processor time on a core.

    python -m bench.beside_cycles --blender PYTHON

PYTHON is an interpreter that has Blender's `bpy` of PyPI. Both render the same triangles with the
same materials: diffuse, glass, lamps. `cornell_glass` is a Cornell box with a glass ball, `door` is
the scene of `bench.hard_light`, and `ajar` (with `--assets`) the geometry of veach-ajar with
diffuse surfaces in place of metal, coats and textures. The error is the variance of pictures of
different seeds, relative to the mean of all, without the worst .1 % of the pixels. It is the whole
error without bias: so the two renderers must agree in the mean, and in blocks of pixels. The time
before a process's first sample is subtracted; the learning of clpt's guide counts. The renderers
take turns.
"""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray
from rich.table import Table

import clpt
from bench import machine
from bench.hard_light.scenes import (
    GLASS,
    SCENES,
    WHITE,
    Diffuse,
    Glass,
    HardScene,
    Lamp,
    ball,
    inside,
    mitsuba_text,
    quads,
    sides,
)  # fmt: skip
from bench.meshes import write_ply
from bench.peer_figures import relative_mse
from bench.peers import APART, WAYS, watched, way_option
from clpt import transforms
from clpt.geometry.winding import triangles_of
from clpt.scene import materials

CYCLES = Path(__file__).with_name("in_blender.py")
WHOLE = (-1, -1, -1), (1, 1, 1)
AJAR = "mitsuba/veach-ajar/scene.xml"
PILOT = 16  # samples of the pilot, for the time of a sample
BLOCK = 16  # pixels of a side

Image = NDArray[np.float32]
Row = dict[str, Any]


def cornell_glass(assets: Path | None) -> HardScene:
    """A Cornell box with a block and a glass ball."""
    lamp = quads(
        ((-0.25, 0.999, -0.25), (0.25, 0.999, -0.25), (0.25, 0.999, 0.25), (-0.25, 0.999, 0.25))
    )
    block = sides((-0.3, -1, -0.3), (0.3, 0.2, 0.3), turn=0.3)
    block = [tuple((x - 0.35, y, z - 0.3) for x, y, z in side) for side in block]
    return HardScene(
        "walls of diffuse colours, and a caustic",
        depth=16, eye=(0, 0, 3.9), at=(0, 0, 0), fov=39.3,
        shapes={
            "white": (quads(*inside(*WHOLE, "yYz"), *block), WHITE),
            "red": (quads(*inside(*WHOLE, "x")), Diffuse((0.57, 0.04, 0.04))),
            "green": (quads(*inside(*WHOLE, "X")), Diffuse((0.11, 0.38, 0.08))),
            "lamp": (lamp, Lamp(15)),
            "ball": (ball(5, (0.4, -0.59, 0.35), 0.4), GLASS),
        },
    )  # fmt: skip


def ajar(assets: Path | None) -> HardScene:
    """Veach's door: its triangles, and of its materials what both renderers have alike."""
    if assets is None:
        raise OSError("ajar: give --assets, the folder that has mitsuba/veach-ajar")
    scene = clpt.load(assets / AJAR)
    view = np.asarray(scene.camera.to_world)
    shapes: dict[str, Any] = {}
    for shape in scene.shapes:
        surface: Diffuse | Glass | Lamp = WHITE
        if isinstance(shape.material, materials.Dielectric):
            surface = GLASS
        elif shape.emission is not None:
            surface = Lamp(float(shape.emission.radiance.r))
        shapes[shape.name] = (triangles_of(shape), surface)
    eye, at = view[:3, 3], view[:3, 3] + view[:3, 2]
    return HardScene(
        "a room that is lit through a door",
        depth=13, eye=tuple(eye.tolist()), at=tuple(at.tolist()), fov=60, shapes=shapes,
    )  # fmt: skip


MADE: dict[str, Callable[[Path | None], HardScene]] = {
    "cornell_glass": cornell_glass,
    "door": lambda assets: SCENES["door"],
    "ajar": ajar,
}


def write(scene: HardScene, folder: Path, side: int) -> None:
    """Write a scene as scene.xml for clpt, and as scene.json for Cycles, with its meshes."""
    shapes = []
    for name, ((vertices, faces), surface) in scene.shapes.items():
        write_ply(folder / f"{name}.ply", vertices, faces)
        file = folder / f"{name}.npz"
        np.savez(file, vertices=vertices, faces=faces)
        shapes.append({"file": str(file), "kind": type(surface).__name__, **asdict(surface)})
    view = transforms.look_at(scene.eye, scene.at, (0, 1, 0)) @ np.diag([-1.0, 1.0, -1.0, 1.0])
    about = {"width": side, "height": side, "depth": scene.depth, "fov": scene.fov}
    described = {**about, "camera": view.tolist(), "shapes": shapes}
    (folder / "scene.json").write_text(json.dumps(described), "utf-8")
    (folder / "scene.xml").write_text(mitsuba_text(scene), "utf-8")


@dataclass(frozen=True)
class Contender:
    """A way to render the scene of a folder. python: of Cycles; None: it is clpt."""

    way: str
    folder: Path
    side: int
    python: str | None

    @property
    def name(self) -> str:
        return f"{'clpt' if self.python is None else 'cycles'}:{self.way}"

    def render(self, spp: int, seed: int) -> tuple[float, Image]:
        """Return the seconds of processor time, and the picture. Raises RuntimeError."""
        with tempfile.TemporaryDirectory() as temporary:
            out = f"{temporary}/a.exr"
            numbers = [str(spp), str(seed)]
            if self.python is None:
                size, film = f"{self.side}x{self.side}", ["--spp", numbers[0], "--seed", numbers[1]]
                command = [sys.executable, "-m", "clpt", "render", f"{self.folder / 'scene.xml'}"]
                command += [*WAYS[self.way], "--mode", "rgb", "--size", size, *film, "-o", out]
            else:
                guiding = str(int(self.way == "guiding"))
                described = str(self.folder / "scene.json")
                command = [self.python, "-I", str(CYCLES), described, *numbers, guiding, out]
            cpu, _, _ = watched(command, CORE, self.folder / "caches")
            return cpu, np.asarray(clpt.read_image(out), np.float32)[..., :3]


CORE = (min(os.sched_getaffinity(0)),) if hasattr(os, "sched_getaffinity") else (0,)


def measure(contenders: list[Contender], seconds: float, seeds: int) -> list[Row]:
    """Return a row for each contender. Raises RuntimeError if the renderers have other pictures."""
    for contender in contenders:  # compiles
        contender.render(1, 1)
    start = {
        contender.name: min(contender.render(1, seed)[0] for seed in (2, 3))
        for contender in contenders
    }
    if "clpt:guiding" in start:  # which learns before its first sample
        start["clpt:guiding"] = start["clpt:path"]
    each = {}
    for contender in contenders:
        plain = contender.render(1, 4)[0]
        each[contender.name] = max(contender.render(1 + PILOT, 5)[0] - plain, 0.01) / PILOT
    rows: list[Row] = [
        {"renderer": contender.name, "spp": max(1, round(seconds / each[contender.name]))}
        for contender in contenders
    ]
    shots: list[list[tuple[float, Image]]] = [[] for _ in contenders]
    for seed in range(11, 11 + seeds):
        for contender, row, taken in zip(contenders, rows, shots, strict=True):
            taken.append(contender.render(row["spp"], seed))
    images = [np.array([image for _, image in taken]) for taken in shots]
    ours = [contender.python is None for contender in contenders]
    means = [
        np.mean(
            [i.mean(0) for i, pictures in zip(images, ours, strict=True) if pictures is which],
            axis=0,
        )
        for which in (True, False)
    ]
    apart, middle = agreement(*means), (means[0] + means[1]) / 2
    for contender, row, taken, pictures in zip(contenders, rows, shots, images, strict=True):
        cpu = float(np.mean([shot[0] for shot in taken])) - start[contender.name]
        error = float(np.mean([
            relative_mse(middle + (a - b) / np.sqrt(2), middle)
            for a, b in itertools.combinations(pictures, 2)
        ]))  # fmt: skip
        row |= {"cpu": round(cpu, 2), "relmse": round(error, 5)}
        row |= {"efficiency": round(1 / (error * cpu), 4), **apart}
    best = max(row["efficiency"] for row in rows if row["renderer"].startswith("cycles"))
    return [{**row, "over_cycles": round(row["efficiency"] / best, 3)} for row in rows]


def agreement(ours: Image, theirs: Image) -> Row:
    """Return the means of two pictures, and the median relative difference of their blocks.

    Raises RuntimeError if they differ too much to be pictures of the same scene.
    """
    means = [float(image.mean()) for image in (ours, theirs)]
    h, w = (n // BLOCK for n in ours.shape[:2])
    a, b = (
        image[: h * BLOCK, : w * BLOCK].reshape(h, BLOCK, w, BLOCK, 3).mean((1, 3, 4))
        for image in (ours, theirs)
    )
    blocks = float(np.median(np.abs(a - b) / np.maximum((a + b) / 2, 1e-6)))
    if max(abs(means[0] / means[1] - 1), blocks / 2) > APART:
        raise RuntimeError(f"the pictures differ: means {means}, blocks by {blocks:.1%}")
    return {"means": [round(mean, 5) for mean in means], "blocks_apart": round(blocks, 5)}


def has_cycles(python: str) -> bool:
    """Return whether an interpreter has `bpy`."""
    try:
        return subprocess.run([python, "-c", "import bpy"], capture_output=True).returncode == 0
    except OSError:
        return False


@click.command(help=__doc__)
@click.option("--blender", default=sys.executable, help="an interpreter that has bpy")
@click.option("--assets", type=click.Path(path_type=Path, file_okay=False), envvar="ASSETS")
@click.option("--scene", "scenes", multiple=True, type=click.Choice(list(MADE)))
@way_option
@click.option("--side", default=128, show_default=True, help="of the picture [pixels]")
@click.option("--seconds", default=10.0, show_default=True, help="of processor time each")
@click.option("--seeds", default=2, show_default=True)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    blender: str, assets: Path | None, scenes: tuple[str, ...], side: int, **options: Any
) -> None:
    if not has_cycles(blender):
        print(f"left out: {blender} has no bpy (pip install bpy==4.2.0 --extra-index-url ...)")
        return
    table = Table("scene", "renderer", "samples", "s", "relMSE", "efficiency", ": best of Cycles")
    for name in scenes or MADE:
        with tempfile.TemporaryDirectory() as folder:
            try:
                write(MADE[name](assets), Path(folder), side)
                sides_ = (Path(folder), side)
                ours = [Contender(way, *sides_, None) for way in options["ways"]]
                theirs = [Contender(way, *sides_, blender) for way in ("path", "guiding")]
                found = measure(ours + theirs, options["seconds"], options["seeds"])
            except (RuntimeError, OSError) as error:
                print(f"{name}: {error}", file=sys.stderr)
                continue
        rows = [{"scene": name, "mode": "rgb", "size": [side, side], **row} for row in found]
        machine.append(options["json_file"], "beside_cycles", rows)
        for row in rows:
            names = ("scene", "renderer", "spp", "cpu", "relmse", "efficiency", "over_cycles")
            table.add_row(*(str(row[name]) for name in names))
            print(" | ".join(str(row[name]) for name in names), file=sys.stderr, flush=True)
    machine.console().print(table)


if __name__ == "__main__":
    main()
