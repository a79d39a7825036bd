"""Tables of MERL (Matusik et al. 2003): isotropic reflection by halfway and difference angles.

A file `.binary` has three int32, by default 90 x 90 x 180, then float64 for red, green and blue:
over the halfway direction's angle to the normal, in even steps of its root, the angle from halfway
to the light, and the light's azimuth about halfway, up to pi (Rusinkiewicz 1998).
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, in_memory
from clpt.errors import SceneError
from clpt.files import input_files, output_files
from clpt.measured.fit import Reflection, area, direction, grid, sample, spherical, warp

STEPS = (90, 90, 180)  # of the published files
SCALES = np.array([1.0, 1.15, 1.66]) / 1500.0  # of the numbers in a file [1/sr]
MOST_VALUES = 1 << 24
VIEWERS, ROWS, COLUMNS = 16, 32, 64  # of the table that samples light
EVEN = 0.05  # share of the samples that follow the cosine alone


@dataclass(frozen=True, eq=False, kw_only=True)
class MerlTable:
    """A reflection f [1/sr], (halfway, difference, azimuths, 3) float32, linear in between.

    A number below 0 marks directions below the horizon. Raises SceneError for another shape, for
    numbers that are not finite, and if all are below 0.
    """

    values: NDArray[Any]

    def __post_init__(self) -> None:
        values = np.asarray(in_memory(self.values), np.float32)
        if values.ndim != 4 or values.shape[3] != 3 or min(values.shape) < 2:
            raise SceneError(f"must be (halfway, difference, azimuths, 3), not {values.shape}")
        if values.size > 3 * MOST_VALUES:
            raise SceneError(f"has {values.size:,} numbers; at most {3 * MOST_VALUES:,} are read")
        if not np.isfinite(values).all():
            raise SceneError("has a number that is not finite")
        if (values < 0.0).all():
            raise SceneError("has no number from 0 on")
        object.__setattr__(self, "values", values)


def read(path: str | Path) -> MerlTable:
    """Read a table. Raises SceneError for another kind of file."""
    path = Path(path)
    data = input_files.read_bytes(path)
    shape = struct.unpack_from("<3i", data) if len(data) >= 12 else (0, 0, 0)
    if min(shape) < 2 or (count := math.prod(shape)) > MOST_VALUES:
        shown = " x ".join(map(str, shape))
        raise SceneError(f"is no table of MERL: it cannot be {shown}", file=path)
    if len(data) != 12 + 24 * count:
        message = f"must have {12 + 24 * count:,} bytes by its header, found {len(data):,}"
        raise SceneError(message, file=path)
    numbers = np.frombuffer(data, "<f8", 3 * count, 12).reshape(3, *shape)
    try:
        with np.errstate(over="ignore"):
            return MerlTable(values=np.moveaxis(numbers, 0, -1) * SCALES)
    except SceneError as error:
        raise SceneError(error.message, file=path) from None


def write(path: str | Path, table: MerlTable) -> None:
    """Write a table, so that `read` returns it but for rounding. Raises SceneError."""
    numbers = np.moveaxis(table.values / SCALES, -1, 0).astype("<f8")
    head = struct.pack("<3i", *table.values.shape[:3])
    try:
        output_files.write(path, head + numbers.tobytes())
    except OSError as error:
        raise SceneError(f"cannot be written: {error.strerror}", file=Path(path)) from None


def tabulate(f: Reflection, steps: tuple[int, int, int] = STEPS) -> MerlTable:
    """Return the table of an isotropic f(wo, wi), whose values (n, 3) are rgb [1/sr]."""
    at = [(np.arange(n) + 0.5) / n for n in steps]
    halfway, difference, phi = (axis.ravel() for axis in np.meshgrid(*at, indexing="ij"))
    halfway, difference, phi = 0.5 * np.pi * halfway**2, 0.5 * np.pi * difference, np.pi * phi
    across, up = np.sin(difference) * np.cos(phi), np.cos(difference)
    sine, cosine = np.sin(halfway), np.cos(halfway)
    wi = np.stack([cosine * across + sine * up, np.sin(difference) * np.sin(phi)], axis=1)
    wi = np.column_stack([wi, cosine * up - sine * across])
    h = np.stack([sine, 0.0 * sine, cosine], axis=1)
    wo = 2.0 * up[:, None] * h - wi
    lit = (wo[:, 2] > 0.0) & (wi[:, 2] > 0.0)
    values = np.full((len(lit), 3), -1.0)
    values[lit] = f(wo[lit], wi[lit])
    return MerlTable(values=values.reshape(*steps, 3))


def filled(table: MerlTable) -> NDArray[Any]:
    """Return the values; below the horizon, the next value towards the mirror direction."""
    values = table.values.copy()
    for i in range(1, values.shape[1]):
        values[:, i] = np.where(values[:, i] < 0.0, values[:, i - 1], values[:, i])
    return np.maximum(values, 0.0)


def densities(values: NDArray[Any]) -> tuple[Floats, Floats, Floats]:
    """Return tables for sampling.

    They are angles of viewers (n,) [rad], densities over the square of halfway directions
    (n, rows, columns), and the reflectance (3,) towards a viewer along the normal. Each density is
    the largest among its neighbours, so that no bright direction is missed.

    values: from `filled`.
    """
    x, y = grid(ROWS, COLUMNS)
    angles = 0.5 * np.pi * (np.arange(VIEWERS) / (VIEWERS - 0.75))
    tables = np.empty((VIEWERS, ROWS, COLUMNS))
    for i, theta in enumerate(angles):
        wo, light, solid = _seen(values, theta, x, y)
        brightness = (light.mean(axis=1) * solid).reshape(ROWS, COLUMNS)
        even = (np.maximum(wo, 0.0) * solid).reshape(ROWS, COLUMNS)
        shares = [
            _widest(density_table) / max(density_table.mean(), 1e-30)
            for density_table in (brightness, even)
        ]
        tables[i] = (1.0 - EVEN) * shares[0] + EVEN * shares[1]
    at = (np.arange(128) + 0.5) / 128
    v, u = (axis.ravel() for axis in np.meshgrid(at, at, indexing="ij"))
    x, y, density = sample(warp(tables[0]), u, v)
    _, light, solid = _seen(values, 0.0, x, y)
    share = (light * (solid / np.maximum(density, 1e-30))[:, None]).mean(axis=0)
    return angles, tables, np.minimum(share, 1.0)


def _seen(
    values: NDArray[Any], theta: float, x: Floats, y: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return at halfway directions: cosine of wi, f cos (n, 3), solid angle over square's area."""
    wo = spherical(theta, 0.0)
    m = direction(x, y)
    cosine = m @ wo
    wi = 2.0 * cosine[:, None] * m - wo
    lit = (wi[:, 2] > 0.0) & (cosine > 0.0)
    solid = np.where(lit, area(x) * 4.0 * np.maximum(cosine, 0.0), 0.0)
    light = _nearest(values, m, wo, wi) * np.maximum(wi[:, 2:], 0.0)
    return wi[:, 2], light * lit[:, None], solid


def angles(m: Floats, wo: Floats, wi: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the angles [rad] of directions (n, 3): of m, the halfway direction, to the normal; of
    wi to m; and the azimuth of wi about m."""
    halfway = np.arctan2(np.hypot(m[:, 0], m[:, 1]), m[:, 2])
    difference = np.arctan2(np.linalg.norm(wi - wo, axis=1), np.linalg.norm(wi + wo, axis=1))
    turn = np.arctan2(m[:, 1], m[:, 0])
    c, s = np.cos(turn), np.sin(turn)
    along = wi[:, 0] * c + wi[:, 1] * s
    side = wi[:, 1] * c - wi[:, 0] * s
    phi = np.arctan2(side, np.cos(halfway) * along - np.sin(halfway) * wi[:, 2])
    return halfway, difference, phi


def _nearest(values: NDArray[Any], m: Floats, wo: Floats, wi: Floats) -> Floats:
    """Return the table's nearest values (n, 3) at halfway directions m."""
    halfway, difference, phi = angles(m, wo, wi)
    at = np.sqrt(halfway * 2.0 / np.pi), difference * 2.0 / np.pi, (phi / np.pi) % 1.0
    cells = [np.clip((a * n).astype(int), 0, n - 1) for a, n in zip(at, values.shape, strict=False)]
    return np.asarray(values[tuple(cells)], np.float64)


def _widest(values: Floats) -> Floats:
    """Return the largest of each value and its eight neighbours; rows are periodic."""
    rows = np.maximum(values, np.maximum(np.roll(values, 1, 0), np.roll(values, -1, 0)))
    padded = np.pad(rows, ((0, 0), (1, 1)), "edge")
    return np.maximum(rows, np.maximum(padded[:, 2:], padded[:, :-2]))
