"""Media of small spheres, far from each other (fog, mist, milk), and scattering by a sphere.

A sphere scatters by Mie 1908, as in Bohren and Huffman 1983, chapter 4, in float64. The index of
water is by IAPWS 1997, release on the refractive index of ordinary water.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import spectra
from clpt.arrays import Floats, number
from clpt.choices import DROP_SIZES
from clpt.errors import SceneError
from clpt.scene.media import Homogeneous
from clpt.scene.phases import Tabulated
from clpt.spectra import Spectrum

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


DENSE = 0.1  # share of the volume above which spheres do not scatter independently
WATER = "water"
EVEN, FINE = 721, 100  # angles from 0 to 180 degrees, and further angles near each end
BEYOND = 1e-6  # share of the cross sections that is cut off at each end
WIDEST = 2.0  # of `spread`: measured laws are narrower
RANGE = (200.0, 1900.0)  # [nm] within which the release holds
A = (
    0.244257733, 9.74634476e-3, -3.73234996e-3, 2.68678472e-4,
    1.58920570e-3, 2.45934259e-3, 0.900704920, -1.66626219e-2,
)  # fmt: skip
ULTRAVIOLET, INFRARED = 0.2292020, 5.432937


@dataclass(frozen=True)
class Sizes:
    """Radii (s,) float64 [m], ascending, and the share of the spheres at each radius (s,)."""

    radii: NDArray[np.float64]
    shares: NDArray[np.float64]

    def mean(self, power: int) -> float:
        """Return the mean of a power of the radius [m^power]."""
        return float(self.shares @ self.radii**power)


def sizes(law: str, radius: float, spread: float = 0.0, count: int = 200) -> Sizes:
    """Return radii and shares of a law of sizes.

    law: "mono", all have `radius` [m]; "log_normal": `radius` is the median, `spread` the standard
    deviation of the radius's logarithm; "gamma": `radius` and `spread` are the effective radius and
    the effective variance of Hansen and Travis 1974, so that shares go as
    r^(1 / spread - 3) exp(-r / (radius spread)). count: of radii.

    Raises SceneError for another law, and for numbers outside the law's range.
    """
    if law not in DROP_SIZES:
        raise SceneError(f"{law!r} is none of {', '.join(DROP_SIZES)}", where="law")
    if not (np.isfinite(radius) and radius > 0.0):
        raise SceneError(f"{radius:g} m; it must be above 0", where="radius")
    if law == "mono":
        return Sizes(np.array([radius], np.float64), np.ones(1))
    most = 0.5 if law == "gamma" else WIDEST
    if not 0.0 < spread < most:
        raise SceneError(
            f"{spread:g}; of the law {law!r} it is above 0 and below {most:g}", where="spread"
        )
    if count < 2:
        raise SceneError("must be 2 or more", where="count")
    # in s = ln(r / radius): the range keeps nearly all of the weight r^2
    s = np.linspace(-12.0, 12.0, 48001)
    if law == "log_normal":
        exponent = -0.5 * (s / spread) ** 2
    else:
        exponent = (1.0 / spread - 2.0) * s - np.exp(s) / spread
    weight = np.exp(exponent + 2.0 * s - np.max(exponent + 2.0 * s))
    running = np.cumsum(weight) / weight.sum()
    low, high = s[np.searchsorted(running, BEYOND)], s[np.searchsorted(running, 1.0 - BEYOND)]
    at = low + (high - low) * (np.arange(count) + 0.5) / count
    shares = np.exp(np.interp(at, s, exponent - exponent.max()))
    return Sizes(radius * np.exp(at), shares / shares.sum())


def water_index(lambdas: ArrayLike, celsius: float = 15.0) -> NDArray[np.float64]:
    """Return the index of liquid water at wavelengths [nm] in vacuum, float64.

    celsius: its temperature, at 1 atm. Raises SceneError for a wavelength outside 200 to 1900 nm or
    water that is not liquid.
    """
    wavelengths = np.asarray(lambdas, np.float64)
    if wavelengths.size and not (RANGE[0] <= wavelengths.min() and wavelengths.max() <= RANGE[1]):
        raise SceneError(
            f"of water it is known from {RANGE[0]:g} to {RANGE[1]:g} nm, not at"
            f" {wavelengths.min():g} to {wavelengths.max():g} nm",
            where="index",
        )
    if not -12.0 <= celsius <= 100.0:
        raise SceneError(f"water of {celsius:g} C; it must be -12 to 100 C", where="celsius")
    rho, t = _density(celsius) / 1000.0, (celsius + 273.15) / 273.15
    square = (wavelengths / 589.0) ** 2
    right = (
        A[0] + A[1] * rho + A[2] * t + A[3] * square * t + A[4] / square
        + A[5] / (square - ULTRAVIOLET**2) + A[6] / (square - INFRARED**2) + A[7] * rho**2
    )  # fmt: skip
    ratio = rho * right
    return np.asarray(np.sqrt((1.0 + 2.0 * ratio) / (1.0 - ratio)))


def _density(t: float) -> float:
    """Return the density of water at 1 atm [kg/m^3] and `t` [C] (Kell 1975)."""
    top = 999.83952 + t * (16.945176 + t * (-7.9870401e-3 + t * (
        -46.170461e-6 + t * (105.56302e-9 - 280.54253e-12 * t))))  # fmt: skip
    return top / (1.0 + 16.879850e-3 * t)


def angles(size: float) -> NDArray[np.float64]:
    """Return cosines from -1 to 1 for a table of spheres up to a size parameter.

    They are even in angle, and dense at both ends, where the corona and the glory have rings of
    1 / size radians.
    """
    least = np.pi / max(200.0 * min(size, 100.0), 4.0 * size)
    near = np.geomspace(min(least, 0.02), 0.3, FINE)
    theta = np.concatenate([np.linspace(0.0, np.pi, EVEN), near, np.pi - near])
    cosines = np.unique(np.round(np.cos(theta), 12))
    apart = np.concatenate([[True], np.diff(cosines) > 2e-7])  # float32 must distinguish them
    apart[-1] = apart[0] = True
    cosines = cosines[apart]
    cosines[0], cosines[-1] = -1.0, 1.0
    return cosines


def _wavelengths(lambdas: ArrayLike) -> NDArray[np.float64]:
    at = np.asarray(lambdas, np.float64) if np.size(lambdas) else np.arange(360.0, 831.0, 10.0)
    if not (np.isfinite(at) & (at > 0.0)).all() or not (np.diff(at) > 0.0).all():
        raise SceneError("must ascend, and be above 0", where="lambdas")
    return at


def droplets(
    of: Sizes,
    share: float,
    *,
    index: float | str | Spectrum = WATER,
    k: float | Spectrum = 0.0,
    host: float | str | Spectrum = 1.0,
    lambdas: ArrayLike = (),
    name: str = "",
) -> Homogeneous:
    """Return the medium of spheres that take a share of its volume.

    of: their sizes; share: 1e-7 is .1 g of water in a cubic metre, 0.04 the fat of milk; index, k:
    refraction and absorption of the spheres; host: index around them, without absorption. Each is a
    number, a spectrum, the name of a glass or "water" (IAPWS 1997, 15 C). lambdas: [nm], by
    default every 10 nm from 360 to 830.

    The medium has sigma_t and albedo by wavelength, and a Tabulated phase function. Raises
    SceneError for a share above DENSE or not above 0, and as `spheres` does.
    """
    at = _wavelengths(lambdas)
    if not 0.0 < share <= DENSE:
        raise SceneError(
            f"{share:g} of the volume; it must be above 0 and up to {DENSE:g}, as denser spheres do"
            " not scatter on their own",
            where="share",
        )
    outside = _index(host, at)
    inside = (_index(index, at) + 1j * _values(k, at)) / outside
    waves = 2.0e9 * np.pi * outside / at  # [1/m]
    cosines = angles(float(waves.max() * of.radii[-1]))
    sigma_t, scattered = np.empty((2, len(at)))
    rows = np.empty((len(at), len(cosines)))
    number = share / (4.0 / 3.0 * np.pi * of.mean(3))
    area = number * of.shares * np.pi * of.radii**2
    for i, (wave, m) in enumerate(zip(waves, inside, strict=True)):
        scattering = spheres(wave * of.radii, m, cosines)
        cross_sections = area * scattering.scattering
        sigma_t[i], scattered[i] = area @ scattering.extinction, cross_sections.sum()
        rows[i] = cross_sections @ scattering.phase
    albedo = np.clip(scattered / sigma_t, 0.0, 1.0)
    return Homogeneous(
        sigma_t=spectra.Tabulated(at, sigma_t, "hold"),
        albedo=spectra.Tabulated(at, albedo, "hold"),
        phase=Tabulated(values=rows, cosines=cosines, wavelengths=at if len(at) > 1 else ()),
        name=name,
    )


def _index(value: float | str | Spectrum, at: NDArray[np.float64]) -> NDArray[np.float64]:
    if isinstance(value, str) and value == WATER:
        return water_index(at)
    return _values(spectra.index(value) if isinstance(value, (str, Spectrum)) else value, at)


def _values(value: float | Spectrum, at: NDArray[np.float64]) -> NDArray[np.float64]:
    if isinstance(value, Spectrum):
        return np.asarray(value.sample(at), np.float64)
    return np.full(len(at), number(value))
