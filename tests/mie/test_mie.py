"""Mie's theory beside another package and closed forms, and the bows of drops of water."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from clpt import mie, spectra
from clpt.errors import SceneError

INDICES = (1.33, 1.33 + 1e-6j, 1.5 + 0.1j, 0.75, 2.0 + 3.0j, 1.02)


@pytest.mark.parametrize("index", INDICES)
def test_is_what_miepython_finds(index):
    other = pytest.importorskip("miepython")
    sizes, cosines = np.array([0.01, 0.3, 5.0, 40.0, 300.0, 2000.0]), np.linspace(-1.0, 1.0, 9)
    found = mie.spheres(sizes, index, cosines)
    for i, size in enumerate(sizes):
        theirs = other.efficiencies_mx(np.conj(complex(index)), size)
        ours = (found.extinction, found.scattering, found.backscattering, found.asymmetry)
        np.testing.assert_allclose([each[i] for each in ours[:2]], theirs[:2], rtol=1e-6)
        np.testing.assert_allclose(ours[2][i], theirs[2], rtol=1e-5)
        np.testing.assert_allclose(ours[3][i], theirs[3], rtol=1e-6, atol=1e-9)
        whole = other.i_unpolarized(np.conj(complex(index)), size, cosines, norm="one")
        np.testing.assert_allclose(found.phase[i], whole, rtol=1e-6, atol=1e-9 * whole.max())


def test_small_spheres_are_rayleighs():
    cosines = np.linspace(-1.0, 1.0, 11)
    found = mie.spheres(1e-3, 1.5 + 0.01j, cosines)
    expected = 3.0 / (16.0 * np.pi) * (1.0 + cosines**2)
    np.testing.assert_allclose(found.phase[0], expected, rtol=1e-5)
    polarised = (complex(1.5, 0.01) ** 2 - 1.0) / (complex(1.5, 0.01) ** 2 + 2.0)
    assert found.scattering[0] == pytest.approx(8.0 / 3.0 * 1e-12 * abs(polarised) ** 2, rel=1e-4)


def test_the_integral_is_one_and_the_mean_cosine_is_g():
    cosines, weights = np.polynomial.legendre.leggauss(1200)
    found = mie.spheres([1.0, 30.0, 250.0], 1.33 + 0.001j, cosines)
    np.testing.assert_allclose(2.0 * np.pi * found.phase @ weights, 1.0, rtol=1e-9)
    np.testing.assert_allclose(
        2.0 * np.pi * found.phase @ (weights * cosines), found.asymmetry, rtol=1e-8
    )
    assert (found.extinction > found.scattering).all()
    clear = mie.spheres([1.0, 30.0, 250.0], 1.33)
    np.testing.assert_allclose(clear.extinction, clear.scattering, rtol=1e-10)


def test_water_has_the_index_of_the_release():
    """IAPWS 1997, and 1.33299 to air, whose index is 1.00027, at the sodium line and 20 C."""
    assert mie.water_index(589.3, 20.0) == pytest.approx(1.33299 * 1.000271, abs=5e-5)
    assert (np.diff(mie.water_index(np.linspace(300.0, 900.0, 50))) < 0.0).all()


@pytest.mark.parametrize("nm, low, high", [(650.0, 137.5, 139.0), (450.0, 138.9, 140.6)])
def test_rainbow(nm, low, high):
    """Drops of .3 mm: Descartes puts the bow at 137.6 degrees in red, 139.4 in violet; waves put
    its crest .5 to 1 degree further in (Airy 1838)."""
    of = mie.sizes("log_normal", 3e-4, 0.05, 40)
    theta = np.radians(np.linspace(130.0, 150.0, 401))
    waves = 2.0e9 * np.pi / nm * of.radii
    found = mie.spheres(waves, mie.water_index(nm), np.cos(theta))
    mean = (of.shares * of.radii**2 * found.scattering) @ found.phase
    assert low < np.degrees(theta[mean.argmax()]) < high


def test_fogbow_and_glory():
    """Drops of 10 um: the bow is wide and lies further in, at about 142 degrees, and there is a
    glory, whose first ring lies at 3 / size [rad] (van de Hulst 1957)."""
    of = mie.sizes("gamma", 1e-5, 0.01, 60)
    theta = np.linspace(120.0, 180.0, 1201)
    rings = []
    for nm in (450.0, 650.0):
        waves = 2.0e9 * np.pi / nm * of.radii
        found = mie.spheres(waves, mie.water_index(nm), np.cos(np.radians(theta)))
        mean = (of.shares * of.radii**2 * found.scattering) @ found.phase
        bow = (theta > 130.0) & (theta < 155.0)
        assert 139.0 < theta[bow][mean[bow].argmax()] < 146.0
        near = mean[theta > 175.0][::-1]
        first = np.flatnonzero((near[1:-1] > near[:-2]) & (near[1:-1] > near[2:]))[0] + 1
        rings.append(np.radians(first * 0.05) * waves.mean())
    np.testing.assert_allclose(rings, 3.0, rtol=0.15)


@pytest.mark.parametrize("law, spread", [("mono", 0.0), ("log_normal", 0.4), ("gamma", 0.1)])
def test_sizes(law, spread):
    of = mie.sizes(law, 2e-6, spread, 400)
    assert of.shares.sum() == pytest.approx(1.0)
    mean, effective = of.mean(1), of.mean(3) / of.mean(2)
    expected = {"mono": 2e-6, "log_normal": 2e-6 * np.exp(0.5 * spread**2)}
    if law == "gamma":
        assert effective == pytest.approx(2e-6, rel=1e-3)
        variance = of.mean(4) * of.mean(2) / of.mean(3) ** 2 - 1.0
        assert variance == pytest.approx(spread, rel=1e-2)
    else:
        assert mean == pytest.approx(expected[law], rel=1e-3)


def test_a_medium_of_droplets():
    """Its extinction is that of the large-drop limit: 3 share / 2 r times Q / 2, Q near 2."""
    fog = mie.droplets(mie.sizes("gamma", 1e-5, 0.1, 40), 1e-7, lambdas=(450.0, 550.0, 650.0))
    fog = dataclasses.replace(fog, name="fog")
    sigma = fog.sigma_t.sample(np.array([450.0, 550.0, 650.0]))
    np.testing.assert_allclose(sigma, 1.5 * 1e-7 / 1e-5, rtol=0.1)
    np.testing.assert_allclose(fog.albedo.values, 1.0, atol=1e-9)
    milk = mie.droplets(
        mie.sizes("log_normal", 4e-7, 0.4, 20), 0.03, index=1.46, host="water", lambdas=(450, 650)
    )
    blue, red = milk.sigma_t.sample(np.array([450.0, 650.0]))
    assert blue > red > 1e4
    ink = mie.droplets(mie.sizes("mono", 1e-6), 1e-6, k=spectra.Constant(0.1), lambdas=(550.0,))
    assert 0.4 < ink.albedo.values[0] < 0.7


@pytest.mark.parametrize(
    "call, said",
    [
        (lambda: mie.spheres(0.0, 1.33), "must be above 0"),
        (lambda: mie.spheres(1e6, 1.33), "smaller radii"),
        (lambda: mie.spheres(1.0, 1.33 - 1e-3j), "k 0 or above"),
        (lambda: mie.spheres(1.0, 1.33, [2.0]), "from -1 to 1"),
        (lambda: mie.sizes("normal", 1e-6), "none of mono"),
        (lambda: mie.sizes("gamma", 1e-6, 0.9), "below 0.5"),
        (lambda: mie.sizes("mono", -1.0), "above 0"),
        (lambda: mie.droplets(mie.sizes("mono", 1e-6), 0.5), "do not scatter on their own"),
        (lambda: mie.droplets(mie.sizes("mono", 1e-6), 1e-6, lambdas=(600, 500)), "ascend"),
        (lambda: mie.water_index(100.0), "from 200 to 1900 nm"),
    ],
)
def test_says_what_is_wrong(call, said):
    with pytest.raises(SceneError, match=said):
        call()
