"""Cameras as uniform records, which kernels/cameras/kinds/<kind>.cl read.

Behind the record of a traced lens follow its tables: surfaces, coatings, zones, blades and ghosts.
Its millimetres become metres of the scene. z counts from the film to the scene, so curvatures
change their sign.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.lenses import COATINGS, Prescription
from clpt.lenses.prescription import DESIGN, LINE_D, reflectance
from clpt.lenses.tracing import ZONES, FocusedLens, sag
from clpt.render.records.camera import GHOST_CELLS, LENS_SURFACE, RECORDS
from clpt.scene.cameras import Camera, Lens
from clpt.scene.insides import check_index
from clpt.scene.integrators import Film
from clpt.spectra import Constant, Spectrum

GHOST_LAMBDAS = np.linspace(420.0, 680.0, 14)  # [nm], of the weights of pairs of surfaces
EVEN = 0.1  # share of the ghosts' samples that is divided evenly among all pairs


def check_camera(camera: Camera, film: Film) -> None:
    """Raise SceneError for a camera whose parameters cannot be used with a film."""
    camera.checked_members(film.width, film.height)
    if camera.traced_lens is not None and camera.rolls:
        message = "rays through a lens do not know the time of a row; take the camera calibrated"
        raise SceneError(message, where=f"{camera.kind}.shutter.readout")
    for glass in camera.dispersive_glasses:
        check_index(glass, film, f"{camera.kind}.glass")


def encode_camera(
    camera: Camera, width: int, height: int, glass_rows: Sequence[int] = ()
) -> NDArray[np.float32]:
    """Return the words (n,) float32 of a camera's record and of the tables behind it.

    width, height: of the film [pixels]; glass_rows: rows in `spectra` of its `dispersive_glasses`;
    empty where no index depends on the wavelength. Raises SceneError for a matrix, a glass or a
    lens that cannot be used.
    """
    kind = RECORDS[camera.kind]
    record, tables = np.zeros((), kind.dtype), _Tables(kind.words)
    for name, value in camera.checked_members(width, height).items():
        record[name] = value
    rows = dict(zip(camera.dispersive_glasses, glass_rows, strict=False))
    for name, table in camera.record_tables(width, height).items():
        record[name] = tables.append(table)
    if camera.traced_lens is not None:
        _encode_lens(camera.traced_lens, height / width, rows, record, tables)
    else:
        for row in rows.values():
            record["glass"] = row
    return tables.behind(record)


class _Tables:
    """Tables of words behind a record."""

    def __init__(self, first: int):
        self._next, self._parts = first, list[NDArray[np.float32]]()

    def append(self, values: NDArray[Any]) -> int:
        """Append a table; return its first word."""
        words = values if values.dtype.names else np.asarray(values, np.float32)
        words = np.ascontiguousarray(words).reshape(-1).view(np.float32)
        first, self._next = self._next, self._next + len(words)
        self._parts.append(words)
        return first

    def behind(self, record: NDArray[Any]) -> NDArray[np.float32]:
        return np.concatenate([record.reshape(1).view(np.float32), *self._parts])


def _encode_lens(
    camera: Lens,
    aspect: float,
    glass_rows: Mapping[Spectrum, int],
    record: NDArray[Any],
    tables: _Tables,
) -> None:
    """Append the tables of a lens and fill the members that depend on them."""
    unit, focused = camera.unit, camera.focused(aspect)
    lens = focused.prescription.with_coating(COATINGS[camera.coating])
    record["exposure"] = _exposure(camera, focused)
    surfaces = _surfaces(lens, focused.back, unit, glass_rows, tables)
    record["count"] = len(surfaces)
    record["surfaces"] = tables.append(surfaces)
    record["zones"] = tables.append(np.pad(focused.zones * unit, ((0, 0), (0, 1))))
    record["zones_per_metre"] = ZONES / (focused.film_radius * unit)
    record["last_zone"] = ZONES - 1
    record["rear_radius"] = _rear_radius(lens, focused.back, focused.film_radius) * unit
    record["blades"] = camera.blades
    if camera.blades:
        turn = 2.0 * math.pi / camera.blades
        # A blade's normal lies halfway between two corners.
        angles = math.radians(camera.blade_angle) + turn * (np.arange(camera.blades) + 0.5)
        record["blade_normals"] = tables.append(np.stack([np.cos(angles), np.sin(angles)], 1))
        record["blade_distance"] = math.cos(0.5 * turn)
    pairs = ghost_pairs(lens) if camera.has_ghosts else None
    if pairs is not None:
        record["ghosts"], record["ghost_cells"] = camera.ghosts, tables.append(_cells(*pairs))


def _exposure(camera: Lens, focused: FocusedLens) -> float:
    """Return the factor of irradiance [1/sr]: 1 over the pupil's solid angle if relative."""
    if camera.exposure != "relative":
        return 1.0
    angle = focused.solid_angle
    if camera.blades:
        turn = 2.0 * math.pi / camera.blades
        angle *= math.sin(turn) / turn
    return 1.0 / angle


def _rear_radius(lens: Prescription, back: float, film: float) -> float:
    """Return the radius on the rear plane within which rays from the film meet the last surface.

    All lengths in mm. It exceeds the surface's own radius, as the surface's rim is off that plane.
    """
    last = lens.surfaces[-1]
    rim = float(sag(last, np.array(last.semi_diameter**2)))
    slope = (film + last.semi_diameter) / max(back - rim, 0.1 * back)
    return last.semi_diameter + abs(rim) * slope


def _surfaces(
    lens: Prescription,
    back: float,
    unit: float,
    glass_rows: Mapping[Spectrum, int],
    tables: _Tables,
) -> NDArray[Any]:
    """Return rows of LensSurface, from the film to the scene; append their coatings."""
    rows = np.zeros(len(lens.surfaces), LENS_SURFACE.dtype)
    indices = lens.indices(LINE_D)
    before: list[Spectrum] = [Constant(1.0), *(surface.glass for surface in lens.surfaces)]
    for i, surface in enumerate(lens.surfaces):
        row = rows[len(rows) - 1 - i]
        row["z"] = (back + lens.length - lens.vertices[i]) * unit
        row["curvature"] = -surface.curvature / unit
        row["conic"], row["radius"] = surface.conic, surface.semi_diameter * unit
        row["stop"] = surface.stop
        row["form"] = 2 if any(surface.aspheric) else int(surface.conic != 0.0)
        row["near_index"], row["far_index"] = indices[i + 1], indices[i]
        row["near_glass"] = glass_rows.get(before[i + 1], -1)
        row["far_glass"] = glass_rows.get(before[i], -1)
        for j, factor in enumerate(surface.aspheric):
            row[f"a{j}"] = -factor * surface.semi_diameter ** (2 * j + 4) * unit
        if surface.coating:
            films = [(float(f.index.sample(DESIGN)), f.thickness) for f in surface.coating]
            row["coats"], row["first_coat"] = len(films), tables.append(np.array(films))
    return rows


def ghost_pairs(lens: Prescription) -> tuple[NDArray[np.int64], Floats] | None:
    """Return the pairs of surfaces that reflect (n, 2) and their shares (n,) of the samples.

    Surfaces are counted from the film on; the nearer surface of a pair comes first. The value is
    None where no two surfaces reflect.
    """
    before, shares = 1.0, []
    for surface in lens.surfaces:
        index = float(surface.glass.sample(DESIGN))
        share = reflectance(before, index, surface.coating, GHOST_LAMBDAS).mean()
        shares.append(0.0 if before == index and not surface.coating else float(share))
        before = index
    shares.reverse()
    reflecting = [i for i, share in enumerate(shares) if share > 0.0]
    pairs = [(near, far) for near in reflecting for far in reflecting if near < far]
    if not pairs:
        return None
    products = np.array([shares[near] * shares[far] for near, far in pairs])
    products = (1.0 - EVEN) * products / products.sum() + EVEN / len(products)
    return np.array(pairs), products


def _cells(pairs: NDArray[np.int64], shares: Floats) -> Floats:
    """Return rows (GHOST_CELLS, 3) of equal probability: a pair, and 1 over its probability."""
    if len(pairs) > GHOST_CELLS // 2:  # the weakest pairs are never drawn
        strongest = np.argsort(shares)[-GHOST_CELLS // 2 :]
        pairs, shares = pairs[strongest], shares[strongest] / shares[strongest].sum()
    counts = 1 + np.floor(shares * (GHOST_CELLS - len(pairs))).astype(int)
    counts[np.argmax(shares)] += GHOST_CELLS - counts.sum()
    rows = np.column_stack([pairs, GHOST_CELLS / counts])
    return np.repeat(rows, counts, axis=0)
