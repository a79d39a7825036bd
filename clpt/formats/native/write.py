"""Writes a Scene as scene.json, with meshes as .ply and arrays of texels as .npy beside it."""

from __future__ import annotations

import dataclasses
import json
import os
import re
from collections.abc import Container, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images, spectral_exr
from clpt.errors import SceneError
from clpt.formats.meshes import particles, strands
from clpt.formats.meshes.mesh import smooth_normals
from clpt.formats.native import reradiation as json_reradiation
from clpt.formats.native import spectra as json_spectra
from clpt.formats.native.read import ARRAYS, default
from clpt.scene import Scene, materials, shapes
from clpt.scene.params import SPECTRUM_ROLES, Kind, Param, params

MANY = 16  # instances in a row, from which on their matrices are a file
NUMBERS = re.compile(r"\[\s+([^\[\]{}\"]*?)\s+\]")


def save(scene: Scene, path: str | Path) -> None:
    """Write a scene such that `load` gives the same content back; its folder must exist.

    Raises SceneError where a file cannot be written.
    """
    path = Path(path)
    writer = _Writer(path)
    try:
        text = json.dumps(writer.scene(scene), indent=2)
        path.write_text(NUMBERS.sub(_on_one_line, text) + "\n", "utf-8")
    except OSError as error:
        raise SceneError(f"cannot be written: {error.strerror}", file=path) from None


class _Writer:
    """Writes one scene; what several shapes share is written once."""

    def __init__(self, path: Path):
        self.path = path
        self.materials: dict[str, Any] = {}
        self.names: dict[int, str] = {}
        self.groups: dict[str, Any] = {}
        self.group_names: dict[int, str] = {}
        self.files: dict[Any, str] = {}

    def scene(self, scene: Scene) -> dict[str, Any]:
        document: dict[str, Any] = {"name": scene.name} if scene.name else {}
        film = self.kind(scene.film)
        del film["type"]
        document |= {
            "camera": self.kind(scene.camera),
            "film": film,
            "integrator": self.kind(scene.integrator),
            "sampler": self.kind(scene.sampler),
            "spp": scene.spp,
            **({} if scene.noise is None else {"noise": scene.noise}),
            "seed": scene.seed,
            "materials": self.materials,
            "groups": self.groups,
            "shapes": self.entries(scene.shapes),
            "lights": [self.kind(light) for light in scene.lights],
        }
        if not self.groups:
            del document["groups"]
        return document

    def entries(self, things: Sequence[shapes.Shape]) -> list[dict[str, Any]]:
        """Write shapes; a run of nameless instances of a group has its matrices in a file."""
        written: list[dict[str, Any]] = []
        for key, members in groupby(things, _run):
            run = list(members)
            if key is None or len(run) < MANY:
                written += [self.kind(shape) for shape in run]
            else:
                written.append(self.placements(run))
        return written

    def placements(self, run: Sequence[Any]) -> dict[str, Any]:
        """Write instances of one group, their matrices as .npy."""
        group = self.group(run[0].group)
        label = re.sub(r"\W+", "_", group)
        name = f"{self.path.stem}.{label}{len(self.files)}.npy"
        matrices = np.stack([np.asarray(one.to_world, np.float64)[:3] for one in run])
        np.save(self.path.parent / name, matrices)
        self.files[name] = name
        return {"type": "instance", "group": group, "file": name}

    def group(self, group: shapes.Group) -> str:
        """Return a group's name in the table of groups, where it is written once."""
        if id(group) not in self.group_names:
            key = free_name(group.name or "group", self.groups)
            self.group_names[id(group)] = key
            self.groups[key] = [self.kind(shape) for shape in group.shapes]
        return self.group_names[id(group)]

    def kind(self, thing: Kind) -> dict[str, Any]:
        """Return the object that stands for a thing; what has its default is left out."""
        given: dict[str, Any] = {"type": thing.kind}
        plain = type(thing)
        declared = params(plain)
        in_file: tuple[str, ...] = ()
        if isinstance(thing, shapes.Mesh):
            given["file"], in_file = self.mesh(thing), (*ARRAYS, "attributes")
        if isinstance(thing, shapes.Curves):
            given["file"], in_file = self.curves(thing), ("points", "lengths")
        if isinstance(thing, shapes.Spheres):
            given["file"], in_file = self.spheres(thing), ("centers", "radii", "attributes")
        declared = {name: p for name, p in declared.items() if name not in in_file}
        defaults = {field.name: default(field) for field in dataclasses.fields(plain)}
        for name, param in declared.items():
            written = self.parameter(name, getattr(thing, name), param)
            file = name == "image" and param.role == "host"
            implied = None if file else self.parameter(name, defaults[name], param)
            if name == "material" or written != implied:
                given[name] = written
        return given

    def parameter(self, name: str, value: Any, param: Param) -> Any:
        if name == "image" and param.role == "host":
            six = isinstance(value, (list, tuple))
            return [self.image(face) for face in value] if six else self.image(value)
        if name == "sensor":
            return json_spectra.write_sensor(value)
        if isinstance(value, materials.Material):
            return self.material(value)
        if isinstance(value, shapes.Group):
            return self.group(value)
        if isinstance(value, Kind):
            return self.kind(value)
        if param.role == "reradiation":
            return json_reradiation.write(value)
        if param.role in SPECTRUM_ROLES and not isinstance(value, (int, float, tuple)):
            return json_spectra.write(value, param.role)
        if param.role == "layers":
            return [self.layer(layer) for layer in value]
        if isinstance(value, np.ndarray):
            return value.tolist()
        return list(value) if isinstance(value, tuple) else value

    def layer(self, layer: materials.Layer) -> dict[str, Any]:
        given = self.kind(layer)
        del given["type"]
        return given

    def material(self, material: materials.Material) -> Any:
        """Return a material, or its name in the table of named ones."""
        if not material.name:
            return self.kind(material)
        if id(material) not in self.names:
            key = free_name(material.name, self.materials)
            self.names[id(material)] = key
            self.materials[key] = None
            written = self.kind(material)
            if key == material.name:
                del written["name"]
            self.materials[key] = written
        return self.names[id(material)]

    def image(self, image: Any) -> str:
        """Return the name of an image's file, which is written if there is none."""
        spectral = isinstance(image, spectral_exr.SpectralImage)
        if not spectral and not isinstance(image, np.ndarray):
            return os.path.relpath(image, self.path.parent)
        if id(image) not in self.files:
            bytes_ = not spectral and image.dtype == np.uint8
            suffix = "exr" if spectral else "png" if bytes_ else "npy"
            name = f"{self.path.stem}.image{len(self.files)}.{suffix}"
            if spectral:
                spectral_exr.write(self.path.parent / name, image)
            elif bytes_:
                images.write_stored(self.path.parent / name, image)
            else:
                np.save(self.path.parent / name, np.asarray(image, np.float32))
            self.files[id(image)] = name
        return self.files[id(image)]

    def curves(self, curves: shapes.Curves) -> str:
        """Write strands, unless another shape shares them; return the file's name."""
        key = id(curves.points), id(curves.lengths)
        if key not in self.files:
            label = re.sub(r"\W+", "_", curves.name) or "curves"
            name = f"{self.path.stem}.{label}{len(self.files)}.txt"
            strands.write(self.path.parent / name, curves.points, curves.lengths)
            self.files[key] = name
        return self.files[key]

    def spheres(self, spheres: shapes.Spheres) -> str:
        """Write centres, radii and attributes; return the file's name."""
        label = re.sub(r"\W+", "_", spheres.name) or "spheres"
        name = f"{self.path.stem}.{label}{len(self.files)}.npz"
        particles.write(self.path.parent / name, spheres)
        self.files[name] = name
        return name

    def mesh(self, mesh: shapes.Mesh) -> str:
        """Write a mesh's arrays, unless another shape shares them; return the file's name."""
        key = tuple(id(getattr(mesh, name)) for name in ARRAYS)
        if key not in self.files:
            label = re.sub(r"\W+", "_", mesh.name) or "mesh"
            name = f"{self.path.stem}.{label}{len(self.files)}.ply"
            (self.path.parent / name).write_bytes(_ply(mesh))
            self.files[key] = name
        return self.files[key]


def free_name(wanted: str, taken: Container[str]) -> str:
    """Return a name, with a number behind it if it is taken."""
    name, count = wanted, 1
    while name in taken:
        count += 1
        name = f"{wanted} {count}"
    return name


def _run(shape: shapes.Shape) -> int | None:
    """What instances that may share a file of matrices have in common."""
    return id(shape.group) if isinstance(shape, shapes.Instance) and not shape.name else None


def _on_one_line(match: re.Match) -> str:
    return "[" + re.sub(r"\s+", " ", match[1]) + "]"


def _ply(mesh: shapes.Mesh) -> bytes:
    """The arrays of a mesh as a binary PLY file, attributes by the names that Mitsuba has."""
    normals, uvs = mesh.normals, mesh.uvs
    if isinstance(normals, str):
        normals = smooth_normals(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    vertex: list[Any] = [("x", "y", "z", mesh.vertices)]
    vertex += [] if normals is None else [("nx", "ny", "nz", normals)]
    vertex += [] if uvs is None else [("s", "t", uvs)]
    face: list[Any] = []
    for name, values in mesh.attributes.items():
        element, _, rest = name.partition("_")
        values = np.asarray(values).reshape(len(values), -1)
        names = [f"{rest}_{i}" for i in range(values.shape[1])]
        names = list("rgb") if rest == "color" and len(names) == 3 else names
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
