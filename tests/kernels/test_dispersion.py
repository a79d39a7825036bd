"""Dielectrics of all kinds at a path's four wavelengths, against formulas in float64.

Indices are those of named glasses at wavelengths of the visible range. Errors stated are relative,
or absolute in the share of light.
"""

from __future__ import annotations

import numpy as np
import pytest

from clpt import spectra
from clpt.scene import materials as m
from clpt.testing.settings import tilted
from tests.kernels.harness import Probe

LAMBDAS = np.array(
    [[400.0, 500.0, 600.0, 700.0], [450.0, 550.0, 650.0, 425.0], [700.0, 430.0, 520.0, 610.0]]
)  # [nm], the hero first
GLASSES = ("bk7", "sf11", "diamond", "water")
ANGLES = (0.0, 20.0, 45.0, 70.0, 85.0)  # degrees
WHITE = {"specular_reflectance": 1.0, "specular_transmittance": 1.0}

glasses = pytest.mark.parametrize("glass", GLASSES)
wavelengths = pytest.mark.parametrize("lambdas", LAMBDAS, ids=lambda at: f"{at[0]:.0f}nm")


def fresnel(cos_i: np.ndarray, n: np.ndarray) -> np.ndarray:
    """Unpolarised reflectance (Born and Wolf 1.5.2); n: of the far side over the near side."""
    c = np.abs(np.asarray(cos_i, float))
    t = np.sqrt(np.maximum(1.0 - (1.0 - c * c) / n**2, 0.0))
    f = 0.5 * (((c - n * t) / (c + n * t)) ** 2 + ((n * c - t) / (n * c + t)) ** 2)
    return np.where((1.0 - c * c) / n**2 >= 1.0, 1.0, f)


def index(glass: str, lambdas: np.ndarray) -> dict[str, np.ndarray | float]:
    return {"int_ior": spectra.glass(glass).sample(lambdas), "ext_ior": 1.0}


def sampled(probe: Probe, params: dict, wo: np.ndarray, uz: float) -> dict:
    """The lobe that a number chooses: 0 reflects; the largest below 1 refracts where it can."""
    return probe(params, wo[None], wo[None], np.array([[0.3, 0.6, uz]]))


@glasses
@wavelengths
def test_smooth(glass: str, lambdas: np.ndarray) -> None:
    """Snell's law for the hero to 1e-5; Fresnel's shares at all four to 2e-5; from both sides."""
    probe, params = Probe(m.Dielectric, "spectral"), {**index(glass, lambdas), **WHITE}
    n = np.asarray(params["int_ior"])
    for degrees in (*ANGLES, *(180.0 - a for a in ANGLES)):
        wo = tilted(degrees)
        eta = n if wo[2] > 0.0 else 1.0 / n
        f = fresnel(wo[2], eta)
        back = sampled(probe, params, wo, 0.0)
        np.testing.assert_allclose(back["weight"][0] * back["sampled_pdf"][0], f, atol=1e-5)
        through = sampled(probe, params, wo, np.nextafter(np.float32(1.0), np.float32(0.0)))
        if f[0] == 1.0:  # the hero is reflected; that others are not is told by `back`
            continue
        got = through["weight"][0] * through["sampled_pdf"][0] * eta[0] ** 2
        np.testing.assert_allclose(got, 1.0 - f, atol=2e-5)
        refracted = np.array([-wo[0] / eta[0], -wo[1] / eta[0], 0.0])
        refracted[2] = -np.sign(wo[2]) * np.sqrt(1.0 - refracted @ refracted)
        np.testing.assert_allclose(through["wi"][0], refracted, atol=1e-5)


@glasses
@wavelengths
def test_total_internal_reflection(glass: str, lambdas: np.ndarray) -> None:
    """.05 degrees below the hero's critical angle some light leaves; as far beyond, none does."""
    probe, params = Probe(m.Dielectric, "spectral"), {**index(glass, lambdas), **WHITE}
    n = np.asarray(params["int_ior"])
    critical = np.degrees(np.arcsin(1.0 / n[0]))
    for degrees, total in ((critical - 0.05, False), (critical + 0.05, True)):
        wo = tilted(180.0 - degrees)
        through = sampled(probe, params, wo, np.nextafter(np.float32(1.0), np.float32(0.0)))
        refracted = through["sampled_pdf"][0] > 0.0 and through["wi"][0, 2] > 0.0
        assert refracted == (not total)
        back = sampled(probe, params, wo, 0.0)
        share = back["weight"][0, 0] * back["sampled_pdf"][0]
        assert share == pytest.approx(1.0, abs=1e-6) if total else share < 0.95


def slab(cos_i: float, n: np.ndarray) -> np.ndarray:
    """What two faces reflect of unpolarised light, reflection by reflection."""
    t, whole = np.sqrt(1.0 - (1.0 - cos_i**2) / n**2), np.zeros(n.shape)
    for a, b in ((cos_i, n * t), (n * cos_i, t)):  # across the plane of incidence, and along it
        f = ((a - b) / (a + b)) ** 2
        inside, returned = 1.0 - f, f
        for _ in range(200):
            returned, inside = returned + inside * f * (1.0 - f), inside * f * f
        whole += 0.5 * returned
    return whole


@glasses
@wavelengths
def test_thin(glass: str, lambdas: np.ndarray) -> None:
    """The mean of 2 F / (1 + F) in both polarisations is sent back, at each wavelength, to 1e-5.

    The rest passes undeviated. Beside a sum over the reflections between the faces.
    """
    probe, params = Probe(m.ThinDielectric, "spectral"), {**index(glass, lambdas), **WHITE}
    for degrees in ANGLES:
        wo = tilted(degrees)
        returned = slab(wo[2], np.asarray(params["int_ior"]))
        for uz, share, wi in (
            (0.0, returned, wo * [-1, -1, 1]),
            (0.9999999, 1.0 - returned, -wo),
        ):
            r = sampled(probe, params, wo, uz)
            np.testing.assert_allclose(r["weight"][0] * r["sampled_pdf"][0], share, atol=1e-5)
            np.testing.assert_allclose(r["wi"][0], wi, atol=1e-6)


def ggx(h: np.ndarray, wo: np.ndarray, wi: np.ndarray, alpha: float) -> tuple[float, float]:
    """D(h) and G1(wo) G1(wi) of isotropic GGX (Walter et al. 2007 eq. 33 and 34)."""
    tan2 = (h[0] ** 2 + h[1] ** 2) / h[2] ** 2
    d = alpha**2 / (np.pi * h[2] ** 4 * (alpha**2 + tan2) ** 2)

    def g1(v: np.ndarray) -> float:
        return 2.0 / (1.0 + np.sqrt(1.0 + alpha**2 * (1.0 / v[2] ** 2 - 1.0)))

    return d, g1(wo) * g1(wi)


PAIRS = [(20.0, 200.0), (50.0, 195.0), (60.0, 140.0), (160.0, 15.0), (30.0, 45.0), (150.0, 135.0)]


@glasses
@wavelengths
@pytest.mark.parametrize("alpha", [0.1, 0.4])
def test_rough(glass: str, lambdas: np.ndarray, alpha: float) -> None:
    """Walter et al. 2007 eq. 20 and 21 at each wavelength, to 1 in 1000 of the largest."""
    probe = Probe(m.RoughDielectric, "spectral")
    params = {**index(glass, lambdas), **WHITE}
    params |= {"distribution": 0, "alpha_u": alpha, "alpha_v": alpha}
    n = np.asarray(params["int_ior"])
    for a, b in PAIRS:
        wo, wi = tilted(a), tilted(b, 0.9)
        got = probe(params, wo[None], wi[None], np.full((1, 3), 0.5))["eval"][0]
        expected = [walter(wo, wi, value, alpha) for value in n]
        np.testing.assert_allclose(got, expected, rtol=2e-3, atol=1e-3 * max(expected) + 1e-7)


def walter(wo: np.ndarray, wi: np.ndarray, n: float, alpha: float) -> float:
    """f |cos| of radiance at one index."""
    n_o, n_i = (1.0, n) if wo[2] > 0.0 else (n, 1.0)
    n_i = n_o if wo[2] * wi[2] > 0.0 else n_i
    h = n_o * wo + n_i * wi
    h = h / np.linalg.norm(h) * np.sign(h[2])
    o, i = wo @ h, wi @ h
    if o * wo[2] <= 0.0 or i * wi[2] <= 0.0:
        return 0.0
    f = float(fresnel(o, np.float64(n if o > 0.0 else 1.0 / n)))
    d, g = ggx(h, wo, wi, alpha)
    if wo[2] * wi[2] > 0.0:
        return f * d * g / (4.0 * abs(wo[2]))
    return abs(o * i / wo[2]) * (1.0 - f) * d * g * n_o**2 / (n_o * o + n_i * i) ** 2


def inside(n: float) -> float:
    """What a smooth coat reflects of diffuse light from below, by quadrature."""
    mu = (np.arange(200000) + 0.5) / 200000
    return float(2.0 * np.mean(fresnel(mu, np.float64(1.0 / n)) * mu))


@glasses
@wavelengths
def test_plastic(glass: str, lambdas: np.ndarray) -> None:
    """A smooth coat: its mirror share to 1e-5, and the base below at each wavelength to 1.5 %.

    The base is (1 - F(wo)) (1 - F(wi)) d / (pi n^2 (1 - d R)), R the coat's reflectance from below,
    for which the kernel has a polynomial.
    """
    probe, albedo = Probe(m.Plastic, "spectral"), np.array([0.8, 0.3, 0.6, 0.5])
    params = {**index(glass, lambdas), **WHITE, "diffuse_reflectance": albedo, "nonlinear": 1}
    n = np.asarray(params["int_ior"])
    below = np.array([inside(value) for value in n])
    for a, b in ((0.0, 30.0), (50.0, 10.0), (80.0, 60.0)):
        wo, wi = tilted(a), tilted(b)
        r = probe(params, wo[None], wi[None], np.array([[0.3, 0.6, 0.0]]))
        f_o, f_i = fresnel(wo[2], n), fresnel(wi[2], n)
        np.testing.assert_allclose(r["weight"][0] * r["sampled_pdf"][0], f_o, atol=1e-5)
        base = (1 - f_o) * (1 - f_i) * albedo / (np.pi * n**2 * (1 - albedo * below)) * wi[2]
        np.testing.assert_allclose(r["eval"][0], base, rtol=0.015 if glass == "diamond" else 0.007)


@glasses
@wavelengths
@pytest.mark.parametrize("alpha", [0.05, 0.3])
def test_rough_plastic(glass: str, lambdas: np.ndarray, alpha: float) -> None:
    """A rough coat over black: F D G / (4 |cos|) at each wavelength, to 1e-3."""
    probe = Probe(m.RoughPlastic, "spectral")
    params = {**index(glass, lambdas), **WHITE, "diffuse_reflectance": 0.0, "nonlinear": 0}
    params |= {"distribution": 0, "alpha": alpha}
    n = np.asarray(params["int_ior"])
    for a, b in ((0.0, 10.0), (50.0, 48.0), (80.0, 70.0)):
        wo, wi = tilted(a), tilted(b, 0.7 + np.pi)
        h = (wo + wi) / np.linalg.norm(wo + wi)
        d, g = ggx(h, wo, wi, alpha)
        expected = fresnel(wo @ h, n) * d * g / (4.0 * wo[2])
        got = probe(params, wo[None], wi[None], np.full((1, 3), 0.5))["eval"][0]
        np.testing.assert_allclose(got, expected, rtol=1e-3)
