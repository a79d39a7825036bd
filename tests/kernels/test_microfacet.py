"""kernels/materials/fresnel.cl and microfacet.cl against references in double precision."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from clpt.render.materials import rough_coat_table as coats
from clpt.scene import facets
from tests.kernels.harness import map_text, run

FILES = ("materials/fresnel.cl", "materials/microfacet.cl", "materials/rough_coat.cl")
NAMES = ("ggx", "beckmann")


def call(body, results, *arguments):
    given = np.stack(np.broadcast_arrays(*map(np.atleast_1d, arguments))).astype(np.float32)
    text = map_text(body, len(given), results, files=FILES)
    return run(text, 16, given, results).astype(float)


def dielectric(cos_i, eta):
    """Reflectance between a vacuum and the real index eta, from the amplitudes."""
    cos_t = np.sqrt(1.0 - (1.0 - cos_i**2) / eta**2 + 0j)
    s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
    p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
    return 0.5 * (np.abs(s) ** 2 + np.abs(p) ** 2)


COSINES = np.linspace(0.001, 1.0, 999)


@pytest.mark.parametrize("eta", [1.001, 1.33, 1.5, 2.4, 0.7])
def test_fresnel_dielectric(eta):
    body = "Fresnel f = fresnel_dielectric(x[0], x[1]); r[0] = f.f; r[1] = f.cos_t; r[2] = f.eta;"
    for cos_i, ratio in ((COSINES, eta), (-COSINES, 1.0 / eta)):
        f, cos_t, eta_t = call(body, 3, cos_i, eta)
        np.testing.assert_allclose(f, dielectric(COSINES, ratio), atol=5e-4)
        np.testing.assert_allclose(eta_t, ratio, rtol=1e-6)
        exact = np.sqrt(np.maximum(0.0, 1.0 - (1.0 - COSINES**2) / ratio**2))
        np.testing.assert_allclose(cos_t, -np.sign(cos_i) * exact, atol=5e-4)


@pytest.mark.parametrize(("eta", "k"), [(0.143, 3.98), (1.44, 1.6), (0.0, 1.0), (1.5, 0.0)])
def test_fresnel_metal(eta, k):
    (f,) = call("r[0] = fresnel_metal(x[0], x[1], x[2]);", 1, COSINES, eta, k)
    np.testing.assert_allclose(f, dielectric(COSINES, eta + 1j * k), atol=1e-6)


def test_fresnel_metal_has_its_digits_however_it_is_rounded():
    """No root is taken of the difference of two numbers that are nearly equal."""
    off = "#define sqrt_r(x) (sqrt(x) * 1.0000002f)\n"
    given = np.stack(np.broadcast_arrays(COSINES, 0.0, 1.0)).astype(np.float32)
    text = map_text("r[0] = fresnel_metal(x[0], x[1], x[2]);", 3, 1, files=FILES)
    place = text.index('#include "materials/fresnel.cl"')
    (f,) = run(text[:place] + off + text[place:], 16, given, 1)
    np.testing.assert_allclose(f, 1.0, atol=3e-6)


@pytest.mark.parametrize("eta", [0.45, 0.6, 0.75, 0.9, 1.1, 1.33, 1.5, 2.0, 2.5])
def test_fresnel_diffuse(eta):
    critical = [np.sqrt(max(0.0, 1.0 - eta**2))]
    exact, _ = quad(lambda c: 2.0 * c * dielectric(c, eta), 0.0, 1.0, points=critical)
    (f,) = call("r[0] = fresnel_diffuse(x[0]);", 1, eta)
    assert f[0] == pytest.approx(exact, abs=2e-3)


def hemisphere(n=1200):
    """Directions (3, n * n / 4) over the upper hemisphere, finer near the pole; solid angles."""
    v = (np.arange(n) + 0.5) / n
    t, dt = 0.5 * np.pi * v**2, np.pi * v / n
    p = (np.arange(n // 4) + 0.5) / (n // 4) * 2.0 * np.pi
    t, p = np.meshgrid(t, p, indexing="ij")
    w = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)]).reshape(3, -1)
    return w, (np.sin(t) * dt[:, None] * 2.0 * np.pi / (n // 4)).ravel()


BODY = """Microfacets d = microfacets_of(to_integer(x[0]), x[1], x[2]);
    vec3 m = v3(x[3], x[4], x[5]), w = v3(x[6], x[7], x[8]);
    r[0] = microfacet_d(d, m); r[1] = microfacet_visible_pdf(d, w, m);"""


@pytest.mark.parametrize("distribution", [0, 1], ids=NAMES)
@pytest.mark.parametrize("alphas", [(0.1, 0.1), (0.05, 0.5), (1.0, 0.7)])
@pytest.mark.parametrize("degrees", [0.0, 50.0, 85.0])
def test_densities_are_normalised(distribution, alphas, degrees):
    m, solid = hemisphere()
    w = np.array([np.sin(np.radians(degrees)) * 0.8, np.sin(np.radians(degrees)) * 0.6, 0.0])
    w[2] = np.cos(np.radians(degrees))
    d, visible = call(BODY, 2, distribution, *alphas, *m, *w)
    assert (d * m[2] * solid).sum() == pytest.approx(1.0, abs=2e-3)
    # Beckmann's G1 is a rational fit, off by up to 0.4%
    assert (visible * solid).sum() == pytest.approx(1.0, abs=2e-3 if distribution == 0 else 6e-3)


def test_ggx_density():
    m, _ = hemisphere(80)
    (d, _) = call(BODY, 2, 0, 0.3, 0.2, *m, 0.0, 0.0, 1.0)
    exact = 1.0 / (np.pi * 0.06 * ((m[0] / 0.3) ** 2 + (m[1] / 0.2) ** 2 + m[2] ** 2) ** 2)
    np.testing.assert_allclose(d, exact, rtol=1e-5)


@pytest.mark.parametrize("eta", [1.3, 1.5, 1.8])
def test_smooth_coat_passes_what_fresnel_says(eta):
    body = """Microfacets d = microfacets_of(to_integer(x[2]), (real)(1e-4f), (real)(1e-4f));
    r[0] = coat_transmittance(d, x[0], x[1]);"""
    for distribution in (0, 1):
        (t,) = call(body, 1, COSINES[20:], eta, distribution)
        np.testing.assert_allclose(t, 1.0 - dielectric(COSINES[20:], eta), atol=3e-3)


COAT = "Microfacets d = microfacets_of(to_integer(x[0]), x[1], x[1]);"


def coat_points():
    """Distribution, roughness and index (3, n), between the nodes of the tables."""
    alphas = [1e-4, 0.002, 0.013, 0.07, 0.13, 0.31, 0.57, 0.83, 1.0]
    etas = [1.01, 1.03, 1.11, 1.21, 1.31, 1.333, 1.49, 1.5046, 1.7, 2.1, 2.42, 2.95]
    return np.stack([g.ravel() for g in np.meshgrid([0, 1], alphas, etas, indexing="ij")])


def test_coat_tables_are_the_ones_that_are_made():
    kept, made = coats.kept(), coats.computed()
    assert kept.keys() == made.keys()
    for name, table in made.items():
        np.testing.assert_array_equal(kept[name], table, err_msg=name)


def test_coat_transmittance_follows_its_integral():
    cos_i = np.concatenate([np.linspace(0.003, 0.1, 12), np.linspace(0.13, 1.0, 20)])
    points = coat_points()
    given = [np.repeat(row, len(cos_i)) for row in points]
    body = f"{COAT} r[0] = coat_transmittance(d, x[3], x[2]);"
    (found,) = call(body, 1, *given, np.tile(cos_i, points.shape[1]))
    exact = [facets.transmittance(NAMES[int(d)], a, e, cos_i) for d, a, e in points.T]
    off = np.abs(found.reshape(-1, len(cos_i)) - exact)
    assert off[points[2] >= 1.2].max() < 0.01  # all that coats are made of
    assert off[points[2] >= 1.1].max() < 0.02 and off.max() < 0.05  # at grazing angles
    assert ((off * cos_i).sum(1) / cos_i.sum()).max() < 0.004


def test_what_a_coat_throws_back_follows_its_integral():
    cos_i = np.linspace(0.05, 1.0, 12)
    points = coat_points()
    given = [np.repeat(row, len(cos_i)) for row in points]
    body = f"{COAT} r[0] = coat_inside_reflectance(d, x[2]); r[1] = coat_bounced(d);"
    body += "r[2] = coat_thrown_back(d, x[3], x[2]);"
    found = call(body, 3, *given, np.tile(cos_i, points.shape[1])).reshape(3, -1, len(cos_i))
    inside, bounce, thrown = found
    exact = [facets.inside_reflectance(NAMES[int(d)], a, e) for d, a, e in points.T]
    assert np.abs(inside[:, 0] - exact).max() < 0.01
    exact = [facets.bounce(NAMES[int(d)], a) for d, a, _ in points.T]
    assert np.abs(bounce[:, 0] - exact).max() < 0.01
    off = np.abs(thrown - [facets.thrown_back(NAMES[int(d)], a, e, cos_i) for d, a, e in points.T])
    assert off.max() < 0.07 and off.mean() < 0.01  # most at the critical angle, of a smooth metal
    assert off[points[1] > 0.3].max() < 0.04


@pytest.mark.parametrize("name", NAMES)
def test_a_coats_integrals_give_no_light(name):
    """What passes a smooth coat inwards passes it outwards too, over eta^2; masks only take."""
    cos_i = (np.arange(200) + 0.5) / 200
    for eta in (1.2, 1.5, 2.4):
        for alpha in (1e-3, 0.3, 1.0):
            inwards = 2.0 * (cos_i * facets.transmittance(name, alpha, eta, cos_i)).mean()
            outwards = eta**2 * (1.0 - facets.inside_reflectance(name, alpha, eta))
            assert inwards <= outwards * (1.0 + 1e-3), (alpha, eta)
