"""Meshes in files that a Mitsuba scene names.

A .serialized file has several meshes, each packed by deflate (mitsuba.readthedocs.io, "Serialized
mesh loader").
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats.meshes import mesh
from clpt.formats.mitsuba.properties import Wanted
from clpt.geometry.polygons import smooth_normals
from clpt.scene.shapes import Mesh

MAGIC = 0x041C
VERSIONS = (3, 4)
NORMALS, UVS, COLOURS, FLAT, DOUBLE = 0x0001, 0x0002, 0x0008, 0x0010, 0x2000
DEFLATE = 1032  # most bytes that a compressed byte of deflate stands for


class _Stream:
    """The decompressed bytes of a mesh, read in their order."""

    def __init__(self, path: Path, packed: bytes):
        self.path, self.packed, self.inflate = path, packed, zlib.decompressobj()
        self.left = DEFLATE * len(packed)

    def take(self, size: int) -> bytes:
        """Return the next bytes. Raises SceneError where there are fewer."""
        if size > self.left:
            raise SceneError("names more vertices or triangles than it can hold", file=self.path)
        budget.check(2 * size, "a mesh in it", self.path)
        self.left -= size
        parts = []
        while size > 0:
            try:
                part = self.inflate.decompress(self.packed, size)
            except zlib.error as error:
                raise SceneError(f"is damaged: {error}", file=self.path) from None
            self.packed = self.inflate.unconsumed_tail
            if not part:
                raise SceneError("ends too early", file=self.path)
            parts.append(part)
            size -= len(part)
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def array(self, rows: int, columns: int, dtype: str) -> NDArray[Any]:
        data = self.take(rows * columns * np.dtype(dtype).itemsize)
        return np.frombuffer(data, dtype).reshape(rows, columns)

    def text(self) -> str:
        """Return the text up to a zero byte."""
        characters = bytearray()
        while (byte := self.take(1)) != b"\0":
            characters += byte
            if len(characters) > 4096:
                raise SceneError("a mesh's name has no end", file=self.path)
        return characters.decode("utf-8", "replace")


def read(path: Path, index: int, archives: dict[Path, bytes]) -> tuple[Mesh, bool, list[str]]:
    """Return the mesh number `index` of a file, whether it is to be flat, and what was left out.

    archives: the contents of the files that were read before, by path; a file is read once.
    Raises SceneError for a file that is missing or broken, or has no such mesh.
    """
    if not archives.get(path):
        archives[path] = input_files.read_bytes(path)
    data = archives[path]
    first, end, version = _mesh_range(path, data, index)
    stream = _Stream(path, data[first + 4 : end])
    (flags,) = struct.unpack("<I", stream.take(4))
    name = stream.text() if version == 4 else path.name
    n_vertices, n_faces = struct.unpack("<QQ", stream.take(16))
    real = "<f8" if flags & DOUBLE else "<f4"
    vertices = stream.array(n_vertices, 3, real)
    normals = stream.array(n_vertices, 3, real) if flags & NORMALS else None
    uvs = stream.array(n_vertices, 2, real) if flags & UVS else None
    inner = {"vertex_color": stream.array(n_vertices, 3, real)} if flags & COLOURS else {}
    wide = "<u8" if n_vertices > 0xFFFFFFFF else "<u4"
    faces = stream.array(n_faces, 3, wide)
    warnings: list[str] = []
    values = mesh.Arrays(vertices, faces, normals, uvs, inner)
    arrays = mesh.checked(path, name, values, warnings)
    if not len(arrays["faces"]):
        raise SceneError("holds no triangles", file=path)
    return Mesh(name=name, **arrays), bool(flags & FLAT), warnings


def _mesh_range(path: Path, data: bytes, index: int) -> tuple[int, int, int]:
    """Return where a mesh begins and ends, by the table at the file's end, and the version."""
    if len(data) < 12 or struct.unpack_from("<H", data)[0] != MAGIC:
        raise SceneError("is not a .serialized file", file=path)
    (version,) = struct.unpack_from("<H", data, 2)
    if version not in VERSIONS:
        raise SceneError(f"is of version {version}, not 3 or 4", file=path)
    (count,) = struct.unpack_from("<I", data, len(data) - 4)
    width = 8 if version == 4 else 4
    table = len(data) - 4 - width * count
    if count == 0 or table < 4:
        raise SceneError("has a broken table of meshes", file=path)
    if index >= count:
        raise SceneError(f"has no mesh {index}: it holds {count}", file=path)
    offsets = [*np.frombuffer(data, f"<u{width}", count, table).tolist(), table]
    first, end = offsets[index], offsets[index + 1]
    if not first + 4 <= end <= table or struct.unpack_from("<H", data, first)[0] != MAGIC:
        raise SceneError(f"has a broken mesh {index}", file=path)
    return first, end, version


MOST_TURNS = 64  # groups of triangles around a vertex; what is left after them stays together


def creased(mesh: Mesh, angle: float) -> Mesh:
    """Return a mesh without normals whose triangles share a vertex where they lie within an angle.

    angle: of the triangles' normals [degrees]. As src/librender/trimesh.cpp (rebuildTopology):
    at each position the first triangle without a group begins a group of all triangles within the
    angle to it.
    """
    faces = np.asarray(mesh.faces, np.int64)
    corners = faces.reshape(-1)
    places = _places(mesh)[corners]
    flat = transforms.unit_vectors(transforms.edge_crosses(mesh.vertices, faces))
    normals = np.repeat(flat, 3, axis=0)
    group = np.full(len(corners), -1)
    least = np.cos(np.radians(min(angle, 180.0)))
    for turn in range(MOST_TURNS):
        waiting = np.flatnonzero(group < 0)
        if not len(waiting):
            break
        kept, first = np.unique(places[waiting], return_index=True)
        seeds = waiting[first][np.searchsorted(kept, places[waiting])]
        near = np.einsum("ij,ij->i", normals[waiting], normals[seeds]) >= least
        group[waiting[near | (waiting == seeds)]] = turn
    keys = np.stack([places, group], axis=1)
    _, first, joined = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    kept = corners[first]
    return replace(
        mesh,
        vertices=mesh.vertices[kept],
        faces=joined.reshape(-1, 3).astype(np.uint32),
        normals=None,
        uvs=None if mesh.uvs is None else mesh.uvs[kept],
        attributes={
            name: values[kept] if name.startswith("vertex_") else values
            for name, values in mesh.attributes.items()
        },
    )


def _places(mesh: Mesh) -> NDArray[Any]:
    """Return for each vertex the number of its place: its position, and uv if it has any."""
    parts = [np.asarray(mesh.vertices, np.float32)]
    if mesh.uvs is not None:
        parts.append(np.asarray(mesh.uvs, np.float32))
    return np.unique(np.concatenate(parts, axis=1), axis=0, return_inverse=True)[1].reshape(-1)


def in_world(
    path: Path, wanted: Wanted, to_world: transforms.Matrix, archives: dict[Path, bytes]
) -> tuple[dict[str, Any], list[str]]:
    """Return the arrays of a mesh in world space, and warnings."""
    flat = wanted.flat
    if wanted.suffix == ".serialized":
        whole, own_flat, warnings = read(path, wanted.number, archives)
        flat |= own_flat
    else:
        loaded = mesh.read_mesh(path, materials=False)
        whole, warnings = mesh.join(loaded.meshes), loaded.warnings
    if wanted.crease >= 0.0 and not flat:
        whole = creased(whole, wanted.crease)
    flat |= whole.normals is None and not wanted.smooth
    vertices, moves = whole.vertices, not np.array_equal(to_world, transforms.IDENTITY)
    if moves:
        vertices = transforms.transform_points(to_world, vertices).astype(np.float32)
    uvs = whole.uvs
    if uvs is not None and wanted.flip_v:
        uvs = np.column_stack([uvs[:, 0], 1.0 - uvs[:, 1]]).astype(np.float32)
    normals, faces = None if flat else whole.normals, whole.faces
    if not flat and normals is None:
        normals = smooth_normals(vertices, faces)
    elif not flat and moves:
        normals = transforms.transform_normals(to_world, whole.normals).astype(np.float32)
        if transforms.flips_handedness(to_world):
            faces = faces[:, ::-1].copy()  # the file's normals decide the front, not the winding
    arrays = {"vertices": vertices, "faces": faces, "normals": normals, "uvs": uvs}
    return {**arrays, "attributes": dict(whole.attributes)}, warnings
