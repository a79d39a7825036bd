"""glTF's material against formulas, quadrature, and Mitsuba's principled where the two coincide."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.render.materials.thin_films import film_colours, film_shares
from clpt.scene.materials import Conductor, GltfSurface, Layer
from clpt.scene.params import device_params
from clpt.testing.checks import albedos
from clpt.testing.probe import LAMBDAS
from clpt.testing.settings import pairs, tilted
from tests.kernels.harness import Probe

UP = np.array([[0.0, 0.0, 1.0]])
PLAIN = GltfSurface()


def _params(**given):
    """A plain white dielectric of roughness one but for what is given; for `Probe`, in RGB."""
    values = {}
    for name in device_params(GltfSurface):
        value = given.get(name, getattr(PLAIN, name))
        values[name] = np.asarray(value if np.ndim(value) else getattr(value, "value", value))
    return values


def _normal(mode="rgb", **given):
    """Reflectance at normal incidence: f |cos| over D / 4."""
    made = _params(**given)
    found = Probe(GltfSurface, mode)(made, UP, UP, UP)["eval"][0]
    return found * 4.0 * np.pi * float(made["roughness"]) ** 4


def test_normal_incidence():
    black = {"base_color": 0.0, "roughness": 0.3}
    np.testing.assert_allclose(_normal(**black), 0.04, rtol=1e-4)
    np.testing.assert_allclose(
        _normal(**black, ior=1.8, specular=0.5), 0.5 * (0.8 / 2.8) ** 2, rtol=1e-4
    )
    glossy = _normal(**black, ior=0.0, specular_color=[0.3, 0.5, 0.7])
    np.testing.assert_allclose(glossy, [0.3, 0.5, 0.7], rtol=1e-4)
    metal = _normal(base_color=[0.9, 0.6, 0.2], metallic=1.0, roughness=0.3)
    np.testing.assert_allclose(metal, [0.9, 0.6, 0.2], rtol=1e-4)
    coat = _normal(**(black | {"roughness": 0.99}), clearcoat=0.5, clearcoat_roughness=0.3)
    scale = 0.99**4 / 0.3**4  # that of the coat's D; the base's is as nothing beside it
    np.testing.assert_allclose(coat, 0.5 * 0.04 * scale, rtol=0.02)


@pytest.mark.parametrize(
    ("given", "roughness", "tolerance"),
    [
        ({}, (0.1, 0.5, 1.0), 0.012),
        ({"diffuse_transmission": 0.6, "thin": 1}, (0.1, 0.5, 1.0), 0.012),
        ({"transmission": 1.0, "thin": 1}, (0.1,), 0.012),
        ({"transmission": 1.0}, (0.1,), 0.012),
        ({"clearcoat": 1.0, "clearcoat_roughness": 0.2}, (0.5,), 0.06),
        ({"sheen_color": 0.6, "sheen_roughness": 0.5}, (1.0,), 0.12),
        ({"metallic": 1.0, "multiple_scattering": 1.0}, (0.6, 1.0), 0.02),
        ({"ior": 0.0, "multiple_scattering": 1.0}, (0.6, 1.0), 0.02),
        ({"multiple_scattering": 1.0}, (0.5, 1.0), 0.012),
    ],
    ids=["diffuse", "leaf", "pane", "glass", "coat", "sheen", "metal", "mirror", "bounced"],
)
def test_white_furnace(given, roughness, tolerance):
    """White layers lose what the lesser of two transmittances loses, and make nothing."""
    rng, probe = np.random.default_rng(2), Probe(GltfSurface, "rgb")
    for r in roughness:
        mean, error = albedos(probe, _params(roughness=r, **given), rng, (5.0, 45.0, 70.0, 80.0))
        assert np.all(mean - 1.0 < 3e-3 + 4.0 * error), (r, mean.max())
        assert np.all(mean > 1.0 - tolerance - 4.0 * error), (r, mean.min())


def test_coat_of_its_own_normal():
    """GGX about another normal, by its formula; what leans away keeps the ratio of cosines."""
    n = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
    wo, wi = (np.abs(w) for w in pairs(np.random.default_rng(5), 300))
    given = {f"clearcoat_normal_{x}": n[i] / 2 + 0.5 for i, x in enumerate("xyz")}
    given |= {"clearcoat": 0.7, "clearcoat_roughness": 0.4, "clearcoat_apart": 1.0}
    made = _params(base_color=0.0, specular=0.0, **given)
    found = Probe(GltfSurface, "rgb")(made, wo, wi, wo)["eval"][:, 0]
    h = wo + wi
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    alpha2 = 0.4**4
    o, i, m = np.maximum(wo @ n, 1e-9), np.maximum(wi @ n, 1e-9), h @ n
    d = alpha2 / (np.pi * (m * m * (alpha2 - 1.0) + 1.0) ** 2)
    masked = [2 * c / (c + np.sqrt(alpha2 + (1 - alpha2) * c * c)) for c in (o, i)]
    schlick = 0.04 + 0.96 * (1.0 - (wo * h).sum(axis=1)) ** 5
    f = 0.7 * d * masked[0] * masked[1] * schlick / (4.0 * o * i)
    lean = np.minimum(o / wo[:, 2], 1.0) * np.minimum(i / wi[:, 2], 1.0)
    expected = np.where((wo @ n > 0) & (wi @ n > 0), f * lean * wi[:, 2], 0.0)
    np.testing.assert_allclose(found, expected, rtol=3e-3, atol=1e-5)


def _charlie_l(x, a):
    t = (1.0 - a) ** 2
    first, second = (
        (21.5473, 3.82987, 0.19823, -1.9776, -4.32054),
        (25.3245, 3.32435, 0.16801, -1.27393, -4.85967),
    )
    k = [p * (1.0 - t) + q * t for p, q in zip(first, second, strict=True)]
    return k[0] / (1.0 + k[1] * x ** k[2]) + k[3] * x + k[4]


def _charlie_lambda(c, a):
    low = np.exp(_charlie_l(np.minimum(c, 0.5), a))
    high = np.exp(2.0 * _charlie_l(0.5, a) - _charlie_l(1.0 - np.maximum(c, 0.5), a))
    return np.where(c < 0.5, low, high)


def test_sheen_is_charlie():
    """Estevez and Kulla 2017, eq. 2 and 3, under KHR_materials_sheen's alpha."""
    wo, wi = (np.abs(w) for w in pairs(np.random.default_rng(3), 300))
    h = wo + wi
    h /= np.linalg.norm(h, axis=1, keepdims=True)
    for roughness in (0.3, 0.8):
        a = roughness**2
        d = (2.0 + 1.0 / a) * (1.0 - h[:, 2] ** 2) ** (0.5 / a) / (2.0 * np.pi)
        masking = 1.0 + _charlie_lambda(wo[:, 2], a) + _charlie_lambda(wi[:, 2], a)
        given = {"sheen_color": [0.2, 0.5, 1.0], "sheen_roughness": roughness}
        made = _params(base_color=0.0, specular=0.0, **given)
        found = Probe(GltfSurface, "rgb")(made, wo, wi, wo)["eval"]
        expected = (d / masking / (4.0 * wo[:, 2]))[:, None] * [0.2, 0.5, 1.0]
        np.testing.assert_allclose(found, expected, rtol=3e-3, atol=1e-6)


def test_iridescence_at_normal_incidence():
    """There the approximations are none: the waves of a film on glass, by film_shares."""
    lambdas = np.array(LAMBDAS)
    for film, thickness in ((1.33, 300.0), (1.8, 520.0)):
        made = {"base_color": 0.0, "roughness": 0.3, "ior": 1.5, "iridescence": 1.0}
        made |= {"iridescence_ior": film, "iridescence_thickness": thickness}
        indices = [np.full(4, n, complex) for n in (1.0, film, 1.5)]
        expected = film_shares(indices, [thickness], np.zeros((1, 4), complex), lambdas)[0][0]
        np.testing.assert_allclose(_normal("spectral", **made), expected, atol=2e-3)


def test_iridescent_colours():
    """In RGB mode two orders of Gaussians come near the colours that a table holds."""
    film = Layer(eta=1.5, thickness=350.0)
    table = film_colours(Conductor(eta=3.0, k=0.0, layers=(film,)))[0, 0, -1, :3]
    made = {"base_color": 0.25, "metallic": 1.0, "roughness": 0.3, "iridescence": 1.0}
    found = _normal(**made, iridescence_ior=1.5, iridescence_thickness=350.0)
    np.testing.assert_allclose(found, table, atol=0.06)


def test_anisotropy_turns():
    """A lobe along x turned by 90 degrees lies along y."""
    across = np.stack([tilted(a, azimuth) for a in (10.0, 40.0) for azimuth in (0.0, np.pi / 2)])
    lobe = {"metallic": 1.0, "roughness": 0.4, "anisotropy": 0.8}
    probe = Probe(GltfSurface, "rgb")
    plain = probe(_params(**lobe), UP, across, across)["eval"][:, 0]
    turned = probe(_params(**lobe, anisotropy_rotation=90.0), UP, across, across)["eval"][:, 0]
    np.testing.assert_allclose(turned, plain.reshape(2, 2)[:, ::-1].ravel(), rtol=1e-3)
    assert plain[2] > 10.0 * plain[3]  # wider along the tangent


@pytest.mark.peers
def test_metal_is_that_of_principled():
    """Metals of both are Schlick's reflectance on GGX; a black dielectric differs by Schlick."""
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with")
    mi.set_variant("scalar_rgb")
    colour = [0.9, 0.6, 0.2]
    rgb = {"type": "rgb", "value": colour}
    wo, wi = pairs(np.random.default_rng(4), 300)
    for roughness, metallic in ((0.3, 1.0), (0.8, 1.0), (0.3, 0.0)):
        given = {"roughness": roughness, "metallic": metallic, "eta": 1.5}
        given["base_color"] = rgb if metallic else {"type": "rgb", "value": [0.0, 0.0, 0.0]}
        bsdf, context = mi.load_dict({"type": "principled", **given}), mi.BSDFContext()
        made = _params(
            base_color=colour if metallic else 0.0, metallic=metallic, roughness=roughness
        )
        ours = Probe(GltfSurface, "rgb")(made, wo, wi, wo)["eval"]
        theirs = []
        for o, i in zip(wo, wi, strict=True):
            si = mi.SurfaceInteraction3f()
            si.wi = mi.Vector3f(*map(float, o))
            theirs.append([*bsdf.eval(context, si, mi.Vector3f(*map(float, i)))])
        near = {"rtol": 3e-3, "atol": 1e-5} if metallic else {"rtol": 0.25, "atol": 1e-3}
        np.testing.assert_allclose(ours, theirs, **near)
