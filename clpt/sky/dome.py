"""Images of a sky: the dome and the ground below it, and the sun's disc, at LAMBDAS.

kernels/lights/kinds/sky.cl says how they lie around the observer. Limb darkening of the sun is a
power of the cosine at its surface (Hestroffer and Magnan 1998).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clpt.arrays import Floats
from clpt.records import SKY_SIZES
from clpt.scene.lights import Sky
from clpt.sky import skylight
from clpt.spectra.air import EARTH, LAMBDAS, SUNLIGHT, Atmosphere

ROWS, COLUMNS = 48, 96  # of cells from the horizon to the zenith, or to the nadir; around
SUN_ROWS, SUN_COLUMNS = SKY_SIZES["sun_rows"], SKY_SIZES["sun_columns"]
SUN_RADIUS = np.radians(0.2666)  # [rad]
LOWEST = 1e-3  # of the observer above the ground [km]

Unscaled = Callable[[tuple[float, ...], tuple[float, ...]], tuple[Floats, Floats]]


def numbers(lamp: Sky) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the numbers that determine a sky: parameters, and the ground's albedo at LAMBDAS."""
    albedo: Any = lamp.ground
    ground = np.clip(albedo.sample(LAMBDAS), 0.0, 1.0)
    return (
        lamp.sun_elevation, lamp.altitude, lamp.aerosol, lamp.exponent, lamp.aerosol_albedo,
        lamp.asymmetry, lamp.ozone, lamp.sky_scale, lamp.sun_scale,
    ), tuple(ground.tolist())  # fmt: skip


def height(altitude: float) -> float:
    """Return the observer's height in the tables [km] from an altitude [m]."""
    return max(altitude / 1000.0, LOWEST)


def horizon(altitude: float) -> float:
    """Return the angle of the horizon above the level [rad], at an altitude [m]; below 0."""
    return -float(np.arccos(EARTH / (EARTH + height(altitude))))


def elevations(at: float, row: ArrayLike) -> Floats:
    """Angles (...,) above the level [rad] of rows from 0, the zenith, over 1, `at`, to 2."""
    below = np.asarray(row, np.float64) - 1.0
    span = np.where(below < 0.0, 0.5 * np.pi - at, 0.5 * np.pi + at)
    return at - np.sign(below) * below * below * span


def directions(at: float, row: ArrayLike, column: ArrayLike) -> Floats:
    """Unit vectors (..., 3) of rows and columns 0 to 1; z is toward the sun."""
    angle = elevations(at, 2.0 * np.asarray(row, np.float64))
    turn = 2.0 * np.pi * np.asarray(column, np.float64)
    level = np.cos(angle)
    return np.stack([level * np.sin(turn), np.sin(angle), level * np.cos(turn)], axis=-1)


def sky_image(lamp: Sky) -> tuple[Floats, Floats]:
    """Return radiance at LAMBDAS [W m^-2 sr^-1 nm^-1] of the dome with the ground, and of the sun.

    (2, rows + 1, columns / 2 + 1, n), and (rows, columns, n) over the sun's disc.
    """
    return images(unscaled, *numbers(lamp))


def images(
    unscaled_images: Unscaled, parameters: tuple[float, ...], ground: tuple[float, ...]
) -> tuple[Floats, Floats]:
    """Return the images of `sky_image` from a sky's `numbers`.

    unscaled_images: `unscaled`, or a cache in front of it.
    """
    *physical, sky, sun = parameters
    around, disc = unscaled_images(tuple(physical), ground)
    return np.maximum(around * (sky * SUNLIGHT), 0.0), disc * sun


@lru_cache(maxsize=4)  # it takes seconds, and a sky's scene is often rebuilt
def unscaled(numbers: tuple[float, ...], ground: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Return both images without their scales: the dome per irradiance of the sun [1/sr].

    numbers, ground: from `numbers`, without the two scales.
    """
    elevation, altitude, aerosol, exponent, share, asymmetry, ozone = numbers
    air = Atmosphere(aerosol, exponent, share, asymmetry, ozone)
    at, high, zenith = horizon(altitude), height(altitude), np.radians(90.0 - elevation)
    rows = np.arange(ROWS + 1) / ROWS
    angles = np.stack([elevations(at, rows), elevations(at, 1.0 + rows)])
    angles[0, -1] += 1e-6  # just above the horizon, and below it
    angles[1, 0] -= 1e-6
    turns = np.cos(2.0 * np.pi * np.arange(COLUMNS // 2 + 1) / COLUMNS)
    mu, turn = np.broadcast_arrays(np.sin(angles)[..., None], turns)
    around = skylight.radiance(air, np.array(ground), zenith, high, mu.ravel(), turn.ravel())
    return around.reshape(*mu.shape, -1), _disc(air, np.radians(elevation), at, high)


def _disc(air: Atmosphere, elevation: float, at: float, high: float) -> Floats:
    """Return the sun's disc, darker toward its edge, seen through each row's air."""
    rows = elevation + SUN_RADIUS * np.linspace(-1.0, 1.0, SUN_ROWS)
    cosine = np.linspace(0.0, 1.0, SUN_COLUMNS)
    power = -0.023 + 292.0 / LAMBDAS
    dark = np.maximum(cosine, 1e-6)[:, None] ** power * (0.5 * power + 1.0)
    way, _ = skylight.sun_columns(
        np.full(SUN_ROWS, EARTH + high), np.sin(np.maximum(rows, at + 1e-6))
    )
    passed = np.exp(-(way.T @ air.depths(LAMBDAS)))
    passed[rows + SUN_RADIUS / SUN_ROWS < at] = 0.0
    even = SUNLIGHT / (np.pi * np.sin(SUN_RADIUS) ** 2)
    return passed[:, None] * dark * even
