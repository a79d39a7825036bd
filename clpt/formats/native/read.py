"""Reader of scene.json, a mirror of clpt.scene: the parameters that a kind declares are read."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from clpt import measured
from clpt.choices import Missing
from clpt.errors import SceneError, UnknownKindError, UnusedParameterError
from clpt.files import budget
from clpt.formats import materialx, volumes
from clpt.formats.native import forms, shape_files
from clpt.formats.native.cursor import Cursor, ReadCursor, parse
from clpt.formats.native.spectra import find_file, kind_name
from clpt.formats.reading import EVEN, GREY, grey_for
from clpt.scene import Scene, checked_noise, integrators, kinds, lights, materials, media, shapes
from clpt.scene.params import Kind, params, shorthands
from clpt.scene.volumes import Volume

ON_SHAPES = tuple(cls.kind for cls in lights.ON_SHAPES)
KEYS = (
    "$schema", "version", "name", "camera", "film", "integrator", "sampler", "materials", "media",
    "groups", "shapes", "lights", "spp", "noise", "seed",
)  # fmt: skip
VERSION = 2  # since it, lamps' files give candela: version 1 took them for W sr^-1 nm^-1
CANDELA = (
    "lamps' files are in candela, as in version 2 of scene files, on a scale with lumens; before, "
    'such a lamp was 72,983 times as bright: write "version": 2 to confirm, 1 for the former light'
)
FILM_KEYS = frozenset(params(integrators.Film))


def load(
    path: Path,
    outside: Iterable[type[materials.Material]] = (),
    missing: Missing = "error",
    *,
    confined: bool = False,
) -> Scene:
    """Read a scene.json.

    outside: material kinds that are not clpt's own; missing: see clpt.load; confined: whether it
    can name only files of its own folder. Raises SceneError, UnknownKindError and
    UnusedParameterError with file, line and path of the value.
    """
    return _Reader(parse(path, confined), outside, missing).scene()


def from_json(value: dict[str, Any], folder: Path, missing: Missing = "error") -> Scene:
    """Return a scene that a program has as the content of a scene.json in `folder`, see `load`."""
    return _Reader(Cursor(value, folder / "scene.json", json.dumps(value)), (), missing).scene()


MATERIALX = "materialx"  # the type of a material that stands in a document


class _Reader:
    """Reads a file; keeps materials and groups by name, so that shapes share them."""

    def __init__(self, root: Cursor, outside: Iterable[type[materials.Material]], missing: Missing):
        self.root, self.missing = root, missing
        self.outside: dict[str, type[Kind]] = {}
        for cls in outside:
            if cls.kind in {**kinds("material"), **self.outside}:
                raise SceneError(f"there are two kinds of materials {cls.kind!r}; rename yours")
            self.outside[cls.kind] = cls
        # None while an entry is being read: it then refers to itself
        self.materials: dict[str, materials.Material | None] = {}
        self.media: dict[str, media.Medium | None] = {}
        self.volumes: dict[str, Volume] = {}
        self.measurements: dict[str, Any] = {}
        self.surfaces: dict[int, Any] = {}  # of MaterialX, by the ids of their materials' parts
        self.groups: dict[str, shapes.Group | None] = {}
        self.version = _version(root)
        self.warnings: list[str] = []

    def scene(self) -> Scene:
        """Read the whole file."""
        root = self.root
        of_film = next((key for key in root.value if key not in KEYS and key in FILM_KEYS), None)
        if of_film is not None:
            raise root.at(of_film).error("stands inside of 'film'")
        root.check_keys("a scene", KEYS)
        if "camera" not in root.value:
            raise root.error("needs a 'camera'")
        readers: dict[str, ReadCursor] = {
            "camera": lambda c: self.kind(c, "camera"),
            "film": lambda c: self.object_of(c, integrators.Film),
            "integrator": lambda c: self.kind(c, "integrator"),
            "sampler": lambda c: self.kind(c, "sampler"),
            "lights": lambda c: [self.light(entry) for entry in c.entries()],
            "shapes": lambda c: [shape for entry in c.entries() for shape in self.shape(entry)],
            "spp": Cursor.integer,
            "noise": _noise,
            "seed": Cursor.integer,
            "name": lambda c: c.expect(str),
        }
        parts = {key: read(root.at(key)) for key, read in readers.items() if key in root.value}
        for _, cursor in root.at("materials").items() if "materials" in root.value else ():
            self.material(cursor)
        for name, cursor in root.at("media").items() if "media" in root.value else ():
            self.named_medium(name, cursor)
        for name, cursor in root.at("groups").items() if "groups" in root.value else ():
            self.named_group(name, cursor)
        if root.file is not None:
            parts.setdefault("name", root.file.stem)
        with root.locating():
            return Scene(**parts, warnings=self.warnings, extra={"format": "native"})

    def kind(self, cursor: Cursor, category: str) -> Any:
        """Read an object of any kind of a category."""
        table = kinds(category)
        if category == "material":
            table |= self.outside
            if isinstance(cursor.value, dict) and cursor.value.get("type") == MATERIALX:
                return self.materialx(cursor)
        return self.object_of(cursor, table[kind_name(cursor, category, table)], ("type",))

    def object_of(self, cursor: Cursor, cls: type[Kind], other_keys: tuple[str, ...] = ()) -> Any:
        """Read an object of a kind; `other_keys` are no parameters, and are not read."""
        budget.take_parts(1, "its objects", cursor.file)
        declared = params(cls)
        known = {**declared, **shorthands(cls)}
        values: dict[str, Any] = {}
        for key, child in cursor.items():
            if key in known:
                values[key] = forms.read(child, known[key], self)
            elif key not in other_keys:
                if key in KEYS and len(cursor.path) == 1:
                    raise child.error(f"stands at the top of the file, beside {cursor.path[0]!r}")
                raise UnusedParameterError(cls.kind, key, known, **child.location())
        with cursor.locating():
            return cls(**values)

    def image(self, cursor: Cursor) -> Any:
        """Return the path of an image; grey if it is missing and missing images are grey."""
        try:
            return find_file(cursor)
        except SceneError:
            if self.missing == "error" or not isinstance(cursor.value, str):
                raise
            if grey_for(cursor.value) not in self.warnings:
                self.warnings.append(grey_for(cursor.value))
            return EVEN if cursor.path[-2:] == ("map", "image") else GREY

    def volume(self, cursor: Cursor, colours: bool = False) -> Any:
        """Read a density and its box, or `colours`, once for each name."""
        name = cursor.expect(str, "the name of a file")
        if name not in self.volumes:
            file, _, grid = name.partition("#")
            path = find_file(cursor, file)
            with cursor.locating():
                read = volumes.read_colours(path) if colours else volumes.read(path, grid)
                self.volumes[name] = read
        return self.volumes[name]

    def measurement(self, cursor: Cursor) -> Any:
        """Read a measured material, once for each name; null is none."""
        return self._measured(cursor, measured.read)

    def merl(self, cursor: Cursor) -> Any:
        """Read a table of MERL, once for each name; null is none."""
        return self._measured(cursor, measured.read_merl)

    def _measured(self, cursor: Cursor, read: Callable[[Path], Any]) -> Any:
        if cursor.value is None:
            return None
        name = cursor.expect(str, "the name of a file")
        if name not in self.measurements:
            path = find_file(cursor, name)
            with cursor.locating():
                self.measurements[name] = read(path)
        return self.measurements[name]

    def layer(self, cursor: Cursor) -> Any:
        """Read a thin film."""
        return self.object_of(cursor, materials.Layer)

    def light(self, cursor: Cursor) -> Any:
        """Read a light that is not a shape's."""
        if kind_name(cursor, "light", kinds("light")) in ON_SHAPES:
            raise cursor.error("an area light stands in a shape's 'emission'")
        cls = kinds("light")[kind_name(cursor, "light", kinds("light"))]
        if cls in shape_files.FILES and "file" in cursor.value:
            shape_files.check_only_in_file(cursor, cls)
            light, file = self.object_of(cursor, cls, ("type", "file")), cursor.at("file")
            path, known = find_file(file), shape_files.FILES[cls]
            with file.locating():
                values = known.read(path) if known.read else {}
                if self.version == 1:
                    return dataclasses.replace(light, **{**values, "candela": None})
                if self.version is None and CANDELA not in self.warnings:
                    self.warnings.append(CANDELA)
                return known.join(light, values)
        return self.kind(cursor, "light")

    def area_light(self, cursor: Cursor) -> Any:
        """Read the light of a shape; null is none."""
        if cursor.value is None:
            return None
        if kind_name(cursor, "light", kinds("light")) not in ON_SHAPES:
            raise cursor.error("only an area light can stand on a shape")
        return self.kind(cursor, "light")

    def material(self, cursor: Cursor) -> Any:
        """Read a material, or find it by its name; null is None."""
        if cursor.value is None:
            return None
        if not isinstance(cursor.value, dict):
            return self.named_material(cursor.expect(str, "a material or its name"), cursor)
        if len(cursor.path) == 2 and cursor.path[0] == "materials":
            return self.named_material(str(cursor.path[1]), cursor)
        return self.kind(cursor, "material")

    def materialx(self, cursor: Cursor) -> Any:
        """Read a material of a document of MaterialX; null chooses its only material."""
        cursor.check_keys(MATERIALX, ("type", "file", "material"))
        if "file" not in cursor.value:
            raise cursor.error("needs a 'file'")
        path = find_file(cursor.at("file"))
        name = cursor.at("material").expect(str) if "material" in cursor.value else None
        with cursor.locating():
            surface, warnings = materialx.load_material(path, name)
        self.warnings += [text for text in warnings if text not in self.warnings]
        self.surfaces |= {id(part): surface for part in materials.parts(surface.material)}
        return surface.material

    def _with_surface(self, shape: shapes.Shape) -> Any:
        """Return a shape with the light and the inside that a material of MaterialX has."""
        parts = materials.parts(shape.material)
        surface = next((self.surfaces[id(p)] for p in parts if id(p) in self.surfaces), None)
        if surface is None:
            return shape
        emission = shape.emission or surface.emission
        interior = surface.interior if shape.interior is None else shape.interior
        return dataclasses.replace(shape, emission=emission, interior=interior)

    def named_material(self, name: str, referrer: Cursor) -> Any:
        """Read the material of that name, once."""
        return self._named(self.materials, "materials", "material", name, referrer)

    def medium(self, cursor: Cursor) -> Any:
        """Read a medium, or find it by its name; null is None."""
        if cursor.value is None:
            return None
        if isinstance(cursor.value, dict):
            return self.kind(cursor, "medium")
        return self.named_medium(cursor.expect(str, "a medium or its name"), cursor)

    def named_medium(self, name: str, referrer: Cursor) -> Any:
        """Read the medium of that name, once."""
        return self._named(self.media, "media", "medium", name, referrer)

    def _named(
        self, known: dict[str, Any], table: str, family: str, name: str, referrer: Cursor
    ) -> Any:
        """Read the entry of that name, once; known: what a table has given so far."""
        if name not in known:
            cursor = self._entry(table, f"{family} name", name, referrer)
            known[name] = None
            kind = self.kind(cursor, family)
            known[name] = kind if "name" in cursor.value else dataclasses.replace(kind, name=name)
            if id(kind) in self.surfaces:
                self.surfaces[id(known[name])] = self.surfaces[id(kind)]
        if known[name] is None:
            raise referrer.error(f"the {family} {name!r} refers to itself")
        return known[name]

    def group(self, cursor: Cursor) -> shapes.Group:
        """Find the group of a name."""
        return self.named_group(cursor.expect(str, "a group's name"), cursor)

    def named_group(self, name: str, referrer: Cursor) -> shapes.Group:
        """Read the group of that name, once."""
        if name not in self.groups:
            entries = self._entry("groups", "group name", name, referrer).entries()
            self.groups[name] = None
            members = [(entry, shape) for entry in entries for shape in self.shape(entry)]
            for entry, shape in members:
                if isinstance(shape, shapes.Instance):
                    raise entry.error("an instance cannot stand in a group")
            self.groups[name] = shapes.Group(tuple(shape for _, shape in members), name)
        group = self.groups[name]
        if group is None:
            raise referrer.error(f"the group {name!r} contains itself")
        return group

    def _entry(self, table: str, noun: str, name: str, referrer: Cursor) -> Cursor:
        """Return the entry of a table of the scene. Raises UnknownKindError."""
        entries = self.root.value.get(table, {})
        known = entries if isinstance(entries, dict) else ()
        if name not in known:
            raise UnknownKindError(noun, name, known, **referrer.location())
        return self.root.at(table).at(name)

    def shape(self, cursor: Cursor) -> list[shapes.Shape]:
        """Read a shape; a file may hold several, meshes with materials of their own."""
        cls = kinds("shape")[kind_name(cursor, "shape", kinds("shape"))]
        if cls is shapes.Instance and "group" not in cursor.value:
            raise cursor.error("needs a 'group'")
        if cls in shape_files.FILES and "file" in cursor.value:
            return self._from_file(cursor, cls)
        shape = self.object_of(cursor, cls, ("type",))
        if cls is shapes.Mesh:
            shape = shape_files.checked_arrays(cursor, shape, self.warnings)
        return [self._with_surface(shape) if self.surfaces else shape]

    def _from_file(self, cursor: Cursor, cls: type[Kind]) -> list[shapes.Shape]:
        """Read a shape whose file holds its arrays, several meshes, or transforms of instances."""
        shape_files.check_only_in_file(cursor, cls)
        shape = self.object_of(cursor, cls, ("type", "file"))
        shape = self._with_surface(shape) if self.surfaces else shape
        file = cursor.at("file")
        if cls is shapes.Instance:
            return [
                shape.placed(np.asarray(shape.to_world) @ matrix)
                for matrix in shape_files.read_transforms(file)
            ]
        path = find_file(file)
        with file.locating():
            if (read := shape_files.FILES[cls].read) is not None:
                return [dataclasses.replace(shape, **read(path))]
            contents = shape_files.read_meshes(path, self.missing)
        self.warnings += [f"{file.value}: {warning}" for warning in contents.warnings]
        own_material, several = "material" in cursor.value, len(contents.meshes) > 1
        return [_merged(part, shape, own_material, several) for part in contents.meshes]


def _merged(
    part: shapes.Mesh, entry: shapes.Mesh, own_material: bool, several: bool
) -> shapes.Mesh:
    """Return a mesh of a file with the transform, material and light that its entry gives it."""
    return dataclasses.replace(
        entry,
        material=entry.material if own_material else part.material,
        emission=entry.emission or (None if own_material else part.emission),
        to_world=np.asarray(entry.to_world) @ part.to_world,
        name=entry.name or (part.name if several else ""),
        vertices=part.vertices,
        faces=part.faces,
        normals=part.normals if entry.normals is None else entry.normals,
        uvs=part.uvs,
        tangents=part.tangents,
        attributes=part.attributes,
    )


def _version(root: Cursor) -> int | None:
    """Return the version that a scene says it has, None without. Raises SceneError."""
    if not isinstance(root.value, dict) or "version" not in root.value:
        return None
    cursor = root.at("version")
    version = cursor.integer()
    if not 1 <= version <= VERSION:
        raise cursor.error(f"this clpt reads the versions 1 to {VERSION}, not {version}")
    return version


def _noise(cursor: Cursor) -> float:
    noise = cursor.number()
    with cursor.locating():
        checked_noise(noise)
    return noise
