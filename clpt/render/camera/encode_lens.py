"""A lens of surfaces on its way to the device: rows of surfaces, pupils, blades and ghosts.

The tables follow the record in `camera`. Millimetres become metres of the scene; z counts from the
film to the scene, so curvatures change their sign.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.lenses import COATINGS, Prescription
from clpt.lenses.coatings import DESIGN, reflectance
from clpt.lenses.glasses import LINE_D
from clpt.lenses.pupils import ZONES
from clpt.lenses.tracing import sag
from clpt.render.camera.lens import focused
from clpt.render.records.camera_rows import GHOST_CELLS, LENS_SURFACE, RECORDS
from clpt.scene.cameras import Lens
from clpt.spectra import Constant, Spectrum

GHOST_LAMBDAS = np.linspace(420.0, 680.0, 14)  # [nm], for which pairs of surfaces are weighed
EVEN = 0.1  # part of the ghosts' samples that all pairs share alike


def lens_words(
    camera: Lens,
    to_world: NDArray[np.float64],
    width: int,
    height: int,
    rows: Mapping[Spectrum, int],
) -> NDArray[np.float32]:
    """Return the words (n,) float32 of a lens: its record and the tables behind it.

    width, height: of the film [pixels]; rows: in `spectra`, of `glasses`. Raises SceneError.
    """
    unit = camera.unit
    extent = np.array([camera.film_width, camera.film_width * height / width])
    lens, back, ellipses, angle, radius = focused(camera, height / width)
    lens = lens.with_coating(COATINGS[camera.coating])
    if camera.blades:
        turn = 2.0 * math.pi / camera.blades
        angle *= math.sin(turn) / turn
    record = np.zeros((), RECORDS["lens"].dtype)
    tables = _Tables(RECORDS["lens"].words)
    record["to_world"], record["extent"], record["back"] = to_world, extent, back * unit
    record["exposure"] = 1.0 / angle if camera.exposure == "relative" else 1.0
    surfaces = _surfaces(lens, back, unit, rows, tables)
    record["count"] = len(surfaces)
    record["surfaces"] = tables.append(surfaces)
    record["zones"] = tables.append(np.pad(ellipses * unit, ((0, 0), (0, 1))))
    record["zones_per_metre"], record["last_zone"] = ZONES / (radius * unit), ZONES - 1
    record["blades"] = camera.blades
    record["rear_radius"] = _rear_radius(lens, back, radius) * unit
    if camera.blades:
        # A blade's normal stands between two corners.
        turned = math.radians(camera.blade_angle) + turn * (np.arange(camera.blades) + 0.5)
        record["blade_normals"] = tables.append(np.stack([np.cos(turned), np.sin(turned)], 1))
        record["blade_distance"] = math.cos(0.5 * turn)
    pairs = ghost_pairs(lens) if camera.ghosts else None
    if pairs is not None:
        record["ghosts"], record["ghost_cells"] = camera.ghosts, tables.append(_cells(*pairs))
    return tables.joined(record)


def _rear_radius(lens: Prescription, back: float, film: float) -> float:
    """Return the rear plane's radius in which rays from the film meet the last surface [mm].

    It is more than the surface's own, as its rim is off that plane.
    """
    last = lens.surfaces[-1]
    rim = float(sag(last, np.array(last.semi_diameter**2)))
    slope = (film + last.semi_diameter) / max(back - rim, 0.1 * back)
    return last.semi_diameter + abs(rim) * slope


class _Tables:
    """Tables of words that follow one another."""

    def __init__(self, first: int):
        self._next, self._parts = first, list[NDArray[np.float32]]()

    def append(self, values: NDArray[Any]) -> int:
        """Append a table; return its first word."""
        words = values if values.dtype.names else np.asarray(values, np.float32)
        words = np.ascontiguousarray(words).reshape(-1).view(np.float32)
        first, self._next = self._next, self._next + len(words)
        self._parts.append(words)
        return first

    def joined(self, record: NDArray[Any]) -> NDArray[np.float32]:
        return np.concatenate([record.reshape(1).view(np.float32), *self._parts])


def _surfaces(
    lens: Prescription, back: float, unit: float, rows: Mapping[Spectrum, int], tables: _Tables
) -> NDArray[Any]:
    """Rows of LensSurface, from the film to the scene; their coatings are appended."""
    made = np.zeros(len(lens.surfaces), LENS_SURFACE.dtype)
    indices = lens.indices(LINE_D)
    before: list[Spectrum] = [Constant(1.0), *(surface.glass for surface in lens.surfaces)]
    for i, surface in enumerate(lens.surfaces):
        row = made[len(made) - 1 - i]
        row["z"] = (back + lens.length - lens.vertices[i]) * unit
        row["curvature"] = -surface.curvature / unit
        row["conic"], row["radius"] = surface.conic, surface.semi_diameter * unit
        row["stop"] = surface.stop
        row["form"] = 2 if any(surface.aspheric) else int(surface.conic != 0.0)
        row["near_index"], row["far_index"] = indices[i + 1], indices[i]
        row["near_glass"] = rows.get(before[i + 1], -1)
        row["far_glass"] = rows.get(before[i], -1)
        for j, factor in enumerate(surface.aspheric):
            row[f"a{j}"] = -factor * surface.semi_diameter ** (2 * j + 4) * unit
        if surface.coating:
            films = [(float(f.index.sample(DESIGN)), f.thickness) for f in surface.coating]
            row["coats"], row["first_coat"] = len(films), tables.append(np.array(films))
    return made


def ghost_pairs(lens: Prescription) -> tuple[NDArray[np.int64], Floats] | None:
    """Return pairs of surfaces that reflect (n, 2), and the share (n,) of the samples of each.

    Surfaces are counted from the film on, the nearer one of a pair is first. It is None where
    there are no pairs.
    """
    before, back = 1.0, []
    for surface in lens.surfaces:
        index = float(surface.glass.sample(DESIGN))
        share = reflectance(before, index, surface.coating, GHOST_LAMBDAS).mean()
        back.append(0.0 if before == index and not surface.coating else float(share))
        before = index
    back.reverse()
    there = [i for i, share in enumerate(back) if share > 0.0]
    pairs = [(near, far) for near in there for far in there if near < far]
    if not pairs:
        return None
    shares = np.array([back[near] * back[far] for near, far in pairs])
    shares = (1.0 - EVEN) * shares / shares.sum() + EVEN / len(shares)
    return np.array(pairs), shares


def _cells(pairs: NDArray[np.int64], shares: Floats) -> Floats:
    """Rows (GHOST_CELLS, 3) of equal probability: the pair, and 1 over its probability."""
    if len(pairs) > GHOST_CELLS // 2:  # of the weakest none is drawn
        kept = np.argsort(shares)[-GHOST_CELLS // 2 :]
        pairs, shares = pairs[kept], shares[kept] / shares[kept].sum()
    counts = 1 + np.floor(shares * (GHOST_CELLS - len(pairs))).astype(int)
    counts[np.argmax(shares)] += GHOST_CELLS - counts.sum()
    rows = np.column_stack([pairs, GHOST_CELLS / counts])
    return np.repeat(rows, counts, axis=0)
