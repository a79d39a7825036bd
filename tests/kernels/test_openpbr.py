"""OpenPBR against its specification's formulas in float64; white layers lose next to nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clpt import spectra
from clpt.scene import facets
from clpt.scene.materials import Openpbr
from clpt.scene.params import device_params
from clpt.spectra import RGBUnbounded
from clpt.testing.checks import albedos
from clpt.testing.settings import pairs, tilted
from tests.kernels.harness import Probe
from tests.kernels.test_dispersion import PAIRS, walter

UP = np.array([[0.0, 0.0, 1.0]])
PLAIN = Openpbr()
ANGLES = (5.0, 45.0, 70.0)
WHITE = {"base_color": 1.0, "subsurface_color": 1.0}


def _params(**given: Any) -> dict[str, np.ndarray]:
    """The specification's default material but for what is given; for `Probe`, in RGB."""
    values = {}
    for name in device_params(Openpbr):
        value = given.get(name, getattr(PLAIN, name))
        values[name] = np.asarray(value if np.ndim(value) else getattr(value, "value", value))
    return values


def _probe() -> Probe:
    return Probe(Openpbr, "rgb")


def _normal(roughness: float = 0.3, **given: Any) -> np.ndarray:
    """Reflectance (3,) of facets at normal incidence: f |cos| over D / 4."""
    made = _params(specular_roughness=roughness, **given)
    return _probe()(made, UP, UP, UP)["eval"][0] * 4.0 * np.pi * roughness**4


def test_normal_incidence() -> None:
    black = {"base_color": 0.0}
    np.testing.assert_allclose(_normal(**black), 0.04, rtol=1e-3)
    half = {"specular_weight": 0.5, "specular_color": [0.2, 0.5, 1.0]}
    np.testing.assert_allclose(
        _normal(**black, **half), 0.02 * np.array([0.2, 0.5, 1.0]), rtol=2e-3
    )
    metal = {"base_color": [0.9, 0.6, 0.2], "base_metalness": 1.0, "specular_weight": 0.8}
    np.testing.assert_allclose(_normal(**metal), [0.72, 0.48, 0.16], rtol=3e-3)


def test_the_index_is_that_over_the_coat() -> None:
    """Below a coat of index 1.6 and a rough base: 1.5 reflects as 1.6 / 1.5, half of it as half."""
    base = {"base_color": 0.0, "specular_roughness": 0.5, "coat_darkening": 0.0}
    probe, wi = _probe(), np.array([tilted(40.0)])
    for weight in (1.0, 0.5):
        eta = 1.5 + (1.6 / 1.5 - 1.5) * weight
        made = _params(**base, coat_weight=weight, coat_roughness=0.0)
        bare = _params(**base, specular_ior=eta)
        left = 1.0 - weight * facets.fresnel(np.cos(np.radians([40.0])), 1.6)[0]
        found, expected = (probe(p, UP, wi, UP)["eval"][0, 0] for p in (made, bare))
        assert found == pytest.approx(expected * left, rel=0.02)


def test_metal_is_tinted_at_its_edge() -> None:
    """At 82 degrees the factor is the specular colour (F82)."""
    cosine = 1.0 / 7.0
    wo = np.array([tilted(np.degrees(np.arccos(cosine)), 0.0)])
    wi, edge = wo * [-1.0, -1.0, 1.0], np.array([0.2, 0.6, 1.0])
    metal = {"base_metalness": 1.0, "base_color": 0.5, "specular_roughness": 0.1}
    plain = _probe()(_params(**metal), wo, wi, wo)["eval"][0]
    tinted = _probe()(_params(**metal, specular_color=edge), wo, wi, wo)["eval"][0]
    np.testing.assert_allclose(tinted / plain, edge, rtol=5e-3)


def test_the_tangent_turns() -> None:
    """A lobe along x turned by 90 degrees lies along y."""
    across = np.stack([tilted(40.0, azimuth) for azimuth in (0.0, np.pi / 2)])
    lobe = {"base_metalness": 1.0, "specular_roughness": 0.4, "specular_roughness_anisotropy": 0.8}
    plain = _probe()(_params(**lobe), UP, across, across)["eval"][:, 0]
    turned = _params(**lobe, anisotropy_rotation=90.0)
    np.testing.assert_allclose(
        _probe()(turned, UP, across, across)["eval"][:, 0], plain[::-1], rtol=1e-3
    )
    assert plain[0] > 10.0 * plain[1]  # wider along the tangent


FURNACE = {
    "diffuse": ({}, 0.012),
    "rough diffuse": ({"base_diffuse_roughness": 1.0}, 0.03),
    "metal": ({"base_metalness": 1.0}, 0.02),
    "leaf": ({"subsurface_weight": 1.0, "thin_walled": 1}, 0.012),
    "skin": ({"subsurface_weight": 1.0, "subsurface_inside": 1}, 0.012),
    "glass": ({"transmission_weight": 1.0, "specular_roughness": 0.1}, 0.006),
    "pane": ({"transmission_weight": 1.0, "specular_roughness": 0.1, "thin_walled": 1}, 0.006),
    "coat": ({"coat_weight": 1.0, "coat_roughness": 0.3}, 0.012),
    "coated metal": ({"coat_weight": 1.0, "coat_roughness": 0.3, "base_metalness": 1.0}, 0.04),
    "fuzz": ({"fuzz_weight": 1.0}, 0.03),
    "film": ({"thin_film_weight": 1.0}, 0.06),
    "bubble": (
        {
            "transmission_weight": 1.0,
            "thin_film_weight": 1.0,
            "specular_roughness": 0.05,
            "specular_ior": 1.0,
            "thin_walled": 1,
        },
        0.006,
    ),
}


@pytest.mark.parametrize("name", FURNACE)
def test_white_furnace(name: str) -> None:
    """White layers make no light, and lose at most what docs/materials.md says."""
    given, lost = FURNACE[name]
    rng, probe = np.random.default_rng(2), _probe()
    for roughness in (0.1, 0.5, 1.0) if "specular_roughness" not in given else (0.1,):
        made = _params(**{"specular_roughness": roughness, **WHITE, **given})
        mean, error = albedos(probe, made, rng, ANGLES)
        assert np.all(mean - 1.0 < 6e-3 + 4.0 * error), (roughness, mean.max())
        assert np.all(mean > 1.0 - lost - 4.0 * error), (roughness, mean.min())


def _fresnel_mean(eta: float) -> float:
    nodes, weights = np.polynomial.legendre.leggauss(64)
    cosines = 0.5 * (nodes + 1.0)
    return float((weights * cosines * facets.fresnel(cosines, eta)).sum())


@pytest.mark.parametrize("eta", [1.3, 1.6, 2.0])
def test_a_coat_darkens_as_the_interfaced_lambertian(eta: float) -> None:
    """A smooth coat over a Lambertian base has an exact albedo in the specification."""
    rng, base = np.random.default_rng(3), np.array([0.1, 0.5, 0.9])
    back = 1.0 - (1.0 - _fresnel_mean(eta)) / eta**2
    matt = {"specular_weight": 0.0, "base_color": base, "coat_weight": 1.0, "coat_ior": eta}
    mean, error = albedos(_probe(), _params(**matt), rng, ANGLES)
    undarkened, more = albedos(_probe(), _params(**matt, coat_darkening=0.0), rng, ANGLES)
    cosines = np.cos(np.radians(ANGLES))[:, None]
    f = facets.fresnel(cosines, eta)
    dark = (1.0 - back) / (1.0 - base * back)
    np.testing.assert_array_less(np.abs(mean - f - base * (1.0 - f) * dark), 8e-3 + 4.0 * error)
    np.testing.assert_array_less(np.abs(undarkened - f - base * (1.0 - f)), 8e-3 + 4.0 * more)


@pytest.mark.parametrize("roughness", [0.2, 0.6])
@pytest.mark.parametrize("ior", [1.3, 1.5, 2.0])
def test_albedo_of_the_dielectric(roughness: float, ior: float) -> None:
    """E + (1 - E) colour, with E by float64 sums; light of several bounces adds some."""
    rng, colour = np.random.default_rng(4), np.array([0.0, 0.3, 0.8])
    made = _params(base_color=colour, specular_roughness=roughness, specular_ior=ior)
    mean, error = albedos(_probe(), made, rng, ANGLES)
    cosines = np.cos(np.radians(ANGLES))
    e = facets.reflectance("ggx", roughness**2, ior, cosines)[:, None]
    np.testing.assert_array_less(np.abs(mean - e - (1.0 - e) * colour), 8e-3 + 4.0 * error)


def test_what_a_coloured_coat_absorbs_grows_with_the_angle() -> None:
    """The colour to the power of the mean of both paths' lengths within the coat."""
    colour, rng = np.array([0.3, 0.6, 1.0]), np.random.default_rng(5)
    matt = {"specular_weight": 0.0, "base_color": 0.5, "coat_weight": 1.0, "coat_darkening": 0.0}
    wo, wi = (np.abs(w) for w in pairs(rng, 200))
    clear, tinted = (
        _probe()(_params(**matt, coat_color=c, coat_roughness=1.0), wo, wi, wo)["eval"]
        for c in (1.0, colour)
    )
    black = _probe()(_params(**{**matt, "base_color": 0.0}, coat_roughness=1.0), wo, wi, wo)["eval"]
    inside = [np.sqrt(1.0 - (1.0 - w[:, 2] ** 2) / 1.6**2) for w in (wo, wi)]
    expected = colour ** (0.5 / inside[0] + 0.5 / inside[1])[:, None]
    np.testing.assert_allclose(tinted - black, (clear - black) * expected, rtol=5e-3, atol=1e-5)


def _eon(colour: np.ndarray, r: float, wo: np.ndarray, wi: np.ndarray) -> np.ndarray:
    """pi f of Portsmouth, Kutz and Hill 2024, with their exact albedo."""
    one, two = 0.5 - 2.0 / (3.0 * np.pi), 2.0 / 3.0 - 28.0 / (15.0 * np.pi)

    def albedo(c: np.ndarray) -> np.ndarray:
        sine = np.sqrt(1.0 - c * c)
        g = sine * (np.arccos(c) - sine * c) + 2.0 / 3.0 * (sine / c * (1.0 - sine**3) - sine)
        return (1.0 + r * g / np.pi) / (1.0 + one * r)

    o, i = wo[:, 2], wi[:, 2]
    s = (wo * wi).sum(axis=1) - o * i
    single = (1.0 + r * np.where(s > 0.0, s / np.maximum(o, i), s)) / (1.0 + one * r)
    mean = (1.0 + two * r) / (1.0 + one * r)
    several = (1.0 - albedo(o)) * (1.0 - albedo(i)) / (1.0 - mean)
    more = colour**2 * mean / (1.0 - colour * (1.0 - mean))
    return single[:, None] * colour + several[:, None] * more


@pytest.mark.parametrize("roughness", [0.3, 1.0])
def test_rough_diffuse_is_eon(roughness: float) -> None:
    wo, wi = (np.abs(w) for w in pairs(np.random.default_rng(6), 300))
    colour = np.array([0.2, 0.6, 1.0])
    matt = {"specular_weight": 0.0, "base_color": colour, "base_diffuse_roughness": roughness}
    found = _probe()(_params(**matt), wo, wi, wo)["eval"]
    expected = _eon(colour, roughness, wo, wi) * wi[:, 2:] / np.pi
    np.testing.assert_allclose(found, expected, rtol=2e-2, atol=2e-3)


def test_a_colour_at_a_depth_is_an_absorption() -> None:
    glass = Openpbr(transmission_color=(0.5, 0.25, 1.0), transmission_depth=0.1)
    assert isinstance(glass.absorption, RGBUnbounded) and glass.transmission_tint.value == 1.0
    a = glass.absorption
    np.testing.assert_allclose(np.exp(-0.1 * np.array([a.r, a.g, a.b])), [0.5, 0.25, 1.0])
    assert Openpbr(transmission_color=0.5).transmission_tint.value == 0.5


SPECTRAL = {"lambdas": np.array([400.0, 500.0, 600.0, 700.0])}  # [nm], the hero first


@pytest.mark.parametrize("glass", ["sf11", "diamond"])
def test_glass_has_the_index_of_each_wavelength(glass: str) -> None:
    """Walter et al. 2007 eq. 20 and 21, but for light of several bounces between facets (2e-4)."""
    n, probe = spectra.glass(glass).sample(SPECTRAL["lambdas"]), Probe(Openpbr, "spectral")
    glassy = {"transmission_weight": 1.0, "specular_ior": n, "specular_roughness": np.sqrt(0.1)}
    made = {**_params(**glassy), **SPECTRAL}
    for a, b in PAIRS:
        wo, wi = tilted(a), tilted(b, 0.9)
        got = probe(made, wo[None], wi[None], np.full((1, 3), 0.5))["eval"][0]
        expected = [walter(wo, wi, value, 0.1) for value in n]
        np.testing.assert_allclose(got, expected, rtol=4e-3, atol=2e-3 * max(expected) + 2e-4)


@pytest.mark.parametrize("glass", ["sf11", "diamond"])
def test_facets_leave_the_share_of_each_wavelength_to_the_base(glass: str) -> None:
    """(1 - E(o)) (1 - E(i)) / (1 - mean E), with E by float64 sums."""
    n, probe = spectra.glass(glass).sample(SPECTRAL["lambdas"]), Probe(Openpbr, "spectral")
    made = {**_params(specular_ior=n, specular_roughness=0.3), **SPECTRAL}
    wo, wi = (
        np.array([tilted(25.0), tilted(60.0)]),
        np.array([tilted(50.0, 0.8), tilted(10.0, 2.0)]),
    )
    black, white = (probe({**made, "base_color": c}, wo, wi, wo)["eval"] for c in (0.0, 1.0))

    def left(cosines: np.ndarray) -> np.ndarray:
        return 1.0 - np.array([facets.reflectance("ggx", 0.09, eta, cosines) for eta in n]).T

    nodes, weights = np.polynomial.legendre.leggauss(16)
    cosines = 0.5 * (nodes + 1.0)
    mean = (weights * cosines) @ left(cosines)
    expected = left(wo[:, 2]) * left(wi[:, 2]) / mean * wi[:, 2:] / np.pi
    got = white - black
    np.testing.assert_allclose(got, expected, rtol=0.01)
    # Wavelengths beside each other: a mean index would be .007 off.
    got, expected = (part / part.mean(axis=1, keepdims=True) for part in (got, expected))
    np.testing.assert_allclose(got, expected, rtol=2e-3)
