"""Densities on grids as bricks of words, see kernels/media/medium_grid.cl."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import on_host
from clpt.render.lowering import device_grids
from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.tables import Words, as_words
from clpt.scene.media import Cloud, Grid, Lattice, Medium, Mixture
from clpt.scene.volumes import check_density, resampled
from clpt.spectra import Spectrum, cie, uplift
from clpt.spectra.emission import planck
from clpt.spectra.spectrum import gridded

CELLS = 8  # of a brick, along an axis
POINTS = CELLS + 1
AT_ONCE = 4096  # bricks
LEAST = 0.01  # of what a brick would emit whose density and light were spread evenly
FAINT = 1e-3  # of all light, which bricks may emit that are not lights
ROUNDED = 1e-4  # by how much a mixture's density bounds more than its parts
GLOW_WORDS = 6  # behind the row of a grid, see kernels/media/medium_grid_light.cl
BODIES = 1024  # temperatures in a table of black bodies
PEAK = 4.0956747e-15  # highest radiance of a black body over T^5 [W m^-2 sr^-1 nm^-1 K^-5]


def row(medium: Lattice, encoder: Encoder) -> Words:
    """Return what stands in the row of a medium behind its coefficients; append its bricks.

    Raises SceneError for a density that is negative or not finite, but on a device.
    """
    counts = brick_counts(medium.size)
    if isinstance(medium, Cloud):
        density = device_grids.cloud_density(medium)
        first = device_grids.reserve(encoder.store, density, counts)
    elif isinstance(medium, Mixture):
        first = encoder.store.append("images", bricks(mixed(medium, encoder)[0]))
    elif not isinstance(medium, Grid):
        raise TypeError(medium.kind)
    elif device_grids.stays_there(medium):
        first = device_grids.reserve(encoder.store, medium.density, counts)
    else:
        words = encoder.cache(bricks, medium.density, medium.bits)
        first = encoder.store.append("images", words)
    numbers = np.concatenate([to_lattice(medium).ravel(), np.array(medium.size) + 0.5])
    bricks_at = np.array([first, *counts], np.uint32)
    return np.concatenate([bricks_at, as_words(numbers)])


def to_lattice(medium: Lattice) -> NDArray[np.float64]:
    """The three rows (3, 4) from the world to the lattice, whose box begins at 1/2."""
    size = np.array(medium.size)
    inverse = np.linalg.inv(medium.box)
    return size[:, None] * inverse[:3] + np.array([0.0, 0.0, 0.0, 0.5])


def bricks(density: object, bits: int = 16) -> Words:
    """Return the bricks of a density (nx, ny, nz): two words for each, x fastest, then points.

    bits: of a point, 16 or 8.

    The points are those of the grid with one more around, as dense as the nearest. Bricks without
    any density have no points.
    """
    windows = Windows(density)
    most = windows.most
    used = np.flatnonzero(most)
    scale = (2**bits - 1) / most[used].astype(np.float64)
    whole = -(-(POINTS**3) * bits // 32) * 32 // bits
    points = np.zeros((len(used), whole), np.uint16 if bits == 16 else np.uint8)
    for some in _parts(len(used)):
        points[some, : POINTS**3] = np.rint(windows.of(used[some]) * scale[some, None])
    packed = points.view("<u4")
    table = np.zeros((len(most), 2), np.uint32)
    table[used, 0] = 2 * len(most) + packed.shape[1] * np.arange(len(used))
    table[:, 1] = as_words(most)
    return np.concatenate([table.ravel(), packed.ravel()])


def colours(density: object, values: NDArray[Any], spectral: bool) -> Words:
    """Return the colours of the bricks that have a density: a word for each, then three a point.

    The first says where its points begin, 0 for nowhere. spectral: they are coefficients of curves.
    """
    table, points = _on_used(density, values)
    words = uplift(points) if spectral else points
    return np.concatenate([table, as_words(words.ravel())])


def _on_used(density: object, values: NDArray[Any]) -> tuple[Words, NDArray[np.float32]]:
    """Where the points begin of each brick that has a density, 0 of others; and what these hold.

    values: some channels at the points of the density.
    """
    used = np.flatnonzero(Windows(density).most)
    channels = [Windows(values[..., c]) for c in range(values.shape[-1])]
    points = np.stack([one.of(used) for one in channels], axis=-1)
    table = np.zeros(len(channels[0].most), np.uint32)
    table[used] = len(table) + len(channels) * POINTS**3 * np.arange(len(used))
    return table, points


def shares(medium: Mixture, encoder: Encoder, count: int) -> Words:
    """Return how dense each part of a mixture is over the density of its bricks.

    As the colours of bricks: a word for each brick, then `count` for a point, 0 beyond its parts.
    """
    density, parts = mixed(medium, encoder)
    over = parts / np.where(density > 0.0, density, 1.0)[..., None]
    beyond = count - parts.shape[-1]
    table, points = _on_used(density, np.pad(over, [(0, 0)] * 3 + [(0, beyond)]))
    return np.concatenate([table, as_words(points.ravel())])


def mixed(medium: Mixture, encoder: Encoder) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the density of a mixture (nx, ny, nz), made once, and those of its parts (..., n).

    Where the coefficients of the medium are multiplied by the former, they are at all wavelengths
    at least those of the parts together; a little more, lest rounding makes them less.
    """
    table = encoder.spectra
    return encoder.cache(_mixed, medium, table.spectral, *table.range, table.samples)


def _mixed(
    medium: Mixture, spectral: bool, low: float, high: float, samples: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    lambdas = np.linspace(low, high, samples)

    def extinction(coefficients: tuple[Spectrum, Spectrum]) -> NDArray[np.float64]:
        values = [gridded(c, lambdas) if spectral else c.to_rgb("unbounded") for c in coefficients]
        return np.asarray(values[0] + values[1], np.float64)

    whole = extinction(medium.coefficients(spectral))
    over = np.where(whole > 0.0, 1.0 / np.maximum(whole, 1e-30), 0.0)
    most = np.unique([extinction(own) * over for own in medium.of_parts(spectral)], axis=1)
    parts = np.stack([_at_points(part, medium) for part in medium.parts], axis=-1)
    rows = parts.reshape(-1, len(medium.parts))
    density = np.empty(len(rows), np.float32)
    for some in _parts(len(rows)):
        density[some] = (rows[some] @ most).max(axis=1) * (1.0 + ROUNDED)
    return density.reshape(parts.shape[:3]), parts


def _at_points(part: Medium, medium: Mixture) -> NDArray[np.float32]:
    """The density of a part at the points of its mixture."""
    if not isinstance(part, Grid):
        return np.ones(medium.size, np.float32)
    values: NDArray[Any] = np.asarray(on_host(part.density))
    check_density(values, "grid.density")
    if values.shape != medium.size:
        values = resampled(values, np.eye(4), medium.size, np.eye(4))
    return values.astype(np.float32)


class Windows:
    """The points of each brick of a grid, x fastest.

    most: the highest number of each. Raises SceneError for numbers that no density can be.
    """

    def __init__(self, numbers: object):
        values: NDArray[Any] = np.asarray(on_host(numbers))
        check_density(values, "grid.density")
        counts = brick_counts(values.shape)
        room = [(1, CELLS * n - size) for n, size in zip(counts, values.shape, strict=True)]
        around = np.pad(values.astype(np.float32), room, "edge")
        steps = np.array(around.strides)
        windows = np.lib.stride_tricks.as_strided(
            around, (*counts, *[POINTS] * 3), (*(CELLS * steps), *steps), writeable=False
        )
        self._windows = windows.transpose(2, 1, 0, 5, 4, 3)  # z, y, x of bricks and their points
        self.most: NDArray[np.float32] = self._windows.max(axis=(3, 4, 5)).ravel()

    def of(self, numbers: NDArray[np.intp]) -> NDArray[np.float32]:
        """The points (n, POINTS**3) of bricks (n)."""
        z, y, x = np.unravel_index(numbers, self._windows.shape[:3])
        return self._windows[z, y, x].reshape(-1, POINTS**3)


def brick_counts(shape: tuple[int, ...]) -> tuple[int, ...]:
    """The number of bricks along each axis: there is a cell more than points of the density."""
    return tuple(-(-(size + 1) // CELLS) for size in shape)


def _parts(count: int) -> Iterator[slice]:
    """Slices of what is done at once."""
    return (slice(first, first + AT_ONCE) for first in range(0, count, AT_ONCE))


@dataclass(frozen=True)
class Glow:
    """The bricks of a grid that emit, see kernels/light/emissive_brick.cl.

    numbers (n,): of each brick; power (n,) [W/nm]; corners (n, 3), edges (n, 3, 3) [m]: the three
    edges of its part of the grid's box, from a corner.
    """

    numbers: NDArray[np.intp]
    power: NDArray[np.float64]
    corners: NDArray[np.float64]
    edges: NDArray[np.float64]

    def brightest(self) -> Glow:
        """Those without the faintest, which emit FAINT of all light together."""
        rising = np.argsort(self.power, kind="stable")
        faint = np.cumsum(self.power[rising]) <= FAINT * self.power.sum()
        kept = np.sort(rising[~faint])
        return Glow(self.numbers[kept], self.power[kept], self.corners[kept], self.edges[kept])


def glow(medium: Grid, strength: float, brightness: NDArray[np.float64] | None) -> Glow:
    """Return the bricks that emit.

    strength: what a metre of a density of 1 emits by `emission`, or absorbs [W m^-3 sr^-1 nm^-1];
    brightness (n, 2): of a black body, over its temperature.
    """
    density = Windows(medium.density)
    source = medium.emission_grid if brightness is None else medium.temperature
    lit = Windows(source) if source is not None else None
    emits = density.most > 0.0
    if lit is not None:
        emits &= lit.most > 0.0
    numbers = np.flatnonzero(emits)
    once = np.where(np.isin(np.arange(POINTS), (0, CELLS)), 0.5, 1.0)
    share = (once[:, None, None] * once[:, None] * once).ravel() / CELLS**3
    means = np.zeros(len(numbers))
    for some in _parts(len(numbers)):
        dense = density.of(numbers[some]).astype(np.float64)
        light = np.ones(dense.shape) if lit is None else lit.of(numbers[some]).astype(np.float64)
        if brightness is not None:
            light = np.interp(light, *brightness.T)
        both = (dense * light) @ share
        means[some] = np.maximum(both, LEAST * (dense @ share) * (light @ share))
    counts = brick_counts(medium.size)
    z, y, x = np.unravel_index(numbers, counts[::-1])
    low = CELLS * np.stack([x, y, z], axis=1).astype(np.float64)
    end = np.minimum(low + CELLS, np.array(medium.size) + 0.5)
    low = np.maximum(low, 0.5)
    lattice = np.vstack([to_lattice(medium), [0.0, 0.0, 0.0, 1.0]])
    world = np.linalg.inv(lattice)
    corners = low @ world[:3, :3].T + world[:3, 3]
    edges = (end - low)[:, :, None] * world[:3, :3].T
    volume = np.abs(np.linalg.det(edges))
    return Glow(numbers, 4.0 * np.pi * strength * volume * means, corners, edges)


def black_bodies(medium: Grid, hottest: float) -> NDArray[np.float64]:
    """Temperatures [K] from 0 to `hottest`, even, and the colours of black bodies: (n, 4)."""
    kelvin = np.linspace(0.0, hottest, BODIES)
    made = np.zeros((BODIES, 4))
    made[:, 0] = kelvin
    values = medium.brightness * planck(cie.GRID, kelvin[1:, None])
    if medium.normalised:
        values /= PEAK * kelvin[1:, None] ** 5
    made[1:, 1:] = np.maximum(cie.spectrum_to_xyz(values) @ cie.XYZ_TO_REC709.T, 0.0)
    return made
