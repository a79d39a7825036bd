"""Scattering by spheres: Mie 1908, as in Bohren and Huffman 1983, chapter 4, in float64."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.errors import SceneError

LARGEST = 2e4  # size parameter: 1 mm of radius at 315 nm
BLOCK = 1 << 22  # numbers in the largest temporary arrays


@dataclass(frozen=True)
class Spheres:
    """Efficiencies of s spheres, (s,) float64 each, and their phase functions.

    extinction, scattering, backscattering: cross sections over the sphere's; asymmetry: the mean
    cosine. phase: (s, k) float64 [1/sr] at the requested cosines; its integral over directions is
    1.
    """

    extinction: Floats
    scattering: Floats
    backscattering: Floats
    asymmetry: Floats
    phase: Floats


def spheres(size: ArrayLike, index: ArrayLike, cosines: ArrayLike = ()) -> Spheres:
    """Return the scattering of unpolarised light by spheres.

    size: circumference over the wavelength in the host (s,); index: the sphere's over the host's
    (s,) complex, with an imaginary part from 0 up for absorption; a single number holds for all
    spheres; cosines: (k,) of the scattering angle.

    Raises SceneError for a size that is not above 0 or above LARGEST, an index whose real part is
    not above 0 or whose imaginary part is negative, and a cosine beyond -1 or 1.
    """
    x, m = np.broadcast_arrays(
        np.atleast_1d(np.asarray(size, np.float64)), np.asarray(index, np.complex128)
    )
    mu = np.asarray(cosines, np.float64)
    _check(x, m, mu)
    orders = np.ceil(x + 4.05 * np.cbrt(x) + 8.0).astype(int)
    a, b = np.zeros((2, len(x), int(orders.max(initial=1))), np.complex128)
    for some in np.array_split(np.argsort(orders), max(1, len(x) // 64)):  # of about the same size
        most = int(orders[some].max(initial=1))
        a[some, :most], b[some, :most] = _coefficients(x[some], m[some], orders[some])
    n = np.arange(1, a.shape[1] + 1)
    twice = 2.0 * n + 1.0
    extinction = 2.0 / x**2 * ((a + b).real @ twice)
    scattering = 2.0 / x**2 * ((np.abs(a) ** 2 + np.abs(b) ** 2) @ twice)
    back = np.abs((a - b) @ (twice * (-1.0) ** n)) ** 2 / x**2
    k, first, last = n[:-1], slice(None, -1), slice(1, None)
    along = (a[:, first] * a[:, last].conj() + b[:, first] * b[:, last].conj()).real
    across = (a * b.conj()).real
    g = along @ (k * (k + 2.0) / (k + 1.0)) + across @ (twice / (n * (n + 1.0)))
    asymmetry = 4.0 / x**2 * g / np.maximum(scattering, 1e-300)
    phase = _intensity(a, b, mu) / (2.0 * np.pi * x**2 * np.maximum(scattering, 1e-300))[:, None]
    return Spheres(extinction, scattering, back, asymmetry, phase)


def _check(x: Floats, m: NDArray[np.complex128], mu: Floats) -> None:
    if not (np.isfinite(x) & (x > 0.0)).all():
        raise SceneError(f"a sphere of the size {x.min():g}; it must be above 0", where="size")
    if (x > LARGEST).any():
        raise SceneError(
            f"a sphere of {x.max():.6g} wavelengths' circumference is above {LARGEST:g}: give"
            " smaller radii, or longer wavelengths",
            where="size",
        )
    if not (np.isfinite(m) & (m.real > 0.0) & (m.imag >= 0.0)).all():
        raise SceneError("must be above 0, and its k 0 or above", where="index")
    if (np.abs(mu) > 1.0).any():
        raise SceneError("must be from -1 to 1", where="cosines")


def _coefficients(
    x: Floats, m: NDArray[np.complex128], orders: NDArray[np.int_]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return a_n and b_n (s, n) of the book's (4.88), from n = 1; 0 beyond a sphere's orders."""
    most, z = int(orders.max()), m * x
    d = np.zeros((most + 1, len(x)), np.complex128)  # logarithmic derivative: downward is stable
    running = np.zeros(len(x), np.complex128)
    largest = float(np.abs(z).max())
    start = int(max(most, largest) + 8.0 * np.cbrt(largest)) + 16
    for n in range(start, 0, -1):
        ratio = n / z
        running = ratio - 1.0 / (running + ratio)
        if n - 1 <= most:
            d[n - 1] = running
    a, b = np.zeros((2, len(x), most), np.complex128)
    before, psi = np.cos(x), np.sin(x)
    chi_before, chi = -np.sin(x), np.cos(x)
    with np.errstate(over="ignore", invalid="ignore"):
        for n in range(1, most + 1):
            factor = (2.0 * n - 1.0) / x
            before, psi = psi, factor * psi - before
            chi_before, chi = chi, factor * chi - chi_before
            xi, xi_before = psi - 1j * chi, before - 1j * chi_before
            within_orders = n <= orders
            for coefficients, part in ((a, d[n] / m + n / x), (b, d[n] * m + n / x)):
                value = (part * psi - before) / (part * xi - xi_before)
                coefficients[:, n - 1] = np.where(within_orders, value, 0.0)
    return a, b


def _intensity(a: NDArray, b: NDArray, mu: Floats) -> Floats:
    """Return |S1|^2 + |S2|^2 (s, k) of the book's (4.74)."""
    intensity = np.zeros((len(a), len(mu)))
    step = max(1, BLOCK // (a.shape[1] + len(a)))
    n = np.arange(1, a.shape[1] + 1)
    weights = (2.0 * n + 1.0) / (n * (n + 1.0))
    for first in range(0, len(mu), step):
        some = mu[first : first + step]
        pi, tau = _angular(a.shape[1], some)
        # the polynomials are real: sum and difference need half of the products
        plus, minus = (weights * (a + b)) @ (pi + tau), (weights * (a - b)) @ (pi - tau)
        intensity[:, first : first + step] = 0.5 * (np.abs(plus) ** 2 + np.abs(minus) ** 2)
    return intensity


def _angular(orders: int, mu: Floats) -> tuple[Floats, Floats]:
    """Return pi_n and tau_n (n, k) of the book's (4.47), from n = 1."""
    pi, tau = np.zeros((2, orders, len(mu)))
    before, now = np.zeros_like(mu), np.ones_like(mu)
    for n in range(1, orders + 1):
        pi[n - 1], tau[n - 1] = now, n * mu * now - (n + 1.0) * before
        before, now = now, ((2.0 * n + 1.0) * mu * now - (n + 1.0) * before) / n
    return pi, tau
