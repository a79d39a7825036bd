"""Densities on grids in bricks: the points of each brick, and the light that it emits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import on_host
from clpt.records import BRICK_CELLS
from clpt.render.lights.bounds import Bounds, all_around
from clpt.render.materials.encoder import Encoder
from clpt.render.records.lights import BRICK, RECORDS
from clpt.scene.media import Grid, Lattice
from clpt.scene.volumes import check_density
from clpt.spectra import cie
from clpt.spectra.emission import planck

CELLS, POINTS = BRICK_CELLS["cells"], BRICK_CELLS["points"]  # of a brick, along an axis
AT_ONCE = 4096  # bricks of a batch
LEAST = 0.01  # of the light of a brick with even density and temperature: the floor of its power
FAINT = 1e-3  # of all light: together the faintest bricks emit it, and are not sampled
BODIES = 1024  # temperatures in a table of black bodies
PEAK = 4.0956747e-15  # highest radiance of a black body over T^5 [W m^-2 sr^-1 nm^-1 K^-5]


def to_lattice(medium: Lattice) -> NDArray[np.float64]:
    """The three rows (3, 4) from the world to the lattice, whose box begins at 1/2."""
    size = np.array(medium.size)
    inverse = np.linalg.inv(medium.box)
    return size[:, None] * inverse[:3] + np.array([0.0, 0.0, 0.0, 0.5])


def brick_counts(shape: tuple[int, ...]) -> tuple[int, ...]:
    """The number of bricks along each axis: there is a cell more than points of the density."""
    return tuple(-(-(size + 1) // CELLS) for size in shape)


def parts_of(count: int) -> Iterator[slice]:
    """Return slices of batches."""
    return (slice(first, first + AT_ONCE) for first in range(0, count, AT_ONCE))


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


@dataclass(frozen=True)
class BrickLights:
    """The bricks of a grid that emit, see kernels/lights/kinds/emissive_brick.cl.

    numbers (n,): of each brick; power (n,) [W/nm]; corners (n, 3), edges (n, 3, 3) [m]: the three
    edges of its part of the grid's box, from a corner; emitting: numbers of all bricks that emit.
    """

    kind: ClassVar[str] = BRICK

    numbers: NDArray[np.intp]
    power: NDArray[np.float64]
    corners: NDArray[np.float64]
    edges: NDArray[np.float64]
    emitting: NDArray[np.intp]

    @property
    def bounds(self) -> Bounds:
        """The bounds (n)."""
        low = self.corners + np.minimum(self.edges, 0.0).sum(axis=1)
        return all_around(low, self.corners + np.maximum(self.edges, 0.0).sum(axis=1))

    def rows(self, encoder: Encoder, medium: int) -> NDArray[np.int64]:
        """Append a record for each brick; return the first word of each in `light_params` (n,).

        medium: its word.
        """
        record = RECORDS[BRICK]
        words = np.zeros(len(self.numbers), record.dtype)
        across = np.cross(self.edges[:, [1, 2, 0]], self.edges[:, [2, 0, 1]])
        surface = 2.0 * np.linalg.norm(across, axis=2).sum(axis=1)
        volume = np.abs(np.linalg.det(self.edges))
        words["medium"], words["number"], words["corner"] = medium, self.numbers, self.corners
        for axis, name in enumerate("xyz"):
            words[name] = self.edges[:, axis]
        words["chord"], words["inverse"] = 4.0 * volume / surface, 1.0 / volume
        first = encoder.store.append("light_params", words.view(np.uint32))
        return first + record.words * np.arange(len(words))

    def brightest(self) -> BrickLights:
        """Return the bricks without the faintest, which emit FAINT of all light together."""
        rising = np.argsort(self.power, kind="stable")
        faint = np.cumsum(self.power[rising]) <= FAINT * self.power.sum()
        kept = np.sort(rising[~faint])
        return replace(
            self,
            numbers=self.numbers[kept],
            power=self.power[kept],
            corners=self.corners[kept],
            edges=self.edges[kept],
        )


def _source(medium: Grid) -> Windows | None:
    """Return the grid of temperatures or of emission; None: all of the density emits."""
    hot = medium.temperature is not None
    source = medium.temperature if hot else medium.emission_grid
    return None if source is None else Windows(source)


def brick_lights(
    medium: Grid, strength: float, brightness: NDArray[np.float64] | None
) -> BrickLights:
    """Return the bricks that emit.

    strength: emission, or absorption, of a density of 1 [W m^-3 sr^-1 nm^-1]; brightness (n, 2):
    of a black body, over its temperature.
    """
    density, lit = Windows(medium.density), _source(medium)
    emits = density.most > 0.0
    numbers = np.flatnonzero(emits if lit is None else emits & (lit.most > 0.0))
    once = np.where(np.isin(np.arange(POINTS), (0, CELLS)), 0.5, 1.0)
    share = (once[:, None, None] * once[:, None] * once).ravel() / CELLS**3
    means = np.zeros(len(numbers))
    for batch in parts_of(len(numbers)):
        dense = density.of(numbers[batch]).astype(np.float64)
        light = np.ones(dense.shape) if lit is None else lit.of(numbers[batch]).astype(np.float64)
        if brightness is not None:
            light = np.interp(light, *brightness.T)
        both = (dense * light) @ share
        means[batch] = np.maximum(both, LEAST * (dense @ share) * (light @ share))
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
    return BrickLights(numbers, 4.0 * np.pi * strength * volume * means, corners, edges, numbers)


def black_bodies(medium: Grid, hottest: float) -> NDArray[np.float64]:
    """Return even temperatures [K] from 0 to `hottest`, and colours of black bodies: (n, 4)."""
    kelvin = np.linspace(0.0, hottest, BODIES)
    table = np.zeros((BODIES, 4))
    table[:, 0] = kelvin
    values = medium.brightness * planck(cie.GRID, kelvin[1:, None])
    if medium.normalised:
        values /= PEAK * kelvin[1:, None] ** 5
    table[1:, 1:] = np.maximum(cie.spectrum_to_xyz(values) @ cie.XYZ_TO_REC709.T, 0.0)
    return table
