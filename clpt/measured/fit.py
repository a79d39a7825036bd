"""The Measurement of any reflection function f, by the method of Dupuy and Jakob 2018.

Retroreflection determines the distribution of microfacets (Dupuy et al. 2015): f(w, w) cos(w) =
ndf(w) / (4 sigma(w)) up to a factor. sigma is an integral of ndf, so that ndf is the eigenvector of
a matrix that is not negative. The visible normals follow from ndf; f is stored over the square that
they warp.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.measured.measurement import Measurement

# f(wo, wi) [1/sr] of unit directions (n, 3), z along the normal, wo to the viewer: (n, colours)
Reflection = Callable[[Floats, Floats], NDArray]
STEPS = 64  # of the power iteration
FEWEST = 64  # azimuths of the integral of ndf


@dataclass(frozen=True)
class Warp:
    """A density of integral 1, values (..., rows, columns), and its integrals.

    across: (..., rows, columns), integrals along a row up to each column, in steps of columns;
    down: (..., rows), integrals over the rows before; the last is 1.
    """

    values: Floats
    across: Floats
    down: Floats


def warp(values: ArrayLike) -> Warp:
    """Return the warp of values from 0 up; a table of zeros becomes uniform.

    The warp takes uniform points of the unit square to a bilinear density. A table is (..., rows,
    columns): x goes over the columns, y over the rows. Its leading axes are parameters; density and
    warp are linear in them (Dupuy and Jakob 2018, section 4.2).
    """
    density = np.asarray(values, np.float64)
    density = np.where((density > 0.0).any(axis=(-2, -1), keepdims=True), density, 1.0)
    across = _running(density)
    down = _running(across[..., -1])
    whole = down[..., -1:]
    return Warp(density / whole[..., None], across / whole[..., None], down / whole)


def _running(values: Floats) -> Floats:
    steps = np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]), axis=-1)
    return np.concatenate([np.zeros_like(values[..., :1]), steps], axis=-1)


def bilinear(table: Floats, x: Floats, y: Floats) -> Floats:
    """Return values (..., n) of a table (..., rows, columns) at points (n,) of the unit square."""
    (column, s), (row, t) = _cell(x, table.shape[-1]), _cell(y, table.shape[-2])
    upper = table[..., row, column] * (1.0 - s) + table[..., row, column + 1] * s
    lower = table[..., row + 1, column] * (1.0 - s) + table[..., row + 1, column + 1] * s
    return upper * (1.0 - t) + lower * t


def _cell(x: Floats, nodes: int) -> tuple[NDArray[np.int64], Floats]:
    at = np.clip(x, 0.0, 1.0) * (nodes - 1)
    cell = np.minimum(at.astype(np.int64), nodes - 2)
    return cell, at - cell


def sample(of: Warp, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
    """Warp points (n,) of the unit square by a single table; return x, y and their density."""
    rows, columns = of.values.shape
    row = np.clip(np.searchsorted(of.down, v, "right") - 1, 0, rows - 2)
    ends = of.across[row, -1], of.across[row + 1, -1]
    t = _linear((v - of.down[row]) / _above(of.down[row + 1] - of.down[row]), *ends)
    sums = of.across[row] * (1.0 - t)[:, None] + of.across[row + 1] * t[:, None]
    left = u * sums[:, -1]
    column = np.clip((sums <= left[:, None]).sum(axis=1) - 1, 0, columns - 2)
    pick = np.arange(len(row))
    near = of.values[row] * (1.0 - t)[:, None] + of.values[row + 1] * t[:, None]
    below, above = sums[pick, column], sums[pick, column + 1]
    a, b = near[pick, column], near[pick, column + 1]
    s = _linear((left - below) / _above(above - below), a, b)
    density = (a + s * (b - a)) * (rows - 1) * (columns - 1)
    return (column + s) / (columns - 1), (row + t) / (rows - 1), density


def _linear(u: Floats, a: Floats, b: Floats) -> Floats:
    """Return x with density proportional to a (1 - x) + b x."""
    u = np.clip(u, 0.0, 1.0)
    root = np.sqrt(a * a + u * (b * b - a * a))
    return np.where(a + root > 0.0, u * (a + b) / _above(a + root), u)


def _above(x: Floats) -> Floats:
    return np.maximum(x, 1e-300)


def fit(
    f: Reflection,
    wavelengths: Sequence[float] = (),
    *,
    theta_i: ArrayLike | None = None,
    phi_i: ArrayLike = (0.0,),
    normals: int = 64,
    size: int = 32,
    description: str = "",
) -> Measurement:
    """Return the measurement of a reflection.

    wavelengths: [nm] of the colours of f; empty for red, green and blue. theta_i, phi_i: of the
    viewers [rad]. By default 8 thetas from 0 to 80 degrees and a single azimuth, for an isotropic
    f; otherwise azimuths from -pi on, over the circle, its half or its quarter. normals, size: rows
    and columns of the tables of facets, and of f. Raises SceneError.
    """
    theta = np.radians(80.0) * np.linspace(0.0, 1.0, 8) if theta_i is None else theta_i
    thetas, phis = np.asarray(theta, np.float64), np.asarray(phi_i, np.float64)
    isotropic = len(phis) <= 2
    x, y = grid(normals, normals)
    m = direction(x, y)
    ndf, sigma = _facets(f, m, area(x), normals, isotropic)
    vndf = np.empty((len(phis), len(thetas), normals, normals))
    spectra = np.empty((len(phis), len(thetas), len(wavelengths) or 3, size, size))
    for i, phi in enumerate(phis):
        for j, theta in enumerate(thetas):
            wo = spherical(theta, phi)
            turned = _turned(m, phi) if isotropic else m
            seen = ndf.ravel() * np.maximum(turned @ wo, 0.0) * area(x)
            vndf[i, j] = seen.reshape(normals, normals)
            spectra[i, j] = _over_square(f, wo, phi * isotropic, vndf[i, j], ndf, sigma, size)
    vndf = warp(vndf).values * (normals - 1) ** 2
    luminance = spectra.mean(axis=2)
    luminance /= np.maximum(luminance.mean(axis=(-2, -1), keepdims=True), 1e-30)
    return Measurement(
        phi_i=phis, theta_i=thetas, ndf=ndf, sigma=sigma, vndf=vndf, luminance=luminance,
        spectra=spectra, wavelengths=np.asarray(wavelengths), description=description,
    )  # fmt: skip


def hemispherical(measurement: Measurement) -> Floats:
    """Return the reflectance (colours,) towards the first viewer; at most 1.

    It is the mean of f cos(theta) over the density of light mirrored at visible normals.
    """
    count = measurement.luminance.shape[-1]
    at = (np.arange(2 * count) + 0.5) / (2 * count)
    v, u = (axis.ravel() for axis in np.meshgrid(at, at, indexing="ij"))
    x, y, density = sample(warp(measurement.vndf[0, 0]), u, v)
    wo = spherical(measurement.theta_i[0], measurement.phi_i[0])
    m = _turned(direction(x, y), float(measurement.phi_i[0]) * measurement.isotropic)
    values = bilinear(measurement.spectra[0, 0], u, v)
    if measurement.jacobian:
        facets = bilinear(measurement.ndf, x, y) / 4.0
        values = values * facets / bilinear(measurement.sigma, *_square(wo[None]))
    solid = np.maximum(area(x), 1e-6) * 4.0 * np.maximum(m @ wo, 0.0)
    share = values * solid / np.maximum(density, 1e-30)
    return np.minimum(share.mean(axis=1), 1.0)


@cache
def grey() -> Measurement:
    """Return the measurement of a matt surface that reflects half of all light."""
    even = np.full(3, 0.5 / np.pi)
    return fit(lambda wo, wi: np.broadcast_to(even, wi.shape), normals=24, size=16)


def _over_square(
    f: Reflection, wo: Floats, turn: float, vndf: Floats, ndf: Floats, sigma: Floats, size: int
) -> Floats:
    """Return 4 sigma f cos(theta) / ndf at a grid of the warped square, (colours, size, size)."""
    u, v = grid(size, size)
    x, y, _ = sample(warp(vndf), u, v)
    m = _turned(direction(x, y), turn)
    wi = 2.0 * (m @ wo)[:, None] * m - wo
    good = (wi[:, 2] > 0.0) & (m @ wo > 0.0)
    values = np.where(good[:, None], f(np.broadcast_to(wo, wi.shape), wi), 0.0)
    values = values * np.maximum(wi[:, 2:], 0.0)
    if not np.isfinite(values).all() or (values < 0.0).any():
        raise SceneError("the reflection to measure is negative or not finite")
    there = _square(wo[None])
    density = bilinear(ndf, x, y) / (4.0 * bilinear(sigma, *there))
    ratio = np.divide(values, density[:, None], np.zeros_like(values), where=density[:, None] > 0)
    return ratio.T.reshape(-1, size, size)


def _facets(
    f: Reflection, m: Floats, solid: Floats, n: int, isotropic: bool
) -> tuple[Floats, Floats]:
    """Return the distribution of facets [1/sr] and its projected areas, (n, n), at directions m.

    solid: solid angle over area of the square at m.
    """
    weight = solid / (n - 1) ** 2 * _ends(n)
    if isotropic:  # a single row of directions; the integral covers the square
        rows = slice(0, n)
        at = spherical(0.5 * np.pi * np.linspace(0.0, 1.0, n) ** 2, 0.0)
        fold = np.tile(np.eye(n), (n, 1))
    else:
        rows = slice(0, n * n)
        at, fold = m, np.eye(n * n)
    at = at[rows].copy()
    at[:, 2] = np.maximum(at[:, 2], 1e-3)  # the horizon reflects nothing
    at /= np.linalg.norm(at, axis=1, keepdims=True)
    back = np.asarray(f(at, at), np.float64).mean(axis=1) * at[:, 2]
    back *= np.isfinite(back)
    if not (back > 0.0).any():
        raise SceneError("nothing is sent back to where light comes from: it cannot be measured")
    kernel = (np.maximum(at @ m.T, 0.0) * weight) @ fold
    ndf = np.ones(len(at))
    for _ in range(STEPS):
        ndf = back * (kernel @ ndf)
        ndf /= ndf.max()
    sigma = kernel @ ndf
    ndf = np.tile(ndf, (n, 1)) if isotropic else ndf.reshape(n, n)
    sigma = np.tile(sigma, (n, 1)) if isotropic else sigma.reshape(n, n)
    flat = (weight * ndf.ravel()) @ m[:, 2]  # the facets' areas seen from above are 1
    return ndf / flat, sigma / flat


def grid(rows: int, columns: int) -> tuple[Floats, Floats]:
    """Return corners x, y (rows * columns,) of cells of the unit square."""
    y, x = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
    return x.ravel(), y.ravel()


def _ends(n: int) -> Floats:
    """Return weights (n * n,) of the trapezoidal rule."""
    edge = np.where((np.arange(n) == 0) | (np.arange(n) == n - 1), 0.5, 1.0)
    return np.outer(edge, edge).ravel()


def area(x: Floats) -> Floats:
    """Return solid angle [sr] over area of the square at x."""
    return 2.0 * np.pi**2 * x * np.sin(0.5 * np.pi * x * x)


def direction(x: Floats, y: Floats) -> Floats:
    """Return the directions (n, 3) at points of the square."""
    return spherical(0.5 * np.pi * x * x, (2.0 * y - 1.0) * np.pi)


def _square(w: Floats) -> tuple[Floats, Floats]:
    """Return the points of the square at directions (n, 3)."""
    theta = np.arctan2(np.hypot(w[:, 0], w[:, 1]), w[:, 2])
    phi = np.arctan2(w[:, 1], w[:, 0])
    return np.sqrt(theta * 2.0 / np.pi), (phi + np.pi) / (2.0 * np.pi)


def spherical(theta: ArrayLike, phi: ArrayLike) -> Floats:
    theta, phi = np.broadcast_arrays(np.asarray(theta, float), np.asarray(phi, float))
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)


def _turned(w: Floats, phi: float) -> Floats:
    """Return directions (n, 3) turned about z."""
    c, s = np.cos(phi), np.sin(phi)
    return w @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
