"""The sky as a light: its images as texels, grids to choose directions by, and its record."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.device import buffers
from clpt.images.spectral_exr import SpectralImage
from clpt.render.lights import block_grids
from clpt.render.lights import images as image_lights
from clpt.render.lights.block_grids import grid_members
from clpt.render.lights.check import rotation
from clpt.render.materials.encoder import Encoder
from clpt.render.spectra.look import Look
from clpt.render.textures.texels import bands, texels
from clpt.scene.lights import Light, Sky
from clpt.scene.params import fields_of
from clpt.scene.roles import EMISSION
from clpt.sky import dome
from clpt.sky.dome import (
    COLUMNS,
    ROWS,
    SUN_COLUMNS,
    SUN_RADIUS,
    SUN_ROWS,
    directions,
    elevations,
    horizon,
)
from clpt.spectra import Tabulated, air, data, luminance
from clpt.spectra.air import LAMBDAS

MOST = 0.75  # share of samples that the sun may take


class Content(NamedTuple):
    """The radiance of a sky.

    texels, sun (n, bands or 4): of the dome and of the sun's disc; number: band by wavelength of
    spectra; corners, grid: to choose directions by; sun_share: of samples; strength: mean radiance.
    """

    texels: NDArray[np.float32]
    sun: NDArray[np.float32]
    number: Tabulated | None
    corners: Floats
    grid: block_grids.BlockGrid
    sun_share: float
    strength: float

    def extent(self, share: float) -> float:
        """Return 0 if the sun's disc gets such a share of the samples, else 1."""
        return 0.0 if self.sun_share >= share else 1.0

    def record(self, lamp: Light, encoder: Encoder) -> tuple[str, dict[str, ArrayLike]]:
        """Append the texels and the grid; return the name and the members of the record.

        Raises SceneError for a transform that is no rotation.
        """
        fields = fields_of(lamp)
        x, y, z = rotation(lamp).T
        turn, up = np.radians([fields[name] for name in ("sun_azimuth", "sun_elevation")])
        members: dict[str, ArrayLike] = {
            "x": np.cos(turn) * x - np.sin(turn) * z,
            "y": y,
            "z": np.sin(turn) * x + np.cos(turn) * z,
            "width": COLUMNS,
            "height": ROWS,
            "texels": encoder.store.append_floats("texels", self.texels),
            "sun_texels": encoder.store.append_floats("texels", self.sun),
            **grid_members(self.corners, self.grid, encoder),
            "horizon": horizon(fields["altitude"]),
            "sun_cos": np.cos(up),
            "sun_sin": np.sin(up),
            "sun_radius": np.sin(SUN_RADIUS),
            "sun_share": self.sun_share,
        }
        if self.number is None:
            return "sky", members
        members |= {"bands": self.texels.shape[1], "number": encoder.spectra.row(self.number)}
        return "spectral_sky", members


def content(lamp: Sky, look: Look) -> Content:
    """Return the radiance of a sky, cached."""
    source = *dome.numbers(lamp), look.spectral, look.lo, look.hi
    return look.cache(_content, *source, by=(repr(source),))


def kept(numbers: tuple[float, ...], ground: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Return the arrays of `dome.unscaled`, from the cache folder if possible."""
    code = *Path(dome.__file__).parent.glob("*.py"), Path(air.__file__)
    tables = (data.ROOT / name for name in ("sky.csv", "air.csv"))
    around, disc = buffers.kept(dome.unscaled, numbers, ground, files=(*code, *tables))
    return around, disc


def _content(
    numbers: tuple[float, ...], ground: tuple[float, ...], spectral: bool, lo: float, hi: float
) -> Content:
    """Return the content of a sky, with spectra from lo to hi [nm]."""
    around, sun = dome.images(kept, numbers, ground)
    at = horizon(numbers[1])
    flat = (f.reshape(1, -1, f.shape[-1]) for f in (around, sun))
    images = [SpectralImage(f.astype(np.float32), LAMBDAS, True) for f in flat]
    colours = [np.maximum(image.to_rgb(), 0.0) for image in images]
    seen = [
        luminance(colour) + image_lights.UNSEEN * image.values.mean(axis=2)
        for colour, image in zip(colours, images, strict=True)
    ]
    if spectral:
        (dome_texels, number), (disc, _) = bands(images[0], lo, hi), bands(images[1], lo, hi)
    else:
        dome_texels, disc = (texels(colour, EMISSION, False) for colour in colours)
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
    return Content(
        dome_texels, disc, number if spectral else None, corners, grid, share, total / (4.0 * np.pi)
    )


def _sun_power(bright: NDArray[Any]) -> float:
    """Return brightness times solid angle of the sun's disc, from its image (rows, columns)."""
    at = np.linspace(-1.0, 1.0, 101)
    a, b = np.meshgrid(at, at)
    inside = 1.0 - a * a - b * b
    keep = inside > 0.0
    row = (0.5 + 0.5 * b[keep]) * (SUN_ROWS - 1)
    column = np.sqrt(inside[keep]) * (SUN_COLUMNS - 1)
    radiance = bright[np.rint(row).astype(int), np.rint(column).astype(int)]
    return float(radiance.mean() * np.pi * np.sin(SUN_RADIUS) ** 2)
