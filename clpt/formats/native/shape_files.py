"""Files that a shape or a lamp of scene.json names in place of its arrays."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clpt.choices import Missing
from clpt.files import budget, numpy_files
from clpt.formats import ies
from clpt.formats.meshes import mesh, spheres_curves
from clpt.formats.meshes.triangles import TANGENTS
from clpt.formats.native.cursor import Cursor
from clpt.formats.native.spectra import find_file
from clpt.formats.volumes import distances
from clpt.scene import lights, shapes
from clpt.scene.params import Kind

PER_INSTANCE = 1024  # bytes of memory, about
MESH_ARRAYS = ("vertices", "faces", "normals", "uvs", "tangents")


@dataclass(frozen=True)
class ShapeFile:
    """A kind of file that a shape may name by its key `file`.

    accepts, meaning: for the schema and the reference; replaces: the parameters that the file
    holds; read: returns these, None if a file makes several shapes; join: returns the kind with
    the parameters that `read` has returned.
    """

    accepts: str
    meaning: str
    replaces: tuple[str, ...] = ()
    read: Callable[[Path], dict[str, Any]] | None = None
    join: Callable[[Any, dict[str, Any]], Any] = lambda kind, values: dataclasses.replace(
        kind, **values
    )


def sdf_grid(path: Path) -> dict[str, Any]:
    """Read signed distances; the box of a .vol is not read. Raises SceneError."""
    return {"values": distances(path)}


FILES: dict[type[Kind], ShapeFile] = {
    shapes.Mesh: ShapeFile(
        "name of a mesh file", "in place of the arrays", (*MESH_ARRAYS, "attributes")
    ),
    shapes.Curves: ShapeFile(
        "name of a text file",
        "lines of x y z radius, blank ones between strands, in place of points and lengths",
        ("points", "lengths"),
        spheres_curves.read_strands,
    ),
    shapes.Spheres: ShapeFile(
        "name of a .npz file",
        "centers, radii and attributes by their names, in place of those",
        ("centers", "radii", "attributes"),
        spheres_curves.read_spheres,
    ),
    shapes.Instance: ShapeFile(
        "name of a .npy file", "matrices (n, 3, 4): an instance for each, before `to_world`"
    ),
    shapes.SdfGrid: ShapeFile(
        "name of a .npy or .vol file", "signed distances, in place of values", ("values",), sdf_grid
    ),
    lights.Goniometric: ShapeFile(
        "name of an .ies or .ldt file",
        "candela by direction, in place of `image`",
        ("image",),
        ies.parameters,
        ies.joined,
    ),
}


def in_file(cls: type[Kind], name: str, value: object) -> bool:
    """Return whether a shape's file holds a parameter; the word `smooth` is not in a file."""
    return name in FILES[cls].replaces and not isinstance(value, str)


def check_only_in_file(cursor: Cursor, cls: type[Kind]) -> None:
    """Raise SceneError where a shape with a file has the file's parameters too."""
    for key, value in cursor.value.items():
        if in_file(cls, key, value):
            raise cursor.at(key).error("stands in the 'file' already; give either")


def read_meshes(path: Path, missing: Missing) -> mesh.MeshFile:
    """Read a file of meshes, glTF included; missing: see clpt.load. Raises SceneError."""
    if path.suffix.lower() not in (".glb", ".gltf"):
        return mesh.read_mesh(path, missing=missing)
    from clpt.formats import gltf  # here: most scenes have no use for it

    return gltf.read_mesh(path)


def read_transforms(cursor: Cursor) -> np.ndarray:
    """Read the matrices (n, 3, 4) of a .npy; return them as (n, 4, 4) float64."""
    path = find_file(cursor)
    rows = numpy_files.array(path)
    if rows.dtype.kind != "f" or rows.shape[1:] != (3, 4):
        raise cursor.error("must hold matrices, (n, 3, 4) of float")
    budget.take_parts(len(rows), "its instances", path)
    budget.take(PER_INSTANCE * len(rows), "its instances", path)
    matrices = np.tile(np.eye(4), (len(rows), 1, 1))
    matrices[:, :3] = rows
    return matrices


def _with_tangents(shape: shapes.Mesh) -> dict[str, Any]:
    """Return a mesh's attributes and its tangents, as both are arrays per vertex."""
    attributes = dict(shape.attributes)
    return attributes if shape.tangents is None else {**attributes, TANGENTS: shape.tangents}


def checked_arrays(cursor: Cursor, shape: shapes.Mesh, warnings: list[str]) -> shapes.Mesh:
    """Check the arrays of a mesh that is given in the JSON itself."""
    if shape.vertices is None or shape.faces is None:
        raise cursor.error("a mesh needs a 'file', or 'vertices' and 'faces'")
    per_vertex = {"normals": shape.normals, "uvs": shape.uvs, "tangents": shape.tangents}
    for name, values in per_vertex.items():
        is_array = values is not None and not isinstance(values, str)
        if is_array and len(values) != len(shape.vertices):
            raise cursor.at(name).error(f"must be one for each of {len(shape.vertices)} vertices")
    for name, values in shape.attributes.items():
        count = len(shape.faces if name.startswith("face_") else shape.vertices)
        if len(values) != count:
            raise cursor.at("attributes").at(name).error(f"must be {count} rows")
    with cursor.locating():
        read = mesh.Arrays(
            shape.vertices,
            shape.faces.astype(np.int64),
            None if isinstance(shape.normals, str) else shape.normals,
            shape.uvs,
            _with_tangents(shape),
        )
        arrays = mesh.checked(None, "", read, warnings)
        if shape.tangents is not None:
            arrays["tangents"] = arrays["attributes"].pop(TANGENTS)
    if isinstance(shape.normals, str):
        arrays["normals"] = shape.normals
    if not len(arrays["faces"]):
        raise cursor.error("holds no triangles")
    return dataclasses.replace(shape, **arrays)
