"""Gratings: where the orders go, and what each of them gets, against formulas in float64."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.scene.materials import Grating
from tests.kernels.harness import Probe, map_text, run

REFLECTIVE, TRANSMISSIVE = 0, 1
SINUSOIDAL, LAMELLAR, BLAZED, EXPLICIT = range(4)
DISPERSE, DELTA = 8, 4
WAVELENGTHS = np.linspace(380.0, 780.0, 10)
PLAIN = {
    "mode": REFLECTIVE, "profile": SINUSOIDAL, "period": 1600.0, "angle": 0.0, "depth": 150.0,
    "fill": 0.5, "orders": 8.0, "efficiencies": np.ones(17), "ior": 1.5, "eta": 0.0, "k": 1.0,
    "reflectance": 1.0,
}  # fmt: skip


def outcomes(params, wo, lambdas, mode="spectral"):
    """What sampling gives over a grid of random numbers that meets every order."""
    u = np.stack(np.meshgrid(np.linspace(0, 0.9999, 501), [0.4], np.linspace(0, 0.9999, 21)), -1)
    u = u.reshape(-1, 3)
    r = Probe(Grating, mode)({**PLAIN, **params, "lambdas": lambdas}, wo[None], wo[None], u)
    return {k: v[r["sampled_pdf"] > 0.0] for k, v in r.items()}


def predicted(params, wo, wavelength):
    """Orders, their directions (n, 3) and normalised shares (n,), all in float64.

    Directions from the scalar equations of conical mounting: with psi the angle between the ray and
    the plane across the grooves, sin a_n = sin a_0 + n lambda / (d cos psi), and psi is kept.
    Shares from the Fourier transform of one period of the wave behind the grooves.
    """
    p = {**PLAIN, **params}
    turn = np.radians(p["angle"])
    across, along = np.array([np.cos(turn), np.sin(turn), 0]), [-np.sin(turn), np.cos(turn), 0]
    sin_psi = -wo @ along
    cos_psi = np.sqrt(1.0 - sin_psi**2)
    orders = np.arange(-8, 9)
    sines = (-wo @ across) / cos_psi + orders * wavelength / (p["period"] * cos_psi)
    orders, sines = orders[np.abs(sines) < 1.0], sines[np.abs(sines) < 1.0]
    heights = np.sqrt(1.0 - sines**2)
    side = np.sign(wo[2]) * (-1.0 if p["mode"] == TRANSMISSIVE else 1.0)
    directions = cos_psi * (np.outer(sines, across) + np.outer(heights, [0.0, 0.0, side]))
    directions += sin_psi * np.asarray(along)
    shares = np.array(
        [fourier_share(p, n, abs(wo[2]), abs(w[2]), wavelength)
         for n, w in zip(orders, directions, strict=True)]
    )  # fmt: skip
    return orders, directions, shares / shares.sum()


def fourier_share(p, order, cos_in, cos_out, wavelength):
    x = (np.arange(8192) + 0.5) / 8192
    profile = {
        SINUSOIDAL: 0.5 * np.sin(2.0 * np.pi * x),
        LAMELLAR: (x < p["fill"]).astype(float),
        BLAZED: x,
    }[p["profile"]]
    lag = cos_in + cos_out
    if p["mode"] == TRANSMISSIVE:
        lag = sum(np.sqrt(p["ior"] ** 2 - 1 + c**2) - c for c in (cos_in, cos_out)) / 2
    wave = np.exp(2j * np.pi * profile * p["depth"] * lag / wavelength)
    return np.abs(np.mean(wave * np.exp(-2j * np.pi * order * x))) ** 2


def incident(theta, phi):
    t, p = np.radians([theta, phi])
    return np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])


MOUNTS = {
    "normal": ({}, incident(0, 0)),
    "oblique": ({"depth": 120.0}, incident(35, 0)),
    "conical": ({"angle": 25.0, "period": 1100.0}, incident(50, 140)),
    "lamellar": ({"profile": LAMELLAR, "fill": 0.3125}, incident(20, 70)),
    "blazed": ({"profile": BLAZED, "depth": 300.0, "period": 2000.0}, incident(15, 200)),
    "transmissive": ({"mode": TRANSMISSIVE, "depth": 700.0}, incident(30, 10)),
    "transmissive-blazed-behind": (
        {"mode": TRANSMISSIVE, "profile": BLAZED, "depth": 900.0, "angle": 80.0, "ior": 1.6},
        incident(140, 60),
    ),
    "grazing": ({"period": 700.0}, incident(80, 30)),
}


@pytest.mark.parametrize("mount", MOUNTS)
def test_directions_and_shares_of_the_orders(mount):
    """Angles to 1e-5 rad, shares to 1e-4, at ten wavelengths; probabilities sum to one."""
    params, wo = MOUNTS[mount]
    for wavelength in WAVELENGTHS:
        lambdas = [wavelength, 500.0, 560.0, 620.0]
        r = outcomes(params, wo, lambdas)
        orders, directions, shares = predicted(params, wo, wavelength)
        angles = np.linalg.norm(r["wi"][:, None] - directions[None], axis=2)
        nearest = angles.argmin(axis=1)
        assert angles.min(axis=1).max() < 1e-5
        share = r["weight"][:, 0] * r["sampled_pdf"]
        np.testing.assert_allclose(share, shares[nearest], atol=1e-4)
        assert np.array_equal(orders[nearest] != 0, r["lobe"] & DISPERSE != 0)
        assert np.all(r["lobe"] & DELTA)
        met, first = np.unique(nearest, return_index=True)
        assert set(np.flatnonzero(shares > 2e-3)) <= set(met)
        missed = shares.sum() - shares[met].sum()
        assert abs(share[first].sum() + missed - 1.0) < 1e-4
        assert abs(r["sampled_pdf"][first].sum() - 1.0) < 1e-3 + 5 * missed


def test_explicit_efficiencies():
    values = np.zeros(17)
    values[[7, 8, 9, 10]] = 1.0, 3.0, 2.0, 2.0
    r = outcomes({"profile": EXPLICIT, "efficiencies": values}, incident(0, 0), [550.0] * 4)
    order = np.round(r["wi"][:, 0] / (550.0 / 1600.0)).astype(int)
    share = r["weight"][:, 0] * r["sampled_pdf"]
    for n, expected in ((-1, 1 / 8), (0, 3 / 8), (1, 2 / 8), (2, 2 / 8)):
        np.testing.assert_allclose(share[order == n], expected, atol=1e-6)
    assert set(order) == {-1, 0, 1, 2}
    # the second order cannot leave at 900 nm: the others share its light
    r = outcomes({"profile": EXPLICIT, "efficiencies": values}, incident(0, 0), [900.0] * 4)
    share = r["weight"][:, 0] * r["sampled_pdf"]
    np.testing.assert_allclose(np.unique(np.round(share, 5)), np.round([1 / 6, 2 / 6, 3 / 6], 5))


def test_order_zero_does_not_know_the_hero():
    """Its probability is the same whichever of the path's wavelengths comes first."""
    wo, lambdas = incident(40, 20), np.array([420.0, 510.0, 600.0, 710.0])
    chances, kept = [], []
    for turn in range(4):
        r = outcomes({}, wo, np.roll(lambdas, -turn))
        zero = r["lobe"] & DISPERSE == 0
        chances.append(r["sampled_pdf"][zero][0])
        kept.append(np.roll(r["weight"][zero][0], turn))
    np.testing.assert_allclose(chances, chances[0], rtol=1e-6)
    np.testing.assert_allclose(kept, np.broadcast_to(kept[0], (4, 4)), rtol=1e-5)


@pytest.mark.parametrize("profile", [SINUSOIDAL, LAMELLAR, BLAZED, EXPLICIT])
@pytest.mark.parametrize("way", [REFLECTIVE, TRANSMISSIVE])
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_no_light_is_lost(profile, way, mode):
    """Mean weight is the reflectance at every angle: of the hero, and of all colours in RGB.

    |z| < 4.5 for each of 2 x 4 x 2 x 6 means of colours: significance 2e-3 altogether.
    """
    rng, n = np.random.default_rng(7), 40_000
    given = {"profile": profile, "mode": way, "reflectance": 0.7, "depth": 260.0, "period": 1300.0}
    count = 1 if mode == "spectral" else 3
    for theta in (0.5, 20.0, 40.0, 60.0, 75.0, 88.0):
        wo = incident(theta, 33.0)[None]
        lambdas = rng.uniform(360.0, 830.0, 4)[: 4 if mode == "spectral" else 3]
        r = Probe(Grating, mode)({**PLAIN, **given, "lambdas": lambdas}, wo, wo, rng.random((n, 3)))
        weight = np.where(r["sampled_pdf"][:, None] > 0.0, r["weight"][:, :count], 0.0)
        error = weight.std(axis=0) / np.sqrt(n) + 1e-5
        assert np.all(np.abs(weight.mean(axis=0) - 0.7) < 4.5 * error)


def test_metal_takes_its_share():
    """Aluminium at 550 nm, n = 0.958 + 6.69i (Rakic 1995), reflects 92% at normal incidence."""
    eta, k = 0.958, 6.69
    r = outcomes({"eta": eta, "k": k}, incident(0, 0), [550.0] * 4)
    _, directions, shares = predicted({}, incident(0, 0), 550.0)
    nearest = np.linalg.norm(r["wi"][:, None] - directions[None], axis=2).argmin(axis=1)
    normal = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    np.testing.assert_allclose(
        r["weight"][:, 0] * r["sampled_pdf"], normal * shares[nearest], atol=1e-4
    )


def test_bessel():
    special = pytest.importorskip("scipy.special")
    x = np.concatenate([[0.0], np.linspace(1e-4, 24.0, 3000)]).astype(np.float32)
    calls = "".join(f"r[{n}] = bessel_r({n}, x[0]); " for n in range(9))
    text = map_text(calls, 1, 9, files=("materials/diffraction.cl",))
    found = run(text, 16, x[None], 9)
    expected = [special.jv(n, x.astype(float)) for n in range(9)]
    np.testing.assert_allclose(found, expected, atol=6e-6)
