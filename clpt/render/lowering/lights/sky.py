"""The sky on its way to the device: images of the dome and of the ground below it, and of the sun.

How the images lie around the observer: kernels/light/sky.cl. Limb darkening of the sun: a power of
the cosine at its surface, Hestroffer and Magnan 1998.
"""

from __future__ import annotations

from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.lights import atmosphere, block_grids, image_lights, skylight
from clpt.render.lowering.textures.texels import bands, texels
from clpt.scene.lights import Sky
from clpt.spectra import Tabulated, luminance
from clpt.spectra.air import EARTH, LAMBDAS, SUNLIGHT, Atmosphere
from clpt.spectral_exr import SpectralImage

Floats = NDArray[np.float64]

ROWS, COLUMNS = 48, 96  # of cells from the horizon to the zenith, or to the nadir; around
SUN_ROWS, SUN_COLUMNS = 24, 12  # SKY_SUN_ROWS, SKY_SUN_COLUMNS
SUN_RADIUS = np.radians(0.2666)  # [rad]
LOWEST = 1e-3  # of the observer above the ground [km]
MOST = 0.75  # share of samples that the sun may take


class _Content(NamedTuple):
    """The radiance of a sky: texels (n, bands or 4), the disc's too, and the grid to choose by."""

    texels: NDArray[np.float32]
    sun: NDArray[np.float32]
    number: Tabulated | None
    corners: Floats
    grid: block_grids.BlockGrid
    sun_share: float
    strength: float


def lower_sky(lamp: Sky, encoder: Encoder) -> tuple[str, dict[str, ArrayLike], float]:
    """Put a sky into the tables; its record's name, its members, and its mean radiance.

    Raises SceneError for a transform that is more than a rotation.
    """
    axes, spectra, made = image_lights.axes_of(lamp), encoder.spectra, _found(lamp, encoder)
    x, y, z = axes.T
    turn, up = np.radians(lamp.sun_azimuth), np.radians(lamp.sun_elevation)
    members: dict[str, ArrayLike] = {
        "x": np.cos(turn) * x - np.sin(turn) * z,
        "y": y,
        "z": np.sin(turn) * x + np.cos(turn) * z,
        "width": COLUMNS,
        "height": ROWS,
        "texels": encoder.store.append_floats("texels", made.texels),
        "sun_texels": encoder.store.append_floats("texels", made.sun),
        **block_grids.members(made.corners, made.grid, encoder),
        "horizon": horizon(lamp.altitude),
        "sun_cos": np.cos(up),
        "sun_sin": np.sin(up),
        "sun_radius": np.sin(SUN_RADIUS),
        "sun_share": made.sun_share,
    }
    if made.number is None:
        return "sky", members, made.strength
    members |= {"bands": made.texels.shape[1], "number": spectra.row(made.number)}
    return "spectral_sky", members, made.strength


def sun_share(lamp: Sky, encoder: Encoder) -> float:
    """Return the share of a sky's samples that its disc gets, 0 where the sun has set."""
    return _found(lamp, encoder).sun_share


def _found(lamp: Sky, encoder: Encoder) -> _Content:
    """The tables of a sky, found once."""
    given = *_numbers(lamp), encoder.spectra.spectral, *encoder.spectra.range
    return encoder.cache(_content, *given, by=(repr(given),))


def _numbers(lamp: Sky) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """What a sky follows from: its parameters, and the albedo of the ground at LAMBDAS."""
    albedo: Any = lamp.ground
    ground = np.clip(albedo.sample(LAMBDAS), 0.0, 1.0)
    return (
        lamp.sun_elevation, lamp.altitude, lamp.aerosol, lamp.exponent, lamp.aerosol_albedo,
        lamp.asymmetry, lamp.ozone, lamp.sky_scale, lamp.sun_scale,
    ), tuple(ground.tolist())  # fmt: skip


def height(altitude: float) -> float:
    """The observer's height in the tables [km], of an altitude [m]."""
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
    """Radiance at LAMBDAS of the dome and the ground (2, rows + 1, columns / 2 + 1, n),
    and of the sun's disc (rows, columns, n) [W m^-2 sr^-1 nm^-1]."""
    return _images(*_numbers(lamp))


def _images(numbers: tuple[float, ...], ground: tuple[float, ...]) -> tuple[Floats, Floats]:
    *physical, sky, sun = numbers
    around, disc = _unscaled(tuple(physical), ground)
    return np.maximum(around * (sky * SUNLIGHT), 0.0), disc * sun


@lru_cache(maxsize=4)  # it takes seconds, and a sky's scene is often made again
def _unscaled(numbers: tuple[float, ...], ground: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Both images without their factors: that of the dome per irradiance of the sun [1/sr]."""
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
    """The sun's disc, darker toward its edge, through the air of each row."""
    rows = elevation + SUN_RADIUS * np.linspace(-1.0, 1.0, SUN_ROWS)
    cosine = np.linspace(0.0, 1.0, SUN_COLUMNS)
    power = -0.023 + 292.0 / LAMBDAS
    dark = np.maximum(cosine, 1e-6)[:, None] ** power * (0.5 * power + 1.0)
    way, _ = atmosphere.sun_columns(
        np.full(SUN_ROWS, EARTH + high), np.sin(np.maximum(rows, at + 1e-6))
    )
    passed = np.exp(-(way.T @ air.depths(LAMBDAS)))
    passed[rows + SUN_RADIUS / SUN_ROWS < at] = 0.0
    even = SUNLIGHT / (np.pi * np.sin(SUN_RADIUS) ** 2)
    return passed[:, None] * dark * even


def _content(
    numbers: tuple[float, ...], ground: tuple[float, ...], spectral: bool, lo: float, hi: float
) -> _Content:
    """The tables of a sky; its spectra from lo to hi [nm]."""
    around, sun = _images(numbers, ground)
    at = horizon(numbers[1])
    flat = (f.reshape(1, -1, f.shape[-1]) for f in (around, sun))
    images = [SpectralImage(f.astype(np.float32), LAMBDAS, True) for f in flat]
    colours = [np.maximum(image.to_rgb(), 0.0) for image in images]
    seen = [
        luminance(colour) + image_lights.UNSEEN * image.values.mean(axis=2)
        for colour, image in zip(colours, images, strict=True)
    ]
    if spectral:
        (found, number), (disc, _) = bands(images[0], lo, hi), bands(images[1], lo, hi)
    else:
        found, disc = (texels(colour, "emission", False) for colour in colours)
    half = seen[0].reshape(2, ROWS + 1, -1)
    weights = np.concatenate([half, half[..., -2::-1]], axis=2).astype(np.float64)
    rows = np.clip(np.arange(ROWS + 1), 0.25, ROWS - 0.25) / ROWS
    root = np.stack([1.0 - rows, rows])
    span = np.array([0.5 * np.pi - at, 0.5 * np.pi + at])[:, None]
    angle = np.stack([elevations(at, rows), elevations(at, 1.0 + rows)])
    area = 2.0 * root * span * np.cos(angle) * 2.0 * np.pi / (ROWS * COLUMNS)
    corners = weights * area[..., None]
    cell = 2.0 * 0.5 * np.pi / ROWS, 2.0 * np.pi / COLUMNS
    grid = block_grids.of(corners, partial(directions, at), cell)
    shining = _sun_power(seen[1].reshape(SUN_ROWS, SUN_COLUMNS))
    total = grid.total + shining
    share = min(shining / total, MOST) if total > 0.0 else 0.0
    return _Content(
        found, disc, number if spectral else None, corners, grid, share, total / (4.0 * np.pi)
    )


def _sun_power(bright: NDArray[Any]) -> float:
    """A disc's brightness times solid angle, of its image (rows, columns)."""
    at = np.linspace(-1.0, 1.0, 101)
    a, b = np.meshgrid(at, at)
    inside = 1.0 - a * a - b * b
    keep = inside > 0.0
    row = (0.5 + 0.5 * b[keep]) * (SUN_ROWS - 1)
    column = np.sqrt(inside[keep]) * (SUN_COLUMNS - 1)
    found = bright[np.rint(row).astype(int), np.rint(column).astype(int)]
    return float(found.mean() * np.pi * np.sin(SUN_RADIUS) ** 2)
