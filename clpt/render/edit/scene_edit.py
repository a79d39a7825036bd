"""Edits of a scene as plain data: a new scene with other materials, transforms or vertices.

For motion between two pictures the former scene and the present scene become keys of a scene.
"""

from __future__ import annotations

import dataclasses
import operator
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt.arrays import is_whole, on_device, on_host
from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.geometry.instancing import distinct
from clpt.render.records.tables import fresh_view, readable
from clpt.scene import Scene
from clpt.scene.materials import Material, parts
from clpt.scene.motion import Deformation, placement, through
from clpt.scene.params import fields_of
from clpt.scene.shapes import SMOOTH, Group, Shape

ShapeKey: TypeAlias = Shape | str | int
MaterialKey: TypeAlias = Material | ShapeKey
# A shape or material, and its replacement, by the id of the former.
Replacements: TypeAlias = dict[int, tuple[Any, Any]]


class Successors:
    """The present shapes and materials, by the first shapes and materials of a renderer.

    Shapes are plain data: an edit replaces a shape by a new object. Callers may still use the first
    object as a key.
    """

    def __init__(self) -> None:
        self._present: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()

    def of(self, first: object) -> Any:
        """Return the replacement of a shape or material; itself if it was not replaced."""
        return self._present.get(first, first)

    def note(self, replacements: Replacements) -> None:
        for first, present in list(self._present.items()):
            if id(present) in replacements:
                self._present[first] = replacements[id(present)][1]
        self._present.update(replacements.values())


def edit_scene(
    scene: Scene,
    successors: Successors,
    materials: Mapping[MaterialKey, Material] | None = None,
    transforms: Mapping[ShapeKey, Any] | None = None,
    vertices: Mapping[ShapeKey, Any] | None = None,
) -> tuple[Scene, Replacements]:
    """Return a scene with other materials, transforms and vertices, and the replacements.

    Keys are as in clpt.Renderer.update. Raises SceneError for a key that no shape has or that
    several have, and for parameters that a shape does not have.
    """
    edit = _Edit(scene, successors)
    for key, material in (materials or {}).items():
        if not isinstance(material, Material):
            raise SceneError(f"{material!r} is not a material", where="materials")
        if isinstance(key, Material):
            edit.replace(edit.material(key), material)
        else:
            edit.change(edit.shape(key, "materials"), "material", material)
    for key, matrix in (transforms or {}).items():
        # A new object: an array that is the same object would be taken to hold the same values.
        new = fresh_view(matrix) if on_device(matrix) else np.array(matrix, float)
        edit.change(edit.shape(key, "transforms"), "to_world", new)
    for key, points in (vertices or {}).items():
        shape = edit.shape(key, "vertices")
        field = shape.deformed_field
        if field not in ("vertices", "centers"):
            raise SceneError(f"a {shape.kind} has none", where=f"vertices[{key!r}]")
        new = fresh_view(points) if on_device(points) else np.asarray(points).view()
        edit.change(shape, field, new)
        if shape.deformation is not None:
            edit.change(shape, "deformation", None)
        if shape.normals is not None:  # which belong to the former vertices
            edit.change(shape, "normals", SMOOTH)
        if shape.tangents is not None:
            edit.change(shape, "tangents", None)
    return edit.edited_scene(), edit.replacements()


def match_replacements(former: Sequence[Shape], placed: Sequence[Shape]) -> Replacements:
    """Return the shapes that replaced removed shapes at equal indices of lists of equal length."""
    if len(former) != len(placed):
        return {}
    present = {id(shape) for shape in placed}
    pairs = zip(former, placed, strict=True)
    return {id(old): (old, new) for old, new in pairs if id(old) not in present}


def resolve_device_arrays(scene: Scene, queue: cl.CommandQueue) -> Scene:
    """Return a scene for lowering: arrays of the queue replace buffers on the device.

    Raises SceneError for memory of another context, or a buffer of the wrong size.
    """
    edit = _Edit(scene, Successors())
    for shape in edit.shapes.values():
        for name, values in readable(shape, queue, shapes.where(shape)).items():
            edit.change(shape, name, values)
    return edit.edited_scene() if edit.changes else scene


class _Edit:
    """The state of a call of `edit_scene`.

    changes: new values of fields by the id of a shape; edited: a shape, group or material and its
    replacement, by the id of the former.
    """

    def __init__(self, scene: Scene, successors: Successors):
        self.scene, self.successors = scene, successors
        self.changes: dict[int, dict[str, Any]] = {}
        self.edited: Replacements = {}
        self.shapes = {id(s): s for s in (*scene.shapes, *distinct(scene.shapes))}
        self._parts: dict[int, Material] | None = None

    def shape(self, key: ShapeKey, where: str) -> Shape:
        """Return the shape of a key. Raises SceneError."""
        if isinstance(key, Shape):
            shape = key if id(key) in self.shapes else self.successors.of(key)
            if id(shape) in self.shapes:
                return shape
            raise SceneError(f"{shapes.where(key)} is not in the scene", where=where)
        if isinstance(key, str):
            named = [shape for shape in self.shapes.values() if shape.name == key]
            if len(named) == 1:
                return named[0]
            count = f"{len(named)} shapes have" if named else "no shape has"
            raise SceneError(f"{count} the name {key!r}", where=where)
        if not is_whole(key):
            raise SceneError(f"{key!r} is no shape, name or index", where=where)
        if not 0 <= key < len(self.scene.shapes):
            count = f"there are {len(self.scene.shapes)} shapes"
            raise SceneError(f"no shape has the index {key}: {count}", where=where)
        return self.scene.shapes[key]

    def material(self, key: Material) -> Material:
        """Return the scene's material of a key. Raises SceneError."""
        if self._parts is None:
            owned = (shape.material for shape in self.shapes.values())
            self._parts = {id(part): part for material in owned for part in parts(material)}
        for material in (key, self.successors.of(key)):
            if id(material) in self._parts:
                return material
        raise SceneError(f"the {key.kind} is not in the scene", where="materials")

    def change(self, shape: Shape, name: str, value: object) -> None:
        self.changes.setdefault(id(shape), {})[name] = value

    def replace(self, old: object, new: object) -> None:
        self.edited[id(old)] = old, new

    def edited_scene(self) -> Scene:
        edited = [self._edited(shape) for shape in self.scene.shapes]
        return dataclasses.replace(self.scene, shapes=edited)

    def replacements(self) -> Replacements:
        """Return pairs of old and new objects; call it after `edited_scene`."""
        return {key: (old, new) for key, (old, new) in self.edited.items() if old is not new}

    def _edited(self, part: Any) -> Any:
        """Return an edited shape, group or material, or a tuple of them; itself if none changes."""
        if isinstance(part, tuple):
            members = tuple(map(self._edited, part))
            return part if all(map(operator.is_, members, part)) else members
        if id(part) not in self.edited:
            changes = self.changes.get(id(part), {})
            parts = {n: value for n, value in part.shared_parts.items() if n not in changes}
            fields = {**changes, **{name: self._edited(value) for name, value in parts.items()}}
            fields = {n: value for n, value in fields.items() if value is not getattr(part, n)}
            self.replace(part, dataclasses.replace(part, **fields) if fields else part)
        return self.edited[id(part)][1]


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
