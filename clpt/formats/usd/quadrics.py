"""Spheres, cubes, cylinders, cones, capsules and planes: all but even spheres are meshes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from pxr import Usd, UsdShade

from clpt.arrays import Floats, Matrix
from clpt.formats.usd import primvars
from clpt.formats.usd.document import Document
from clpt.formats.usd.materials import surface
from clpt.formats.usd.primvars import Topology
from clpt.scene.params import fields_of
from clpt.scene.shapes import Mesh, Shape, Sphere

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
        primvar = primvars.read(document, prim, name, ONE, len(row))
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
    a, b, c = (points[triangles[:, i]] for i in range(3))
    solid = np.abs(np.cross(b - a, c - a)).max(axis=1) > 0.0
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
