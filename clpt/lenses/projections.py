"""Projections of calibrated cameras: points to the image plane, and back to directions.

Points are in OpenCV's camera space: x right, y down, z forward. The image plane is that of the
pinhole at a distance of 1; intrinsics scale it to pixels. Coefficients stand in the order of the
tools that estimate them:

opencv          k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, from none on (Brown 1966; rational from k4 on)
kannala_brandt  k1 k2 k3 k4 of theta^3 to theta^9, from none on: equidistant (Kannala, Brandt 2006)
fov             omega [rad] (Devernay and Faugeras 2001)
ucm             alpha (Geyer and Daniilidis 2000, as Usenko et al. 2018 have it)
eucm            alpha beta (Khomutenko et al. 2016)
double_sphere   xi alpha (Usenko, Demmel and Cremers 2018)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.errors import SceneError

COUNTS = {
    "opencv": (0, 4, 5, 8, 12), "kannala_brandt": (0, 1, 2, 3, 4), "fov": (1,), "ucm": (1,),
    "eucm": (2,), "double_sphere": (2,),
}  # fmt: skip
MODELS = tuple(COUNTS)
MOST_COEFFICIENTS = 12
STEPS = 8192  # of the angle to the axis, in tables of radii
ITERATIONS = 12  # of Newton's method
TOLERANCE = 1e-9  # of a point on the image plane


@dataclass(frozen=True)
class Projection:
    """A model of projection with its coefficients.

    model: a name in MODELS; coefficients: see the module. Raises SceneError for coefficients that
    the model does not have.
    """

    model: str
    coefficients: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        counts, k = COUNTS[self.model], self.coefficients
        if len(k) not in counts:
            wanted = ", ".join(map(str, counts))
            message = f"{self.model} has {wanted} coefficients, not {len(k)}"
            raise SceneError(message, where="distortion")
        if not all(map(math.isfinite, k)):
            raise SceneError("must be finite", where="distortion")
        if self.model == "fov" and not 0.0 < k[0] < math.pi:
            raise SceneError(f"omega must lie between 0 and pi, not {k[0]:g}", where="distortion")
        if self.model in ("ucm", "eucm") and not 0.0 <= k[0] <= 1.0:
            raise SceneError(f"alpha must lie between 0 and 1, not {k[0]:g}", where="distortion")
        if self.model == "eucm" and not k[1] > 0.0:
            raise SceneError(f"beta must be above 0, not {k[1]:g}", where="distortion")
        if self.model == "double_sphere" and not (-1.0 < k[0] <= 1.0 and 0.0 <= k[1] <= 1.0):
            message = f"xi must lie between -1 and 1, alpha between 0 and 1, not {k[0]:g}, {k[1]:g}"
            raise SceneError(message, where="distortion")

    def project(self, points: ArrayLike) -> Floats:
        """Return where points (..., 3) lie on the image plane (..., 2); NaN for what is not seen.

        Directions beyond the angle from which on the radius falls again are not seen.
        """
        p = np.asarray(points, np.float64)
        across = np.hypot(p[..., 0], p[..., 1])
        theta = np.arctan2(across, p[..., 2])
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.model == "opencv":
                plane = self._distorted(p[..., :2] / p[..., 2:])
            else:
                scale = self._radius(theta) / across
                scale = np.where(across > 0.0, scale, 0.0)
                plane = p[..., :2] * scale[..., None]
        plane[~(theta <= self.widest)] = np.nan
        return plane

    def directions(self, plane: ArrayLike) -> Floats:
        """Return unit directions (..., 3) of places on the image plane (..., 2).

        NaN where no direction that is seen leads there: the distortion cannot be inverted.
        """
        xy = np.asarray(plane, np.float64)
        radius = np.linalg.norm(xy, axis=-1)
        thetas, radii = self._table
        theta = np.interp(radius, radii, thetas)
        if self.model == "opencv":
            return self._undistorted(xy, radius, theta)
        for _ in range(3):
            step = 1e-6
            slope = (self._radius(theta + step) - self._radius(theta - step)) / (2.0 * step)
            with np.errstate(divide="ignore", invalid="ignore"):
                theta = np.clip(theta - (self._radius(theta) - radius) / slope, 0.0, self.widest)
        unit = xy / np.maximum(radius, 1e-300)[..., None]
        rows = np.concatenate([unit * np.sin(theta)[..., None], np.cos(theta)[..., None]], axis=-1)
        rows[radius > radii[-1]] = np.nan
        return rows

    def kernel_form(self) -> tuple[int, list[float]]:
        """Return the form and the coefficients that kernels/cameras/kinds/calibrated.cl takes."""
        k = list(self.coefficients)
        if self.model == "fov":
            k = [2.0 * math.tan(0.5 * k[0]), 1.0 / k[0]]
        elif self.model in ("ucm", "eucm"):
            k = [0.0, *k]
        form = {"opencv": 0, "kannala_brandt": 1, "fov": 2}.get(self.model, 3)
        if form == 3:  # shift, alpha and beta
            k = [*k, 1.0][:3]
        return form, k + [0.0] * (MOST_COEFFICIENTS - len(k))

    @property
    def widest(self) -> float:
        """The largest angle to the axis that is seen [rad]."""
        return float(self._table[0][-1])

    @cached_property
    def _table(self) -> tuple[Floats, Floats]:
        """Angles and their radii, as far as the radii rise."""
        thetas = np.linspace(0.0, math.pi, STEPS + 1)[:-1]
        if self.model == "opencv":
            thetas = np.concatenate(
                [np.linspace(0.0, 1.5, STEPS), np.linspace(1.5, 1.57, STEPS)[1:]]
            )
        with np.errstate(all="ignore"):
            radii = self._radius(thetas)
            rises = np.diff(radii) > 0.0
        last = len(rises) if rises.all() else int(np.argmin(rises))
        return thetas[: last + 1], radii[: last + 1]

    def _radius(self, theta: Floats) -> Floats:
        """Return the distance from the middle of the image plane by the angle to the axis [rad]."""
        k = self.coefficients
        if self.model == "opencv":
            r = np.tan(theta)
            return r * self._radial(r * r)
        if self.model == "kannala_brandt":
            square = theta * theta
            return theta * (1.0 + square * _polynomial(square, k))
        if self.model == "fov":
            seen = np.where(theta < math.pi / 2.0, np.tan(theta), np.nan)
            return np.arctan(2.0 * math.tan(k[0] / 2.0) * seen) / k[0]
        sine, cosine = np.sin(theta), np.cos(theta)
        alpha, beta, shift = k[0], 1.0, 0.0
        if self.model == "eucm":
            beta = k[1]
        if self.model == "double_sphere":
            shift, alpha = k
        z = shift + cosine
        below = alpha * np.sqrt(beta * sine * sine + z * z) + (1.0 - alpha) * z
        return np.where(below > 0.0, sine / below, np.nan)

    def _radial(self, square: Floats) -> Floats:
        """Return OpenCV's factor of the radius, by the square of the radius."""
        k = (*self.coefficients, *[0.0] * 12)
        above = 1.0 + square * _polynomial(square, (k[0], k[1], k[4]))
        return above / (1.0 + square * _polynomial(square, k[5:8]))

    def _distorted(self, xy: Floats) -> Floats:
        """Return OpenCV's distortion of places (..., 2) on the image plane of the pinhole."""
        _, _, p1, p2, _, _, _, _, s1, s2, s3, s4, *_ = (*self.coefficients, *[0.0] * 12)
        x, y = xy[..., 0], xy[..., 1]
        r2 = x * x + y * y
        radial, both = self._radial(r2), 2.0 * x * y
        return np.stack(
            [
                x * radial + p1 * both + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + s2 * r2),
                y * radial + p2 * both + p1 * (r2 + 2.0 * y * y) + r2 * (s3 + s4 * r2),
            ],
            axis=-1,
        )

    def _undistorted(self, plane: Floats, radius: Floats, theta: Floats) -> Floats:
        """Return directions by Newton's method, from those of the radial part alone."""
        xy = plane * (np.tan(theta) / np.maximum(radius, 1e-300))[..., None]
        limit, step = math.tan(self.widest), 1e-6
        with np.errstate(all="ignore"):
            for _ in range(ITERATIONS):
                residual = self._distorted(xy) - plane
                if not (np.abs(residual) > 0.01 * TOLERANCE).any():
                    break
                columns = [
                    (self._distorted(xy + shift) - self._distorted(xy - shift)) / (2.0 * step)
                    for shift in (np.array([step, 0.0]), np.array([0.0, step]))
                ]
                (a, c), (b, d) = (np.moveaxis(column, -1, 0) for column in columns)
                u, v = np.moveaxis(residual, -1, 0)
                determinant = a * d - b * c
                xy = xy - np.stack([d * u - b * v, a * v - c * u], -1) / determinant[..., None]
            away = np.linalg.norm(self._distorted(xy) - plane, axis=-1)
            bad = ~((away < TOLERANCE) & (np.linalg.norm(xy, axis=-1) <= limit))
        rows = np.concatenate([xy, np.ones((*xy.shape[:-1], 1))], axis=-1)
        rows[bad] = np.nan
        return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


def _polynomial(x: NDArray[np.float64], factors: Sequence[float]) -> Floats:
    """Return the sum of factors[i] x^i, by Horner's rule."""
    total = np.zeros_like(x)
    for factor in reversed(factors):
        total = total * x + factor
    return total
