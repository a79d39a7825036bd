"""KHR_draco_mesh_compression, decoded by DracoPy."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt.files import budget
from clpt.formats.gltf import accessors
from clpt.formats.gltf.document import Element
from clpt.formats.gltf.geometry import Geometry, attribute, types, warn_of_whole_numbers

NAME = "KHR_draco_mesh_compression"
HEADER = b"DRACO"
VERSION, MESH, EDGEBREAKER, METADATA, DEEPEST = (2, 2), 1, 1, 0x8000, 16
PER_TRIANGLE = 160  # bytes that Draco takes for each, as measured


def attributes(primitive: Element, compressed: Element) -> Geometry:
    """Return the triangles and attributes of a compressed primitive.

    Raises SceneError for data that Draco does not decode and for counts that differ from the
    accessors'.
    """
    mesh = _decoded(compressed)
    faces = np.asarray(mesh.faces, np.int64).reshape(-1, 3)
    ids, declared = compressed.needed("attributes"), primitive.needed("attributes")
    arrays = {}
    for name in filter(types, declared.value):
        accessor = declared.entry(name, "accessors")
        if accessor is None:
            continue
        warn_of_whole_numbers(name, accessor)
        if name not in ids:
            arrays[name] = accessors.floats(accessor, types(name))
            continue
        decoded = mesh.get_attribute_by_unique_id(ids.integer(name, high=2**32 - 1))
        if decoded is None:
            raise ids.error("the compressed data has no such attribute", name)
        values = np.asarray(decoded["data"])
        columns = accessors.width(accessor, types(name))
        if values.ndim != 2 or values.shape[1] != columns:
            raise ids.error(f"holds {values.shape[1:]} numbers a vertex, not {columns}", name)
        arrays[name] = attribute(name, values, accessor)
        if not np.isfinite(arrays[name]).all():
            raise ids.error("holds a number that is not finite", name)
    if "POSITION" not in arrays:
        raise ids.error("'POSITION' is missing")
    return Geometry(faces, arrays)


def _decoded(compressed: Element) -> Any:
    import DracoPy  # imported where it is used: few files need it

    data = bytes(accessors.view(compressed)[0])
    if data[:5] != HEADER or len(data) < 12:
        raise compressed.error("its data are not Draco's")
    if tuple(data[5:7]) != VERSION:
        raise compressed.error(f"is of Draco's version {data[5]}.{data[6]}; 2.2 is read")
    if data[7] != MESH:
        raise compressed.error("Draco finds a point cloud in it, no triangles")
    try:
        faces = _claimed_faces(data)
    except IndexError:
        raise compressed.error("its data end before the triangles") from None
    described = f"{compressed.path} of {faces} triangles"
    budget.check(PER_TRIANGLE * faces, described, compressed.document.file)
    try:
        mesh = DracoPy.decode(data)
    except Exception as error:  # DracoPy raises its own kinds, of no common base
        reason = str(error).splitlines()[0][:80] if str(error) else type(error).__name__
        raise compressed.error(f"Draco cannot decode it: {reason}") from None
    if getattr(mesh, "faces", None) is None:
        raise compressed.error("Draco finds a point cloud in it, no triangles")
    return mesh


def _claimed_faces(data: bytes) -> int:
    """Read the number of faces from a mesh's header (Draco bitstream 2.2, section 3).

    Raises IndexError where the header goes on behind the data's end.
    """
    stream = _Stream(data, 11)
    if int.from_bytes(data[9:11], "little") & METADATA:
        for _ in range(stream.number()):
            stream.number()
            stream.skip_metadata()
        stream.skip_metadata()
    if data[8] == EDGEBREAKER:
        stream.at += 1
        stream.number()
    return stream.number()


class _Stream:
    """Reads a header's bytes in order; beyond the end is an IndexError."""

    def __init__(self, data: bytes, at: int):
        self.data, self.at = data, at

    def byte(self) -> int:
        """Return the next byte."""
        self.at += 1
        return self.data[self.at - 1]

    def number(self) -> int:
        """Return a whole number, seven bits a byte."""
        value = 0
        for shift in range(0, 35, 7):
            byte = self.byte()
            value |= (byte & 127) << shift
            if byte < 128:
                break
        return value

    def skip_metadata(self, depth: int = 0) -> None:
        """Pass over entries, and what is inside; raises IndexError where they are too deep."""
        if depth > DEEPEST:
            raise IndexError
        for _ in range(self.number()):
            for length in (self.byte, self.number):  # of a name, and of its value
                size = length()
                self.at += size
        for _ in range(self.number()):
            size = self.byte()
            self.at += size
            self.skip_metadata(depth + 1)
