"""Edits of a scene as plain data: a new scene with other materials, transforms or vertices."""

from __future__ import annotations

import dataclasses
import operator
from collections.abc import Mapping
from typing import Any, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np
import pyopencl as cl

from clpt.arrays import is_whole, on_device
from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.geometry.instancing import distinct
from clpt.render.records.tables import fresh_view, readable
from clpt.scene import Scene
from clpt.scene.materials import Material, parts
from clpt.scene.shapes import SMOOTH, Shape

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


def match_replacements(former: Scene, scene: Scene) -> Replacements:
    """Return the shapes that replaced removed shapes at equal indices of lists of equal length."""
    if len(former.shapes) != len(scene.shapes):
        return {}
    present = {id(shape) for shape in scene.shapes}
    pairs = zip(former.shapes, scene.shapes, strict=True)
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
