"""Polygon meshes: triangles with normals, texture coordinates and subsets of other materials."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdShade

from clpt.arrays import Integers
from clpt.formats.meshes.mesh import Arrays, checked
from clpt.formats.usd import primvars
from clpt.formats.usd.document import Document, rows
from clpt.formats.usd.materials import Surface, surface
from clpt.formats.usd.primvars import Primvar, Topology
from clpt.geometry.polygons import smooth_normals, triangulate
from clpt.scene.shapes import Mesh
from clpt.scene.textures import SECOND_UV


@dataclasses.dataclass(frozen=True)
class Polygons:
    """A mesh before it is cut into triangles: its vertices (n, 3), faces and primvars by name."""

    points: NDArray[np.float32]
    topology: Topology
    normals: Primvar | None
    flipped: bool


def meshes(document: Document, prim: Usd.Prim, material: UsdShade.Material | None) -> list[Mesh]:
    """Return a prim's meshes in its own space: one for each material of its subsets.

    material: that of the faces in no subset. Raises SceneError for faces of vertices that are not
    there.
    """
    polygons = _polygons(document, prim)
    if polygons is None:
        return []
    parts = []
    for faces, bound in _subsets(document, prim, len(polygons.topology.counts), material):
        both = bool(document.value(prim, "doubleSided", False))
        look = surface(document, bound, prim, both=both)
        part = _mesh(document, prim, polygons, faces, look)
        parts += [] if part is None else [part]
    return parts


def _polygons(document: Document, prim: Usd.Prim) -> Polygons | None:
    """Return a mesh prim's polygons; None for a mesh without any."""
    points = document.array(prim, "points", 3)
    counts = document.array(prim, "faceVertexCounts", 0, np.int64)
    corners = document.array(prim, "faceVertexIndices", 0, np.int64)
    if points is None or counts is None or corners is None or not len(corners):
        return None
    if (counts < 0).any() or counts.sum() != len(corners):
        message = f"faceVertexCounts add up to {counts.sum()}, there are {len(corners)} corners"
        raise document.error(message, prim.GetPath())
    if corners.min() < 0 or corners.max() >= len(points):
        message = f"faceVertexIndices name a vertex beyond the {len(points)} that there are"
        raise document.error(message, prim.GetPath())
    topology = Topology(counts, corners, len(points))
    flipped = document.value(prim, "orientation", "rightHanded") == "leftHanded"
    return Polygons(points, topology, _normals(document, prim, topology), flipped)


def _normals(document: Document, prim: Usd.Prim, topology: Topology) -> Primvar | None:
    """Return the normals of a prim: primvars:normals before its own attribute."""
    found = primvars.read(document, prim, "normals", topology, 3)
    value = document.value(prim, "normals")
    if found is not None or value is None or not len(value):
        return found
    form = UsdGeom.PointBased(prim).GetNormalsInterpolation(), 3
    return primvars.checked(document, prim, "normals", topology, form, (value, None))


def _subsets(
    document: Document, prim: Usd.Prim, count: int, material: UsdShade.Material | None
) -> Iterator[tuple[Integers | None, UsdShade.Material | None]]:
    """Yield faces and their material; None for all faces."""
    subsets = []
    if prim.GetAllChildrenNames():
        subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
    if not subsets:
        yield None, material
        return
    left = np.ones(count, bool)
    for subset in subsets:
        faces = rows(document.value(subset.GetPrim(), "indices", ()), 0, np.int64)
        if len(faces) and (faces.min() < 0 or faces.max() >= count):
            document.warn("names faces that are not there", subset.GetPath())
            faces = faces[(faces >= 0) & (faces < count)]
        faces = faces[left[faces]]
        left[faces] = False
        bound = UsdShade.MaterialBindingAPI(subset.GetPrim()).ComputeBoundMaterial()[0]
        yield faces, bound if bound else material
    if left.any():
        yield np.flatnonzero(left), material


def _mesh(
    document: Document, prim: Usd.Prim, polygons: Polygons, faces: Integers | None, look: Surface
) -> Mesh | None:
    """Return the mesh of some faces; None where they have no triangle."""
    topology = polygons.topology
    triangles, polygon = triangulate(polygons.points, topology.counts, topology.corners)
    if faces is not None:
        chosen = np.zeros(len(topology.counts), bool)
        chosen[faces] = True
        triangles = triangles[chosen[polygon]]
    if not len(triangles):
        return None
    if polygons.flipped:
        triangles = triangles[:, ::-1]
    named = {"normals": polygons.normals} | {
        name: primvars.read(document, prim, name, topology, width)
        for name, width in look.primvars.items()
    }
    used = {name: primvar for name, primvar in named.items() if primvar is not None}
    values, like = _split(polygons, triangles.reshape(-1).astype(np.int64), used)
    for name, row in look.fallbacks.items():
        values.setdefault(name, np.tile(np.array([row], np.float32), (len(values[""]), 1)))
    normals = values.pop("normals", None)
    if normals is None and document.value(prim, "subdivisionScheme", "catmullClark") != "none":
        smooth = smooth_normals(polygons.points, topology.corners[triangles])
        normals = smooth[values[""][:, 0].astype(np.int64)]
    return _shape(document, prim, look, polygons, values, normals, like.reshape(-1, 3))


def _split(
    polygons: Polygons, corners: Integers, used: dict[str, Primvar]
) -> tuple[dict[str, NDArray[Any]], Integers]:
    """Return values by name, one row a vertex of triangles, and the vertex of each corner.

    corners: positions in the topology's. The values of "" are the numbers of the mesh's vertices.
    """
    vertex = polygons.topology.corners[corners]
    columns = {name: one.at_corners(polygons.topology)[corners] for name, one in used.items()}
    apart = [
        columns[name]
        for name, one in used.items()
        if one.interpolation not in (*primvars.AT_VERTICES, "constant")
    ]
    if apart:
        first, like = primvars.joined([vertex, *apart])
    else:
        _, first, like = np.unique(vertex, return_index=True, return_inverse=True)
    values: dict[str, NDArray[Any]] = {n: used[n].values[c[first]] for n, c in columns.items()}
    values[""] = vertex[first][:, None]
    return values, like.reshape(-1)


def _shape(
    document: Document,
    prim: Usd.Prim,
    look: Surface,
    polygons: Polygons,
    values: dict[str, NDArray[Any]],
    normals: NDArray[Any] | None,
    faces: Integers,
) -> Mesh | None:
    points = polygons.points[values.pop("")[:, 0]]
    uvs = [values.pop(name, None) for name in look.uv_sets[:2]]
    attributes = {f"vertex_{name}": value for name, value in values.items()}
    if len(look.uv_sets) > 1 and len(uvs) > 1:
        second = np.zeros((len(points), 2), np.float32) if uvs[1] is None else uvs[1]
        attributes |= dict(zip(SECOND_UV, (second[:, :1], second[:, 1:]), strict=True))
    given = Arrays(points, faces, normals, uvs[0] if uvs else None, attributes)
    notes: list[str] = []
    arrays = checked(document.file, str(prim.GetPath()), given, notes)
    for note in notes:
        document.warn(note.partition(": ")[2], prim.GetPath())
    if not len(arrays["faces"]):
        return None
    return Mesh(name=prim.GetName(), material=look.material, emission=look.emission, **arrays)
