"""Exact rays through a lens in float64, for pupils, spot diagrams and tests.

z counts from the first surface's vertex towards the film [mm]. Rays go in both directions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.lenses.glasses import LINE_D
from clpt.lenses.prescription import Prescription, Surface

NEWTON_STEPS = 12


@dataclass
class Rays:
    """Rays (n, 3): origins [mm] and unit directions; alive (n,): whether no surface stopped it."""

    o: Floats
    d: Floats
    alive: NDArray[np.bool_]

    @staticmethod
    def of(o: Floats, d: Floats) -> Rays:
        """Return rays from points (n, 3) along directions (n, 3) of any length."""
        o, d = np.broadcast_arrays(np.asarray(o, np.float64), np.asarray(d, np.float64))
        length = np.linalg.norm(d, axis=1, keepdims=True)
        return Rays(o.copy(), d / length, np.ones(len(o), np.bool_))


def sag(surface: Surface, r2: Floats) -> Floats:
    """Return a surface's sag behind its vertex [mm]; r2: squared distances from the axis."""
    c = surface.curvature
    root = np.sqrt(np.maximum(1.0 - (1.0 + surface.conic) * c * c * r2, 0.0))
    z = c * r2 / (1.0 + root)
    for i, factor in enumerate(surface.aspheric):
        z = z + factor * r2 ** (i + 2)
    return np.asarray(z)


def trace(
    lens: Prescription,
    rays: Rays,
    wavelength: float = LINE_D,
    backwards: bool = False,
    open_: bool = False,
) -> Rays:
    """Return rays as they leave the lens.

    wavelength [nm]; backwards: from the film to the front; open_: semi-diameters stop no ray; a
    ray ends only if it misses a surface or is totally reflected.
    """
    indices = lens.indices(wavelength)
    order = range(len(lens.surfaces))
    o, d, alive = rays.o.copy(), rays.d.copy(), rays.alive.copy()
    for i in reversed(order) if backwards else order:
        surface, vertex = lens.surfaces[i], lens.vertices[i]
        o[:, 2] -= vertex
        met, normal, there = intersect(surface, o, d)
        alive &= there
        if not open_:
            alive &= met[:, 0] ** 2 + met[:, 1] ** 2 <= surface.semi_diameter**2 * (1.0 + 1e-12)
        n, beyond = indices[i], indices[i + 1]
        if backwards:
            n, beyond = beyond, n
        d, passes = refract(d, normal, n / beyond)
        alive &= passes
        o = met
        o[:, 2] += vertex
    return Rays(o, d, alive)


def intersect(surface: Surface, o: Floats, d: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return points where rays meet a surface, its normals towards -z, and whether they meet it.

    o, d: (n, 3), z from the vertex. A sphere or conic is solved in closed form (Welford 1986, 4.4);
    an asphere by Newton's method from its conic.
    """
    z = np.where(np.abs(d[:, 2]) < 1e-12, 1e-12, d[:, 2])
    p = o - d * (o[:, 2] / z)[:, None]
    c, k = surface.curvature, surface.conic
    f = c * (p[:, 0] ** 2 + p[:, 1] ** 2)
    g = z - c * (p[:, 0] * d[:, 0] + p[:, 1] * d[:, 1])
    inside = g * g - c * f * (1.0 + k * d[:, 2] ** 2)
    there = (inside >= 0.0) & (np.abs(d[:, 2]) > 1e-12)
    root = np.sign(z) * np.sqrt(np.maximum(inside, 0.0))
    t = f / np.where(g + root == 0.0, 1e-300, g + root)
    if surface.aspheric:
        for _ in range(NEWTON_STEPS):
            q = p + d * t[:, None]
            r2 = q[:, 0] ** 2 + q[:, 1] ** 2
            slope = _slope(surface, r2)
            down = d[:, 2] - slope * (q[:, 0] * d[:, 0] + q[:, 1] * d[:, 1])
            t = t - (q[:, 2] - sag(surface, r2)) / np.where(down == 0.0, 1e-300, down)
        q = p + d * t[:, None]
        there &= np.abs(q[:, 2] - sag(surface, q[:, 0] ** 2 + q[:, 1] ** 2)) < 1e-6
    q = p + d * np.where(there, t, 0.0)[:, None]
    slope = _slope(surface, q[:, 0] ** 2 + q[:, 1] ** 2)
    normal = np.stack([q[:, 0] * slope, q[:, 1] * slope, -np.ones(len(q))], axis=1)
    return q, normal / np.linalg.norm(normal, axis=1, keepdims=True), there


def _slope(surface: Surface, r2: Floats) -> Floats:
    """The derivative of the sag by r, over r."""
    c = surface.curvature
    root = np.sqrt(np.maximum(1.0 - (1.0 + surface.conic) * c * c * r2, 1e-12))
    slope = c / root
    for i, factor in enumerate(surface.aspheric):
        slope = slope + 2.0 * (i + 2) * factor * r2 ** (i + 1)
    return np.asarray(slope)


def refract(d: Floats, normal: Floats, ratio: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Return directions behind a boundary, and whether light passes; ratio: n over n' behind."""
    cosine = -np.sum(d * normal, axis=1)
    side = np.where(cosine < 0.0, -1.0, 1.0)
    inside = 1.0 - ratio * ratio * (1.0 - cosine * cosine)
    beyond = side * np.sqrt(np.maximum(inside, 0.0))
    bent = ratio * d + (ratio * cosine - beyond)[:, None] * normal
    return bent, inside > 0.0
