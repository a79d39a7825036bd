"""Edits of a scene as plain data: a new scene with other materials, transforms or vertices."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np
import pyopencl as cl

from clpt.arrays import on_device
from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.geometry.instancing import distinct
from clpt.render.records.device_arrays import fresh_view, readable
from clpt.scalars import is_whole
from clpt.scene import Scene
from clpt.scene.materials import Material, inner, parts
from clpt.scene.shapes import SMOOTH, Group, Instance, Shape

ShapeKey: TypeAlias = Shape | str | int
MaterialKey: TypeAlias = Material | ShapeKey
# By the id of a shape or material: it, and what replaces it.
Replacements: TypeAlias = dict[int, tuple[Any, Any]]


class Successors:
    """Present shapes and materials, by those that a renderer had at first.

    Shapes are plain data: an edit replaces one by another object. Who holds the first can go on to
    use it as a key.
    """

    def __init__(self) -> None:
        self._present: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()

    def of(self, thing: object) -> Any:
        """Return what has replaced a shape or material; itself, if nothing has."""
        return self._present.get(thing, thing)

    def note(self, replacements: Replacements) -> None:
        """Note that things were replaced."""
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
    """Return a scene with other materials, transforms and vertices, and what was replaced.

    The keys are those of clpt.Renderer.update. Raises SceneError for a key that names nothing in
    the scene, or more than one shape, and for what a shape does not have.
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
        field = next((name for name in ("vertices", "centers") if hasattr(shape, name)), None)
        if field is None:
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
    """Return which shapes have replaced one that is gone, at the same index of as long a list."""
    if len(former.shapes) != len(scene.shapes):
        return {}
    present = {id(shape) for shape in scene.shapes}
    pairs = zip(former.shapes, scene.shapes, strict=True)
    return {id(old): (old, new) for old, new in pairs if id(old) not in present}


def resolve_device_arrays(scene: Scene, queue: cl.CommandQueue) -> Scene:
    """Return a scene that can be lowered, whose buffers in device memory are arrays of the queue.

    Raises SceneError for memory of another context, or a buffer of the wrong size.
    """
    edit = _Edit(scene, Successors())
    for shape in (one for one in edit.shapes.values() if isinstance(one, Shape)):
        for name, values in readable(shape, queue, shapes.where(shape)).items():
            edit.change(shape, name, values)
    return edit.edited_scene() if edit.changes else scene


class _Edit:
    """The state of one `edit_scene`.

    changes: the new values of fields, by the id of a shape; edited: by the id of a shape, group or
    material: it, and what stands for it afterwards.
    """

    def __init__(self, scene: Scene, successors: Successors):
        self.scene, self.successors = scene, successors
        self.changes: dict[int, dict[str, Any]] = {}
        self.edited: Replacements = {}
        self.shapes = {id(s): s for s in (*scene.shapes, *distinct(scene.shapes))}
        self._parts: dict[int, Material] | None = None

    def shape(self, key: ShapeKey, where: str) -> Shape:
        """The shape that a key means."""
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
        """The material of the scene that a key means."""
        if self._parts is None:
            owned = (shape.material for shape in self.shapes.values())
            self._parts = {id(part): part for material in owned for part in parts(material)}
        for material in (key, self.successors.of(key)):
            if id(material) in self._parts:
                return material
        raise SceneError(f"the {key.kind} is not in the scene", where="materials")

    def change(self, shape: Shape, name: str, value: object) -> None:
        """Let a field of a shape have another value."""
        self.changes.setdefault(id(shape), {})[name] = value

    def replace(self, old: object, new: object) -> None:
        """Replace an object by another, wherever it stands."""
        self.edited[id(old)] = old, new

    def edited_scene(self) -> Scene:
        """The scene afterwards."""
        edited = [self._edited(shape) for shape in self.scene.shapes]
        return dataclasses.replace(self.scene, shapes=edited)

    def replacements(self) -> Replacements:
        """Return pairs of the objects that were replaced, old and new, once the scene is edited."""
        return {key: (old, new) for key, (old, new) in self.edited.items() if old is not new}

    def _edited(self, thing: Any) -> Any:
        """Return a shape, group or material as the edit leaves it; itself if nothing changes."""
        if id(thing) not in self.edited:
            fields = self._fields(thing)
            fields = {n: value for n, value in fields.items() if value is not getattr(thing, n)}
            self.replace(thing, dataclasses.replace(thing, **fields) if fields else thing)
        return self.edited[id(thing)][1]

    def _fields(self, thing: Any) -> dict[str, Any]:
        """Return the fields of a thing that may change, as they are after the edit."""
        if isinstance(thing, Material):
            return {name: self._edited(part) for name, part in inner(thing)}
        if isinstance(thing, Group):
            members = tuple(self._edited(shape) for shape in thing.shapes)
            same = all(a is b for a, b in zip(members, thing.shapes, strict=True))
            return {"shapes": thing.shapes if same else members}
        fields = self.changes.get(id(thing), {})
        if isinstance(thing, Instance):
            return {**fields, "group": self._edited(thing.group)}
        if isinstance(thing.material, Material) and "material" not in fields:
            return {**fields, "material": self._edited(thing.material)}
        return fields
