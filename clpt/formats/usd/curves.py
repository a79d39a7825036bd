"""Curves and points: as strands and as balls."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from clpt.arrays import Floats, Integers
from clpt.files import budget
from clpt.formats.usd import meshes, skeletons
from clpt.formats.usd.document import Document, rows
from clpt.formats.usd.materials import Surface, surface
from clpt.formats.usd.meshes import Topology
from clpt.scene.shapes import Curves, Shape, Spheres
from clpt.scene.textures import attributes_in

WIDTH = 1.0  # of curves and points without widths
# Rows that give the Bezier points of a piece from the four of its basis.
TO_BEZIER = {
    "bspline": np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6.0,
    "catmullRom": np.array([[0, 6, 0, 0], [-1, 6, 1, 0], [0, 1, 6, -1], [0, 0, 6, 0]]) / 6.0,
}


def curves(document: Document, prim: Usd.Prim, material: UsdShade.Material | None) -> list[Shape]:
    """Return the strands of a BasisCurves prim, as one shape, in a list.

    Raises SceneError for counts that do not fit the points.
    """
    points = document.points(prim)
    counts = document.array(prim, "curveVertexCounts", 0, np.int64)
    if points is None or counts is None or not len(points):
        return []
    points = skeletons.moved(document, prim, points)
    if (counts < 1).any() or counts.sum() != len(points):
        message = f"curveVertexCounts add up to {counts.sum()}, there are {len(points)} points"
        raise document.error(message, prim.GetPath())
    budget.take(64 * points.nbytes, "curves", document.file)
    if document.value(prim, "normals") is not None:
        document.warn("its ribbons become round strands", prim.GetPath())
    basis = str(document.value(prim, "basis", "bezier"))
    if str(document.value(prim, "type", "cubic")) == "linear":
        basis = "linear"
    wrap = str(document.value(prim, "wrap", "nonperiodic"))
    widths, at_ends = _widths(document, prim, counts)
    strands = np.concatenate([points, 0.5 * widths[:, None]], axis=1)
    kept = _all_pieces(strands, counts, basis, wrap)
    if len(kept) < len(counts):
        document.warn(f"{len(counts) - len(kept)} curves have too few points", prim.GetPath())
    if not kept:
        return []
    rows = np.concatenate(kept)
    if at_ends is not None:
        rows[:, 3] = _between(at_ends, [len(part) for part in kept], basis) / 2.0
    rows[:, 3] = np.maximum(rows[:, 3], 0.0)
    look = _look(document, prim, material)
    return [
        Curves(
            points=rows.astype(np.float32), lengths=tuple(len(part) for part in kept),
            basis="linear" if basis == "linear" else "bezier",
            name=prim.GetName(), material=look.material, emission=look.emission,
        )
    ]  # fmt: skip


def _look(document: Document, prim: Usd.Prim, material: UsdShade.Material | None) -> Surface:
    """Return the surface of curves: means stand for primvars, and light that these vary is dark."""
    look = surface(document, material, prim, both=True)
    look = look.settled(_means(document, prim, look.fallbacks))
    if look.emission is None or not attributes_in(look.emission):
        return look
    document.warn("its light is left out, as it varies by a primvar", prim.GetPath())
    return dataclasses.replace(look, emission=None)


def _all_pieces(strands: Floats, counts: Integers, basis: str, wrap: str) -> list[Floats]:
    """Return each strand as lines or Bezier cubics, (n, 4); none for those that are too short."""
    starts = np.cumsum(counts) - counts
    parts: dict[int, Floats] = {}
    for count in np.unique(counts).tolist():
        own = np.flatnonzero(counts == count)
        pieces = _pieces(strands[starts[own][:, None] + np.arange(count)], basis, wrap)
        parts |= {} if pieces is None else dict(zip(own.tolist(), pieces, strict=True))
    return [parts[number] for number in sorted(parts)]


def _pieces(strands: Floats, basis: str, wrap: str) -> Floats | None:
    """Return strands (s, n, 4) of one length as lines or Bezier cubics; None if they are too short.

    A pinned strand goes to its first and last point: those before and after continue it evenly.
    """
    count = strands.shape[1]
    if basis in TO_BEZIER:
        if wrap == "periodic" and count > 2:
            strands = np.concatenate([strands[:, -1:], strands, strands[:, :2]], axis=1)
        elif wrap == "pinned" and count > 1:
            before = 2.0 * strands[:, :1] - strands[:, 1:2]
            after = 2.0 * strands[:, -1:] - strands[:, -2:-1]
            strands = np.concatenate([before, strands, after], axis=1)
        if strands.shape[1] < 4:
            return None
        window = np.arange(strands.shape[1] - 3)[:, None] + np.arange(4)
        cubics = TO_BEZIER[basis] @ strands[:, window]
        firsts = cubics[:, :, :3].reshape(len(strands), -1, 4)
        return np.concatenate([firsts, cubics[:, -1, 3:]], axis=1)
    if wrap == "periodic":
        strands = np.concatenate([strands, strands[:, :1]], axis=1)
    least, step = (2, 1) if basis == "linear" else (4, 3)
    usable = (strands.shape[1] - least) // step * step + least
    return strands[:, :usable] if strands.shape[1] >= least else None


def _widths(document: Document, prim: Usd.Prim, counts: Integers) -> tuple[Floats, Floats | None]:
    """Return a width for each point, and those at the ends of pieces where the file has these."""
    points = int(counts.sum())
    value = document.array(prim, "widths", 0, np.float64)
    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("widths")
    if primvar and primvar.HasValue():
        value = rows(primvar.ComputeFlattened(document.time), 0, np.float64)
        interpolation = primvar.GetInterpolation()
    else:
        interpolation = UsdGeom.Curves(prim).GetWidthsInterpolation()
    usual = np.full(points, WIDTH)
    if value is None or not len(value):
        return usual, None
    if len(value) == 1:
        return np.full(points, value[0]), None
    if interpolation == "uniform" and len(value) == len(counts):
        return np.repeat(value, counts), None
    if interpolation == "varying" and len(value) != points:
        return usual, value
    if len(value) != points:
        document.warn(
            f"its {len(value)} widths do not fit; {WIDTH:g} stands for them", prim.GetPath()
        )
        return usual, None
    return value, None


def _between(ends: Floats, lengths: list[int], basis: str) -> Floats:
    """Return values of the ends of pieces at all points, even between; the last is repeated."""
    step, parts, first = 1 if basis == "linear" else 3, [], 0
    for length in lengths:
        pieces = (length - 1) // step
        own = ends[np.minimum(np.arange(first, first + pieces + 1), len(ends) - 1)]
        parts.append(np.interp(np.arange(length) / step, np.arange(pieces + 1), own))
        first += pieces + 1
    return np.concatenate(parts)


def points(document: Document, prim: Usd.Prim, material: UsdShade.Material | None) -> list[Shape]:
    """Return the balls of a Points prim, as one shape, in a list."""
    centers = document.points(prim)
    if centers is None or not len(centers):
        return []
    centers = skeletons.moved(document, prim, centers)
    budget.take(8 * centers.nbytes, "points", document.file)
    widths = _widths(document, prim, np.ones(len(centers), np.int64))[0]
    look = surface(document, material, prim, both=True)
    topology = Topology(np.zeros(0, np.int64), np.arange(len(centers)), len(centers))
    attributes = {}
    for name, row in look.fallbacks.items():
        primvar = meshes.read(document, prim, name, topology, len(row))
        usual = np.tile(np.array([row], np.float32), (len(centers), 1))
        attributes[f"vertex_{name}"] = (
            usual if primvar is None else primvar.values[primvar.at_corners(topology)]
        )
    radii = np.maximum(0.5 * widths, 1e-9).astype(np.float32)
    return [
        Spheres(
            centers=centers, radii=radii, attributes=attributes, name=prim.GetName(),
            material=look.material, emission=look.emission,
        )
    ]  # fmt: skip


def _means(
    document: Document, prim: Usd.Prim, names: Iterable[str]
) -> dict[str, tuple[float, ...]]:
    """Return the means of the primvars that a prim has, by name."""
    means: dict[str, tuple[float, ...]] = {}
    for name in names:
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
        value = primvar.ComputeFlattened(document.time) if primvar else None
        if value is None or not len(value):
            continue
        if len(value) > 1:
            document.warn(f"the mean of primvar {name!r} stands for its values", prim.GetPath())
        table = np.asarray(value, np.float64).reshape(len(value), -1)
        means[name] = tuple(table.mean(axis=0).tolist())
    return means


READERS = {"BasisCurves": curves, "Points": points}
