"""Light scattered many times: slabs beside adding and doubling and DISORT, a half space beside H.

Significance as in tests/pictures/support.py. A slab lies across z, and the light comes from +z.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.scene import Film, Scene, media, phases
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Box, Path
from clpt.scene.lights import Directional
from clpt.scene.materials import Null
from clpt.scene.shapes import Cube
from tests.pictures.media import slabs
from tests.pictures.support import assert_mean, exposures

ALBEDOS = (0.6, 0.95, 1.0)  # of the three colours
WITHIN = 0.05  # relative; most of it is noise
WIDE = 2e5  # rays begin off surfaces by its rounding, which flights take into account
QUICK = (2.0, 0.7)
CASES = [(0.3, 0.0), (2.0, 0.7), (2.0, -0.4), (8.0, 0.0), (8.0, 0.9)]  # optical depth, g


def slab(depth: float, g: float, albedo=ALBEDOS, mu0: float = 1.0) -> Scene:
    """A slab of extinction 1 under a beam of irradiance 1, mu0 the cosine of its direction."""
    phase = phases.HenyeyGreenstein(g=g) if g else phases.Isotropic()
    medium = media.Homogeneous(sigma_t=1.0, albedo=albedo, phase=phase)
    size = tf.scale([WIDE, WIDE, depth / 2.0])
    sine = np.sqrt(1.0 - mu0**2)
    return Scene(
        camera=Perspective(),
        shapes=[Cube(material=Null(), interior=medium, to_world=size)],
        lights=[Directional(direction=(sine, 0.0, -mu0), irradiance=1.0)],
        film=Film(width=8, height=8, filter=Box(), mode="rgb"),
        integrator=Path(max_depth=-1, rr_depth=64, light_paths=0),
    )


def seen(scene: Scene, depth: float, mu: float, azimuth: float = 0.0, spp: int = 64) -> np.ndarray:
    """Exposures of a spot of the slab that sends light to the cosine mu, below 0 downward."""
    sine = np.sqrt(1.0 - mu**2)
    out = np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), mu])
    spot = np.array([0.0, 0.0, np.sign(mu) * depth / 2.0])
    view = tf.look_at(spot + 5.0 * out, spot, [0, 1, 0])
    camera = Perspective(to_world=view, fov=0.05)
    return exposures(dataclasses.replace(scene, camera=camera), 8, spp)


@pytest.mark.parametrize(
    ("depth", "g"),
    [pytest.param(*case, marks=[] if case == QUICK else pytest.mark.slow) for case in CASES],
)
def test_slabs(depth: float, g: float) -> None:
    """Radiance above and below a slab, of three albedos, also where nothing is absorbed."""
    told = [slabs.beam_on_slab(depth, albedo, g) for albedo in ALBEDOS]
    mu = told[0][0]
    nodes, spp = ((10, 40), 1024) if (depth, g) != QUICK else ((40,), 64)
    for node in nodes:
        for side, number in ((1.0, 1), (-1.0, 2)):
            expected = [one[number][node] for one in told]
            found = seen(slab(depth, g), depth, side * mu[node], spp=spp)
            assert_mean(found, expected, WITHIN)


@pytest.mark.slow
@pytest.mark.parametrize(("mu", "mu0"), [(0.9, 1.0), (0.5, 0.7), (0.3, 0.3)])
def test_half_space(mu: float, mu0: float) -> None:
    """A thick isotropic slab is Chandrasekhar's half space."""
    albedo = (0.3, 0.8, 0.98)
    expected = [slabs.half_space(mu, mu0, one) for one in albedo]
    scene = slab(60.0, 0.0, albedo, mu0)
    assert_mean(seen(scene, 60.0, mu, azimuth=0.7), expected, WITHIN)


@pytest.mark.slow
@pytest.mark.parametrize(("depth", "g"), [(1.0, 0.5), (4.0, 0.8)])
def test_disort(depth: float, g: float) -> None:
    """Oblique light toward several azimuths, beside DISORT (Stamnes et al. 1988)."""
    disort = pytest.importorskip("PythonicDISORT")
    streams, mu0 = 48, 0.6
    told = [
        disort.pydisort(
            depth, one, streams, g ** np.arange(2 * streams), mu0, 1.0, 0.0,
            NLeg=streams, NFourier=streams, f_arr=g**streams, NT_cor=True,
        )
        for one in (0.6, 0.95, 1.0 - 1e-6)
    ]  # fmt: skip
    mu = told[0][0]
    for node, azimuth in ((15, 0.0), (15, 2.0), (20, np.pi), (streams // 2 + 15, 1.0)):
        place = 0.0 if mu[node] > 0.0 else depth
        expected = [float(np.asarray(one[-1](place, azimuth))[node]) for one in told]
        scene = slab(depth, g, mu0=mu0)
        assert_mean(seen(scene, depth, mu[node], azimuth), expected, WITHIN)


def test_the_references() -> None:
    """H as Chandrasekhar's tables have it; a slab without absorption keeps all light."""
    assert float(slabs.h_function(1.0, 1.0)) == pytest.approx(2.9078, abs=1e-4)
    mu, up, down = slabs.beam_on_slab(3.0, 1.0, 0.6)
    fluxes = 2.0 * np.pi * (slabs.gauss(len(mu))[1] * mu) @ np.stack([up, down], axis=1)
    assert fluxes.sum() + np.exp(-3.0) == pytest.approx(1.0, abs=1e-5)
