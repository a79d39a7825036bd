"""Motion between two pictures: a former scene and the present scene become keys of a scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import on_host
from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.scene import Scene
from clpt.scene.motion import Deformation, placement, through
from clpt.scene.params import fields_of
from clpt.scene.shapes import Group, Shape


def between(former: Scene, scene: Scene) -> tuple[Scene, list[str]]:
    """Return a scene that moves from `former` to `scene` while its shutter is open, and warnings.

    Shapes and lights are matched by their indices. A shape, a light or a camera with a `motion`
    keeps it.

    Raises SceneError if there is no shutter, and for another number of shapes or lights.
    """
    shutter = scene.camera.shutter
    if shutter is None or not shutter.close > shutter.open:
        message = "motion needs a time for which the shutter is open: camera.shutter"
        raise SceneError(message, where="camera.shutter")
    for name, *counts in (
        ("shapes", len(former.shapes), len(scene.shapes)),
        ("lights", len(former.lights), len(scene.lights)),
    ):
        if counts[0] != counts[1]:
            message = (
                f"motion needs what is in both scenes: there were {counts[0]}, now {counts[1]}"
            )
            raise SceneError(message, where=name)
    way = _Way((shutter.open, shutter.close))
    moving = [way.shape(a, b) for a, b in zip(former.shapes, scene.shapes, strict=True)]
    lamps = [way.moved(a, b, "light") for a, b in zip(former.lights, scene.lights, strict=True)]
    camera = way.moved(former.camera, scene.camera, "camera")
    return replace(scene, shapes=moving, lights=lamps, camera=camera), way.warnings


class _Way:
    """The motion from a scene to the next, between two times [s]."""

    def __init__(self, times: tuple[float, float]):
        self.times, self.warnings = times, list[str]()
        self.groups: dict[tuple[int, int], Group] = {}

    def shape(self, old: Shape, new: Shape) -> Shape:
        """Return a shape with keys of its transform and of its points."""
        if old is new:
            return new
        keyed = self.moved(old, new, shapes.where(new))
        if new.group is not None and old.group is not None:
            group = self.group(old.group, new.group)
            return keyed if group is new.group else replace(keyed, group=group)
        return self.deformed(old, keyed)

    def group(self, old: Group, new: Group) -> Group:
        """Return a group with keys of its shapes' points."""
        if old is new or len(old.shapes) != len(new.shapes):
            return new
        key = id(old), id(new)
        if key not in self.groups:
            pairs = zip(old.shapes, new.shapes, strict=True)
            inner = tuple(self.deformed(a, b) for a, b in pairs)
            self.groups[key] = replace(new, shapes=inner)
        return self.groups[key]

    def deformed(self, old: Shape, new: Shape) -> Shape:
        """Return a shape with keys of its points, if they differ from the former points."""
        name = new.deformed_field
        if not name or name != old.deformed_field or new.deformation is not None:
            return new
        was, now = fields_of(old), fields_of(new)
        if was[name] is now[name] and was.get("radii") is now.get("radii"):
            return new
        first, last = (_points(shape, name) for shape in (old, new))
        if np.array_equal(first, last):
            return new
        shines = new.emission is not None and new.radii is not None
        if first.shape != last.shape or shines:
            why = "emits light" if shines else f"had {len(first)} of them"
            self.warnings.append(f"{shapes.where(new)}: its {name} do not move, as it {why}")
            return new
        pair = [shape.normals for shape in (old, new)]
        in_arrays = all(n is not None and not isinstance(n, str) for n in pair)
        normals = np.stack([np.asarray(on_host(n)) for n in pair]) if in_arrays else None
        keys: dict[str, Any] = {"deformation": Deformation(self.times, [first, last], normals)}
        return replace(new, **keys)

    def moved(self, old: Any, new: Any, name: str) -> Any:
        """Return a shape, light or camera with keys of its transform, if that changed."""
        if old is new or type(old) is not type(new) or new.motion is not None:
            return new
        was, now = (placement(_read(value)) for value in (old, new))
        if was is None or now is None or np.array_equal(was, now):
            return new
        try:
            return through(new, self.times, [was, now])
        except SceneError as error:
            self.warnings.append(f"{name}: does not move: {error}")
            return new


def _points(shape: Shape, name: str) -> NDArray[np.float32]:
    """Return the points of a shape on the host; for spheres with the radii (n, 4)."""
    points = np.asarray(on_host(fields_of(shape)[name]), np.float32)
    if shape.radii is None or points.ndim != 2 or points.shape[1] != 3:
        return points
    radii = np.asarray(on_host(shape.radii), np.float32)
    return np.column_stack([points, np.broadcast_to(radii, len(points))])


def _read(value: Any) -> Any:
    """Return a shape, light or camera with its transform on the host."""
    matrix = fields_of(value).get("to_world")
    return value if matrix is None else replace(value, to_world=on_host(matrix))
