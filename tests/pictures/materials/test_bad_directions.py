"""A material of one's own may send a path in no direction: the path ends, the process does not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import clpt
from clpt.scene import Film, Scene
from clpt.scene.lights import Constant, CubeMap, Envmap, Light
from clpt.scene.materials import Material
from clpt.scene.shapes import Sphere
from tests.pictures.builders import facing_down

IMAGE = np.ones((4, 8, 3), np.float32)
SKIES = [
    Constant(radiance=(1.0, 1.0, 1.0)),
    Envmap(image=IMAGE),
    CubeMap(image=[np.ones((2, 2, 3), np.float32)] * 6),
]


@dataclass(frozen=True, kw_only=True, eq=False)
class Nowhere(Material):
    """Scatters along 0 / 0, which optimisation must not see through."""

    source = """
        BsdfSample nowhere_sample(Nowhere m, vec3 wo, vec3 u)
        {
            BsdfSample s = bsdf_nothing();
            real zero = u.x * 0.0f, none = zero / zero;
            s.wi = v3(none, sel(u.y > 0.5f, none, wo.y), none);
            s.weight = spectrum_of(1.0f);
            s.pdf = 1.0f;
            return s;
        }
        Spectrum nowhere_eval(Nowhere m, vec3 wo, vec3 wi) { return spectrum_of(0.0f); }
        real nowhere_pdf(Nowhere m, vec3 wo, vec3 wi) { return 0.0f; }
        Spectrum nowhere_albedo(Nowhere m) { return spectrum_of(0.0f); }
    """


@pytest.mark.parametrize("sky", SKIES, ids=lambda sky: sky.kind)
def test_a_direction_that_is_no_number(sky: Light) -> None:
    """Nothing arrives, from whatever sky, and nothing is read outside of its image."""
    scene = Scene(
        camera=facing_down(),
        shapes=[Sphere(radius=0.02, material=Nowhere())],
        lights=[sky],
        film=Film(width=4, height=4, mode="rgb"),
    )
    renderer = clpt.Renderer(scene)
    renderer.run(4)
    assert renderer.image().max() == 0.0
    assert renderer._wavefront.counts.rejected == 0
