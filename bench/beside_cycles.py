"""clpt beside Cycles, with path guiding (OpenPGL) and without, by their efficiency on a core.

    python -m bench.beside_cycles --blender PYTHON SCENE.xml...

PYTHON is an interpreter that has Blender's `bpy` of PyPI. Films, times and turns are those of
`bench.peers`, but times are those of the film alone, since guides learn for as long as a render
goes on, and all ways of clpt have the start of `path`, so that what others do before their first
sample counts. Both render the same triangles, images and lamps; of materials, diffuse, glass with
an absorbing inside and metals are equal, and plastics and principled surfaces are much alike. So
the error of a picture is that beside a long render by the same renderer, and the ratio of clpt's
mean to Cycles' is told for each quarter of the film.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.table import Table

import clpt
from bench import machine
from bench.peer_figures import Picture, relative_mse
from bench.peer_films import with_film
from bench.peers import (
    FILMS,
    HEADINGS,
    WAYS,
    Contender,
    Row,
    compare,
    rows_of,
    table_cells,
    way_option,
)
from clpt.formats import as_openpbr
from clpt.geometry.triangles import triangulate
from clpt.geometry.winding import triangles_of
from clpt.scene import materials
from clpt.scene.roles import REFLECTANCE
from clpt.scene.shapes import Disk, Shape
from clpt.scene.textures import Bitmap, Checkerboard

IN_BLENDER = Path(__file__).with_name("in_blender.py")
LONG = 77  # the seed of long renders


@dataclass(frozen=True)
class Cycles(Contender):
    """Cycles with a scene that `write` wrote; options: "guiding", or none."""

    blender: str = sys.executable

    def command(self, spp: int, seed: int, out: Path) -> list[str]:
        program = [self.blender, "-I", str(IN_BLENDER)]
        return [*program, str(self.file), str(spp), str(seed), str(out), *(self.options or ())]


def write(scene: clpt.Scene, size: tuple[int, int], folder: Path) -> Path:
    """Write a scene for Cycles to a folder. Raises ValueError for what has no counterpart there."""
    if scene.lights:
        raise ValueError("lights beside those of shapes are not written for Cycles")
    camera = scene.camera
    view = np.asarray(camera.to_world) @ np.diag([-1.0, 1.0, -1.0, 1.0])
    shapes = []
    for number, shape in enumerate(scene.shapes):
        if isinstance(shape, Disk):
            vertices, faces, normals, uvs = *triangles_of(shape), None, None
        else:
            vertices, faces, normals, uvs = triangulate(shape)
        described, to_uv = surface(shape, folder / f"{number}.exr")
        arrays = {"vertices": vertices, "faces": faces, "normals": normals}
        if uvs is not None:
            arrays["uvs"] = uvs @ to_uv[:2, :2].T + to_uv[:2, 2]
        file = folder / f"{number}.npz"
        np.savez(file, **{name: array for name, array in arrays.items() if array is not None})
        shapes.append({"file": str(file), **described})
    about = {"size": size, "depth": scene.integrator.max_depth, "fov": camera.fov}
    file = folder / "scene.json"
    file.write_text(json.dumps({**about, "camera": view.tolist(), "shapes": shapes}), "utf-8")
    return file


def surface(shape: Shape, image: Path) -> tuple[Row, Any]:
    """Return a shader of Cycles with its inputs, and what takes uv to its image; it writes it."""
    material: Any = shape.material
    if isinstance(material, materials.TwoSided):
        material = material.front
    if shape.emission is not None:
        return {"kind": "Emission", "Color": colour(shape.emission.radiance)}, np.eye(3)
    textured: Any = None
    match material:
        case materials.Diffuse():
            described, textured = {"kind": "BsdfDiffuse"}, material.reflectance
        case materials.Dielectric():
            described = {"kind": "BsdfGlass", "Roughness": 0.0, "IOR": index(material)}
            if shape.interior is not None:
                described["absorbs"] = colour(shape.interior.sigma_t)
        case materials.RoughConductor():
            described = {"kind": "BsdfMetallic", "distribution": material.distribution.upper()}
            described |= {"IOR": colour(material.eta), "Extinction": colour(material.k)}
            described |= {"Roughness": material.alpha_u**0.5}
            textured = material.specular_reflectance
        case materials.RoughPlastic():
            described = {"kind": "BsdfPrincipled", "Roughness": material.alpha**0.5}
            described |= {"IOR": index(material)}
            textured = as_openpbr.surface(material, lambda _: None).base.base_color
        case materials.Principled():
            described = {"kind": "BsdfPrincipled", "Roughness": material.roughness, "IOR": 1.5}
            described |= {"Metallic": material.metallic}
            textured = material.base_color
        case _:
            raise ValueError(f"Cycles has no {type(material).__name__}")
    if isinstance(textured, Bitmap):
        pixels, closest = textured.pixels(REFLECTANCE), textured.filter == "nearest"
    elif isinstance(textured, Checkerboard):
        a, b = colour(textured.color0), colour(textured.color1)
        pixels, closest = np.array([[b, a], [a, b]], np.float32), True
    else:
        return described | ({} if textured is None else {"Color": colour(textured)}), np.eye(3)
    clpt.write_image(image, np.broadcast_to(pixels, (*pixels.shape[:2], 3)))
    return {**described, "image": str(image), "closest": closest}, textured.to_uv


def index(material: Any) -> float:
    """Return a material's index relative to what is outside, at the D line."""
    inside, outside = (as_openpbr.dispersion(n)[0] for n in (material.int_ior, material.ext_ior))
    return inside / outside


def colour(value: Any) -> list[float]:
    """Return three numbers. Raises AttributeError for what is no colour."""
    return [float(value)] * 3 if np.isscalar(value) else [value.r, value.g, value.b]


def quarters(ours: Picture, theirs: Picture) -> list[float]:
    """Return the ratio of the means of two pictures in each quarter of the film."""
    h, w = (n // 2 for n in ours.shape[:2])
    parts = [np.s_[:h, :w], np.s_[:h, w:], np.s_[h:, :w], np.s_[h:, w:]]
    return [round(float(ours[part].mean() / theirs[part].mean()), 4) for part in parts]


def rows_for(
    scene: Path, blender: str, ways: Sequence[str], film: str, seeds: int, long: int
) -> list[Row]:
    """Return a row for each contender. Raises RuntimeError, ValueError and OSError."""
    width, spp, _ = FILMS[film]
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        copy, size = with_film(scene, folder / "film", width, "rgb")
        each = ("rgb", CORE, folder / "caches")
        written = write(clpt.load(copy), size, folder)
        ours = {way: Contender(copy, *each, WAYS[way]) for way in ways}
        theirs = {
            name: Cycles(written, *each, options, blender=blender)
            for name, options in {"cycles": (), "cycles-guiding": ("guiding",)}.items()
        }
        records, failures = compare(scene, {**ours, **theirs}, spp, 1, seeds)
        if failures:
            raise RuntimeError("; ".join(failures))
        for way in ways:  # a guide is learnt before the first sample
            records[way].seconds += records[way].start - records["path"].start
        long_renders = [next(iter(group.values())) for group in (ours, theirs)]
        references = [contender.render(long, LONG).image for contender in long_renders]
        values = {
            name: [relative_mse(image, references[name in theirs]) for image in record.images]
            for name, record in records.items()
        }
    about = {"scene": machine.scene_name(scene), "film": film, "mode": "rgb", "long": long}
    about |= {"quarters": quarters(*references)}
    rows = rows_of(records, spp, values)
    costs = [float(np.mean(row["relmse"])) * row["seconds"] for row in rows]
    return [
        {**about, **row, "efficiency": round(1 / c, 3)} for row, c in zip(rows, costs, strict=True)
    ]


CORE = (min(os.sched_getaffinity(0)),) if hasattr(os, "sched_getaffinity") else (0,)


@click.command(help=__doc__)
@click.argument("scenes", nargs=-1, type=click.Path(path_type=Path, exists=True))
@click.option("--blender", default=sys.executable, help="an interpreter that has bpy")
@click.option("--film", default="preview", show_default=True, type=click.Choice(list(FILMS)))
@way_option
@click.option("--seeds", type=click.IntRange(min=2), default=4, show_default=True)
@click.option("--long", default=2048, show_default=True, help="samples of the long renders")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    scenes: Sequence[Path], blender: str, ways: Sequence[str], json_file: str | None, **options: Any
) -> None:
    table = Table(*HEADINGS, title=machine.processor())
    for scene in scenes:
        try:
            rows = rows_for(
                scene, blender, list(dict.fromkeys([*(ways or ["file"]), "path"])), **options
            )
        except (RuntimeError, ValueError, OSError) as error:
            print(f"{scene}: {error}", file=sys.stderr)
            continue
        machine.append(json_file, "beside_cycles", rows)
        print(scene, "quarters:", rows[0]["quarters"], file=sys.stderr)
        for cells in table_cells(rows):
            table.add_row(*cells)
            print(" | ".join(cells), file=sys.stderr, flush=True)
    machine.console().print(table)


if __name__ == "__main__":
    main()
