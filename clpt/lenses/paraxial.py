"""A lens near its axis: focal lengths, pupils, focus by distance. All in float64 and millimetres.

A ray is a height and a slope (y, u); a surface of curvature c from index n to n' makes
n' u' = n u - y (n' - n) c, and a distance t makes y' = y + t u (Hecht 2017, 6.2). z counts from the
first surface's vertex towards the film.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from clpt.errors import SceneError
from clpt.lenses.prescription import LINE_D, Prescription

NO_POWER = 1e-9  # [1/mm], a lens of less power has no focus


@dataclass(frozen=True)
class Cardinal:
    """Properties of a lens near its axis, at a wavelength [nm]; lengths [mm].

    focal_length: of the whole lens; back_focus: from the last surface to the image of a far object;
    front_focus: from the first surface to the front focus, below 0 in front of it; entrance, exit:
    distances of the pupils behind the first and the last surface; entrance_radius, exit_radius: of
    the pupils; f_number: for a far object.
    """

    wavelength: float
    focal_length: float
    back_focus: float
    front_focus: float
    entrance: float
    entrance_radius: float
    exit: float
    exit_radius: float

    @property
    def f_number(self) -> float:
        return abs(self.focal_length) / (2.0 * self.entrance_radius)


def matrix(
    lens: Prescription, wavelength: float = LINE_D, first: int = 0, last: int | None = None
) -> np.ndarray:
    """Return the matrix (2, 2) that takes (y, u) in front of `first` to behind the surfaces.

    first, last: numbers of the surfaces, from 0, without `last`; None: to the end.
    """
    indices = lens.indices(wavelength)
    last = len(lens.surfaces) if last is None else last
    whole = np.eye(2)
    for i in range(first, last):
        surface = lens.surfaces[i]
        # Neither the conic constant nor r^4 and beyond change the curvature at the vertex.
        power = (indices[i + 1] - indices[i]) * surface.curvature
        refraction = np.array([[1.0, 0.0], [-power / indices[i + 1], indices[i] / indices[i + 1]]])
        whole = refraction @ whole
        if i + 1 < last:
            whole = np.array([[1.0, surface.thickness], [0.0, 1.0]]) @ whole
    return whole


def cardinal(lens: Prescription, wavelength: float = LINE_D) -> Cardinal:
    """Return the properties of a lens near its axis at a wavelength [nm].

    A length that is infinite, such as the focal length of a pinhole, is inf.
    """
    (a, _), (c, d) = matrix(lens, wavelength)
    c = 0.0 if abs(c) < NO_POWER else c
    stop, radius = lens.stop, lens.surfaces[lens.stop].semi_diameter
    entrance = exit_ = 0.0
    entrance_radius = exit_radius = radius
    if stop > 0:
        # From the first surface to the stop's vertex: y = 0 at the stop's centre.
        front = matrix(lens, wavelength, 0, stop)
        gap = lens.surfaces[stop - 1].thickness
        front = np.array([[1.0, gap], [0.0, 1.0]]) @ front
        entrance = _ratio(front[0, 1], front[0, 0])
        entrance_radius = abs(_ratio(radius, front[0, 0]))
    if stop + 1 < len(lens.surfaces) or lens.surfaces[stop].radius:
        # The stop stands in front of its own surface.
        rear = matrix(lens, wavelength, stop)
        exit_ = -_ratio(rear[0, 1], rear[1, 1])
        index = lens.indices(wavelength)[stop]
        # The pupil's size follows from the invariant n y u, of a ray through the stop's middle.
        exit_radius = abs(_ratio(radius * index, rear[1, 1]))
    return Cardinal(
        wavelength, _ratio(-1.0, c), _ratio(-a, c), _ratio(d, c),
        float(entrance), float(entrance_radius), float(exit_), float(exit_radius),
    )  # fmt: skip


def _ratio(a: float, b: float) -> float:
    """a / b, infinite where b is 0."""
    return math.copysign(math.inf, a) if abs(b) < 1e-12 else float(a / b)


def film_distance(lens: Prescription, focus: float, wavelength: float = LINE_D) -> float:
    """Return the distance of the film behind the last surface [mm] that focuses at `focus` [mm].

    `focus` counts from the film. The whole lens moves; a lens without power, such as a pinhole,
    stays at its last thickness. Raises SceneError for a distance that is too near.
    """
    (a, b), (c, d) = matrix(lens, wavelength)
    if abs(c) < NO_POWER and lens.surfaces[-1].thickness > 0.0:
        return lens.surfaces[-1].thickness
    if not c < -NO_POWER:
        raise SceneError("this lens forms no picture: its focal length is not above 0")
    # An object s in front of the first surface has its image x behind the last surface:
    # a s + b + x (c s + d) = 0, and s + length + x = focus. With s from that:
    # -c x^2 + x (c r - a + d) + a r + b = 0 with r = focus - length; the smaller x is a camera's.
    room = focus - lens.length
    p, q, r = -c, c * room - a + d, a * room + b
    inside = q * q - 4.0 * p * r
    if inside < 0.0 or room <= 0.0:
        nearest = _nearest(a, b, c, d) + lens.length
        raise SceneError(
            f"this lens cannot focus nearer than {nearest:.4g} mm from the film, asked {focus:.4g}"
        )
    return float(2.0 * r / (-q + math.sqrt(inside)))


def _nearest(a: float, b: float, c: float, d: float) -> float:
    """Return the least sum of the distances of an object and its image from the lens [mm].

    It is at a magnification of -1: c s + d = -1 and a + c x = -1.
    """
    return (-1.0 - d) / c + (-1.0 - a) / c


def stop_radius(lens: Prescription, f_number: float) -> float:
    """Return the semi-diameter of the stop [mm] at an f-number. Raises SceneError."""
    optics = cardinal(lens)
    if math.isinf(optics.f_number):
        raise SceneError("a lens without power has no f-number")
    if f_number < optics.f_number * (1.0 - 1e-3):
        raise SceneError(
            f"this lens opens to f/{optics.f_number:.3g} at most, asked f/{f_number:g}"
        )
    return lens.surfaces[lens.stop].semi_diameter * min(optics.f_number / f_number, 1.0)
