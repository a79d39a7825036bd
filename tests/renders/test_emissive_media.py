"""Media that give out light: slabs in closed form, furnaces, grids against quadrature.

Significance as in tests/renders/support.py. All quick tests in a mode share their kernels.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clpt import spectra
from clpt import transforms as tf
from clpt.scene import Film, Scene, media
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Box
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.lights import Constant
from clpt.scene.materials import Null
from clpt.scene.shapes import Cube
from tests.renders.support import assert_mean, exposures, with_film

LONG = PathIntegrator(max_depth=-1, rr_depth=1000, light_paths=0)
CHROMATIC = np.array([0.5, 2.0, 3.0])  # [1/m]
COLOUR = np.array([0.2, 0.6, 0.9])
LAMBDAS = np.arange(380.0, 741.0, 5.0)
ABSORBS = spectra.Tabulated(LAMBDAS, 0.2 + 1e-5 * (LAMBDAS - 400.0) ** 2, "hold")
GLOWS = spectra.Blackbody(2500.0)
WITHIN = 0.02


def slab(medium: media.Medium, light: Any = 0.0, **film: Any) -> Scene:
    """A cube of 2 m that parallel rays go through, under the same light from everywhere."""
    return Scene(
        camera=Orthographic(
            to_world=tf.look_at([0.1, 0.2, 5], [0.1, 0.2, 0], [0, 1, 0]) @ tf.scale(1e-3)
        ),
        shapes=[Cube(material=Null(), interior=medium)],
        lights=[Constant(radiance=light)],
        film=Film(**{"width": 8, "height": 8, "filter": Box(), "mode": "rgb", **film}),
        integrator=LONG,
    )


def test_slab() -> None:
    """It shows L (1 - exp(-sigma_a d)), exactly: also a thin one."""
    for scale in (1.0, 1e-3):
        medium = media.Homogeneous(sigma_a=CHROMATIC, scale=scale, emission=COLOUR)
        got = exposures(slab(medium), 1, 4).mean(axis=(0, 1, 2))
        np.testing.assert_allclose(got, -COLOUR * np.expm1(-2.0 * scale * CHROMATIC), rtol=2e-5)


def test_slab_at_each_wavelength() -> None:
    medium = media.Homogeneous(sigma_a=ABSORBS, emission=GLOWS)
    got = exposures(slab(medium, mode="spectral", bands=6), 8, 64)
    fine = np.linspace(360.0, 830.0, 60001)[:-1]
    wanted = -GLOWS.sample(fine) * np.expm1(-2.0 * ABSORBS.sample(fine))
    assert_mean(got, wanted.reshape(6, -1).mean(axis=1), 0.05)


@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_furnace(mode: str) -> None:
    """What emits as much as its surroundings cannot be seen before them, whatever it scatters."""
    medium = media.Homogeneous(sigma_a=0.3 * CHROMATIC, sigma_s=CHROMATIC, emission=1.0)
    assert_mean(exposures(slab(medium, 1.0, mode=mode), 8, 64), 1.0, WITHIN)
