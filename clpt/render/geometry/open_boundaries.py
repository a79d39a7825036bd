"""Meshes around something with an inside, a medium or what a glass absorbs, that have a hole.

What a ray passes is told by the boundaries that it meets. Where it leaves or enters through a hole
it meets none, and what it is in from there on is not defined: paths from the camera and from lights
take it for one thing or the other, so that their pictures differ.

A hole is where edges have triangles on one side alone, or of unlike winding. Its size is the area
that its edges enclose, so that a vertex on another triangle's edge is none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import on_device
from clpt.geometry import holes, shapes
from clpt.geometry.winding import triangles_of
from clpt.render.geometry.surroundings import every
from clpt.render.scene_index import SceneIndex
from clpt.scene import materials as mt
from clpt.scene.materials import CLEAR
from clpt.scene.shapes import Cylinder, Disk, Mesh, Shape

HOLE = 1e-4  # of a mesh's area: smaller ones are no matter
ROUND = Disk, Cylinder


def warnings_of(index: SceneIndex, cached: Callable[..., Any] | None = None) -> list[str]:
    """Return a warning where meshes that have an inside are not closed, else none.

    cached: `LoweringCache`, which keeps what was found of a mesh.
    """
    suspects: list[tuple[Any, Mesh]] = []
    for shape in index.shapes:
        if isinstance(shape, Mesh) and not on_device(shape.vertices):
            for inside in _insides(shape):
                known = any(inside == other for other, _ in suspects)
                if not known and _own_hole(shape, cached) > HOLE:
                    suspects.append((inside, shape))
    found = [(shape, hole_around(index, inside, cached)) for inside, shape in suspects]
    holes = [(shape, share) for shape, share in found if share > HOLE]
    if not holes:
        return []
    (shape, share), more = holes[0], len(holes) - 1
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
        thin = isinstance(part, mt.GltfSurface) and part.thin
        if part.absorption != CLEAR and not thin:
            yield part.absorption


def _own_hole(shape: Shape, cached: Callable[..., Any] | None) -> float:
    """The largest hole of a shape alone, over its area."""
    if cached is None:
        return holes.largest_hole(*triangles_of(shape))
    vertices, faces = triangles_of(shape, cached)
    share: float = cached(holes.largest_hole, vertices, faces)
    return share


def hole_around(index: SceneIndex, inside: object, cached: Callable[..., Any] | None) -> float:
    """The largest hole of all shapes around something, over their area."""
    around: list[tuple[float, Shape]] = []
    for shape in every(index.listed, lambda one: True):
        around += [(1.0, shape)] * any(inside == own for own in _insides(shape))
        around += [(-1.0, shape)] * (shape.exterior is inside)
    if len(around) == 1:
        return _own_hole(around[0][1], cached)
    if any(isinstance(shape, ROUND) for _, shape in around):
        return 0.0  # their rims are no edges
    points: list[NDArray[Any]] = []
    faces: list[NDArray[Any]] = []
    first = 0
    for sign, shape in around:
        if isinstance(shape, Mesh) and on_device(shape.vertices):
            return 0.0
        own, triangles = triangles_of(shape, cached)
        points.append(np.asarray(own, np.float64))
        faces.append(np.asarray(triangles, np.int64)[:, :: int(sign)] + first)
        first += len(own)
    return holes.largest_hole(holes.together(np.concatenate(points)), np.concatenate(faces))
