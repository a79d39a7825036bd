"""Geometry of a primitive: triangles, attributes of vertices, and skins (glTF 3.7.3.3).

DracoPy decodes what KHR_draco_mesh_compression stores smaller.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats32
from clpt.files import budget
from clpt.formats.gltf import accessors
from clpt.formats.gltf.accessors import floats, normalised
from clpt.formats.gltf.document import Element

TYPES = {  # of the accessors of an attribute, by the first part of its name
    "POSITION": ("VEC3",), "NORMAL": ("VEC3",), "TANGENT": ("VEC4",), "TEXCOORD": ("VEC2",),
    "COLOR": ("VEC3", "VEC4"), "JOINTS": ("VEC4",), "WEIGHTS": ("VEC4",),
}  # fmt: skip
FLOAT = 5126
SHARES = ("COLOR_", "WEIGHTS_")  # attributes between 0 and 1


@dataclass
class Geometry:
    """A primitive's triangles (m, 3), and by attribute, such as TEXCOORD_0, arrays (n, width).

    targets: for each morph target, displacements by attribute.
    """

    faces: NDArray[np.int64]
    attributes: dict[str, NDArray[Any]]
    targets: list[dict[str, Floats32]] = field(default_factory=list)


def types(name: str) -> tuple[str, ...]:
    """Return the accessor types that an attribute may have; none if it is not read."""
    return TYPES.get(name.partition("_")[0], ())


def target_types(name: str) -> tuple[str, ...]:
    """Return the accessor types of a morph target's attribute: of a tangent, without its side."""
    return ("VEC3",) if name == "TANGENT" else types(name)


def attribute(name: str, values: NDArray[Any], accessor: Element) -> NDArray[Any]:
    """Return an attribute's stored values as floats; joints stay whole numbers."""
    return values if name.startswith("JOINTS_") else normalised(values, accessor)


def warn_of_whole_numbers(name: str, accessor: Element) -> None:
    """Warn of colours and weights that are whole numbers, and not normalized (glTF 3.7.2.1)."""
    whole = name.startswith(SHARES) and accessor.integer("componentType") != FLOAT
    if whole and not accessor.flag("normalized"):
        accessor.warn(f"{name} of whole numbers must be normalized; taken as it is")


PER_VERTEX, PER_PART = 96, 256  # bytes that joints take, and vertices that count as a part
CHUNK = 1 << 16  # vertices at a time: each takes a matrix


def joint_matrices(skin: Element, to_world: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrices (joints, 4, 4) from vertices to the world, by joint."""
    joints = skin.indices("joints", "nodes")
    if not joints:
        raise skin.error("has no joints")
    posed = to_world[joints]
    accessor = skin.entry("inverseBindMatrices", "accessors")
    if accessor is None:
        return posed
    inverse = floats(accessor, ("MAT4",)).astype(np.float64)
    if len(inverse) < len(joints):
        message = f"has {len(inverse)} matrices for {len(joints)} joints"
        raise skin.error(message, "inverseBindMatrices")
    return posed @ inverse[: len(joints)].reshape(-1, 4, 4).transpose(0, 2, 1)


def skinned(primitive: Element, geometry: Geometry, joints: NDArray[np.float64]) -> None:
    """Move a primitive's vertices, normals and tangents into the world, as joints take them."""
    pairs = _influences(primitive, geometry, len(joints))
    if not pairs:
        primitive.warn("has a skin, but no JOINTS_0 and WEIGHTS_0; it stays as it is")
        pairs = [(np.zeros((len(geometry.attributes["POSITION"]), 1), int), np.ones((1, 1)))]
    normals = geometry.attributes.get("NORMAL")
    positions = geometry.attributes["POSITION"].astype(np.float64)
    turned = None if normals is None else normals.astype(np.float64)
    along = geometry.attributes.get("TANGENT")
    along = None if along is None else along.astype(np.float64)
    total = _total(primitive, pairs)
    for first in range(0, len(positions), CHUNK):
        part = slice(first, first + CHUNK)
        blend = np.zeros((len(positions[part]), 4, 4))
        for which, weights in pairs:
            share = np.broadcast_to(weights / total, which.shape)[part]
            blend += np.einsum("nk,nkij->nij", share, joints[which[part]])
        moved = np.einsum("nij,nj->ni", blend[:, :3, :3], positions[part])
        positions[part] = moved + blend[:, :3, 3]
        if turned is not None:
            turned[part] = np.einsum("nij,nj->ni", _cofactors(blend[:, :3, :3]), turned[part])
        if along is not None:
            along[part, :3] = np.einsum("nij,nj->ni", blend[:, :3, :3], along[part, :3])
    geometry.attributes["POSITION"] = positions.astype(np.float32)
    if turned is not None:
        geometry.attributes["NORMAL"] = turned.astype(np.float32)
    if along is not None:
        geometry.attributes["TANGENT"] = along.astype(np.float32)


def _total(
    primitive: Element, pairs: list[tuple[NDArray[np.int64], NDArray[np.float64]]]
) -> NDArray[np.float64]:
    """Return the sum of each vertex' weights (n, 1); a vertex without any follows joint 0.

    The specification wants a sum of 1. Exporters write vertices without weights, and viewers agree
    on joint 0 for these.
    """
    total = sum(weights.sum(axis=1, keepdims=True) for _, weights in pairs)
    free = ~(total[:, 0] > 0.0)
    if free.any():
        primitive.warn(f"{free.sum():,} vertices have no weights; they follow the joint 0")
        pairs[0][0][free, 0], pairs[0][1][free, 0] = 0, 1.0
        total = np.where(free[:, None], 1.0, total)
    return total


def _influences(
    primitive: Element, geometry: Geometry, count: int
) -> list[tuple[NDArray[np.int64], NDArray[np.float64]]]:
    """Joints (n, 4) and their weights (n, 4), as many pairs as the primitive has sets."""
    pairs: list[tuple[NDArray[np.int64], NDArray[np.float64]]] = []
    while (
        f"JOINTS_{len(pairs)}" in geometry.attributes
        and f"WEIGHTS_{len(pairs)}" in geometry.attributes
    ):
        name = f"JOINTS_{len(pairs)}"
        vertices = len(geometry.attributes[name])
        size = PER_VERTEX * vertices * (len(pairs) + 1)
        budget.check(size, f"{len(pairs) + 1} joints of its vertices", primitive.document.file)
        budget.take_parts(vertices // PER_PART, "joints of its vertices", primitive.document.file)
        which = geometry.attributes[name].astype(np.int64)
        weights = geometry.attributes[f"WEIGHTS_{len(pairs)}"].astype(np.float64)
        which = np.where(weights == 0.0, 0, which)
        if which.max() >= count:
            message = f"joint {which.max()} is outside of the skin's {count}"
            raise primitive.error(message, f"attributes.{name}")
        pairs.append((which, weights))
    return pairs


def _cofactors(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The inverse transposes (n, 3, 3) times their determinants: what turns normals."""
    a, b, c = np.moveaxis(matrix, 2, 0)
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)


DRACO = "KHR_draco_mesh_compression"
HEADER = b"DRACO"
VERSION, MESH, EDGEBREAKER, METADATA, DEEPEST = (2, 2), 1, 1, 0x8000, 16
PER_TRIANGLE = 160  # bytes that Draco takes for each, as measured


def draco_attributes(primitive: Element, compressed: Element) -> Geometry:
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
