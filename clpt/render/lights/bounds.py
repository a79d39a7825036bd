"""Bounds of lights in space and direction: the boxes and cones of a light tree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.arrays import Faces, Floats, Points
from clpt.geometry import analytic
from clpt.scene.lights import Light
from clpt.scene.shapes import Shape


@dataclass(frozen=True)
class Bounds:
    """Bounds of n lights: boxes, and cones as in Conty Estevez and Kulla 2018 (4.1).

    low, high (n, 3) [m]; center (n, 3): in the plane of a flat light [m]; axis (n, 3) unit length;
    theta_o (n,): largest angle of a normal to the axis [rad]; theta_e (n,): largest angle of light
    to a normal [rad], up to pi / 2; both (n,) bool: light leaves against the normals too; placed
    (n,) bool: False for a light that shines on the whole scene.
    """

    low: Floats
    high: Floats
    center: Floats
    axis: Floats
    theta_o: Floats
    theta_e: Floats
    both: NDArray[np.bool_]
    placed: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.low)

    @property
    def arrays(self) -> tuple[Any, ...]:
        """The arrays, in the order of the fields."""
        cones = self.axis, self.theta_o, self.theta_e, self.both
        return self.low, self.high, self.center, *cones, self.placed

    def within(self, low: Floats, high: Floats) -> Bounds:
        """Return the bounds of lights that move or turn in larger boxes (n, 3)."""
        theta_o = np.full(len(low), np.pi)
        return replace(self, low=low, high=high, center=0.5 * (low + high), theta_o=theta_o)

    def __getitem__(self, rows: ArrayLike | slice) -> Bounds:
        return Bounds(*(array[rows] for array in self.arrays))


def concatenated(parts: Sequence[Bounds]) -> Bounds:
    """Return the bounds of all lights, in their order."""
    return Bounds(*map(np.concatenate, zip(*(part.arrays for part in parts), strict=True)))


def of_lamp(lamp: Light) -> Bounds:
    """Return the bounds (1) of a light that is not on a shape."""
    bounds = lamp.bounds()
    if bounds is None:
        return _one(np.zeros(3), placed=False)
    return _one(bounds.low, bounds.axis, bounds.theta_o, bounds.theta_e, high=bounds.high)


def of_shape(shape: Shape, two_sided: bool) -> Bounds:
    """Return the bounds (1) of a shape that is sampled as a whole."""
    low, high = (np.asarray(corner, np.float64) for corner in analytic.bounds(shape))
    if shape.kind in ("sphere", "cylinder"):
        return _one(low, high=high)
    axis = analytic.facing(shape)
    return _one(low, axis, 0.0, np.pi / 2.0, high=high, both=two_sided)


def of_triangles(vertices: Points, faces: Faces, two_sided: bool) -> Bounds:
    """Return the bounds (m) of triangles (m, 3); the front is on the winding's side."""
    corners = np.asarray(vertices, np.float64)[faces]
    normals = transforms.unit_vectors(transforms.edge_crosses(vertices, faces))
    count = len(faces)
    return Bounds(
        corners.min(axis=1),
        corners.max(axis=1),
        corners.mean(axis=1),
        normals,
        np.where(normals.any(axis=1), 0.0, np.pi),
        np.full(count, np.pi / 2.0),
        np.full(count, two_sided),
        np.full(count, True),
    )


def of_balls(balls: NDArray[np.float32]) -> Bounds:
    """Return the bounds (n) of spheres (n, 4): centre and radius."""
    center, radius = balls[:, :3].astype(np.float64), balls[:, 3:].astype(np.float64)
    return replace(all_around(center - radius, center + radius), center=center)


def all_around(low: Floats, high: Floats) -> Bounds:
    """Return the bounds (n) of lights that shine in all directions, in boxes (n, 3)."""
    count = len(low)
    return Bounds(
        low, high, 0.5 * (low + high),
        np.tile([0.0, 0.0, 1.0], (count, 1)),
        np.full(count, np.pi), np.full(count, np.pi / 2.0), np.full(count, False),
        np.full(count, True),
    )  # fmt: skip


def _one(
    low: Floats,
    axis: ArrayLike = (0.0, 0.0, 1.0),
    theta_o: float = np.pi,
    theta_e: float = np.pi / 2.0,
    *,
    high: Floats | None = None,
    both: bool = False,
    placed: bool = True,
) -> Bounds:
    """Return the bounds of a single light; by default it shines everywhere."""
    high = low if high is None else high
    angles = (np.array([theta_o]), np.array([theta_e]))
    return Bounds(
        low[None], high[None], 0.5 * (low + high)[None], np.array([axis], np.float64), *angles,
        np.array([both]), np.array([placed]),
    )  # fmt: skip
