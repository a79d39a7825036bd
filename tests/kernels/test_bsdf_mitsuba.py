"""Our material kinds mean what Mitsuba 3's plugins of the same name mean.

Both sides compute in single precision, so values are compared relative to the largest component
with a floor. Mitsuba's `wi` is our `wo`.
"""

from __future__ import annotations

import numpy as np
import pytest

from clpt.scene import materials as m
from tests.kernels.harness import Probe
from tests.kernels.settings import cosine_pairs, directions

mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
pytestmark = pytest.mark.peers

RGB = [0.8, 0.5, 0.3]
GOLD = {"eta": [0.143, 0.375, 1.442], "k": [3.983, 2.386, 1.603]}


def _spectrum(value):
    return {"type": "rgb", "value": list(value)} if np.ndim(value) else {"type": "uniform", "value": value}


def _pair(cls, plugin: str, params: dict, spectra=(), renamed=None):
    """Our parameters and Mitsuba's plugin for them."""
    theirs = {"type": plugin}
    for name, value in params.items():
        theirs[(renamed or {}).get(name, name)] = _spectrum(value) if name in spectra else value
    ours = {k: 0 if v == "ggx" else 1 if v == "beckmann" else v for k, v in params.items()}
    return cls, ours, theirs


def _rough(distribution, au, av):
    return {"distribution": distribution, "alpha_u": au, "alpha_v": av}


def _settings():
    full = {"specular_reflectance": 1.0}
    yield _pair(m.Diffuse, "diffuse", {"reflectance": RGB}, ["reflectance"])
    yield _pair(m.Conductor, "conductor", GOLD | {"specular_reflectance": RGB}, ["eta", "k", "specular_reflectance"])
    glass = {"specular_reflectance": RGB, "specular_transmittance": [0.3, 0.9, 0.6]}
    for inside, outside in ((1.5, 1.0), (1.0, 1.33)):
        ior = {"int_ior": inside, "ext_ior": outside}
        for cls, plugin in ((m.Dielectric, "dielectric"), (m.ThinDielectric, "thindielectric")):
            yield _pair(cls, plugin, ior | glass, list(glass))
        for distribution, au, av in (("ggx", 0.3, 0.3), ("beckmann", 0.15, 0.15), ("ggx", 0.4, 0.1)):
            rough = _rough(distribution, au, av)
            yield _pair(m.RoughDielectric, "roughdielectric", ior | glass | rough, list(glass))
        for nonlinear in (False, True):
            base = {"diffuse_reflectance": RGB, "specular_reflectance": [0.9, 0.7, 1.0]}
            coat = ior | {"nonlinear": nonlinear}
            yield _pair(m.Plastic, "plastic", coat | base, list(base))
            for distribution, alpha in (("ggx", 0.1), ("beckmann", 0.3), ("ggx", 0.6)):
                rough = coat | base | {"distribution": distribution, "alpha": alpha}
                yield _pair(m.RoughPlastic, "roughplastic", rough, list(base))
    for distribution, au, av in (("ggx", 0.2, 0.2), ("beckmann", 0.05, 0.4), ("ggx", 0.9, 0.3), ("beckmann", 0.8, 0.8)):
        rough = GOLD | full | _rough(distribution, au, av)
        yield _pair(m.RoughConductor, "roughconductor", rough, ["eta", "k", "specular_reflectance"])


SETTINGS = list(_settings())
IDS = [f"{c.kind}-{i}" for i, (c, _, _) in enumerate(SETTINGS)]


@pytest.fixture(scope="module", autouse=True)
def variant():
    mi.set_variant("scalar_rgb")


def _interaction(wo):
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(*map(float, wo))
    return si


def _close(ours, theirs, rtol, floor):
    scale = np.maximum(np.abs(theirs), floor)
    worst = np.max(np.abs(ours - theirs) / scale)
    assert worst < rtol, f"relative difference {worst:.2e}"


@pytest.mark.parametrize("setting", SETTINGS, ids=IDS)
def test_eval_and_pdf(setting):
    cls, ours, theirs = setting
    bsdf, rng = mi.load_dict(theirs), np.random.default_rng(5)
    wo, wi = cosine_pairs(rng, 300)
    result = Probe(cls, "rgb")(ours, wo, wi, rng.random((len(wo), 3)))
    context = mi.BSDFContext()
    pairs = [bsdf.eval_pdf(context, _interaction(a), mi.Vector3f(*map(float, b))) for a, b in zip(wo, wi, strict=True)]
    _close(result["eval"], np.array([[*f] for f, _ in pairs]), 2e-3, 1e-3)
    _close(result["pdf"], np.array([p for _, p in pairs]), 2e-3, 1e-3)


@pytest.mark.parametrize("setting", [s for s in SETTINGS if s[0] in (m.Conductor, m.Dielectric, m.ThinDielectric)])
def test_sampled_deltas(setting):
    cls, ours, theirs = setting
    bsdf, rng = mi.load_dict(theirs), np.random.default_rng(6)
    wo, u = directions(rng, 200), rng.random((200, 3))
    result = Probe(cls, "rgb")(ours, wo, wo, u)
    context = mi.BSDFContext()
    for i in range(len(wo)):
        sample, weight = bsdf.sample(context, _interaction(wo[i]), float(u[i, 2]), mi.Point2f(0.5, 0.5))
        assert sample.pdf == pytest.approx(float(result["sampled_pdf"][i]), abs=2e-6)
        if sample.pdf > 0:
            np.testing.assert_allclose(result["wi"][i], [*sample.wo], atol=2e-6)
            np.testing.assert_allclose(result["weight"][i], [*weight], rtol=2e-5)
            assert float(result["eta"][i]) == pytest.approx(float(sample.eta), rel=1e-6)
