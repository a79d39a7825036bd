"""Writes a Scene as scene.json, with meshes as .ply and arrays of texels as .npy beside it."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
from collections import Counter
from collections.abc import Callable, Container, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images, measured
from clpt.arrays import on_host
from clpt.errors import SceneError
from clpt.files import output_files
from clpt.formats.meshes import spheres_curves
from clpt.formats.meshes.triangles import TANGENT_COLUMNS
from clpt.formats.native import forms, motion
from clpt.formats.native.read import VERSION
from clpt.formats.native.shape_files import MESH_ARRAYS, in_file
from clpt.images import spectral_exr
from clpt.scene import Scene, kinds, materials, shapes
from clpt.scene.media import Medium
from clpt.scene.motion import Deformation
from clpt.scene.params import Kind, defaults, fields_of, params

MANY = 16  # from so many instances in a row on, a file holds their matrices
NUMBERS = re.compile(r"\[\s+([^\[\]{}\"]*?)\s+\]")


def save(scene: Scene, path: str | Path, *, copies: bool = False) -> None:
    """Write a scene as `clpt.save` does, to the .json at `path`. Raises SceneError.

    copies: whether images that the scene has by their paths are copied beside it, so that another
    machine can read the folder; materials that are not clpt's own are then refused.
    """
    path = Path(path)
    writer = _Writer(path, copies)
    try:
        text = json.dumps(writer.scene(scene), indent=2)
        output_files.write_text(path, NUMBERS.sub(_on_one_line, text) + "\n")
    except OSError as error:
        raise SceneError(f"cannot be written: {error.strerror}", file=path) from None


def write_medium(medium: Medium, digits: int) -> str:
    """Return a medium as it stands in `media` of a scene.json; digits: of numbers in its tables."""

    def rounded(value: object, key: str = "") -> Any:
        if isinstance(value, dict):
            return {name: rounded(part, name) for name, part in value.items()}
        if isinstance(value, list):
            return [rounded(part, key) for part in value]
        kept = digits + 4 if key == "cosines" else digits  # those near 1 are close to each other
        return float(f"{value:.{kept}g}") if isinstance(value, float) else value

    written = _Writer(Path("medium.json")).kind(medium)
    written.pop("name", None)
    return NUMBERS.sub(_on_one_line, json.dumps(rounded(written), indent=2))


class _Writer:
    """Writes a scene; materials, groups and arrays that several shapes share are written once."""

    def __init__(self, path: Path, copies: bool = False):
        self.path, self.copies = path, copies
        self.array_files: dict[type[Kind], Callable[[Any], str]] = {
            shapes.Mesh: self.mesh,
            shapes.Curves: self.curves,
            shapes.SdfGrid: self.sdf_grid,
            shapes.Spheres: self.spheres,
        }
        self.materials: dict[str, Any] = {}
        self.media: dict[str, Any] = {}
        self.names: dict[int, str] = {}  # of materials and media
        self.shared: set[int] = set()  # those of them that have no name
        self.groups: dict[str, Any] = {}
        self.group_names: dict[int, str] = {}
        self.files: dict[Any, str] = {}  # names by their contents

    def scene(self, scene: Scene) -> dict[str, Any]:
        """Write the whole file."""
        self.shared = _shared(scene)
        document: dict[str, Any] = {"version": VERSION}
        document |= {"name": scene.name} if scene.name else {}
        document |= {
            "camera": self.kind(scene.camera),
            "film": self.untyped(scene.film),
            "integrator": self.kind(scene.integrator),
            "sampler": self.kind(scene.sampler),
            "spp": scene.spp,
            **({} if scene.noise is None else {"noise": scene.noise}),
            "seed": scene.seed,
            "materials": self.materials,
            "media": self.media,
            "groups": self.groups,
            "shapes": self.entries(scene.shapes),
            "lights": [self.kind(light) for light in scene.lights],
        }
        for name in ("media", "groups"):
            if not document[name]:
                del document[name]
        return document

    def entries(self, members: Sequence[shapes.Shape]) -> list[dict[str, Any]]:
        """Write shapes; a run of nameless instances of a group has its matrices in a file."""
        written: list[dict[str, Any]] = []
        for group, instances in groupby(members, _group_of_run):
            run = list(instances)
            if group is None or len(run) < MANY:
                written += [self.kind(shape) for shape in run]
            else:
                written.append(self.instances(run))
        return written

    def instances(self, run: Sequence[Any]) -> dict[str, Any]:
        """Write instances of a group, their matrices as .npy."""
        group = self.group(run[0].group)
        name = self.file_name(group, "npy")
        matrices = np.stack([np.asarray(instance.to_world, np.float64)[:3] for instance in run])
        images.write_npy(self.path.parent / name, matrices)
        self.files[name] = name
        return {"type": "instance", "group": group, "file": name}

    def group(self, group: shapes.Group) -> str:
        """Return a group's name in the table of groups, where it is written once."""
        if id(group) not in self.group_names:
            key = unused_name(group.name or "group", self.groups)
            self.group_names[id(group)] = key
            self.groups[key] = [self.kind(shape) for shape in group.shapes]
        return self.group_names[id(group)]

    def kind(self, kind: Kind) -> dict[str, Any]:
        """Return the JSON object of a kind; parameters with their defaults are left out.

        The material of a shape is always written: a mesh without a material has its file's.
        """
        cls, kind = type(kind), _on_host(kind)
        if self.copies and issubclass(cls, materials.Material) and not _is_known(cls):
            raise SceneError(f"the material {cls.kind!r} is not clpt's own: it stays here")
        written: dict[str, Any] = {"type": kind.kind}
        if cls in self.array_files:
            written["file"] = self.array_files[cls](kind)
        default, values = defaults(cls), fields_of(kind)
        for name, param in params(cls).items():
            parameter = values[name]
            if "file" in written and in_file(cls, name, parameter):
                continue
            value = forms.write(parameter, param, self)
            if name == "material" or value != forms.write(default[name], param, self):
                written[name] = value
        return written

    def untyped(self, kind: Kind) -> dict[str, Any]:
        """Return the JSON object of a kind that is implied, without its `type`."""
        written = self.kind(kind)
        del written["type"]
        return written

    def layer(self, layer: materials.Layer) -> dict[str, Any]:
        """Return the object that stands for a thin film."""
        return self.untyped(layer)

    def material(self, material: materials.Material) -> Any:
        """Return a material, or its name in the table of named materials."""
        return self._named(material, self.materials)

    def medium(self, medium: object) -> Any:
        """Return a medium, or its name in the table of named media."""
        return self._named(medium, self.media)

    def _named(self, kind: Any, table: dict[str, Any]) -> Any:
        """Return a thing, or its name in the table where it is written once."""
        if not kind.name and id(kind) not in self.shared:
            return self.kind(kind)
        if id(kind) not in self.names:
            key = unused_name(kind.name or kind.kind, table)
            self.names[id(kind)] = key
            table[key] = None
            table[key] = {**self.kind(kind), "name": kind.name}
            if key == kind.name:
                del table[key]["name"]
        return self.names[id(kind)]

    def file_name(self, label: str, suffix: str) -> str:
        """Return the name of a new file beside the scene's."""
        label = re.sub(r"\W+", "_", label)
        return f"{self.path.stem}.{label}{len(self.files)}.{suffix}"

    def image(self, image: Any) -> str:
        """Return the name of an image's file; an array is written to a file."""
        spectral = isinstance(image, spectral_exr.SpectralImage)
        if not spectral and not isinstance(image, np.ndarray):
            return (
                self.copy(Path(image)) if self.copies else os.path.relpath(image, self.path.parent)
            )
        if id(image) not in self.files:
            bytes_ = not spectral and image.dtype == np.uint8
            suffix = "exr" if spectral else "png" if bytes_ else "npy"
            name = self.file_name("image", suffix)
            if spectral:
                spectral_exr.write(self.path.parent / name, image)
            elif bytes_:
                images.write_stored(self.path.parent / name, image)
            else:
                images.write_npy(self.path.parent / name, np.asarray(image, np.float32))
            self.files[id(image)] = name
        return self.files[id(image)]

    def volume(self, values: object) -> str:
        """Return the name of the file that a density is written to; its box is the unit cube."""
        if id(values) not in self.files:
            name = self.file_name("density", "npy")
            images.write_npy(self.path.parent / name, np.asarray(values, np.float32))
            self.files[id(values)] = name
        return self.files[id(values)]

    def measurement(self, value: measured.Measurement) -> str:
        """Return the name of the file that a measured material is written to."""
        if id(value) not in self.files:
            name = self.file_name("measured", "bsdf")
            measured.write(self.path.parent / name, value)
            self.files[id(value)] = name
        return self.files[id(value)]

    def merl(self, value: measured.MerlTable) -> str:
        """Return the name of the file that a table of MERL is written to."""
        if id(value) not in self.files:
            name = self.file_name("merl", "binary")
            measured.write_merl(self.path.parent / name, value)
            self.files[id(value)] = name
        return self.files[id(value)]

    def copy(self, path: Path) -> str:
        """Copy a file, once; return its name."""
        key = os.path.realpath(path)
        if key not in self.files:
            name = self.file_name("image", path.suffix.lstrip("."))
            with output_files.replacing(self.path.parent / name) as partial:
                shutil.copyfile(path, partial)
            self.files[key] = name
        return self.files[key]

    def deformation(self, value: Deformation) -> dict[str, str]:
        """Write keys of points, once; return what names their file."""
        if id(value) not in self.files:
            name = self.file_name("deformation", "npz")
            motion.write_deformation(value, self.path.parent / name)
            self.files[id(value)] = name
        return {"file": self.files[id(value)]}

    def curves(self, curves: shapes.Curves) -> str:
        """Write strands, unless another shape shares them; return the file's name."""
        key = id(curves.points), id(curves.lengths)
        if key not in self.files:
            name = self.file_name(curves.name or "curves", "txt")
            spheres_curves.write_strands(self.path.parent / name, curves.points, curves.lengths)
            self.files[key] = name
        return self.files[key]

    def spheres(self, spheres: shapes.Spheres) -> str:
        """Write centres, radii and attributes; return the file's name."""
        name = self.file_name(spheres.name or "spheres", "npz")
        spheres_curves.write_spheres(self.path.parent / name, spheres)
        self.files[name] = name
        return name

    def sdf_grid(self, grid: shapes.SdfGrid) -> str:
        """Write signed distances; return the file's name."""
        name = self.file_name(grid.name or "distances", "npy")
        images.write_npy(self.path.parent / name, np.asarray(grid.values, np.float32))
        self.files[name] = name
        return name

    def mesh(self, mesh: shapes.Mesh) -> str:
        """Write a mesh's arrays, unless another shape shares them; return the file's name."""
        key = tuple(id(fields_of(mesh)[name]) for name in MESH_ARRAYS)
        if key not in self.files:
            name = self.file_name(mesh.name or "mesh", "ply")
            output_files.write(self.path.parent / name, _ply(mesh))
            self.files[key] = name
        return self.files[key]


def _shared(scene: Scene) -> set[int]:
    """Return the ids of nameless materials and media that are used several times.

    Their identity matters: a medium may have several shapes around it.
    """
    counts: Counter[int] = Counter()
    waiting: list[Any] = [scene.camera, *scene.shapes]
    while waiting:
        entry = waiting.pop()
        if isinstance(entry, (tuple, list)) and entry and isinstance(entry[0], Kind):
            waiting += entry
        if isinstance(entry, shapes.Instance):
            entry = entry.group
        if isinstance(entry, (materials.Material, Medium, shapes.Group)):
            counts[id(entry)] += 1
            if counts[id(entry)] > 1:
                continue
        if isinstance(entry, shapes.Group):
            waiting += entry.shapes
        if isinstance(entry, Kind):
            usual = defaults(type(entry))
            fields = fields_of(entry)
            names = params(type(entry))
            waiting += [fields[name] for name in names if fields[name] is not usual[name]]
    return {key for key, count in counts.items() if count > 1}


def unused_name(name: str, used: Container[str]) -> str:
    """Return a name, with a number behind it if it is used already."""
    free, count = name, 1
    while free in used:
        count += 1
        free = f"{name} {count}"
    return free


def _on_host(kind: Kind) -> Kind:
    """Return a thing whose arrays on a device are copied to the host. Raises SceneError."""
    named = fields_of(kind)
    on_device = {name: value for name, value in named.items() if hasattr(value, "context")}
    for name, value in on_device.items():
        if not hasattr(value, "get"):
            message = "a buffer has no shape: give a pyopencl.array.Array"
            raise SceneError(message, where=f"{kind.kind}.{name}")
        on_device[name] = on_host(value)
    return dataclasses.replace(kind, **on_device) if on_device else kind


def _is_known(cls: type[materials.Material]) -> bool:
    """Whether a kind of material is clpt's own."""
    return kinds("material").get(cls.kind) is cls


def _group_of_run(shape: shapes.Shape) -> int | None:
    """Return the identity of a nameless instance's group; None for any other shape."""
    return id(shape.group) if isinstance(shape, shapes.Instance) and not shape.name else None


def _on_one_line(match: re.Match) -> str:
    return "[" + re.sub(r"\s+", " ", match[1]) + "]"


def _ply(mesh: shapes.Mesh) -> bytes:
    """Return the arrays of a mesh as a binary PLY file, attributes by Mitsuba's names."""
    normals, uvs = mesh.normals, mesh.uvs
    if isinstance(normals, str):  # the scene's file says so
        normals = None
    vertex: list[Any] = [("x", "y", "z", mesh.vertices)]
    vertex += [] if normals is None else [("nx", "ny", "nz", normals)]
    vertex += [] if uvs is None else [("s", "t", uvs)]
    if mesh.tangents is not None:
        vertex.append((*TANGENT_COLUMNS, mesh.tangents))
    face: list[Any] = []
    for name, values in mesh.attributes.items():
        element, _, suffix = name.partition("_")
        values = np.asarray(values).reshape(len(values), -1)
        names = [f"{suffix}_{i}" for i in range(values.shape[1])]
        names = list("rgb") if suffix == "color" and len(names) == 3 else names
        (face if element == "face" else vertex).append((*names, values))
    count = np.full((len(mesh.faces), 1), 3, np.uint8)
    corners = np.ascontiguousarray(mesh.faces, "<i4").view(np.uint8).reshape(len(mesh.faces), -1)
    columns = [np.ascontiguousarray(v, "<f4").view(np.uint8) for *_, v in face]
    head = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(mesh.vertices)}",
        *(f"property float {name}" for *names, _ in vertex for name in names),
        f"element face {len(mesh.faces)}",
        "property list uchar int vertex_indices",
        *(f"property float {name}" for *names, _ in face for name in names),
        "end_header\n",
    ]
    points = np.concatenate([np.asarray(v, "<f4") for *_, v in vertex], axis=1)
    triangles = np.concatenate([count, corners, *columns], axis=1)
    return "\n".join(head).encode() + points.tobytes() + triangles.tobytes()
