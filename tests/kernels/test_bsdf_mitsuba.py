"""Our material kinds mean what Mitsuba 3's plugins of the same name mean.

Both sides compute in single precision. Mitsuba's `wi` is our `wo`.
"""

from __future__ import annotations

import numpy as np
import pytest

from clpt.scene import materials as m
from clpt.scene.params import device_params
from clpt.scene.roles import CHOICE
from clpt.testing.settings import directions, pairs
from tests.kernels.harness import Probe

mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
pytestmark = pytest.mark.peers

RGB = [0.8, 0.5, 0.3]
GOLD = {"eta": [0.143, 0.375, 1.442], "k": [3.983, 2.386, 1.603]}
GLASS = {"specular_reflectance": RGB, "specular_transmittance": [0.3, 0.9, 0.6]}
PAINT = {"diffuse_reflectance": RGB, "specular_reflectance": [0.9, 0.7, 1.0]}
DISNEY = {
    "base_color": RGB, "roughness": 0.4, "anisotropic": 0.0, "metallic": 0.0, "spec_trans": 0.0,
    "eta": 1.5, "spec_tint": 0.0, "sheen": 0.0, "sheen_tint": 0.0, "flatness": 0.0,
    "clearcoat": 0.0,
}  # fmt: skip
ALL = {"metallic": 0.3, "spec_trans": 0.4, "spec_tint": 0.3, "sheen": 0.4, "sheen_tint": 0.5}
PRINCIPLED = [
    {},
    {"metallic": 0.7, "roughness": 0.2, "anisotropic": 0.8, "clearcoat": 0.9},
    {"sheen": 0.8, "sheen_tint": 0.7, "flatness": 0.6, "roughness": 1.0, "eta": 1.2},
    ALL | {"flatness": 0.3, "clearcoat": 0.7, "anisotropic": 0.5, "eta": 1.8},
    ALL | {"roughness": 0.05, "eta": 0.8},
]
ROUGH = [("ggx", 0.2, 0.2), ("ggx", 0.9, 0.3), ("beckmann", 0.05, 0.4), ("beckmann", 0.8, 0.8)]


def _settings():
    """Triples: a kind of ours, the name of Mitsuba's plugin, the parameters that both take."""
    yield m.Diffuse, "diffuse", {"reflectance": RGB}
    yield m.Conductor, "conductor", GOLD | {"specular_reflectance": RGB}
    for distribution, au, av in ROUGH:
        rough = {"distribution": distribution, "alpha_u": au, "alpha_v": av}
        yield m.RoughConductor, "roughconductor", GOLD | {"specular_reflectance": RGB} | rough
    for inside, outside in ((1.5, 1.0), (1.0, 1.33)):
        ior = {"int_ior": inside, "ext_ior": outside}
        # Mitsuba's thindielectric sums reflections as if each were unpolarised: no reference
        yield m.Dielectric, "dielectric", ior | GLASS
        for distribution, au, av in ROUGH:
            rough = {"distribution": distribution, "alpha_u": au, "alpha_v": av}
            yield m.RoughDielectric, "roughdielectric", ior | GLASS | rough
        for nonlinear in (False, True):
            yield m.Plastic, "plastic", ior | PAINT | {"nonlinear": nonlinear}
    for i, (distribution, alpha, _) in enumerate(ROUGH):
        rough = {"distribution": distribution, "alpha": alpha, "nonlinear": i % 2 == 1}
        yield m.RoughPlastic, "roughplastic", {"int_ior": 1.5, "ext_ior": 1.0} | PAINT | rough
    for i, given in enumerate(PRINCIPLED):
        yield m.Principled, "principled", DISNEY | {"clearcoat_gloss": 0.3} | given
        thin = {"diff_trans": 0.5 * i} | DISNEY | given
        names = device_params(m.PrincipledThin)
        yield m.PrincipledThin, "principledthin", {k: v for k, v in thin.items() if k in names}


SETTINGS = [pytest.param(*s, id=f"{s[0].kind}-{i}") for i, s in enumerate(_settings())]
DELTAS = [s for s in SETTINGS if s.values[0] in (m.Conductor, m.Dielectric)]
# the coat's transmittance is a quadrature of ours and a table of theirs
TOLERANCE = {m.RoughPlastic: 0.08}


@pytest.fixture(scope="module", autouse=True)
def variant():
    mi.set_variant("scalar_rgb")


def _ours(cls, params):
    """Choices and flags as the kernels see them."""
    choices = {k: p.choices for k, p in device_params(cls).items() if p.role is CHOICE}
    return {k: choices[k].index(v) if k in choices else v for k, v in params.items()}


def _theirs(plugin, params):
    def value(v):
        return {"type": "rgb", "value": v} if isinstance(v, list) else v

    return mi.load_dict({"type": plugin} | {k: value(v) for k, v in params.items()})


def _vector(w):
    return mi.Vector3f(*map(float, w))


def _interaction(wo):
    si = mi.SurfaceInteraction3f()
    si.wi = _vector(wo)
    return si


@pytest.mark.parametrize(("cls", "plugin", "params"), SETTINGS)
def test_eval_and_pdf(cls, plugin, params):
    bsdf, context, rng = _theirs(plugin, params), mi.BSDFContext(), np.random.default_rng(5)
    wo, wi = pairs(rng, 400)
    ours = Probe(cls, "rgb")(_ours(cls, params), wo, wi, wo)
    for i in range(len(wo)):
        value, pdf = bsdf.eval_pdf(context, _interaction(wo[i]), _vector(wi[i]))
        if cls is m.Principled and params["spec_trans"] == 0.0 and wo[i, 2] < 0.0:
            pdf = 0.0  # of an opaque back Mitsuba tells one, though it samples nothing there
        near = {"rtol": TOLERANCE.get(cls, 2e-3), "atol": 2e-6}
        np.testing.assert_allclose(ours["eval"][i], [*value], **near)
        np.testing.assert_allclose(ours["pdf"][i], pdf, **near)


@pytest.mark.parametrize(("cls", "plugin", "params"), DELTAS)
def test_sampled_deltas(cls, plugin, params):
    bsdf, context, rng = _theirs(plugin, params), mi.BSDFContext(), np.random.default_rng(6)
    wo, u = directions(rng, 200), rng.random((200, 3))
    ours = Probe(cls, "rgb")(_ours(cls, params), wo, wo, u)
    for i in range(len(wo)):
        point = mi.Point2f(*map(float, u[i, :2]))
        sample, weight = bsdf.sample(context, _interaction(wo[i]), float(u[i, 2]), point)
        np.testing.assert_allclose(ours["sampled_pdf"][i], sample.pdf, atol=2e-6)
        if sample.pdf > 0.0:
            np.testing.assert_allclose(ours["wi"][i], [*sample.wo], atol=2e-6)
            np.testing.assert_allclose(ours["weight"][i], [*weight], rtol=2e-5)
            np.testing.assert_allclose(ours["eta"][i], sample.eta, rtol=1e-6)


@pytest.mark.parametrize("distribution", ["ggx", "beckmann"])
@pytest.mark.parametrize("alpha", [0.05, 0.3, 0.7])
@pytest.mark.parametrize("ior", [1.3, 1.49, 1.8])
def test_rough_plastic_is_as_bright(distribution, alpha, ior):
    """The diffuse part over all directions agrees better than it does at grazing ones."""
    params = {"int_ior": ior, "ext_ior": 1.0, "diffuse_reflectance": [0.8, 0.8, 0.8]}
    params |= {"specular_reflectance": [0.0, 0.0, 0.0], "nonlinear": False}
    params |= {"distribution": distribution, "alpha": alpha}
    bsdf, context, rng = _theirs("roughplastic", params), mi.BSDFContext(), np.random.default_rng(7)
    wo, wi = (np.abs(directions(rng, 500)) for _ in range(2))
    ours = Probe(m.RoughPlastic, "rgb")(_ours(m.RoughPlastic, params), wo, wi, wo)["eval"][:, 0]
    interactions = [_interaction(w) for w in wo]
    theirs = [bsdf.eval(context, s, _vector(w))[0] for s, w in zip(interactions, wi, strict=True)]
    assert ours.sum() == pytest.approx(sum(theirs), rel=0.008)
