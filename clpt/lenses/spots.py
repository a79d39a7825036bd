"""Spot diagrams: the points on the film that a far point's light reaches."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from clpt.arrays import Floats
from clpt.lenses.glasses import LINE_D
from clpt.lenses.paraxial import cardinal
from clpt.lenses.prescription import Prescription
from clpt.lenses.tracing import Rays, trace

RINGS = 24


@dataclass(frozen=True)
class Spot:
    """Points (n, 2) where a far point's light meets the film [mm], each of the same power.

    through: part of the light into the entrance pupil that reaches the film.
    """

    points: Floats
    through: float

    @property
    def radius(self) -> float:
        """Root mean square distance from the centroid [mm]."""
        return float(np.sqrt(np.mean(np.sum((self.points - self.points.mean(axis=0)) ** 2, 1))))


def pupil_points(rings: int = RINGS) -> Floats:
    """Return points (n, 2) evenly over the unit disk: 6 i + 3 on the ring i."""
    circles = []
    for i in range(rings):
        turns = 2.0 * math.pi * (np.arange(6 * i + 3) + 0.5) / (6 * i + 3)
        circles.append((i + 0.5) / rings * np.stack([np.cos(turns), np.sin(turns)], 1))
    return np.concatenate(circles)


def bundle(lens: Prescription, angle: float, wide: float = 1.0, rings: int = RINGS) -> Rays:
    """Return parallel rays to the entrance pupil, from a point at an angle [degrees] in y.

    wide: the bundle's radius in the pupil's paraxial radii: wide lenses' pupils grow off the axis.
    """
    optics = cardinal(lens)
    slope = math.tan(math.radians(angle))
    disk = wide * optics.entrance_radius * pupil_points(rings)
    o = np.column_stack([disk, np.full(len(disk), optics.entrance)])
    d = np.array([[0.0, slope, 1.0]])
    # From a plane perpendicular to the rays, in front of all glass.
    far = optics.entrance + lens.length + 10.0 * optics.entrance_radius
    rays = Rays.of(o, d)
    rays.o -= rays.d * (far / rays.d[:, 2:])
    return rays


def spot(
    lens: Prescription, angle: float, wavelength: float = LINE_D, distance: float | None = None
) -> Spot:
    """Return the spot of a far point at an angle [degrees] and a wavelength [nm].

    distance: from the last surface to the film [mm]; None: the paraxial focus at the line d.
    """
    away = cardinal(lens).back_focus if distance is None else distance
    rays = trace(lens, bundle(lens, angle), wavelength)
    at = (lens.length + away - rays.o[:, 2]) / rays.d[:, 2]
    points = (rays.o + at[:, None] * rays.d)[rays.alive, :2]
    return Spot(points, float(rays.alive.mean()))
