"""Media that are lights: bricks of grids, and homogeneous media in their boundaries."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, on_device
from clpt.geometry import analytic, shapes
from clpt.geometry.analytic import keeps_its_kind
from clpt.geometry.winding import box
from clpt.render.geometry.open_boundaries import HOLE, hole_around
from clpt.render.geometry.surroundings import every
from clpt.render.lights.bounds import Bounds, all_around
from clpt.render.lights.bricks import BrickLights, black_bodies, brick_lights
from clpt.render.materials.encoder import Encoder
from clpt.render.records.lights import BODY, RECORDS
from clpt.render.scene_index import SceneIndex, leaves_of
from clpt.render.spectra.look import Look
from clpt.scene.media import Grid, Medium
from clpt.scene.shapes import Cube, Cylinder, Disk, Mesh, Rectangle, SdfGrid, Shape, Sphere
from clpt.spectra import Spectrum
from clpt.spectra.spectrum import gridded

SOLID = Sphere | Cube | Mesh | SdfGrid
WALLS = Cylinder | Disk | Rectangle  # which may enclose something together
FILLED = 0.1  # least share of a box that bodies must fill, else rays to the box are wasted

Cached = Callable[..., Any] | None


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
        strength = _brightness(light, absorbs, look, lambda coefficient: coefficient)
    return brick_lights(medium, max(strength, 1e-30), brightness).brightest()


def _brightness(
    light: Spectrum, absorbs: Spectrum, look: Look, share: Callable[[Floats], Floats]
) -> float:
    """Return the brightness of light times a share that depends on a coefficient [1/m]."""
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


def _place(shape: Shape, cached: Cached) -> tuple[NDArray[np.float64], bool]:
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
    shown = _brightness(light, absorbs, look, lambda a: -np.expm1(-np.maximum(a, 0.0) * chord))
    return max(np.pi * surface * shown, 1e-30)
