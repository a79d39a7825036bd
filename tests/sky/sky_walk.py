"""Walks of light through the air in float64, one by one: what the sky's tables must agree with.

Flights end at collisions of which some are with nothing (Woodcock tracking); at every true one, and
on the ground, light comes from the sun straight. Nothing is interpolated, and the aerosol keeps its
forward peak; of the tables' code only columns toward the sun are used, which have a test alone.
"""

from __future__ import annotations

import numpy as np

from clpt.sky import skylight
from clpt.sky.skylight import TOP
from clpt.spectra.air import EARTH, OZONE_MIDDLE, Atmosphere, densities

FEW = 1e-3  # throughput at which a walk goes on by chance
MOST = 200  # collisions


def radiance(air: Atmosphere, albedo, sun, height, mu, turn, lambda_nm, count, seed=1):
    """Radiance per irradiance of the sun in one direction at one wavelength, and its error."""
    rng = np.random.default_rng(seed)
    depth = air.depths([lambda_nm])[:, 0]
    toward = np.array([np.sin(sun), 0.0, np.cos(sun)])
    across = np.sqrt(1.0 - mu * mu)
    d = np.tile([across * turn, across * np.sqrt(max(1.0 - turn * turn, 0.0)), mu], (count, 1))
    p = np.tile([0.0, 0.0, EARTH + height], (count, 1))
    beta, found, alive = np.ones(count), np.zeros(count), np.arange(count)
    for _ in range(MOST):
        p[alive], state = _flight(rng, depth, p[alive], d[alive])
        air_hit, ground = alive[state == 1], alive[state == 2]
        beta[ground] *= albedo
        up = p[ground] / np.linalg.norm(p[ground], axis=1, keepdims=True)
        found[ground] += (
            beta[ground] / np.pi * np.maximum(up @ toward, 0.0) * _lit(depth, p[ground], toward)
        )
        d[ground] = _cosine(rng, up)
        scatter = densities(np.linalg.norm(p[air_hit], axis=1) - EARTH) * depth[:, None]
        share = np.stack([scatter[0], scatter[1] * air.aerosol_albedo])
        beta[air_hit] *= share.sum(axis=0) / scatter.sum(axis=0)
        part = share[0] / share.sum(axis=0)
        found[air_hit] += (
            beta[air_hit] * _phase(air, part, d[air_hit] @ toward) * _lit(depth, p[air_hit], toward)
        )
        d[air_hit] = _turned(rng, air, part, d[air_hit])
        alive = np.concatenate([air_hit, ground])
        low = alive[beta[alive] < FEW]
        beta[low] *= 2.0 * (rng.random(len(low)) < 0.5)
        alive = alive[beta[alive] > 0.0]
        if not len(alive):
            break
    return found.mean(), found.std() / np.sqrt(count)


def _flight(rng, depth, p, d):
    """Where flights end, and how: 0 in space, 1 in the air, 2 on the ground."""
    n = len(p)
    b = (p * d).sum(axis=1)
    c = (p * p).sum(axis=1)
    root = b * b - c + EARTH**2
    floor = np.where(
        (root > 0.0) & (b < 0.0), np.maximum(-b - np.sqrt(np.maximum(root, 0.0)), 0.0), np.inf
    )
    end = -b + np.sqrt(np.maximum(b * b - c + TOP**2, 0.0))
    state, t = np.where(np.isfinite(floor), 2, 0), np.zeros(n)
    end = np.minimum(end, floor)
    going = np.arange(n)
    while len(going):
        # Bounds by the lowest point of the next 40 km: a step beyond them only goes on from there.
        r2 = c[going] + t[going] ** 2 + 2.0 * b[going] * t[going]
        near = np.clip(-(b[going] + t[going]), 0.0, 40.0)
        low = np.sqrt(np.maximum(r2 + near**2 + 2.0 * (b[going] + t[going]) * near, EARTH**2))
        bound = _bound(low - EARTH, depth)
        step = rng.exponential(size=len(going)) / bound
        stopped = step > 40.0
        t[going] += np.minimum(step, 40.0)
        out = t[going] >= end[going]
        r = np.sqrt(c[going] + t[going] ** 2 + 2.0 * b[going] * t[going])
        real = densities(np.maximum(r - EARTH, 0.0)).T @ depth
        assert (real <= bound * (1.0 + 1e-9))[~out].all()
        hit = ~out & ~stopped & (rng.random(len(going)) * bound < real)
        state[going[hit]] = 1
        t[going[out]] = end[going[out]]
        going = going[~out & ~hit]
    q = p + t[:, None] * d
    ground = state == 2
    q[ground] *= (EARTH + 1e-7) / np.linalg.norm(q[ground], axis=1, keepdims=True)
    return q, state


def _bound(height, depth):
    """What extinction is nowhere above, at a height or higher [1/km]."""
    h = np.maximum(height, 0.0)
    dense = densities(h)
    dense[2] = densities(np.maximum(h, OZONE_MIDDLE))[2]
    return np.maximum(dense.T @ depth, 1e-9)


def _lit(depth, p, toward):
    """Share of sunlight that comes to places."""
    r = np.linalg.norm(p, axis=1)
    columns, seen = skylight.sun_columns(r, np.clip(p @ toward / r, -1.0, 1.0))
    return np.exp(-(columns.T @ depth)) * seen


def _phase(air, part, cosine):
    found = skylight.aerosol_phase(cosine, air.asymmetry)
    return part * skylight.rayleigh_phase(cosine) + (1.0 - part) * found


def _turned(rng, air, part, d):
    """New directions by the phase functions."""
    n, g = len(d), air.asymmetry
    u = rng.random(n)
    root = (1.0 - g * g) / (1.0 - g + 2.0 * g * u)
    cosine = (1.0 + g * g - root * root) / (2.0 * g)
    own = rng.random(n) < part
    left = np.flatnonzero(own)
    while len(left):  # by rejection
        x = rng.uniform(-1.0, 1.0, len(left))
        most = skylight.rayleigh_phase(1.0)
        keep = rng.random(len(left)) * most < skylight.rayleigh_phase(x)
        cosine[left[keep]] = x[keep]
        left = left[~keep]
    return _around(rng, d, cosine)


def _cosine(rng, up):
    return _around(rng, up, np.sqrt(rng.random(len(up))))


def _around(rng, axis, cosine):
    """Directions at an angle to axes, turned by chance."""
    other = np.where(np.abs(axis[:, :1]) < 0.5, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    x = np.cross(axis, other)
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)
    y = np.cross(axis, x)
    turn = rng.uniform(0.0, 2.0 * np.pi, len(axis))[:, None]
    s = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))[:, None]
    return s * np.cos(turn) * x + s * np.sin(turn) * y + cosine[:, None] * axis
