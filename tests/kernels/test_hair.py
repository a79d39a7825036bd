"""Hair: its value against Mitsuba's, and the Bessel function that it is made of."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import i0e

from clpt.scene.materials import Hair
from clpt.testing.settings import pairs
from tests.kernels.harness import Probe, map_text, run

SETTINGS = (
    {"sigma_a": [0.2, 0.5, 0.9], "longitudinal_roughness": 0.3, "azimuthal_roughness": 0.3,
     "scale_tilt": 2.0, "eta": 1.55},
    {"sigma_a": [0.05] * 3, "longitudinal_roughness": 0.1, "azimuthal_roughness": 0.6,
     "scale_tilt": 7.0, "eta": 1.3},
    {"sigma_a": [0.0] * 3, "longitudinal_roughness": 0.9, "azimuthal_roughness": 0.9,
     "scale_tilt": 0.0, "eta": 1.8},
)  # fmt: skip


def test_bessel():
    x = np.concatenate([np.linspace(0.0, 20.0, 4001), np.logspace(1, 5, 2000)]).astype(np.float32)
    text = map_text("r[0] = bessel_i0_scaled(x[0]);", 1, 1, files=("core/math.cl",))
    made = run(text, 16, x[None], 1)[0]
    np.testing.assert_allclose(made, i0e(x.astype(float)), rtol=6e-7)


@pytest.mark.peers
def test_value_is_mitsubas():
    """Within 0.6%: where 1 / v exceeds 12, Mitsuba's Bessel function is an asymptote so far off."""
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    rng, context = np.random.default_rng(5), mi.BSDFContext()
    for params in SETTINGS:
        given = {"int_ior": params["eta"], "ext_ior": 1.0, "type": "hair"}
        given |= {k: v for k, v in params.items() if k not in ("eta", "sigma_a")}
        given["sigma_a"] = {"type": "rgb", "value": params["sigma_a"]}
        bsdf = mi.load_dict(given)
        wo, wi = pairs(rng, 300)
        ours = Probe(Hair, "rgb")(params, wo, wi, wo)
        for i in range(len(wo)):
            si = mi.SurfaceInteraction3f()
            si.wi = mi.Vector3f(*map(float, wo[i]))
            value, pdf = bsdf.eval_pdf(context, si, mi.Vector3f(*map(float, wi[i])))
            np.testing.assert_allclose(ours["eval"][i], [*value], rtol=6e-3, atol=1e-6)
            if len({*params["sigma_a"]}) == 1:  # else lobes are chosen by another mean
                np.testing.assert_allclose(ours["pdf"][i], pdf, rtol=6e-3, atol=1e-6)
