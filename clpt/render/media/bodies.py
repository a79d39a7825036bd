"""Bodies that may overlap: what counts of each is its matter.

Matter is material, medium inside and priority. Bodies of the same matter join where they overlap.
"""

from __future__ import annotations

from collections.abc import Iterable

from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.scalars import is_whole
from clpt.scene.materials import Dielectric, Material, Null, RoughDielectric
from clpt.scene.media import Medium
from clpt.scene.shapes import Curves, Cylinder, Disk, Instance, Rectangle, Shape

OPEN = (Rectangle, Disk, Cylinder, Curves)
BENDS = (Dielectric, RoughDielectric)

Matter = tuple[int, Material, "Medium | None"]


def matter_of(shape: Shape) -> Matter | None:
    """Return the matter of a shape's body in a scene with priorities, None of what is no body."""
    if not isinstance(shape.material, BENDS) and shape.interior is None:
        return None
    return shape.priority, shape.material, shape.interior


def check_bodies(things: Iterable[Shape]) -> None:
    """Raise SceneError for priorities that make no sense; nothing in a scene without any."""
    found = list(things)
    for shape in found:
        where, given = shapes.where(shape), shape.priority
        if not is_whole(given) or given < 0:
            raise SceneError(f"priority must be an integer from 0, not {given!r}", where=where)
        if given and isinstance(shape, Instance):
            raise SceneError("priority is for the shapes of its group", where=where)
        if given and not isinstance(shape.material, (*BENDS, Null)):
            raise SceneError(
                "priority is for bodies of dielectric, rough_dielectric or null, not of "
                f"{shape.material.kind}",
                where=where,
            )
    if not any(shape.priority for shape in found):
        return
    for shape in found:
        if isinstance(shape, OPEN) and matter_of(shape) is not None:
            raise SceneError(
                f"a {shape.kind} is not closed: where bodies have a priority, each is one closed "
                "shape, such as a mesh, a cube or a sphere",
                where=shapes.where(shape),
            )
    for shape in found:
        if shape.exterior is not None:
            raise SceneError(
                "leave exterior out where bodies have a priority: it tells what is outside",
                where=shapes.where(shape),
            )
