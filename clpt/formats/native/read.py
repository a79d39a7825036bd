"""scene.json, one-to-one with the dataclasses of clpt.scene: a kind reads what it declares."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from clpt import spectra
from clpt.errors import SceneError, UnknownKindError, UnusedParameterError
from clpt.formats.meshes import mesh, particles, strands
from clpt.formats.native import reradiation
from clpt.formats.native import spectra as json_spectra
from clpt.formats.native.cursor import Cursor, parse, placed
from clpt.formats.native.spectra import find_file, kind_name
from clpt.formats.native.transforms import matrix
from clpt.scene import Scene, cameras, check_noise, integrators, kinds, lights, materials, shapes
from clpt.scene.params import SPECTRUM_ROLES, Kind, Param, params
from clpt.scene.textures import ATTRIBUTES

ON_SHAPES = tuple(cls.kind for cls in lights.ON_SHAPES)
KEYS = (
    "$schema", "name", "camera", "film", "integrator", "sampler", "materials", "groups", "shapes",
    "lights", "spp", "noise", "seed",
)  # fmt: skip
# A mesh's arrays: numbers in a row, and of what type.
ARRAYS = {
    "vertices": (3, "number"),
    "faces": (3, "integer"),
    "normals": (3, "number"),
    "uvs": (2, "number"),
}
# Shapes whose arrays may stand in a file: what is there, and who reads it.
IN_FILES: dict[type[shapes.Shape], tuple[tuple[str, ...], Callable[[Path], dict[str, Any]]]] = {
    shapes.Curves: (("points", "lengths"), strands.read),
    shapes.Spheres: (("centers", "radii", "attributes"), particles.read),
}
BASES: dict[str, type[Kind]] = {
    "material": materials.Material,
    "light": lights.Light,
    "shape": shapes.Shape,
    "camera": cameras.Camera,
    "integrator": integrators.Integrator,
    "sampler": integrators.Sampler,
    "filter": integrators.Filter,
}


def load(path: Path, outside: Iterable[type[materials.Material]] = ()) -> Scene:
    """Read a scene.json.

    outside: material kinds that are not clpt's own. Raises SceneError, UnknownKindError and
    UnusedParameterError with file, line and place.
    """
    return _Reader(parse(path), outside).scene()


def default(field: dataclasses.Field[Any]) -> Any:
    """Return the default of a dataclass's field."""
    made = field.default_factory
    return field.default if made is dataclasses.MISSING else made()


class _Reader:
    """Reads one file; keeps the materials by name so that they are shared."""

    def __init__(self, root: Cursor, outside: Iterable[type[materials.Material]]):
        self.root = root
        self.outside: dict[str, type[Kind]] = {}
        for cls in outside:
            if cls.kind in {**kinds("material"), **self.outside}:
                raise SceneError(f"there are two kinds of materials {cls.kind!r}; rename yours")
            self.outside[cls.kind] = cls
        self.materials: dict[str, materials.Material | None] = {}
        self.groups: dict[str, shapes.Group | None] = {}
        self.warnings: list[str] = []
        self.special: dict[str, Callable[[Cursor], Any]] = {
            "back": self.material,
            "crop": lambda c: tuple(entry.integer() for entry in c.entries()),
            "map": lambda c: self.kind(c, "texture"),
            "emission": self.emission,
            "group": self.group,
            "image": _image,
            "sensor": json_spectra.read_sensor,
            "white_balance": lambda c: (
                tuple(c.numbers(2)) if isinstance(c.value, list) else c.value
            ),
            "attributes": _attributes,
            "points": _array_reader(4, "number"),
            "centers": _array_reader(3, "number"),
            "radii": lambda c: c.numbers() if isinstance(c.value, list) else c.number(),
            "lengths": lambda c: tuple(entry.integer() for entry in c.entries()),
            **{name: _array_reader(*form) for name, form in ARRAYS.items()},
        }

    def scene(self) -> Scene:
        root = self.root
        for key in root.value:
            if key not in KEYS:
                raise UnusedParameterError("a scene", key, KEYS, **root.at(key).place())
        if "camera" not in root.value:
            raise root.error("needs a 'camera'")
        given: dict[str, Any] = {}
        readers: dict[str, Callable[[Cursor], Any]] = {
            "camera": lambda c: self.kind(c, "camera"),
            "film": lambda c: self.make(c, integrators.Film, ()),
            "integrator": lambda c: self.kind(c, "integrator"),
            "sampler": lambda c: self.kind(c, "sampler"),
            "lights": lambda c: [self.light(entry) for entry in c.entries()],
            "shapes": lambda c: [made for entry in c.entries() for made in self.shape(entry)],
            "spp": Cursor.integer,
            "noise": _noise,
            "seed": Cursor.integer,
            "name": lambda c: c.expect(str),
        }
        for key, read in readers.items():
            if key in root.value:
                given[key] = read(root.at(key))
        if "materials" in root.value:
            for _, cursor in root.at("materials").items():
                self.material(cursor)
        for name, cursor in root.at("groups").items() if "groups" in root.value else ():
            self.named_group(name, cursor)
        given.setdefault("name", root.file.stem)
        with_place = root.at("spp") if "spp" in root.value else root
        return placed(
            with_place,
            lambda: Scene(**given, warnings=self.warnings, extra={"format": "native"}),
        )

    def kind(self, cursor: Cursor, category: str) -> Any:
        """Read an object of one of a category's kinds."""
        table = kinds(category)
        if category == "material":
            table |= self.outside
        return self.make(cursor, table[kind_name(cursor, category, table)], ("type",))

    def make(self, cursor: Cursor, cls: type[Kind], more: tuple[str, ...]) -> Any:
        """Read an object of a kind; `more` are keys that are no parameters."""
        declared = params(cls)
        shortcut = ("metal",) if {"eta", "k"} <= declared.keys() else ()
        defaults = {field.name: default(field) for field in dataclasses.fields(cls)}
        given: dict[str, Any] = {}
        for key, child in cursor.items():
            if key in declared:
                given[key] = self.parameter(child, key, declared[key], defaults[key])
            elif key not in (*more, *shortcut):
                known = (*declared, *shortcut)
                raise UnusedParameterError(cls.kind, key, known, **child.place())
        if shortcut and "metal" in cursor.value:
            if "eta" in given or "k" in given:
                raise cursor.at("metal").error("stands for 'eta' and 'k'; give either")
            given["eta"], given["k"] = _metal(cursor.at("metal"))
        return placed(cursor, lambda: cls(**given))

    def parameter(self, cursor: Cursor, name: str, param: Param, value: Any) -> Any:
        """Read one parameter by its role, or what only the host needs by its name or default."""
        if param.role in ("flag", "choice"):
            return cursor.value
        if param.textured and isinstance(cursor.value, dict) and "type" in cursor.value:
            known = {**kinds("texture"), **json_spectra.SPECTRA}
            if kind_name(cursor, "texture or spectrum", known) in kinds("texture"):
                return self.kind(cursor, "texture")
        if param.role == "reradiation":
            return reradiation.read(cursor)
        if param.role in SPECTRUM_ROLES:
            return json_spectra.read(cursor, param.role, name)
        if param.role == "real":
            return cursor.number()
        if param.role == "orders":
            return tuple(cursor.numbers())
        if param.role == "layers":
            return [self.make(entry, materials.Layer, ()) for entry in cursor.entries()]
        return self.special[name](cursor) if name in self.special else self.plain(cursor, value)

    def plain(self, cursor: Cursor, value: Any) -> Any:
        """Read what has the type of a default."""
        if isinstance(value, materials.Material):
            return self.material(cursor)
        if isinstance(value, Kind):
            return self.kind(
                cursor, next(c for c, base in BASES.items() if isinstance(value, base))
            )
        if isinstance(value, np.ndarray):
            return matrix(cursor, len(value))
        if isinstance(value, (bool, str)):
            return cursor.expect(type(value))
        if isinstance(value, int):
            return cursor.integer()
        if isinstance(value, float):
            return cursor.number()
        if isinstance(value, tuple) and value and isinstance(value[0], str):
            return tuple(entry.expect(str) for entry in cursor.entries())
        return tuple(cursor.numbers(len(value)))

    def light(self, cursor: Cursor) -> Any:
        if kind_name(cursor, "light", kinds("light")) in ON_SHAPES:
            raise cursor.error("an area light stands in a shape's 'emission'")
        return self.kind(cursor, "light")

    def emission(self, cursor: Cursor) -> Any:
        if cursor.value is None:
            return None
        if kind_name(cursor, "light", kinds("light")) not in ON_SHAPES:
            raise cursor.error("only an area light can stand on a shape")
        return self.kind(cursor, "light")

    def material(self, cursor: Cursor) -> Any:
        """Read a material, or find the one of that name."""
        if cursor.value is None or isinstance(cursor.value, dict):
            in_table = len(cursor.path) == 2 and cursor.path[0] == "materials"
            if in_table:
                return self.named(str(cursor.path[1]), cursor)
            return self.kind(cursor, "material") if cursor.value is not None else None
        return self.named(cursor.expect(str, "a material or its name"), cursor)

    def named(self, name: str, asked_by: Cursor) -> Any:
        if name not in self.materials:
            table = self.root.value.get("materials", {})
            if not isinstance(table, dict) or name not in table:
                known = table if isinstance(table, dict) else ()
                raise UnknownKindError("material name", name, known, **asked_by.place())
            cursor = self.root.at("materials").at(name)
            self.materials[name] = None
            made = self.kind(cursor, "material")
            self.materials[name] = made if made.name else dataclasses.replace(made, name=name)
        if self.materials[name] is None:
            raise asked_by.error(f"the material {name!r} refers to itself")
        return self.materials[name]

    def group(self, cursor: Cursor) -> shapes.Group:
        return self.named_group(cursor.expect(str, "a group's name"), cursor)

    def named_group(self, name: str, asked_by: Cursor) -> shapes.Group:
        """Read the group of that name, once."""
        if name not in self.groups:
            table = self.root.value.get("groups", {})
            if not isinstance(table, dict) or name not in table:
                known = table if isinstance(table, dict) else ()
                raise UnknownKindError("group name", name, known, **asked_by.place())
            self.groups[name] = None
            entries = self.root.at("groups").at(name).entries()
            found = [(entry, made) for entry in entries for made in self.shape(entry)]
            for entry, made in found:
                if isinstance(made, shapes.Instance):
                    raise entry.error("an instance cannot stand in a group")
            self.groups[name] = shapes.Group(tuple(made for _, made in found), name)
        group = self.groups[name]
        if group is None:
            raise asked_by.error(f"the group {name!r} holds itself")
        return group

    def instances(self, cursor: Cursor) -> list[shapes.Shape]:
        """Read an instance, or one for each matrix of a file."""
        if "group" not in cursor.value:
            raise cursor.error("needs a 'group'")
        if "file" not in cursor.value:
            return [self.kind(cursor, "shape")]
        first = self.make(cursor, shapes.Instance, ("type", "file"))
        placements = _placements(cursor.at("file"))
        return [
            dataclasses.replace(first, to_world=np.asarray(first.to_world) @ matrix)
            for matrix in placements
        ]

    def in_file(self, cursor: Cursor, cls: type[shapes.Shape]) -> shapes.Shape:
        """Read a shape whose arrays are in a file."""
        arrays, read = IN_FILES[cls]
        _only_in_file(cursor, arrays)
        made = self.make(cursor, cls, ("type", "file"))
        child = cursor.at("file")
        return dataclasses.replace(made, **placed(child, lambda: read(find_file(child))))

    def shape(self, cursor: Cursor) -> list[shapes.Shape]:
        """Read a shape; a mesh file may hold several, with materials of their own."""
        kind = kind_name(cursor, "shape", kinds("shape"))
        if kind == "instance":
            return self.instances(cursor)
        cls = kinds("shape")[kind]
        if cls in IN_FILES and "file" in cursor.value:
            return [self.in_file(cursor, cls)]
        if kind != "mesh" or "file" not in cursor.value:
            made = self.kind(cursor, "shape")
            return [_checked_mesh(cursor, made, self.warnings)] if kind == "mesh" else [made]
        _only_in_file(cursor, ARRAYS)
        frame = self.make(cursor, shapes.Mesh, ("type", "file"))
        child = cursor.at("file")
        loaded = placed(child, lambda: _meshes(find_file(child)))
        self.warnings += [f"{child.value}: {note}" for note in loaded.warnings]
        dressed, several = "material" in cursor.value, len(loaded.meshes) > 1
        return [_in_frame(part, frame, dressed, several) for part in loaded.meshes]


def _only_in_file(cursor: Cursor, keys: Iterable[str]) -> None:
    """Raise SceneError where an entry with a file has its arrays too."""
    for key in keys:
        if key in cursor.value:
            raise cursor.at(key).error("stands in the 'file' already; give either")


def _meshes(path: Path) -> mesh.MeshFile:
    if path.suffix.lower() not in (".glb", ".gltf"):
        return mesh.read_mesh(path)
    from clpt.formats import gltf  # here: most scenes have no use for it

    return gltf.read_mesh(path)


def _placements(cursor: Cursor) -> np.ndarray:
    """Read the matrices (n, 3, 4) of a .npy; return them as (n, 4, 4) float64."""
    path = find_file(cursor)
    try:
        rows = np.load(path, mmap_mode="r")  # a wrong header claims no memory
    except (OSError, ValueError, EOFError) as error:
        raise cursor.error(f"is no .npy file: {error}") from None
    good = isinstance(rows, np.ndarray) and rows.dtype.kind == "f" and rows.shape[1:] == (3, 4)
    if not good:
        raise cursor.error("must hold matrices, (n, 3, 4) of float")
    matrices = np.tile(np.eye(4), (len(rows), 1, 1))
    matrices[:, :3] = rows
    return matrices


def _in_frame(part: shapes.Mesh, frame: shapes.Mesh, dressed: bool, several: bool) -> shapes.Mesh:
    """Return a part of a file, placed and dressed as the scene says."""
    return dataclasses.replace(
        frame,
        material=frame.material if dressed else part.material,
        emission=frame.emission or (None if dressed else part.emission),
        to_world=np.asarray(frame.to_world) @ part.to_world,
        name=frame.name or (part.name if several else ""),
        vertices=part.vertices,
        faces=part.faces,
        normals=part.normals,
        uvs=part.uvs,
        attributes=part.attributes,
    )


def _checked_mesh(cursor: Cursor, made: shapes.Mesh, notes: list[str]) -> shapes.Mesh:
    """Check the arrays of a mesh that is given in the JSON itself."""
    if made.vertices is None or made.faces is None:
        raise cursor.error("a mesh needs a 'file', or 'vertices' and 'faces'")
    for name in ("normals", "uvs"):
        values = getattr(made, name)
        if values is not None and len(values) != len(made.vertices):
            raise cursor.at(name).error(f"must be one for each of {len(made.vertices)} vertices")
    for name, values in made.attributes.items():
        count = len(made.faces if name.startswith("face_") else made.vertices)
        if len(values) != count:
            raise cursor.at("attributes").at(name).error(f"must be {count} rows")
    faces = made.faces.astype(np.int64)
    arrays = placed(
        cursor,
        lambda: mesh.checked(
            None, "", made.vertices, faces, made.normals, made.uvs, notes, made.attributes
        ),
    )
    if not len(arrays["faces"]):
        raise cursor.error("holds no triangles")
    return dataclasses.replace(made, **arrays)


def _metal(cursor: Cursor) -> tuple[spectra.Spectrum, spectra.Spectrum]:
    if isinstance(cursor.value, dict):
        if list(cursor.value) != ["file"]:
            raise cursor.error("a metal is a name, or an object with the key 'file' alone")
        path = find_file(cursor.at("file"))
        return placed(cursor, lambda: spectra.read_refractive_index(path))
    name = cursor.expect(str)
    if name not in spectra.metals():
        raise UnknownKindError("metal", name, spectra.metals(), **cursor.place())
    return spectra.metal(name)


def _image(cursor: Cursor) -> Any:
    if isinstance(cursor.value, list):
        return [find_file(entry) for entry in cursor.entries(6)]
    return find_file(cursor)


def _attributes(cursor: Cursor) -> dict[str, np.ndarray]:
    """Rows of 1 or 3 numbers by their attribute's name."""
    found = {}
    for name, child in cursor.items():
        if not name.startswith(ATTRIBUTES):
            raise child.error(f"the name must begin with {' or '.join(ATTRIBUTES)}")
        rows = child.expect(list)
        wide = len(rows[0]) if rows and isinstance(rows[0], list) else 3
        found[name] = _array(child, 1 if wide == 1 else 3, np.float32)
    return {name: values for name, values in found.items() if values is not None}


def _array_reader(width: int, item: str) -> Callable[[Cursor], np.ndarray | None]:
    return lambda cursor: _array(cursor, width, np.uint32 if item == "integer" else np.float32)


def _array(cursor: Cursor, width: int, dtype: type) -> np.ndarray | None:
    if cursor.value is None:
        return None
    rows = cursor.expect(list)
    try:
        values = np.asarray(rows, np.float64).reshape(-1, width)
        valid = len(values) == len(rows) and not any(isinstance(row, (int, float)) for row in rows)
    except (ValueError, TypeError, OverflowError):
        valid = False
    if not valid:
        raise cursor.error(f"must be a list of rows of {width} numbers")
    if dtype is np.uint32 and not ((values >= 0) & (values < 2**31) & (values % 1 == 0)).all():
        raise cursor.error("must be whole numbers from zero")
    return values.astype(dtype)


def _noise(cursor: Cursor) -> float:
    noise = cursor.number()
    placed(cursor, lambda: check_noise(noise))
    return noise
