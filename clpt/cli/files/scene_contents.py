"""The contents of a scene, as `clpt info` shows them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from ...geometry.triangles import triangulate
from ...scene import Scene, materials, shapes, studio, textures
from ...scene.params import Kind, fields_of

DIGITS = 4  # of bounds that people read
OF_FILES = ("scenes", "variables", "asset")  # further entries of some formats
FLAT_TRIANGLES = {shapes.Rectangle: 2, shapes.Cube: 12}


def summary(scene: Scene) -> dict[str, Any]:
    """Return the contents of a scene's file, without additions of the studio.

    `triangles` counts those of meshes, cubes and rectangles once, `triangles_instanced` once for
    each instance; `spheres` counts those of shapes with many.
    """
    added = scene.extra.get("studio", {"camera": False, "shapes": 0, "lights": 0})
    authored = scene.shapes[: len(scene.shapes) - added["shapes"]]
    groups = {
        id(shape.group): shape.group for shape in authored if isinstance(shape, shapes.Instance)
    }
    inside = [shape for group in groups.values() for shape in group.shapes]
    plain = [shape for shape in authored if not isinstance(shape, shapes.Instance)]
    surfaces = [*plain, *inside]
    counts = {_arrays(shape): _triangles(shape) for shape in surfaces}
    kinds = list(_nested(surfaces))
    lights = [light.kind for light in scene.lights[: len(scene.lights) - added["lights"]]]
    lights += [shape.emission.kind for shape in surfaces if shape.emission is not None]
    bounds = [corner.tolist() for corner in studio.world_bounds(authored)] if authored else None
    return {
        "format": scene.extra.get("format", "python"),
        "triangles": sum(counts.values()),
        "triangles_instanced": sum(_instanced_triangles(authored, groups)),
        "spheres": sum(len(s.centers) for s in surfaces if isinstance(s, shapes.Spheres)),
        "instances": len(authored) - len({_arrays(shape) for shape in plain}),
        "bounds": bounds,
        "shapes": dict(Counter(shape.kind for shape in authored)),
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
        **{name: scene.extra[name] for name in OF_FILES if scene.extra.get(name)},
        "warnings": scene.warnings,
    }


def tidy(contents: dict[str, Any]) -> dict[str, Any]:
    """Return a summary for people: without empty entries, and with rounded bounds."""
    same = {"triangles_instanced": "triangles", "sampler_in_file": "sampler"}
    kept = {
        name: value
        for name, value in contents.items()
        if value not in (0, None, [], {}, "", ()) and value != contents.get(same.get(name, ""))
    }
    if kept.get("format") == "native":
        kept["format"] = "scene.json"
    if "bounds" in kept:
        kept["bounds"] = _rounded(kept["bounds"])
    return kept


def _rounded(bounds: list[list[float]]) -> list[list[float]]:
    """Return corners to DIGITS digits of the largest side."""
    side = max(high - low for low, high in zip(*bounds, strict=True))
    if not 0.0 < side < math.inf:
        return bounds
    places = DIGITS - 1 - math.floor(math.log10(side))
    return [[round(number, places) + 0.0 for number in corner] for corner in bounds]


def _arrays(shape: shapes.Shape) -> int:
    """Return the identity of a mesh's triangles, or of any other shape."""
    return id(shape.faces) if isinstance(shape, shapes.Mesh) else id(shape)


def _instanced_triangles(
    members: Iterable[shapes.Shape], groups: dict[int, shapes.Group]
) -> Iterator[int]:
    """Yield the triangles that each shape adds to the scene."""
    sizes = {key: sum(map(_triangles, group.shapes)) for key, group in groups.items()}
    for shape in members:
        if isinstance(shape, shapes.Instance):
            yield sizes[id(shape.group)]
        else:
            yield _triangles(shape)


def _triangles(shape: shapes.Shape) -> int:
    if isinstance(shape, shapes.Mesh):
        return len(shape.faces)
    if isinstance(shape, shapes.SdfGrid):
        return len(triangulate(shape)[1])
    return FLAT_TRIANGLES.get(type(shape), 0)


def _nested(roots: Iterable[Kind]) -> Iterator[Kind]:
    """Yield kinds and the kinds in their fields: materials, lights and their textures."""
    for root in roots:
        yield root
        yield from _nested(value for value in fields_of(root).values() if isinstance(value, Kind))


def _by_kind(objects: Iterable[Kind], base: type[Kind]) -> dict[str, int]:
    distinct = {id(element): element for element in objects if isinstance(element, base)}
    return dict(Counter(element.kind for element in distinct.values()))


def _film(scene: Scene) -> dict[str, Any]:
    film = scene.film
    size = dict(zip(("width", "height"), film.size, strict=True))
    whole = {} if film.crop is None else {"crop": [*film.crop], "of": [film.width, film.height]}
    usual = {
        "bands": 0, "alpha": False, "layers": (), "output_space": "rec709", "exposure": 1.0,
        "display_exposure": 0.0,
    }  # fmt: skip
    unusual = {k: value for k, value in fields_of(film).items() if k in usual and value != usual[k]}
    return {**size, **whole, "mode": film.mode, "filter": film.filter.kind, **unusual}
