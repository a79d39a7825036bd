"""Mitsuba's .serialized meshes: several in a file, each packed by deflate.

Format: mitsuba.readthedocs.io, "Serialized mesh loader".
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats.meshes import mesh
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
    """Return the mesh number `index` of a file, whether it is to be flat, and its warnings.

    archives: the contents of the files that were read before, by path; a file is read once.
    Raises SceneError for a file that is missing or broken, or has no such mesh.
    """
    if path not in archives:
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
