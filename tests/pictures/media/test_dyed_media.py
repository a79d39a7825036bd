"""Media with a dye: what it takes at one wavelength and gives out at another, per band.

Significance as in tests/pictures/support.py.
"""

from __future__ import annotations

import numpy as np
import pytest

from clpt import spectra
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.scene import Film, Scene, media, phases
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Box
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.lights import Constant
from clpt.scene.materials import Null
from clpt.scene.shapes import Cube
from tests.pictures.support import assert_mean, exposures

LOW, HIGH, BANDS = 350.0, 650.0, 6
ABSORBS = spectra.Tabulated((339.0, 340.0, 450.0, 451.0), (0.0, 1.0, 1.0, 0.0))
EMITS = spectra.Tabulated((500.0, 520.0, 600.0, 640.0), (0.0, 1.0, 1.0, 0.0))
DYE = spectra.Fluorophore(ABSORBS, EMITS, 1.0)
LIGHT = spectra.Tabulated((370.0, 400.0, 430.0), (0.0, 1.0, 0.0))


def slab(medium: media.Medium, thickness: float, **integrator: float) -> Scene:
    """A wide slab of a medium that a parallel ray goes through, under blue light all around."""
    return Scene(
        camera=Orthographic(
            to_world=tf.look_at([0.07, 0.11, 5], [0.07, 0.11, 0], [0, 1, 0]) @ tf.scale(1e-4)
        ),
        shapes=[
            Cube(
                material=Null(),
                interior=medium,
                to_world=tf.scale([1000.0, 1000.0, 0.5 * thickness]),
            )
        ],
        lights=[Constant(radiance=LIGHT)],
        film=Film(width=8, height=8, filter=Box(), mode="spectral", bands=BANDS,
                  lambda_min=LOW, lambda_max=HIGH),
        integrator=PathIntegrator(rr_depth=1000, light_paths=0, **integrator),
    )  # fmt: skip


def arriving() -> np.ndarray:
    """The light at whole nanometres."""
    return LIGHT.sample(np.arange(LOW, HIGH + 0.5))


def given() -> np.ndarray:
    """What the dye makes of it there, where all of it is absorbed."""
    nodes = np.arange(LOW, HIGH + 0.5)
    return DYE.sample(nodes[:, None], nodes) @ arriving()


def bands(values: np.ndarray) -> list[float]:
    """Means over the bands of values at whole nanometres."""
    width = (len(values) - 1) // BANDS
    parts = [values[width * i : width * (i + 1) + 1] for i in range(BANDS)]
    return [float(np.trapezoid(part) / width) for part in parts]


def test_thin_slab() -> None:
    """What a slab gives out once, in closed form: the light in it is that of both its sides."""
    strength, thickness = 0.8, 1.0
    medium = media.Dyed(dye=DYE, strength=strength)
    got = exposures(slab(medium, thickness, max_depth=2), 16, 256)
    # Light of radiance 1 comes evenly from both sides; at the depth z its mean over directions is
    # (E2(a z) + E2(a (d - z))) / 2. The ray of the camera is not dimmed where light is given out.
    z = (np.arange(4000) + 0.5) / 4000 * thickness
    mu = (np.arange(2000) + 0.5) / 2000

    def mean(depth: np.ndarray) -> np.ndarray:
        return 0.5 * np.exp(-depth[:, None] / mu).mean(axis=1)

    within = (mean(strength * z) + mean(strength * (thickness - z))).mean() * thickness
    expected = bands(strength * within * given() + np.exp(-strength * thickness) * arriving())
    assert_mean(got, expected, 0.08, 2e-3)


def test_scattered_light() -> None:
    """With elastic scattering beside it, any number of times: a random walk in float64."""
    strength, scatters, thickness = 1.5, 0.7, 1.0
    medium = media.Dyed(dye=DYE, strength=strength, sigma_s=scatters)
    got = exposures(slab(medium, thickness, max_depth=-1), 16, 256)
    rng = np.random.default_rng(3)

    def walk(z: np.ndarray, mu: np.ndarray, taken: float) -> tuple[np.ndarray, np.ndarray]:
        """What light all around brings along rays from z: and what a metre each gives out does."""
        count = len(z)
        weight, leaves, glow = np.ones(count), np.zeros(count), np.zeros(count)
        at = np.arange(count)
        while len(at):
            end = np.where(mu > 0.0, thickness - z, -z) / mu
            t = np.minimum(-np.log(1.0 - rng.random(len(at))) / scatters, end)
            if taken == 0.0:  # a point of each way, from which light is sought
                start = z + mu * t * rng.random(len(at))
                found, _ = walk(start, rng.uniform(-1.0, 1.0, len(at)), strength)
                np.add.at(glow, at, t * found)
            weight = weight * np.exp(-taken * t)
            out = t == end
            leaves[at[out]] = weight[out]
            z, weight, at = (z + mu * t)[~out], weight[~out], at[~out]
            mu = rng.uniform(-1.0, 1.0, len(at))
        return leaves, glow

    rays = np.zeros(40_000), np.ones(40_000)
    passed, glow = walk(*rays, strength)[0], walk(*rays, 0.0)[1]
    assert glow.std() / glow.mean() < 2.0
    expected = bands(strength * glow.mean() * given() + passed.mean() * arriving())
    assert_mean(got, expected, 0.08, 0.02)


def test_what_a_dye_may_be() -> None:
    with pytest.raises(SceneError, match="must be a dye"):
        media.Dyed(dye=spectra.Donaldson((400.0, 500.0), (300.0, 400.0), ((0.0, 0.0), (0.0, 0.0))))
    with pytest.raises(SceneError, match="alike in all directions"):
        media.Dyed(dye=DYE, phase=phases.Rayleigh())
    with pytest.raises(SceneError, match="no light by itself"):
        media.Dyed(dye=DYE, emission=1.0)
    with pytest.raises(SceneError, match="would leave"):
        phases.Reradiating(reflectance=0.9, reradiation=DYE)


def test_without_glow_it_is_homogeneous() -> None:
    """A dye that gives nothing out only absorbs: the bits are those of such a medium."""
    dark = media.Dyed(dye=spectra.Fluorophore(ABSORBS, EMITS, 0.0), strength=1.5, sigma_s=0.7)
    absorbs, scatters = dark.coefficients(spectral=True)
    plain = media.Homogeneous(sigma_a=absorbs, sigma_s=scatters)
    films = [exposures(slab(one, 1.0, max_depth=4), 1, 8) for one in (dark, plain)]
    assert np.array_equal(*films)
