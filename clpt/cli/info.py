"""`clpt info`: what a scene file holds, without rendering it."""

from __future__ import annotations

import dataclasses
import json
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from clpt.formats import load
from clpt.formats.meshes import framing
from clpt.render.lowering.geometry.triangles import triangulate

from ..render import film_file
from ..scene import Scene, materials, shapes, textures
from ..scene.params import Kind
from . import checkpoints
from .output_console import output_console
from .outputs import FILM
from .scene_variables import scene_variables

FLAT_TRIANGLES = {shapes.Rectangle: 2, shapes.Cube: 12}


@click.command()
@click.argument("scene", type=click.Path(path_type=Path))
@scene_variables
@click.option("--json", "as_json", is_flag=True, help="Write JSON instead of a table.")
def info(scene: Path, variables: dict[str, Any], as_json: bool) -> None:
    """Show what the file or folder SCENE holds, without rendering it; or a film, or checkpoint."""
    is_film = scene.suffix.lower() == FILM or scene.name.endswith(checkpoints.SUFFIX)
    contents = film_summary(scene) if is_film else summary(load(scene, **variables))
    if as_json:
        click.echo(json.dumps(contents, indent=2))
        return
    table = Table(show_header=False, title=str(scene), title_justify="left")
    for name, value in contents.items():
        table.add_row(name.replace("_", " "), _shown(value))
    output_console().print(table)


def film_summary(path: Path) -> dict[str, Any]:
    """Return what a film file says of itself."""
    header = film_file.read_header(path)
    height, width = header["shapes"]["words"][-2:]
    origin, sessions = header["scene"], header["sessions"]
    return {
        "format": "film",
        "clpt": header["clpt"],
        "samples": [f"{first} to {end - 1}" for first, end in header["taken"]],
        "film": {"width": width, "height": height, "bands": header["form"]["bands"]},
        "integrator": header["settings"]["chosen.integrator"],
        "sampler": origin["sampler.type"],
        "seed": origin["seed"],
        "noise": "noise" in header["adaptive"],
        "seconds": round(sum(one["seconds"] for one in sessions), 3),
        "sessions": [
            f"{one['began']}  {one['seconds']:.1f} s  {one['device']['device']}" for one in sessions
        ],
    }


def summary(scene: Scene) -> dict[str, Any]:
    """Return what a scene's file holds, without what the studio added.

    `triangles` counts those of meshes, cubes and rectangles once, `triangles_instanced` once for
    each instance; `spheres` counts those of shapes with many.
    """
    added = scene.extra.get("studio", {"camera": False, "shapes": 0, "lights": 0})
    own = scene.shapes[: len(scene.shapes) - added["shapes"]]
    groups = {id(shape.group): shape.group for shape in own if isinstance(shape, shapes.Instance)}
    inside = [shape for group in groups.values() for shape in group.shapes]
    plain = [shape for shape in own if not isinstance(shape, shapes.Instance)]
    surfaces = [*plain, *inside]
    counts = {_arrays(shape): _triangles(shape) for shape in surfaces}
    kinds = list(_nested(surfaces))
    lights = [light.kind for light in scene.lights[: len(scene.lights) - added["lights"]]]
    lights += [shape.emission.kind for shape in surfaces if shape.emission is not None]
    bounds = [corner.tolist() for corner in framing.world_bounds(own)] if own else None
    return {
        "format": scene.extra.get("format", "python"),
        "triangles": sum(counts.values()),
        "triangles_instanced": sum(_instanced_triangles(own, groups)),
        "spheres": sum(len(s.centers) for s in surfaces if isinstance(s, shapes.Spheres)),
        "instances": len(own) - len({_arrays(shape) for shape in plain}),
        "bounds": bounds,
        "shapes": dict(Counter(shape.kind for shape in own)),
        "cameras": scene.extra.get("cameras", [] if added["camera"] else [scene.camera.kind]),
        "lights": dict(Counter(lights)),
        "materials": _by_kind(kinds, materials.Material),
        "textures": _by_kind(kinds, textures.Texture),
        "animations": scene.extra.get("animations", []),
        "film": _film(scene),
        "spp": scene.spp,
        "integrator": scene.integrator.kind,
        "sampler": scene.sampler.kind,
        "sampler_in_file": scene.extra.get("sampler", scene.sampler.kind),
        "warnings": scene.warnings,
    }


def _arrays(shape: shapes.Shape) -> int:
    """Return the identity of a mesh's triangles, or of any other shape."""
    return id(shape.faces) if isinstance(shape, shapes.Mesh) else id(shape)


def _instanced_triangles(
    own: Iterable[shapes.Shape], groups: dict[int, shapes.Group]
) -> Iterator[int]:
    """Yield the triangles that each shape adds to the scene."""
    sizes = {key: sum(map(_triangles, group.shapes)) for key, group in groups.items()}
    for shape in own:
        if isinstance(shape, shapes.Instance):
            yield sizes[id(shape.group)]
        else:
            yield _triangles(shape)


def _triangles(shape: shapes.Shape) -> int:
    if isinstance(shape, shapes.Mesh):
        return len(shape.faces)
    if isinstance(shape, shapes.Curves):
        return len(triangulate(shape)[1])
    return FLAT_TRIANGLES.get(type(shape), 0)


def _nested(things: Iterable[Kind]) -> Iterator[Kind]:
    """Yield the kinds within things: materials, lights and the textures in them."""
    for thing in things:
        yield thing
        values = [getattr(thing, field.name) for field in dataclasses.fields(thing)]
        yield from _nested(value for value in values if isinstance(value, Kind))


def _by_kind(things: Iterable[Kind], base: type[Kind]) -> dict[str, int]:
    distinct = {id(thing): thing for thing in things if isinstance(thing, base)}
    return dict(Counter(thing.kind for thing in distinct.values()))


def _film(scene: Scene) -> dict[str, Any]:
    film = scene.film
    size = dict(zip(("width", "height"), film.size, strict=True))
    return {**size, "mode": film.mode, "filter": film.filter.kind}


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key}: {count}" for key, count in value.items()) or "none"
    if isinstance(value, list) and value and isinstance(value[0], list):
        return " to ".join("(" + ", ".join(f"{x:g}" for x in corner) + ")" for corner in value)
    if isinstance(value, list):
        return "\n".join(str(entry) for entry in value) or "none"
    return f"{value:,}" if isinstance(value, int) else str(value)
