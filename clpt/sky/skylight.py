"""Radiance of the sky: sunlight scattered once along each ray, and all further orders.

Light scattered once is integrated along each ray. All higher orders are a field: its moments in
spherical harmonics up to DEGREE, at heights and sun angles around the observer. Air needs no higher
degree, haze hardly. The field is computed in orders of scattering, along rays from these points.
The ground is diffuse. Lengths are in km, radiance is per irradiance of the sun above the air
[1/sr]. `clpt.spectra.air` has the air's constituents. Rays are straight. docs/sky.md
and tests/sky compare it with random walks of light.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.spectra.air import DEPOLARISED, EARTH, LAMBDAS, Atmosphere, densities

TOP = EARTH + 100.0  # radius of the top of the air
NODES = 32  # of a column to the top
DEGREE = 5  # of the harmonics
HEIGHTS = np.array([0, 0.5, 1.5, 3, 6, 10, 16, 23, 32, 45, 60, 99.0])  # [km]
AROUND, BETWEEN = 15.0, 2.5  # sun angles [degrees]: range on either side of the observer's, step
DUSK, AT_DUSK = 89.0, 1.25  # light falls off fast beyond this sun angle; the step there [degrees]
SIDE_ANGLES, TURNS = 6, 6  # directions at a point: on each side of the horizon, around
FAR_NODES, VIEW_NODES = 8, 24  # quadrature points of a ray: from the field, from the observer
COARSE = np.array([360, 390, 420, 460, 500, 550, 575, 603, 640, 700, 830.0])  # [nm], of the field
HAZY = 12.0  # the field has haze below this height [km]
CORNERS = ((0, 0), (0, 1), (1, 0), (1, 1))  # of a cell
PIECE = 4096  # points per block
ORDERS, ENOUGH = 24, 1e-3  # most orders; the last order's share of the light that ends them


def to_top(radius: Floats, cosine: Floats) -> Floats:
    """Return distances to the top [km] of rays from a radius, with a cosine to the vertical."""
    square = np.maximum(TOP**2 - radius**2 * (1.0 - cosine**2), 0.0)
    return np.maximum(np.sqrt(square) - radius * cosine, 0.0)


def columns(radius: ArrayLike, cosine: ArrayLike) -> Floats:
    """Return columns (3, ...) from a radius [km] to the top, over the vertical columns at the sea.

    cosine: to the vertical, 0 to 1.
    """
    r, mu = np.broadcast_arrays(np.asarray(radius, np.float64), np.asarray(cosine, np.float64))
    x, w = np.polynomial.legendre.leggauss(NODES)
    x, w = 0.5 + 0.5 * x, 0.5 * w
    far, total = to_top(r, mu), np.zeros((3, *r.shape))
    for u, weight in zip(x, w, strict=True):
        t = far * u**3
        height = np.sqrt(r * r + t * t + 2.0 * r * mu * t) - EARTH
        total += densities(height) * (weight * 3.0 * u * u * far)
    return total


def sun_columns(radius: ArrayLike, cosine: ArrayLike) -> tuple[Floats, NDArray[np.bool_]]:
    """Return columns (3, ...) toward the sun, and whether the earth leaves it visible.

    cosine: of the sun's direction to the vertical, -1 to 1.
    """
    r, mu = np.broadcast_arrays(np.asarray(radius, np.float64), np.asarray(cosine, np.float64))
    nearest = r * np.sqrt(np.maximum(1.0 - mu * mu, 0.0))
    seen = (mu >= 0.0) | (nearest > EARTH)
    depths = columns(r, np.abs(mu))
    past = (mu < 0.0) & seen
    if past.any():
        depths[:, past] = 2.0 * columns(nearest[past], np.zeros(int(past.sum()))) - depths[:, past]
    return depths, seen


def rayleigh_phase(cosine: ArrayLike) -> Floats:
    """Phase function of air [1/sr] (Chandrasekhar 1960, with its depolarisation)."""
    square = np.asarray(cosine, np.float64) ** 2
    g = DEPOLARISED
    return 3.0 / (16.0 * np.pi * (1.0 + 2.0 * g)) * ((1.0 + 3.0 * g) + (1.0 - g) * square)


def aerosol_phase(cosine: ArrayLike, g: float) -> Floats:
    """Henyey and Greenstein's phase function [1/sr]."""
    below = 1.0 + g * g - 2.0 * g * np.asarray(cosine, np.float64)
    return (1.0 - g * g) / (4.0 * np.pi * below**1.5)


class Air(NamedTuple):
    """The air at n wavelengths.

    Vertical optical depths: extinct (3, n), scatter (2, n); moments of both phase functions
    (2, DEGREE + 1); asymmetry: g of the aerosol.
    """

    extinct: Floats
    scatter: Floats
    moments: Floats
    asymmetry: float


def air(contents: Atmosphere, lambdas: Floats) -> Air:
    extinct, gamma = contents.depths(lambdas), DEPOLARISED
    rayleigh = np.zeros(DEGREE + 1)
    rayleigh[0], rayleigh[2] = 1.0, (1.0 - gamma) / (10.0 * (1.0 + 2.0 * gamma))
    moments = np.stack([rayleigh, contents.asymmetry ** np.arange(DEGREE + 1)])
    scatter = np.stack([extinct[0], contents.aerosol_albedo * extinct[1]])
    return Air(extinct, scatter, moments, contents.asymmetry)


class Rays(NamedTuple):
    """Quadrature points on rays, grouped by ray.

    ray (m,): the point's ray; t (m,): its distance [km]; weight (m,): its length of the ray [km];
    columns (3, m): from the ray's start; ground (n,): distance of the ground, or -1; below (3, n):
    columns to the ground.
    """

    ray: NDArray[np.int64]
    t: Floats
    weight: Floats
    columns: Floats
    ground: Floats
    below: Floats


def rays(radius: Floats, mu: Floats, count: int, after: Floats | None = None) -> Rays:
    """Return points on rays from radii (n,) [km] with cosines (n,) to the vertical.

    They are dense near a ray's lowest point. after (n,): the distance where the integral along a
    rising ray begins.
    """
    lowest = np.maximum(radius * np.sqrt(np.maximum(1.0 - mu * mu, 0.0)), 0.0)
    down = mu < 0.0
    hits = down & (lowest < EARTH)
    turn = np.where(down, -radius * mu, 0.0)
    ground = np.where(hits, turn - np.sqrt(np.maximum(EARTH**2 - lowest**2, 0.0)), -1.0)
    end = np.where(down, turn + np.sqrt(TOP**2 - lowest**2), to_top(radius, mu))
    low = np.where(hits, np.maximum(ground, 0.0), turn)
    low = low if after is None else np.maximum(low, after)
    x, w = np.polynomial.legendre.leggauss(count)
    u, w = (0.5 + 0.5 * x)[None], (0.5 * w)[None]
    rise, fall = np.where(hits, 0.0, np.maximum(end - low, 0.0)), np.where(down, low, 0.0)
    t = np.concatenate(
        [low[:, None] - fall[:, None] * u[:, ::-1] ** 3, low[:, None] + rise[:, None] * u**3], 1
    )
    weight = 3.0 * np.concatenate(
        [fall[:, None] * (w * u * u)[:, ::-1], rise[:, None] * (w * u * u)], 1
    )
    ray, at = np.nonzero(weight > 0.0)
    t, weight = t[ray, at], weight[ray, at]
    start = columns(radius, np.abs(mu))
    r, cosine = _along(radius[ray], mu[ray], t)
    there = columns(r, np.abs(cosine))
    middle = np.zeros_like(start)
    passing = down & ~hits
    middle[:, passing] = 2.0 * columns(lowest[passing], np.zeros(int(passing.sum())))
    rising = cosine >= 0.0
    depths = np.where(
        down[ray],
        np.where(rising, middle[:, ray] - there, there) - start[:, ray],
        start[:, ray] - there,
    )
    slope = np.sqrt(np.maximum(1.0 - (lowest / EARTH) ** 2, 0.0))
    below = np.where(hits, columns(np.full_like(slope, EARTH), slope) - start, 0.0)
    return Rays(ray, t, weight, np.maximum(depths, 0.0), ground, np.maximum(below, 0.0))


def _along(radius: Floats, mu: Floats, t: Floats) -> tuple[Floats, Floats]:
    """Return radius and cosine to the vertical at a distance along rays."""
    r = np.sqrt(np.maximum(radius * radius + t * t + 2.0 * radius * mu * t, EARTH**2))
    return r, np.clip((radius * mu + t) / r, -1.0, 1.0)


def harmonics(mu: Floats, turn: Floats) -> Floats:
    """Return real spherical harmonics that are even in azimuth, (k, ...), at cosines (...).

    They are ordered by degree, then by order from 0.
    """
    s = np.sqrt(np.maximum(1.0 - mu * mu, 0.0))
    legendre: dict[tuple[int, int], Floats] = {(0, 0): np.ones_like(mu)}
    for m in range(DEGREE + 1):
        if m:
            legendre[m, m] = (2 * m - 1) * s * legendre[m - 1, m - 1]
        if m < DEGREE:
            legendre[m + 1, m] = (2 * m + 1) * mu * legendre[m, m]
        for n in range(m + 2, DEGREE + 1):
            above = (2 * n - 1) * mu * legendre[n - 1, m] - (n + m - 1) * legendre[n - 2, m]
            legendre[n, m] = above / (n - m)
    cosines = [np.ones_like(mu), turn]
    for _ in range(2, DEGREE + 1):
        cosines.append(2.0 * turn * cosines[-1] - cosines[-2])
    out = []
    for n in range(DEGREE + 1):
        for m in range(n + 1):
            ratio = np.prod(np.arange(n - m + 1, n + m + 1, dtype=np.float64))
            norm = np.sqrt((2 * n + 1) / (4.0 * np.pi) / ratio * (2.0 if m else 1.0))
            out.append(norm * legendre[n, m] * cosines[m])
    return np.stack(out)


DEGREES = np.array([n for n in range(DEGREE + 1) for _ in range(n + 1)])  # of each harmonic


class Places(NamedTuple):
    """Points on rays, each value (m,).

    height [km]; cosines: sun and mu, of the sun and the ray to the vertical; turn, of the azimuth
    between them; angle, between the ray and the sun.
    """

    height: Floats
    sun: Floats
    mu: Floats
    turn: Floats
    angle: Floats


def places(radius: Floats, sun: Floats, mu: Floats, turn: Floats, t: Floats) -> Places:
    """Return points (m,) at distances t along rays with a start radius, sun and direction."""
    across, side = np.sqrt(1.0 - np.minimum(mu * mu, 1.0)), np.sqrt(1.0 - np.minimum(sun * sun, 1))
    angle = np.clip(mu * sun + across * side * turn, -1.0, 1.0)
    r, ray_cosine = _along(radius, mu, t)
    there = np.clip((radius * sun + t * angle) / r, -1.0, 1.0)
    below = np.sqrt(
        np.maximum(1.0 - ray_cosine * ray_cosine, 0.0) * np.maximum(1.0 - there * there, 0.0)
    )
    turned = np.where(below > 1e-9, (angle - ray_cosine * there) / np.maximum(below, 1e-9), 1.0)
    return Places(r - EARTH, there, ray_cosine, np.clip(turned, -1.0, 1.0), angle)


def once(a: Air, way: Rays, at: Places, count: int) -> Floats:
    """Return sunlight scattered once into rays, (count, n) [1/sr]."""
    toward, seen = sun_columns(at.height + EARTH, at.sun)
    out = np.zeros((count, a.extinct.shape[1]))
    kept = np.flatnonzero(seen)
    if not len(kept):
        return out
    depth = (way.columns + toward)[:, kept].T @ a.extinct
    dense = densities(at.height[kept]) * way.weight[kept]
    angle = at.angle[kept]
    haze = aerosol_phase(angle, a.asymmetry)
    phases = dense[:2] * np.stack([rayleigh_phase(angle), haze])
    _add(out, way.ray[kept], np.exp(-depth) * (phases.T @ a.scatter))
    return out


def _add(out: Floats, ray: NDArray[np.int64], values: Floats) -> None:
    """Add up values (m, n) at the points of each ray."""
    first = np.flatnonzero(np.diff(ray, prepend=-1))
    out[ray[first]] += np.add.reduceat(values, first, axis=0)


class Plan(NamedTuple):
    """Interpolation of a field of light at points on rays, float32.

    corners, shares: 4 of (m,), of the cell around each point; harmonics: the numbers of the used
    harmonics; look (m, 1, harmonics): their values in the ray's direction, times the phase
    function's moments; weights (m, n): scattering times transmittance to the ray's start.
    """

    ray: NDArray[np.int64]
    corners: list[NDArray[np.int64]]
    shares: list[NDArray[np.float32]]
    harmonics: NDArray[np.int64]
    look: NDArray[np.float32]
    weights: NDArray[np.float32]


def plans(a: Air, angles: Floats, way: Rays, at: Places) -> list[Plan]:
    """Return the interpolation of a field of sun angles at points on rays: for air, then haze."""
    dense = densities(at.height)[:2] * way.weight
    h, x = _between(HEIGHTS, at.height)
    s, y = _between(angles, np.arccos(at.sun))
    share = np.exp(-(way.columns.T @ a.extinct))
    look = harmonics(at.mu, at.turn)
    reading_plans = []
    for kind, low in enumerate((at.height < TOP, at.height < HAZY)):
        selected = np.flatnonzero(low)
        seen = np.flatnonzero(a.moments[kind][DEGREES] != 0.0)
        if not (len(selected) and a.scatter[kind].any()):
            continue
        by = [
            (i, j, x[selected] if i else 1.0 - x[selected], y[selected] if j else 1.0 - y[selected])
            for i, j in CORNERS
        ]
        shown = (look[seen][:, selected] * a.moments[kind][DEGREES[seen], None]).T[:, None]
        reading_plans.append(
            Plan(
                way.ray[selected],
                [(h[selected] + i) * len(angles) + s[selected] + j for i, j, _, _ in by],
                [(u * v).astype(np.float32) for _, _, u, v in by],
                seen,
                np.ascontiguousarray(shown, np.float32),
                (share[selected] * dense[kind, selected, None] * a.scatter[kind]).astype(
                    np.float32
                ),
            )
        )
    return reading_plans


class Field(NamedTuple):
    """Moments of the scattered radiance, and its irradiance of the ground.

    angles: of the sun to the vertical [rad], ascending; moments (heights, angles, harmonics, n);
    ground (angles, n).
    """

    angles: Floats
    moments: Floats
    ground: Floats

    def scattered(self, seen: list[Plan], count: int) -> Floats:
        """Return this field's light scattered into rays, (count, n)."""
        out = np.zeros((count, self.moments.shape[-1]))
        for plan in seen:
            flat = self.moments[:, :, plan.harmonics].astype(np.float32)
            flat = flat.reshape(-1, *flat.shape[2:])
            for first in range(0, len(plan.ray), PIECE):
                piece = slice(first, first + PIECE)
                there = np.zeros((1, 1, 1), np.float32)
                for i, w in zip(plan.corners, plan.shares, strict=True):
                    there = there + w[piece, None, None] * flat[i[piece]]
                value = np.matmul(plan.look[piece], there)[:, 0] * plan.weights[piece]
                _add(out, plan.ray[piece], value.astype(np.float64))
        return np.maximum(out, 0.0)

    def reflected(
        self, a: Air, way: Rays, sun: Floats, albedo: Floats, mu: Floats, turn: Floats, r: Floats
    ) -> Floats:
        """Return the ground's light along rays; sun, mu, turn, r (n,): at the rays' starts."""
        hit = way.ground >= 0.0
        out = np.zeros((len(hit), a.extinct.shape[1]))
        if not hit.any():
            return out
        at = places(r[hit], sun[hit], mu[hit], turn[hit], way.ground[hit])
        cosine = np.maximum(at.sun, 0.0)
        toward = columns(np.full(len(cosine), EARTH), cosine)
        direct = np.exp(-(toward.T @ a.extinct)) * cosine[:, None]
        s, y = _between(self.angles, np.arccos(at.sun))
        around = self.ground[s] * (1.0 - y)[:, None] + self.ground[s + 1] * y[:, None]
        out[hit] = albedo / np.pi * (direct + around) * np.exp(-(way.below[:, hit].T @ a.extinct))
        return out


def _between(grid: Floats, x: Floats) -> tuple[NDArray[np.int64], Floats]:
    """Return each value's cell of a grid, and its fraction of the cell, 0 to 1."""
    i = np.clip(np.searchsorted(grid, x, "right") - 1, 0, len(grid) - 2)
    return i, np.clip((x - grid[i]) / (grid[i + 1] - grid[i]), 0.0, 1.0)


def _places_around(sun: float) -> Floats:
    """Return angles of the sun to the vertical (n,) around `sun` [rad]."""
    low = max(np.degrees(sun) - AROUND, 0.0)
    high = min(np.degrees(sun) + AROUND, 180.0)
    apart = BETWEEN if np.degrees(sun) < DUSK else AT_DUSK
    return np.asarray(np.radians(np.linspace(low, high, int(np.ceil((high - low) / apart)) + 1)))


def _heights_of_directions(radii: Floats) -> tuple[Floats, Floats]:
    """Return cosines to the vertical, and their weights, above and below the horizon at radii."""
    x, w = np.polynomial.legendre.leggauss(SIDE_ANGLES)
    horizon = -np.sqrt(1.0 - (EARTH / radii) ** 2)
    mu = np.concatenate(
        [
            horizon[:, None] + (1.0 - horizon)[:, None] * (0.5 + 0.5 * x) ** 2,
            horizon[:, None] - (1.0 + horizon)[:, None] * (0.5 + 0.5 * x) ** 2,
        ],
        axis=1,
    )
    each = w * (0.5 + 0.5 * x)
    span = np.concatenate(
        [(1.0 - horizon)[:, None] * each, (1.0 + horizon)[:, None] * each], axis=1
    )
    return mu, span


def field(a: Air, albedo: Floats, sun: float) -> Field:
    """Return all orders of scattered light; sun: its zenith angle [rad]; albedo (n,): ground."""
    angles = _places_around(sun)
    turns = np.cos(np.pi * (np.arange(TURNS) + 0.5) / TURNS)
    radii = np.maximum(HEIGHTS, 1e-3) + EARTH
    mu, span = _heights_of_directions(radii)
    shape = (len(radii), len(angles), 2 * SIDE_ANGLES, TURNS)
    template = rays(np.repeat(radii, 2 * SIDE_ANGLES), mu.ravel(), FAR_NODES)
    number = np.arange(len(radii) * 2 * SIDE_ANGLES).reshape(len(radii), 1, -1, 1)
    way = _spread(template, np.broadcast_to(number, shape).ravel())
    starts = (
        radii[:, None, None, None],
        np.cos(angles)[:, None, None],
        mu[:, None, :, None],
        turns,
    )
    radius, suns, cosines, turned = (np.broadcast_to(v, shape).ravel() for v in starts)
    at = places(radius[way.ray], suns[way.ray], cosines[way.ray], turned[way.ray], way.t)
    count, bands = radius.size, a.extinct.shape[1]
    single, seen = once(a, way, at, count), plans(a, angles, way, at)
    look = harmonics(cosines, turned).reshape(-1, *shape)
    solid = np.broadcast_to((span * 2.0 * np.pi / TURNS)[:, None, :, None], shape)
    above = np.maximum(mu[0], 0.0)[None, :, None, None] * solid[0][..., None]
    light_field = Field(
        angles,
        np.zeros((len(radii), len(angles), len(look), bands)),
        np.zeros((len(angles), bands)),
    )
    for _ in range(ORDERS):
        light = single + light_field.scattered(seen, count)
        light += light_field.reflected(a, way, suns, albedo, cosines, turned, radius)
        light = light.reshape(*shape, bands)
        moments = np.einsum("kpsdt,psdt,psdtn->pskn", look, solid, light, optimize=True)
        ground = (light[0] * above).sum(axis=(1, 2))
        change = np.abs(moments - light_field.moments).max()
        light_field = Field(angles, moments, ground)
        if change <= ENOUGH * np.abs(moments).max():
            break
    return light_field


def _spread(template: Rays, source: NDArray[np.int64]) -> Rays:
    """Return the rays of numbers (n,) of `template`; a ray may repeat."""
    total = len(template.ground)
    first, each = (
        np.searchsorted(template.ray, np.arange(total)),
        np.bincount(template.ray, minlength=total),
    )
    counts = each[source]
    ray = np.repeat(np.arange(len(source)), counts)
    inside = np.arange(len(ray)) - np.repeat(np.cumsum(counts) - counts, counts)
    pick = np.repeat(first[source], counts) + inside
    return Rays(
        ray, template.t[pick], template.weight[pick], template.columns[:, pick],
        template.ground[source], template.below[:, source],
    )  # fmt: skip


def radiance(
    contents: Atmosphere,
    albedo: Floats,
    sun: float,
    height: float,
    mu: Floats,
    turn: Floats,
    lambdas: Floats = LAMBDAS,
) -> Floats:
    """Return radiance of sky and ground per irradiance of the sun, (n, m) [1/sr] at lambdas (m,).

    albedo (m,): of the ground; sun: its angle to the vertical [rad]; height: of the observer [km];
    mu, turn (n,): cosines of the directions' angle to the vertical and azimuth from the sun.
    """
    coarse = COARSE[(lambdas.min() <= COARSE) & (lambdas.max() >= COARSE)]
    coarse = coarse if len(coarse) > 1 and len(lambdas) > len(coarse) else lambdas
    dim = air(contents, coarse)
    low = np.interp(coarse, lambdas, albedo)
    light_field = field(dim, low, sun)
    radius, suns = np.full(len(mu), EARTH + height), np.full(len(mu), np.cos(sun))
    steep, which = np.unique(mu, return_inverse=True)
    way = _spread(rays(radius[: len(steep)], steep, VIEW_NODES // 2), which)
    at = places(radius[way.ray], suns[way.ray], mu[way.ray], turn[way.ray], way.t)
    further = light_field.scattered(plans(dim, light_field.angles, way, at), len(mu))
    further += light_field.reflected(dim, way, suns, low, mu, turn, radius)
    fine = air(contents, lambdas)
    way = rays(radius, mu, VIEW_NODES, _shadow(radius, suns, mu, turn))
    at = places(radius[way.ray], suns[way.ray], mu[way.ray], turn[way.ray], way.t)
    return once(fine, way, at, len(mu)) + _refined(further, coarse, lambdas)


def _refined(values: Floats, coarse: Floats, lambdas: Floats) -> Floats:
    """Return values (n, k) at coarse wavelengths interpolated to lambdas (n, m), by logarithms."""
    if len(coarse) == len(lambdas):
        return values
    i, x = _between(coarse, lambdas)
    logs = np.log(np.maximum(values, 1e-30))
    return np.exp(logs[:, i] * (1.0 - x) + logs[:, i + 1] * x)


def _shadow(radius: Floats, sun: Floats, mu: Floats, turn: Floats) -> Floats:
    """Return distances along rising rays to the end of the earth's shadow [km]; 0 outside of it."""
    across, side = np.sqrt(1.0 - np.minimum(mu * mu, 1.0)), np.sqrt(1.0 - np.minimum(sun * sun, 1))
    angle = mu * sun + across * side * turn
    inside = (sun < 0.0) & (radius * side < EARTH) & (mu >= 0.0)
    a = np.maximum(1.0 - angle * angle, 1e-12)
    b, c = radius * (mu - sun * angle), (radius * side) ** 2 - EARTH**2
    out = (-b + np.sqrt(np.maximum(b * b - a * c, 0.0))) / a
    lit = radius * sun + out * angle >= 0.0  # toward the sun, beyond the shadow's end
    out = np.where(lit, np.minimum(out, -radius * sun / np.maximum(angle, 1e-9)), out)
    return np.where(inside, np.maximum(out, 0.0), 0.0)
