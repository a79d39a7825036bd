"""Edits of a scene as plain data: a new scene with other materials, places or vertices in it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np
import pyopencl as cl

from clpt.errors import SceneError
from clpt.render.lowering.device_arrays import fresh_view, on_device, readable
from clpt.render.lowering.geometry import shapes
from clpt.render.lowering.geometry.instancing import distinct
from clpt.scene import Scene
from clpt.scene.materials import Material, inner, parts
from clpt.scene.shapes import SMOOTH, Group, Instance, Shape

ShapeKey: TypeAlias = Shape | str | int
MaterialKey: TypeAlias = Material | ShapeKey


class Names:
    """What stands in a scene now for the shapes and materials that were given at first.

    Shapes are plain data: an edit puts another object in the place of one. Who holds the first can
    go on to name the place by it.
    """

    def __init__(self) -> None:
        self._now: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()

    def now(self, thing: Any) -> Any:
        """Return what stands in the place of a shape or material; itself, if nothing else does."""
        return self._now.get(thing, thing)

    def replace(self, swaps: Mapping[int, tuple[Any, Any]]) -> None:
        """Note what took a place; swaps: by the id of what was there, that and the new one."""
        for first, present in list(self._now.items()):
            if id(present) in swaps:
                self._now[first] = swaps[id(present)][1]
        self._now.update(swaps.values())


def edited(
    scene: Scene,
    names: Names,
    materials: Mapping[MaterialKey, Material] | None = None,
    transforms: Mapping[ShapeKey, Any] | None = None,
    vertices: Mapping[ShapeKey, Any] | None = None,
) -> tuple[Scene, dict[int, tuple[Any, Any]]]:
    """Return the scene with what is given, and what took the place of what, see `Names.replace`.

    The keys are those of clpt.Renderer.update. Raises SceneError for a key that names nothing in
    the scene, or more than one shape, and for what a shape does not have.
    """
    edit = _Edit(scene, names)
    for key, material in (materials or {}).items():
        if not isinstance(material, Material):
            raise SceneError(f"{material!r} is not a material", where="materials")
        if isinstance(key, Material):
            edit.swap(edit.material(key), material)
        else:
            edit.change(edit.shape(key, "materials"), "material", material)
    for key, matrix in (transforms or {}).items():
        # another object: an array that is the same one would be taken to hold the same
        given = fresh_view(matrix) if on_device(matrix) else np.array(matrix, float)
        edit.change(edit.shape(key, "transforms"), "to_world", given)
    for key, points in (vertices or {}).items():
        shape = edit.shape(key, "vertices")
        field = next((name for name in ("vertices", "centers") if hasattr(shape, name)), None)
        if field is None:
            raise SceneError(f"a {shape.kind} has none", where=f"vertices[{key!r}]")
        new = fresh_view(points) if on_device(points) else np.asarray(points).view()
        edit.change(shape, field, new)
        if getattr(shape, "normals", None) is not None:  # the former vertices' are of no use
            edit.change(shape, "normals", SMOOTH)
    made = edit.scene_made()
    swaps = {at: (old, new) for at, (old, new) in edit.done.items() if old is not new}
    return made, swaps


def match_replacements(former: Scene, scene: Scene) -> dict[int, tuple[Any, Any]]:
    """Return which shapes took the place of one that is gone, see `Names.replace`.

    They stand at the same place in a list of the same length.
    """
    if len(former.shapes) != len(scene.shapes):
        return {}
    present = {id(shape) for shape in scene.shapes}
    pairs = zip(former.shapes, scene.shapes, strict=True)
    return {id(old): (old, new) for old, new in pairs if id(old) not in present}


def resolve_device_arrays(scene: Scene, queue: cl.CommandQueue) -> Scene:
    """Return a scene that can be lowered: what its shapes have in device memory can be read.

    Raises SceneError for memory of another context, or a buffer of the wrong size.
    """
    edit = _Edit(scene, Names())
    for shape in (one for one in edit.shapes.values() if isinstance(one, Shape)):
        for name, values in readable(shape, queue, shapes.where(shape)).items():
            edit.change(shape, name, values)
    return edit.scene_made() if edit.changes else scene


class _Edit:
    """The state of one `edited`: what changes, and what has been made in its place."""

    def __init__(self, scene: Scene, names: Names):
        self.scene, self.names = scene, names
        self.changes: dict[int, dict[str, Any]] = {}
        self.done: dict[int, tuple[Any, Any]] = {}  # by the id of what was there, it and the new
        self.shapes = {id(s): s for s in (*scene.shapes, *distinct(scene.shapes))}
        self._parts: dict[int, Material] | None = None

    def shape(self, key: ShapeKey, where: str) -> Shape:
        """The shape that a key means."""
        if isinstance(key, Shape):
            found = key if id(key) in self.shapes else self.names.now(key)
            if id(found) in self.shapes:
                return found
            raise SceneError(f"{shapes.where(key)} is not in the scene", where=where)
        if isinstance(key, str):
            named = [shape for shape in self.shapes.values() if shape.name == key]
            if len(named) == 1:
                return named[0]
            count = f"{len(named)} shapes have" if named else "no shape has"
            raise SceneError(f"{count} the name {key!r}", where=where)
        if isinstance(key, bool) or not isinstance(key, (int, np.integer)):
            raise SceneError(f"{key!r} is no shape, name or index", where=where)
        if not 0 <= key < len(self.scene.shapes):
            found_ = f"there are {len(self.scene.shapes)} shapes"
            raise SceneError(f"no shape has the index {key}: {found_}", where=where)
        return self.scene.shapes[key]

    def material(self, key: Material) -> Material:
        """The material of the scene that a key means."""
        if self._parts is None:
            owned = (shape.material for shape in self.shapes.values())
            self._parts = {id(part): part for material in owned for part in parts(material)}
        for found in (key, self.names.now(key)):
            if id(found) in self._parts:
                return found
        raise SceneError(f"a {key.kind} that was given is not in the scene", where="materials")

    def change(self, shape: Shape, name: str, value: Any) -> None:
        """Let a field of a shape be another."""
        self.changes.setdefault(id(shape), {})[name] = value

    def made(self, thing: Any) -> Any:
        """What stands for a shape, group or material afterwards; itself where nothing changes."""
        if id(thing) not in self.done:
            fields = self._fields(thing)
            fields = {n: value for n, value in fields.items() if value is not getattr(thing, n)}
            self.swap(thing, dataclasses.replace(thing, **fields) if fields else thing)
        return self.done[id(thing)][1]

    def scene_made(self) -> Scene:
        """The scene afterwards."""
        made = [self.made(shape) for shape in self.scene.shapes]
        return dataclasses.replace(self.scene, shapes=made)

    def swap(self, old: Any, new: Any) -> None:
        """Put one object in the place of another, wherever that stands."""
        self.done[id(old)] = old, new

    def _fields(self, thing: Any) -> dict[str, Any]:
        """What some fields of a thing are afterwards."""
        if isinstance(thing, Material):
            return {name: self.made(part) for name, part in inner(thing)}
        if isinstance(thing, Group):
            members = tuple(self.made(shape) for shape in thing.shapes)
            same = all(a is b for a, b in zip(members, thing.shapes, strict=True))
            return {"shapes": thing.shapes if same else members}
        fields = self.changes.get(id(thing), {})
        if isinstance(thing, Instance):
            return {**fields, "group": self.made(thing.group)}
        if isinstance(thing.material, Material) and "material" not in fields:
            return {**fields, "material": self.made(thing.material)}
        return fields
