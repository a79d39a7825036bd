"""Media that are lights: bricks of grids, and homogeneous media in their boundaries."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, on_device, on_host
from clpt.files import budget
from clpt.geometry import analytic, shapes
from clpt.geometry.analytic import keeps_its_kind
from clpt.geometry.winding import box
from clpt.records import BRICK_CELLS
from clpt.render.geometry.surroundings import HOLE, every, hole_around
from clpt.render.lights.bounds import Bounds, all_around
from clpt.render.materials.encoder import Encoder
from clpt.render.records.lights import BODY, BRICK, RECORDS
from clpt.render.records.tables import LoweringCache
from clpt.render.scene_index import SceneIndex, leaves_of
from clpt.render.spectra.find import Look
from clpt.scene.media import Grid, Lattice, Medium
from clpt.scene.shapes import Cube, Cylinder, Disk, Mesh, Rectangle, SdfGrid, Shape, Sphere
from clpt.scene.volumes import check_density
from clpt.spectra import Spectrum, cie
from clpt.spectra.emission import planck
from clpt.spectra.spectrum import gridded

SOLID = Sphere | Cube | Mesh | SdfGrid
WALLS = Cylinder | Disk | Rectangle  # which may enclose something together
FILLED = 0.1  # least share of a box that bodies must fill, else rays to the box are wasted


@dataclass(frozen=True)
class BodyLight:
    """A homogeneous medium as a single light, see kernels/lights/kinds/emissive_body.cl.

    matrix (3, 4): axes and middle of the ball or box around it [m]; ball: False for a box; power
    [W/nm].
    """

    kind: ClassVar[str] = BODY

    matrix: NDArray[np.float64]
    ball: bool
    power: float

    @property
    def volume(self) -> float:
        """The volume of the ball or box [m^3]."""
        return _volume(self.matrix, self.ball)

    @property
    def reach(self) -> NDArray[np.float64]:
        """Its extent from the middle along x, y and z (3,) [m]."""
        edges = self.matrix[:, :3]
        extent = np.linalg.norm(edges, axis=1) if self.ball else np.abs(edges).sum(axis=1)
        return np.asarray(extent)

    @property
    def bounds(self) -> Bounds:
        """The bounds (1)."""
        middle, reach = self.matrix[:, 3], self.reach
        return all_around((middle - reach)[None], (middle + reach)[None])

    def rows(self, encoder: Encoder, medium: int) -> NDArray[np.int64]:
        """Append the record; return its first word in `light_params` (1,). medium: its word."""
        words = np.zeros(1, RECORDS[BODY].dtype)
        inverse = np.linalg.inv(np.vstack([self.matrix, [0.0, 0.0, 0.0, 1.0]]))
        words["medium"], words["box"] = medium, not self.ball
        for axis, name in enumerate("xyz"):
            words[name] = inverse[axis, :3]
            words[f"edge_{name}"] = self.matrix[:, axis]
        words["at"], words["center"] = inverse[:3, 3], self.matrix[:, 3]
        words["inverse"] = 1.0 / self.volume
        return np.array([encoder.store.append("light_params", words.view(np.uint32))])


def volume_lights(index: SceneIndex, look: Look) -> dict[Medium, BrickLights | BodyLight]:
    """Return the lights of media: bricks of a density grid, a body of a homogeneous medium.

    look: of the film; its cache keeps the triangles of boundaries.
    """
    lights: dict[Medium, BrickLights | BodyLight] = {}
    for medium in index.emitting:
        if medium.lattice is None:
            body = _body(medium, index, look)
            lights |= {medium: body} if body else {}
        elif medium.lattice.noise is None:
            lights[medium] = _bricks(cast(Grid, medium), look)
    return lights


def _bricks(medium: Grid, look: Look) -> BrickLights:
    light: Any = medium.light
    absorbs, _ = medium.coefficients(look.spectral)
    strength, brightness = float(np.mean(absorbs.to_rgb("unbounded"))), None
    if medium.temperature is not None:
        table = black_bodies(medium, light.kelvin)
        brightness = np.stack([table[:, 0], table[:, 1:].mean(axis=1)], axis=1)
    else:
        strength = _brightness(light, absorbs, look)
    return brick_lights(medium, max(strength, 1e-30), brightness).brightest()


def _brightness(
    light: Spectrum, absorbs: Spectrum, look: Look, chord: float | None = None
) -> float:
    """Return the brightness of light times a coefficient [1/m], or the share that a chord absorbs.

    chord: [m]
    """

    def share(coefficient: Floats) -> Floats:
        return coefficient if chord is None else -np.expm1(-np.maximum(coefficient, 0.0) * chord)

    colour = np.asarray(light.to_rgb("emission"), float)
    seen = float((colour * share(np.asarray(absorbs.to_rgb("unbounded"), float))).mean())
    if not look.spectral:
        return seen
    power = gridded(light, look.grid) * share(gridded(absorbs, look.grid))
    return seen + look.unseen * max(float(power.mean()), 0.0)


def _body(medium: Medium, index: SceneIndex, look: Look) -> BodyLight | None:
    """Return a homogeneous medium as a light, None where rays to it would be wasted.

    Its boundaries must be closed, at rest and null, and must fill a box well.
    """
    cached = look.cache
    elsewhere = {index.camera.medium, *(shape.exterior for shape in index.shapes)}
    around = [shape for shape in every(index.listed) if shape.interior is medium]
    if medium in elsewhere or not around or not all(_encloses(shape) for shape in around):
        return None
    if hole_around(index, medium, cached) > HOLE:
        return None
    places = [_place(shape, cached) for shape in around]
    if len(places) == 1:
        matrix, ball = places[0]
    else:
        matrix, ball = _box_around([box(shape, cached) for shape in around]), False
    whole = _volume(matrix, ball)
    apart = all(isinstance(shape, SOLID) for shape in around)
    filled = sum(_volume(*place) for place in places) if apart else whole
    if not whole > 0.0 or filled < FILLED * whole:
        return None
    return BodyLight(matrix, ball, _power(medium, matrix, ball, look))


def _encloses(shape: Shape) -> bool:
    """Whether a boundary is at rest, may be closed, and lets shadow rays through."""
    if shape.motion is not None or shape.deformation is not None:
        return False
    if on_device(shape.vertices):
        return False
    return isinstance(shape, SOLID | WALLS) and any(
        leaf.is_null for leaf in leaves_of(shape.material)
    )


def _place(shape: Shape, cached: LoweringCache) -> tuple[NDArray[np.float64], bool]:
    """Return axes and middle (3, 4) of a ball or box around a shape, and whether it is a ball."""
    if isinstance(shape, Sphere) and keeps_its_kind(shape):
        members = analytic.members_of(shape)
        return np.column_stack([float(members["radius"]) * np.eye(3), members["center"]]), True
    if isinstance(shape, Cube):
        return shapes.placement(shape)[:3], False
    return _box_around([box(shape, cached)]), False


def _box_around(boxes: Iterable[tuple[Any, Any]]) -> NDArray[np.float64]:
    """Return axes and middle (3, 4) of the box around boxes."""
    lows, highs = zip(*boxes, strict=True)
    low, high = np.min(lows, axis=0).astype(float), np.max(highs, axis=0).astype(float)
    return np.column_stack([np.diag((high - low) / 2.0), (high + low) / 2.0])


def _volume(matrix: NDArray[np.float64], ball: bool) -> float:
    return (4.0 / 3.0 * np.pi if ball else 8.0) * abs(float(np.linalg.det(matrix[:, :3])))


def _power(medium: Medium, matrix: NDArray[np.float64], ball: bool, look: Look) -> float:
    """Return the power of a ball or box [W/nm]: pi times surface times radiance of a mean chord."""
    light: Any = medium.light
    absorbs = medium.coefficients(look.spectral)[0]
    volume, edges = _volume(matrix, ball), matrix[:, :3]
    sides = [np.linalg.norm(np.cross(edges[:, i], edges[:, i - 1])) for i in range(3)]
    surface = 4.0 * (np.pi * float(np.mean(sides)) if ball else 2.0 * float(np.sum(sides)))
    chord = 4.0 * volume / surface
    shown = _brightness(light, absorbs, look, chord)
    return max(np.pi * surface * shown, 1e-30)


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
    """Yield slices of batches. Raises SceneError if the time of the load is spent."""
    for first in range(0, count, AT_ONCE):
        budget.check_time()
        yield slice(first, first + AT_ONCE)


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
