"""Polygon meshes: triangles with normals, texture coordinates and subsets of other materials.

Primvars of every interpolation are values, and the row that each corner of a face takes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdLux, UsdShade

from clpt import transforms
from clpt.arrays import Integers
from clpt.files import budget
from clpt.formats.meshes.mesh import Arrays, checked
from clpt.formats.usd import lights, skeletons
from clpt.formats.usd.document import Document, rows
from clpt.formats.usd.materials import Surface, surface
from clpt.geometry import catmull_clark
from clpt.geometry.catmull_clark import Cage
from clpt.geometry.polygons import smooth_normals, triangulate
from clpt.scene.shapes import Mesh
from clpt.scene.textures import SECOND_UV

AT_VERTICES = ("vertex", "varying")


@dataclass(frozen=True)
class Topology:
    """Faces: how many corners each has (f,), and the vertex of each corner (c,); n vertices."""

    counts: Integers
    corners: Integers
    vertices: int

    @property
    def faces(self) -> Integers:
        """The face of each corner, (c,)."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    def elements(self, interpolation: str) -> Integers:
        """Return the element that each corner takes a value of, (c,), before a primvar's indices.

        interpolation: one of USD's; elements are vertices, faces, corners, or the whole mesh.
        """
        if interpolation in AT_VERTICES:
            return self.corners
        if interpolation == "uniform":
            return self.faces
        if interpolation == "faceVarying":
            return np.arange(len(self.corners))
        return np.zeros(len(self.corners), np.int64)

    def count(self, interpolation: str) -> int:
        """Return how many elements there are."""
        sizes = {"uniform": len(self.counts), "faceVarying": len(self.corners), "constant": 1}
        return sizes.get(interpolation, self.vertices)


@dataclass(frozen=True)
class Primvar:
    """Values (v, width) and the row of them that each element has, (e,)."""

    values: NDArray[np.float32]
    indices: Integers
    interpolation: str

    def at_corners(self, topology: Topology) -> Integers:
        """Return the row of the values for each corner, (c,)."""
        return self.indices[topology.elements(self.interpolation)]


def read(
    document: Document, prim: Usd.Prim, name: str, topology: Topology, width: int = 0
) -> Primvar | None:
    """Return a primvar, inherited from above if need be; None where there is none of use.

    width: of a value, 0 for that of the file. A primvar with too few values is left out.
    """
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    value = primvar.Get(document.time) if primvar else None
    if value is None or isinstance(value, str):
        return None
    indices = primvar.GetIndices(document.time) if primvar.IsIndexed() else None
    form = primvar.GetInterpolation(), width
    return checked_primvar(document, prim, name, topology, form, (value, indices))


def checked_primvar(
    document: Document,
    prim: Usd.Prim,
    name: str,
    topology: Topology,
    form: tuple[str, int],
    stored: tuple[object, object],
) -> Primvar | None:
    """Return values as a primvar; None, with a warning, where they do not fit the faces.

    form: its interpolation, and the width of a value, 0 for that of the file. stored: the values,
    and the row of each element or None.
    """
    interpolation, width = form
    value, indices = stored
    try:
        table = np.asarray(value, np.float32)
        table = table.reshape(-1, width or (table.shape[1] if table.ndim > 1 else 1))
    except (TypeError, ValueError):
        document.warn(f"primvar {name!r} is of a type that is not read", prim.GetPath())
        return None
    count = topology.count(interpolation)
    order = np.arange(count) if indices is None else rows(indices, 0, np.int64)[:count]
    fits = len(order) == count and (not count or (order.min() >= 0 and order.max() < len(table)))
    if not fits:
        message = f"primvar {name!r} is left out, as it has too few values to be {interpolation}"
        document.warn(message, prim.GetPath())
        return None
    return Primvar(table, order, interpolation)


def joined(columns: list[Integers]) -> tuple[Integers, Integers]:
    """Return corners (k,) that differ in some column, and of each corner the number of its like.

    columns: of each corner, numbers from 0.
    """
    key = columns[0]
    for column in columns[1:]:
        key = np.unique(key * (int(column.max(initial=0)) + 1) + column, return_inverse=True)[1]
    _, first, like = np.unique(key, return_index=True, return_inverse=True)
    return first, like.reshape(-1)


MOST_FACES = 200_000  # of a mesh that is refined by a level of its own
# How the boundaries of texture coordinates go, by faceVaryingLinearInterpolation.
BOUNDARIES = {"none": "edgeOnly", "boundaries": "linear", "all": "bilinear"}


@dataclasses.dataclass(frozen=True)
class Polygons:
    """A mesh before it is cut into triangles: its vertices (n, 3), faces and normals.

    parents (f,): the face of the file of each face. cage: of the file's faces, if these were
    refined, `levels` times.
    """

    points: NDArray[np.float32]
    topology: Topology
    normals: Primvar | None
    parents: Integers
    flipped: bool
    cage: Cage | None = None
    levels: int = 0


def meshes(document: Document, prim: Usd.Prim, material: UsdShade.Material | None) -> list[Mesh]:
    """Return a prim's meshes in its own space: one for each material of its subsets.

    material: that of the faces in no subset. Raises SceneError for faces of vertices that are not
    there.
    """
    stays = skeletons.skin_of(document, prim) is None and not any(
        prim.GetAttribute(name).ValueMightBeTimeVarying() for name in ("points", "normals")
    )
    key = "meshes", str(prim.GetPath()), str(material.GetPath()) if material else ""
    if stays:
        return document.once(key, lambda: _all(document, prim, material))
    return _all(document, prim, material)


def _all(document: Document, prim: Usd.Prim, material: UsdShade.Material | None) -> list[Mesh]:
    topology = _topology(document, prim)
    if topology is None:
        return []
    polygons = _polygons(document, prim, topology)
    both, parts = bool(document.value(prim, "doubleSided", False)), []
    shines = prim.HasAPI(UsdLux.MeshLightAPI)
    area = _area(document, prim, polygons) if shines else 0.0
    for faces, bound in _subsets(document, prim, len(topology.counts), material):
        look = surface(document, bound, prim, both=both)
        if shines:
            look = lights.on_mesh(document, prim, look, both, area)
        part = _mesh(document, prim, polygons, faces, look)
        parts += [] if part is None else [part]
    return parts


def _area(document: Document, prim: Usd.Prim, polygons: Polygons) -> float:
    """Return the area of all faces under the prim's own transforms, in units of the stage."""
    topology = polygons.topology
    triangles, _ = triangulate(polygons.points, topology.counts, topology.corners)
    corners = transforms.transform_points(document.placement(prim), polygons.points)
    first, second, third = corners[topology.corners[triangles]].swapaxes(0, 1)
    across = np.cross(second - first, third - first)
    return 0.5 * float(np.linalg.norm(across, axis=1).sum())


def _topology(document: Document, prim: Usd.Prim) -> Topology | None:
    """Return a mesh prim's faces; None for a mesh without any."""
    points = document.points(prim)
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
    return Topology(counts, corners, len(points))


def _polygons(document: Document, prim: Usd.Prim, topology: Topology) -> Polygons:
    points = skeletons.moved(document, prim, document.points(prim))
    flipped = document.value(prim, "orientation", "rightHanded") == "leftHanded"
    scheme = str(document.value(prim, "subdivisionScheme", "catmullClark"))
    levels = document.level
    if levels is None:
        levels = next((n for n in (2, 1) if len(topology.corners) * 4 ** (n - 1) <= MOST_FACES), 0)
    if scheme == "catmullClark" and levels > 0 and (topology.counts >= 3).all():
        return _refined(document, prim, topology, points, levels, flipped)
    parents = np.arange(len(topology.counts))
    own = _normals(document, prim, topology)
    skin = None if own is None else skeletons.skin_of(document, prim)
    if own is not None and skin is not None:
        at_corners = own.values[own.at_corners(topology)]
        turned = skin.turned(document.points(prim), at_corners, topology.corners)
        own = Primvar(turned, np.arange(len(turned)), "faceVarying")
    if own is None and scheme in ("catmullClark", "loop"):
        triangles, _ = triangulate(points, topology.counts, topology.corners)
        smooth = smooth_normals(points, topology.corners[triangles])
        own = Primvar(-smooth if flipped else smooth, np.arange(len(points)), "vertex")
    return Polygons(points, topology, own, parents, flipped)


def _refined(
    document: Document,
    prim: Usd.Prim,
    topology: Topology,
    points: NDArray[np.float32],
    levels: int,
    flipped: bool,
) -> Polygons:
    """Return the polygons of a Catmull-Clark surface, at their limit."""
    budget.take(300 * len(topology.corners) * 4 ** (levels - 1), "subdivision", document.file)
    cage = _cage(document, prim, topology)
    child, moved = catmull_clark.refined(cage, points.astype(np.float64), levels)
    at = catmull_clark.limits(child, moved)
    directions, corner = catmull_clark.normals(child, at)
    if flipped:
        directions = -directions
    parents = np.repeat(np.arange(len(topology.counts)), topology.counts)
    return Polygons(
        at.astype(np.float32),
        Topology(child.counts, child.corners, len(at)),
        Primvar(directions.astype(np.float32), corner, "faceVarying"),
        np.repeat(parents, 4 ** (levels - 1)),
        flipped, cage, levels,
    )  # fmt: skip


def _cage(document: Document, prim: Usd.Prim, topology: Topology) -> Cage:
    """Return a prim's faces with its creases, sharp corners and boundaries."""
    sharp = np.zeros(topology.vertices)
    corners = rows(document.value(prim, "cornerIndices", ()), 0, np.int64)
    sharpness = rows(document.value(prim, "cornerSharpnesses", ()), 0, np.float64)
    lengths = rows(document.value(prim, "creaseLengths", ()), 0, np.int64)
    chain = rows(document.value(prim, "creaseIndices", ()), 0, np.int64)
    crease = rows(document.value(prim, "creaseSharpnesses", ()), 0, np.float64)
    whole = np.concatenate([corners, chain])
    if len(whole) and (whole.min() < 0 or whole.max() >= topology.vertices):
        raise document.error("a crease or corner names a vertex that is not there", prim.GetPath())
    if len(corners) == len(sharpness):
        sharp[corners] = sharpness
    edges = np.zeros((0, 2), np.int64)
    if len(lengths) and (lengths >= 2).all() and lengths.sum() == len(chain):
        last = np.cumsum(lengths) - 1
        inner = np.setdiff1d(np.arange(len(chain)), last)
        edges = np.stack([chain[inner], chain[inner + 1]], axis=1)
        # A chain has one sharpness, or one for each of its edges.
        each = np.repeat(crease, lengths - 1) if len(crease) == len(lengths) else crease
        crease = each if len(each) == len(edges) else np.full(len(edges), catmull_clark.INFINITE)
    rule = str(document.value(prim, "interpolateBoundary", "edgeAndCorner"))
    rule = "edgeOnly" if rule == "edgeOnly" else "edgeAndCorner"
    return Cage(topology.counts, topology.corners, edges, crease[: len(edges)], sharp, rule)


def _primvar(
    document: Document, prim: Usd.Prim, polygons: Polygons, name: str, width: int
) -> Primvar | None:
    """Return a primvar for a mesh's faces, refined as they are."""
    cage = polygons.cage
    if cage is None:
        return read(document, prim, name, polygons.topology, width)
    coarse = Topology(cage.counts, cage.corners, len(cage.corner))
    primvar = read(document, prim, name, coarse, width)
    if primvar is None or primvar.interpolation == "constant":
        return primvar
    if primvar.interpolation == "uniform":
        return dataclasses.replace(primvar, indices=primvar.indices[polygons.parents])
    if primvar.interpolation == "faceVarying":
        rule = str(document.value(prim, "faceVaryingLinearInterpolation", "cornersPlus1"))
        first, like = joined([cage.corners, primvar.indices])
        values, corners = primvar.values[primvar.indices[first]], like
        cage = Cage(
            cage.counts, corners, np.zeros((0, 2), np.int64), np.zeros(0), np.zeros(len(first)),
            BOUNDARIES.get(rule, "edgeAndCorner"),
        )  # fmt: skip
        child, moved = _limit_values(cage, values, polygons.levels)
        return Primvar(moved, child.corners, "faceVarying")
    if primvar.interpolation == "varying":
        cage = dataclasses.replace(cage, smooth="bilinear")
    moved = _limit_values(cage, primvar.values[primvar.indices], polygons.levels)[1]
    return Primvar(moved, np.arange(len(moved)), "vertex")


def _limit_values(
    cage: Cage, values: NDArray[np.float32], levels: int
) -> tuple[Cage, NDArray[np.float32]]:
    """Return a refined cage and its values at the limit surface."""
    child, moved = catmull_clark.refined(cage, values.astype(np.float64), levels)
    if cage.smooth != "bilinear":
        moved = catmull_clark.limits(child, moved)
    return child, moved.astype(np.float32)


def _normals(document: Document, prim: Usd.Prim, topology: Topology) -> Primvar | None:
    """Return the normals of a prim: primvars:normals before its own attribute."""
    found = read(document, prim, "normals", topology, 3)
    value = document.value(prim, "normals")
    if found is not None or value is None or not len(value):
        return found
    form = UsdGeom.PointBased(prim).GetNormalsInterpolation(), 3
    return checked_primvar(document, prim, "normals", topology, form, (value, None))


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
    holes = rows(document.value(prim, "holeIndices", ()), 0, np.int64)
    if faces is not None or len(holes):
        chosen = np.ones(int(polygons.parents.max()) + 1, bool)
        if faces is not None:
            chosen[:] = False
            chosen[faces] = True
        chosen[holes[(holes >= 0) & (holes < len(chosen))]] = False
        triangles = triangles[chosen[polygons.parents[polygon]]]
    if not len(triangles):
        return None
    if polygons.flipped:
        triangles = triangles[:, ::-1]
    named = {"normals": polygons.normals} | {
        name: _primvar(document, prim, polygons, name, width)
        for name, width in look.primvars.items()
    }
    used = {name: primvar for name, primvar in named.items() if primvar is not None}
    values, like = _split(polygons, triangles.reshape(-1).astype(np.int64), used)
    for name, row in look.fallbacks.items():
        values.setdefault(name, np.tile(np.array([row], np.float32), (len(values[""]), 1)))
    normals = values.pop("normals", None)
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
        if one.interpolation not in (*AT_VERTICES, "constant")
    ]
    if apart:
        first, like = joined([vertex, *apart])
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
    # A set that a mesh lacks is the fallback of who reads it, a single place.
    nowhere = np.zeros((len(points), 2), np.float32)
    uvs = [values.pop(name, nowhere) for name in look.uv_sets[:2]]
    attributes = {f"vertex_{name}": value for name, value in values.items()}
    if len(look.uv_sets) > 1 and len(uvs) > 1:
        attributes |= dict(zip(SECOND_UV, (uvs[1][:, :1], uvs[1][:, 1:]), strict=True))
    given = Arrays(points, faces, normals, uvs[0] if uvs else None, attributes)
    notes: list[str] = []
    arrays = checked(document.file, str(prim.GetPath()), given, notes)
    for note in notes:
        document.warn(note.partition(": ")[2], prim.GetPath())
    if not len(arrays["faces"]):
        return None
    loop = document.value(prim, "subdivisionScheme") == "loop"
    if loop and (polygons.topology.counts == 3).all():
        arrays |= {"normals": None, "subdivision": 2 if document.level is None else document.level}
    return Mesh(
        name=prim.GetName(),
        material=look.material,
        emission=look.emission,
        interior=look.interior,
        **arrays,
    )
