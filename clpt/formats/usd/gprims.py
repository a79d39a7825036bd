"""Gprims as shapes, in the world or in prototypes that instances and point instancers place.

Spheres, cubes, cylinders, cones, capsules and planes are meshes, but for even spheres. A volume is
a box with the density of an OpenVDB field.
"""

from __future__ import annotations

import dataclasses
import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdLux, UsdShade

from clpt import transforms
from clpt.arrays import Floats, Matrix
from clpt.errors import SceneError
from clpt.files import budget
from clpt.formats import volumes
from clpt.formats.framing import TO_BOX
from clpt.formats.usd import curves, meshes
from clpt.formats.usd.document import Document, Shown, file_of, shown
from clpt.formats.usd.materials import surface
from clpt.formats.usd.meshes import Topology
from clpt.scene.materials import Null
from clpt.scene.media import Grid
from clpt.scene.params import fields_of
from clpt.scene.shapes import Cube, Group, Instance, Mesh, Shape, Sphere

AROUND, ALONG = 64, 24  # pieces around, and of half a circle
AXES = {"X": 0, "Y": 1, "Z": 2}
EVEN = 1e-4  # relative difference of scales that counts as none
ONE = Topology(np.array([1]), np.array([0]), 1)
# Of a cube, the corners of its sides, each twice its middle away; x counts least.
SIDES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def quadric(document: Document, prim: Usd.Prim, material: UsdShade.Material | None) -> list[Shape]:
    """Return the shape of a prim in its own space, in a list; none for a prim without a size."""
    arrays = MESHES[prim.GetTypeName()](document, prim)
    both = bool(document.value(prim, "doubleSided", False))
    look = surface(document, material, prim, both=both)
    attributes = {}
    for name, row in look.fallbacks.items():
        primvar = meshes.read(document, prim, name, ONE, len(row))
        value = np.array([row], np.float32) if primvar is None else primvar.values[:1]
        attributes[f"vertex_{name}"] = np.tile(value, (len(arrays["vertices"]), 1))
    shared: dict[str, Any] = {
        "name": prim.GetName(), "material": look.material, "emission": look.emission,
        "interior": look.interior,
    }  # fmt: skip
    extent = float(np.ptp(arrays["vertices"], axis=0).max())
    if not extent > 0.0 or not math.isfinite(extent):
        document.warn("left out, as it has no size", prim.GetPath())
        return []
    if prim.GetTypeName() == "Sphere" and not attributes:
        return [Sphere(radius=0.5 * extent, **shared)]
    return [Mesh(attributes=attributes, **arrays, **shared)]


def under(shape: Shape, matrix: Matrix) -> Shape:
    """Return a shape that may be placed by a matrix: an uneven scale makes a sphere a mesh."""
    if not isinstance(shape, Sphere):
        return shape
    sizes = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    if sizes[0] <= sizes[2] * (1.0 + EVEN):
        return shape
    common = [field.name for field in dataclasses.fields(Shape)]
    parts = {name: value for name, value in fields_of(shape).items() if name in common}
    return Mesh(**parts, **_revolved([_arc(shape.radius, 0.0, 0.0, math.pi)], "Z"))


def _revolved(runs: list[Floats], axis: str) -> dict[str, Any]:
    """Return the arrays of a mesh of revolution about an axis through the origin.

    runs: rows of a radius, a height, and both parts of the normal, from below; edges are between.
    """
    angle = 2.0 * np.pi * np.arange(AROUND + 1) / AROUND
    turn = np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle)], axis=1)
    vertices: list[Floats] = []
    normals: list[Floats] = []
    faces, first = [], 0
    for run in runs:
        for rows, columns in ((vertices, [0, 0, 1]), (normals, [2, 2, 3])):
            rows.append((run[:, None, columns] * turn).reshape(-1, 3))
        row = (np.arange(len(run) - 1)[:, None] * len(angle) + np.arange(AROUND) + first).ravel()
        over = row + len(angle)
        faces += [
            np.stack([row, row + 1, over + 1], axis=1),
            np.stack([row, over + 1, over], axis=1),
        ]
        first += len(run) * len(angle)
    order = np.roll([0, 1, 2], AXES.get(axis, 2) + 1)  # of x, y, z; the last column is the axis
    points, triangles = np.concatenate(vertices), np.concatenate(faces)
    solid = transforms.edge_crosses(points, triangles).any(axis=1)
    return {
        "vertices": points[:, order].astype(np.float32),
        "normals": np.concatenate(normals)[:, order].astype(np.float32),
        "faces": triangles[solid].astype(np.uint32),
    }


def _arc(radius: float, center: float, first: float, last: float) -> Floats:
    """Return a run along a circle; angles [rad] from below."""
    angles = np.linspace(first, last, ALONG + 1)
    x, z = np.sin(angles), -np.cos(angles)
    return np.stack([radius * x, center + radius * z, x, z], axis=1)


def _line(start: tuple[float, float], end: tuple[float, float]) -> Floats:
    """Return a run along a line, from one (radius, height) to another."""
    across, up = end[1] - start[1], start[0] - end[0]
    length = max(math.hypot(across, up), 1e-30)
    normal = across / length, up / length
    return np.array([[*start, *normal], [*end, *normal]])


def _radii(document: Document, prim: Usd.Prim, usual: float) -> tuple[float, float, float]:
    """Return the radii below and above, and half the height."""
    both = document.number(prim, "radius", usual)
    below, above = (document.number(prim, name, both) for name in ("radiusBottom", "radiusTop"))
    return below, above, 0.5 * document.number(prim, "height", 2.0 if usual == 1.0 else 1.0)


def _axis(document: Document, prim: Usd.Prim) -> str:
    return str(document.value(prim, "axis", "Z"))


def _sphere(document: Document, prim: Usd.Prim) -> dict[str, Any]:
    radius = document.number(prim, "radius", 1.0)
    return _revolved([_arc(radius, 0.0, 0.0, math.pi)], "Z")


def _cylinder(document: Document, prim: Usd.Prim) -> dict[str, Any]:
    below, above, half = _radii(document, prim, 1.0)
    corners = [(0.0, -half), (below, -half), (above, half), (0.0, half)]
    runs = [_line(start, end) for start, end in pairwise(corners)]
    return _revolved(runs, _axis(document, prim))


def _cone(document: Document, prim: Usd.Prim) -> dict[str, Any]:
    radius, half = document.number(prim, "radius", 1.0), 0.5 * document.number(prim, "height", 2.0)
    runs = [_line((0.0, -half), (radius, -half)), _line((radius, -half), (0.0, half))]
    return _revolved(runs, _axis(document, prim))


def _capsule(document: Document, prim: Usd.Prim) -> dict[str, Any]:
    below, above, half = _radii(document, prim, 0.5)
    runs = [
        _arc(below, -half, 0.0, 0.5 * math.pi),
        _line((below, -half), (above, half)),
        _arc(above, half, 0.5 * math.pi, math.pi),
    ]
    return _revolved(runs, _axis(document, prim))


def _cube(document: Document, prim: Usd.Prim) -> dict[str, Any]:
    half = 0.5 * document.number(prim, "size", 2.0)
    corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], np.float32)
    faces = [(side[0], *side[i : i + 2]) for side in SIDES for i in (1, 2)]
    return {"vertices": half * corners, "faces": np.array(faces, np.uint32)}


def _plane(document: Document, prim: Usd.Prim) -> dict[str, Any]:
    """Return a rectangle; length is along y, or along z of a plane across x or y."""
    width, length = (document.number(prim, name, 2.0) for name in ("width", "length"))
    square = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [width, length]
    axis = AXES.get(_axis(document, prim), 2)
    # Which coordinates width and length run along, so that the front is on the side of the axis.
    u, v = ((2, 1), (0, 2), (0, 1))[axis]
    points = np.zeros((4, 3), np.float32)
    points[:, u], points[:, v] = square.T
    front = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    return {"vertices": points, "faces": front if axis == 2 else front[:, ::-1].copy()}


MESHES: dict[str, Callable[[Document, Usd.Prim], dict[str, Any]]] = {
    "Sphere": _sphere, "Cube": _cube, "Cylinder": _cylinder, "Cylinder_1": _cylinder,
    "Cone": _cone, "Capsule": _capsule, "Capsule_1": _capsule, "Plane": _plane,
}  # fmt: skip


ALBEDO = 0.9  # of smoke between white and grey; a stage does not say


def volume(document: Document, prim: Usd.Prim, placement: Matrix) -> list[Shape]:
    """Return a box that holds a density, in a list; none, with a warning, where none can be read.

    placement: to the world, in units of the stage. A density of 1 is an extinction of 1 for each
    unit of the stage.
    """
    fields = {
        relation.GetName().partition(":")[2]: relation.GetTargets()
        for relation in prim.GetRelationships()
        if relation.GetName().startswith("field:")
    }
    if prim.HasAPI(UsdLux.VolumeLightAPI):
        document.warn("VolumeLightAPI is left out", prim.GetPath())
    for name in fields.keys() - {"density"}:
        document.warn(f"field {name!r} is left out", prim.GetPath())
    source = document.stage.GetPrimAtPath(fields["density"][0]) if fields.get("density") else None
    if not source or source.GetTypeName() != "OpenVDBAsset":
        document.warn("left out, as it has no density of OpenVDB", prim.GetPath())
        return []
    asset = document.value(source, "filePath")
    try:
        file = file_of(document, asset)
        density = volumes.read(file, str(document.value(source, "fieldName", "density")))
    except (SceneError, AttributeError) as error:
        document.warn(f"left out: {error}", prim.GetPath())
        return []
    cloud = Grid(
        density=density,
        sigma_t=1.0 / document.metres,
        albedo=ALBEDO,
        to_world=document.to_metres @ placement,
    )
    matrix = document.to_metres @ placement @ np.asarray(density.to_world, np.float64)
    box = Cube(to_world=matrix @ TO_BOX, material=Null(), name=prim.GetName(), interior=cloud)
    return [box]


Reader = Callable[[Document, Usd.Prim, "UsdShade.Material | None"], Sequence[Shape]]
READERS: dict[str, Reader] = {
    "Mesh": meshes.meshes,
    **dict.fromkeys(MESHES, quadric),
    **curves.READERS,
}
BYTES = 2048  # of a copy in memory, about
INSTANCED = 20_000  # triangles that copies would add; fewer are traced faster as copies
DEEPEST = 32  # instances in each other


@dataclass
class Content:
    """Shapes below a prim, in its space, with prototypes that it places and lights.

    shapes and lights: each with its prim and its transform; copies: prototypes with the transforms
    (n, 4, 4) that place them.
    """

    shapes: list[tuple[Usd.Prim, Shape, Matrix]] = field(default_factory=list)
    lights: list[tuple[Usd.Prim, Matrix]] = field(default_factory=list)
    cameras: list[Usd.Prim] = field(default_factory=list)
    volumes: list[Usd.Prim] = field(default_factory=list)
    settings: list[Usd.Prim] = field(default_factory=list)
    copies: list[tuple[Content, Floats]] = field(default_factory=list)

    def flat(self) -> Content:
        """Return the content with the shapes of all its copies among its own."""
        whole = Content(list(self.shapes))
        for inner, matrices in self.copies:
            parts = inner.flat()
            budget.take_parts(len(matrices) * len(parts.shapes), "instances in prototypes")
            for matrix in matrices:
                whole.shapes += [(prim, one, matrix @ at) for prim, one, at in parts.shapes]
        return whole

    def flat_lights(self) -> list[tuple[Usd.Prim, Matrix]]:
        """Return all lights with their transforms, those of copies too."""
        lights = list(self.lights)
        for inner, matrices in self.copies:
            parts = inner.flat_lights()
            lights += [(prim, matrix @ at) for matrix in matrices for prim, at in parts]
        return lights


def content(
    document: Document,
    root: Usd.Prim,
    base: Matrix | None = None,
    inherited: UsdShade.Material | None = None,
    depth: int = 0,
) -> Content:
    """Return the content of a prim.

    base: from the world to the content's space, None for the world. inherited: the material of
    shapes that bind none. Raises SceneError for instances in each other without end.
    """
    if depth > DEEPEST:
        raise document.error("instances are nested too deeply", root.GetPath())
    prims = shown(document, root, defined=base is None)
    whole = Content(cameras=prims["cameras"], volumes=prims["volumes"], settings=prims["settings"])
    for prim in prims["volumes"] if base is not None else ():
        document.warn("volumes of prototypes are left out", prim.GetPath())

    def placement(prim: Usd.Prim) -> Matrix:
        matrix = document.placement(prim)
        return matrix if base is None else base @ matrix

    for prim, shapes in _shapes(document, prims["gprims"], inherited):
        whole.shapes += [(prim, shape, placement(prim)) for shape in shapes]
    whole.lights = [(prim, placement(prim)) for prim in prims["lights"]]
    for prototype, material, several in _alike(prims, inherited, in_world=base is None):
        key = "content", document.code, str(prototype.GetPath()), _path_of(material)
        make = partial(content, document, prototype, np.eye(4), material, depth + 1)
        matrices = document.placements(several)
        inner = document.once(key, make)
        whole.copies.append((inner, matrices if base is None else base @ matrices))
    for prim in prims["instancers"]:
        whole.copies += _instancer(document, prim, placement(prim), inherited, depth)
    return whole


def _alike(
    prims: Shown, inherited: UsdShade.Material | None, *, in_world: bool
) -> Iterator[tuple[Usd.Prim, UsdShade.Material | None, list[Usd.Prim]]]:
    """Yield a prototype, the material of its shapes that bind none, and its instances."""
    instances, alike = prims["instances"], defaultdict[tuple[Usd.Prim, str], list[Usd.Prim]](list)
    # Nothing in the world is bound unless a prim of it binds.
    binds = prims["bindings"] or not in_world
    materials = {"": inherited}
    all_bound = _bound(instances) if binds else [None] * len(instances)
    for prim, bound in zip(instances, all_bound, strict=True):
        name = _path_of(bound)
        materials.setdefault(name, bound)
        alike[prim.GetPrototype(), name].append(prim)
    for (prototype, name), several in alike.items():
        yield prototype, materials[name], several


def _path_of(material: UsdShade.Material | None) -> str:
    return str(material.GetPath()) if material else ""


def _bound(prims: list[Usd.Prim]) -> list[UsdShade.Material | None]:
    """Return the material that each prim binds, or None."""
    materials = UsdShade.MaterialBindingAPI.ComputeBoundMaterials(prims)[0] if prims else []
    return [material if material else None for material in materials]


def _shapes(
    document: Document, prims: list[Usd.Prim], inherited: UsdShade.Material | None
) -> Iterable[tuple[Usd.Prim, Sequence[Shape]]]:
    """Yield prims and their shapes, each in its prim's own space."""
    budget.take_parts(len(prims), "prims", document.file)
    for prim, material in zip(prims, _bound(prims), strict=True):
        yield prim, READERS[prim.GetTypeName()](document, prim, material or inherited)


def _instancer(
    document: Document,
    prim: Usd.Prim,
    placement: Matrix,
    inherited: UsdShade.Material | None,
    depth: int,
) -> list[tuple[Content, Floats]]:
    """Return the prototypes of a PointInstancer with the transforms that place them."""
    instancer = UsdGeom.PointInstancer(prim)
    indices = document.array(prim, "protoIndices", 0, np.int64)
    targets = instancer.GetPrototypesRel().GetTargets()
    roots = [document.stage.GetPrimAtPath(path) for path in targets]
    if indices is None or not len(indices) or not roots:
        return []
    budget.take_parts(len(indices), "instances", document.file)
    budget.take(BYTES * len(indices), "instances", document.file)
    matrices, there = _transforms(document, instancer, len(indices))
    if len(matrices) != len(indices):
        document.warn("left out: its arrays are not of one length", prim.GetPath())
        return []
    matrices = placement @ matrices
    copies = []
    for number, root in enumerate(roots):
        own = matrices[there & (indices == number)]
        if not root or not len(own):
            continue
        above = transforms.inverse(document.placement(root.GetParent()))
        key = "content", document.code, str(root.GetPath()), _path_of(inherited)
        make = partial(content, document, root, above, inherited, depth + 1)
        inner = document.once(key, make)
        copies.append((inner, own))
    return copies


def _transforms(
    document: Document, instancer: UsdGeom.PointInstancer, count: int
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the transforms of instances (n, 4, 4), and which are shown, (count,)."""
    whole = instancer.ComputeInstanceTransformsAtTime(
        document.time, document.time, UsdGeom.PointInstancer.ExcludeProtoXform,
        UsdGeom.PointInstancer.IgnoreMask,
    )  # fmt: skip
    mask = instancer.ComputeMaskAtTime(document.time)
    there = np.array(list(mask), bool) if len(mask) else np.ones(count, bool)
    return np.array(whole, np.float64).reshape(-1, 4, 4).swapaxes(1, 2), there


def placed(document: Document, whole: Content) -> list[Shape]:
    """Return the shapes of a world's content; many copies of many triangles as instances."""
    shapes = []
    for prim, shape, matrix in whole.shapes:
        shapes += at(document, prim, shape, document.to_metres @ matrix)
    for inner, matrices in whole.copies:
        parts = inner.flat().shapes
        budget.take_parts(len(matrices), "instances", document.file)
        triangles = sum(len(one.faces) if isinstance(one, Mesh) else 1 for _, one, _ in parts)
        world = document.to_metres @ matrices
        if triangles * (len(matrices) - 1) < INSTANCED:
            for prim, shape, local in parts:
                for matrix in world:
                    shapes += at(document, prim, shape, matrix @ local)
            continue
        sizes = np.linalg.svd(world[:, :3, :3], compute_uv=False)
        uneven = world[int(np.argmax(sizes[:, 0] / np.maximum(sizes[:, 2], 1e-300)))]
        own = [
            moved
            for prim, one, local in parts
            for moved in at(document, prim, under(one, uneven @ local), local)
        ]
        group = Group(tuple(own), parts[0][0].GetName())
        solid = world[~transforms.are_singular(world)]
        shapes += Instance(group=group).placed_at(solid)
    return shapes


def at(document: Document, prim: Usd.Prim, shape: Shape, matrix: Matrix) -> list[Shape]:
    """Return a shape under a transform; none, with a warning, where that flattens space."""
    if transforms.is_singular(matrix):
        document.warn("left out, as its transform flattens space", prim.GetPath())
        return []
    whole = matrix @ np.asarray(shape.to_world)
    return [under(shape, whole).placed(whole)]
