"""Warnings of holes in meshes that enclose a medium or absorb inside.

A ray knows its medium from the boundaries that it crosses. If it passes through a hole, its medium
is undefined: paths from the camera and paths from lights may assume different media, and their
pictures differ.

The edges of a hole have a triangle on a single side, or triangles of opposite winding. Its size is
the area that its edges enclose, so a vertex on the edge of another triangle makes no hole.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import on_device
from clpt.geometry import shapes, winding
from clpt.geometry.winding import triangles_of
from clpt.render.geometry.surroundings import every
from clpt.render.records.lowering_cache import LoweringCache
from clpt.render.scene_index import SceneIndex
from clpt.scene import materials as mt
from clpt.scene.shapes import Cylinder, Disk, Shape

HOLE = 1e-4  # of a mesh's area: smaller holes are ignored
ROUND = Disk, Cylinder


def warnings_of(index: SceneIndex, cached: LoweringCache | None = None) -> list[str]:
    """Return a warning if meshes with an inside are not closed, else an empty list."""
    suspects: list[tuple[Any, Shape]] = []
    for shape in index.shapes:
        if shape.vertices is not None and not on_device(shape.vertices):
            for inside in _insides(shape):
                known = any(inside == other for other, _ in suspects)
                if not known and _largest_hole(shape, cached) > HOLE:
                    suspects.append((inside, shape))
    shares = [(shape, hole_around(index, inside, cached)) for inside, shape in suspects]
    open_meshes = [(shape, share) for shape, share in shares if share > HOLE]
    if not open_meshes:
        return []
    (shape, share), more = open_meshes[0], len(open_meshes) - 1
    others = f", and {more} other{'s' * (more > 1)}" * (more > 0)
    return [
        f"{shapes.where(shape)}{others}: not closed, a hole has {100.0 * share:.2g}% of the area, "
        "but it has an inside that absorbs or scatters; where rays go through the hole what they "
        "are in is not defined, and integrators differ. Close the mesh, and turn its triangles to "
        "one side; or leave its medium or `absorption` out"
    ]


def _insides(shape: Shape) -> Iterator[Any]:
    """Yield the insides of a shape: its medium, or the absorptions of its materials."""
    if shape.interior is not None:
        yield shape.interior
        return
    for part in mt.parts(shape.material):
        if part.absorbs_inside and not part.is_sheet:
            yield part.absorption


def _largest_hole(shape: Shape, cached: LoweringCache | None) -> float:
    """Return the size of a shape's largest hole over the shape's area."""
    if cached is None:
        return winding.largest_hole(*triangles_of(shape))
    vertices, faces = triangles_of(shape, cached)
    share: float = cached(winding.largest_hole, vertices, faces)
    return share


def hole_around(index: SceneIndex, inside: object, cached: LoweringCache | None) -> float:
    """Return the size of the largest hole in all shapes around an inside, over their area."""
    around: list[tuple[float, Shape]] = []
    for shape in every(index.listed, lambda shape: True):
        around += [(1.0, shape)] * any(inside == other for other in _insides(shape))
        around += [(-1.0, shape)] * (shape.exterior is inside)
    if len(around) == 1:
        return _largest_hole(around[0][1], cached)
    if any(isinstance(shape, ROUND) for _, shape in around):
        return 0.0  # their rims have no edges
    points: list[NDArray[Any]] = []
    faces: list[NDArray[Any]] = []
    first = 0
    for sign, shape in around:
        if on_device(shape.vertices):
            return 0.0
        vertices, triangles = triangles_of(shape, cached)
        points.append(np.asarray(vertices, np.float64))
        faces.append(np.asarray(triangles, np.int64)[:, :: int(sign)] + first)
        first += len(vertices)
    return winding.largest_hole(winding.snapped(np.concatenate(points)), np.concatenate(faces))
