"""Samples that serve all pixels whose filters hold them: mean, constants, bright light, bands."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.render.scene_index import SceneIndex
from clpt.scene import Film, Scene, lights
from clpt.scene import integrators as it
from clpt.scene.cameras import Perspective
from tests.pictures.support import assert_agree, exposures, with_film

WIDE = [it.Box(radius=1.0), it.Tent(), it.Gaussian(), it.Mitchell(), it.Lanczos()]
NARROW = [it.Box(), it.Tent(radius=0.5), it.Gaussian(stddev=0.1)]


def sky(radiance: float, **film: object) -> Scene:
    light = lights.Constant(radiance=(radiance, 0.5 * radiance, 0.25 * radiance))
    given = {"width": 5, "height": 3, "mode": "rgb", "filter": it.Gaussian(), **film}
    return Scene(camera=Perspective(), lights=[light], film=Film(**given))


@pytest.mark.parametrize("radius", [0.3, 0.5, 0.75, 1.0, 1.2, 1.5, 2.0, 2.3, 3.0])
def test_how_far_a_filter_reaches(radius):
    """No pixel outside of the taps holds a point, and all of them are within reach."""
    chosen = it.Box(radius=radius)
    reach, taps = chosen.reach, chosen.taps
    assert taps <= 2 * reach + 1
    offset = np.linspace(-0.5, 0.5, 1001)[1:-1]
    pixels = np.arange(-8, 9)
    holds = np.abs(pixels[:, None] - offset) < radius - 1e-9
    first = np.clip(np.ceil(offset - radius), -reach, reach + 1 - taps)
    served = (pixels[:, None] >= first) & (pixels[:, None] < first + taps)
    assert (served | ~holds).all() and (np.abs(pixels[holds.any(axis=1)]) <= reach).all()


def test_what_is_splatted():
    """Filters wider than a pixel, but with `noise`, of values, or where the film says otherwise."""
    for chosen in (*WIDE, *NARROW):
        assert SceneIndex.of(sky(1.0, filter=chosen)).splatting == (chosen in WIDE)
    scene = sky(1.0)
    assert not SceneIndex.of(with_film(scene, filtering="importance")).splatting
    assert not SceneIndex.of(dataclasses.replace(scene, noise=0.1)).splatting


@pytest.mark.parametrize(
    "chosen",
    [pytest.param(f, marks=() if f.kind == "lanczos" else pytest.mark.slow) for f in WIDE],
    ids=lambda f: f.kind,
)
def test_an_even_sky_is_even(chosen):
    """To float32 at the first sample, also at the film's edges, where samples lie beyond them."""
    with clpt.Renderer(sky(0.7, filter=chosen, alpha=True)) as renderer:
        renderer.run(1)
        np.testing.assert_array_equal(renderer.image(), np.zeros((3, 5, 4)))
    with clpt.Renderer(sky(0.7, filter=chosen)) as renderer:
        renderer.run(1)
        expected = np.broadcast_to([0.7, 0.35, 0.175], (3, 5, 3))
        np.testing.assert_allclose(renderer.image(), expected, rtol=1e-5)
        assert (renderer.film.get()[..., 3] == 1.0).all()


def test_bright_light_and_many_samples():
    """What a footprint has no room for goes to the film at once, or before the pixel is left."""
    for radiance, samples in ((3e6, 3), (0.5, 5000)):
        with clpt.Renderer(sky(radiance, width=2, height=2), slots=64) as renderer:
            renderer.run(samples)
            expected = np.broadcast_to(radiance * np.array([1.0, 0.5, 0.25]), (2, 2, 3))
            np.testing.assert_allclose(renderer.image(), expected, rtol=1e-5)
            assert (renderer.film_state().samples == samples).all()
            assert renderer._wavefront.counts.full == 0


@pytest.mark.slow
def test_the_mean_is_that_of_importance_sampling(scenes: Path):
    """Welch's tests over all pixels at SIGNIFICANCE; and the noise is lower."""
    film = {"width": 12, "height": 9, "mode": "rgb", "filter": it.Gaussian()}
    scene = with_film(clpt.load(scenes / "cornell.xml"), **film)
    ours = exposures(scene, 16, 128)
    reference = exposures(with_film(scene, filtering="importance"), 16, 128)
    assert_agree(ours, reference)
    assert ours.var(axis=0).mean() < 0.6 * reference.var(axis=0).mean()


@pytest.mark.slow
def test_bands_of_an_even_sky():
    film = {"mode": "spectral", "bands": 3, "filter": it.Tent()}
    scene = dataclasses.replace(sky(1.0, **film), lights=[lights.Constant(radiance="E")])
    with clpt.Renderer(scene) as renderer:
        renderer.run(64)
        np.testing.assert_allclose(renderer.image().mean(axis=(0, 1)), 1.0, rtol=0.02)


def test_noise_needs_pixels_of_their_own():
    with clpt.Renderer(sky(1.0)) as renderer, pytest.raises(SceneError, match="filtering"):
        renderer.run(8, noise=0.1)
    assert clpt.render(sky(1.0), 8, noise=0.1).shape == (3, 5, 3)
