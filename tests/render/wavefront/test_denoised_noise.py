"""What is left after denoising: beside the truth of a made picture, and as a limit of renders."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import clpt
from clpt.device import choose
from clpt.errors import SceneError
from clpt.render.wavefront.noise import DenoisedNoise, _pixels
from clpt.scene.integrators import Film, Path

LIMIT, MOST = 0.1, 256


def box(**changes) -> clpt.Scene:
    scene = clpt.load("scenes/cornell_box")
    scene.integrator, scene.film = Path(light_paths=0), Film(width=97, height=80)
    return dataclasses.replace(scene, **changes)


@pytest.mark.parametrize("height, width", [(1, 1), (1, 2), (2, 1), (3, 5), (4, 6)])
def test_colours_have_each_pixel_once(height, width):
    seen = np.zeros((height, width), int)
    for colour in range(2):
        y, x, inside = _pixels(height, width, colour)
        assert y.max(initial=0) < height and x.min() >= 0
        assert (((x + y) % 2 == colour) | ~inside).all()
        np.add.at(seen, (y[inside], x[inside]), 1)
    assert (seen == 1).all()


@pytest.mark.parametrize("method", ["oidn", "statistical"])
def test_the_error_is_told(method):
    """A soft picture with noise of 30 %: the truth is known, so the error is."""
    if method == "oidn":
        pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")
    rng, size = np.random.default_rng(1), 96
    y, x = np.mgrid[:size, :size] / size
    truth = np.stack([1 + np.sin(5 * x) * y, 1 + 0.5 * y, 1 + 0.3 * np.cos(9 * x * y)], axis=2)
    halves = [
        (truth * (1 + 0.3 * 2**0.5 * rng.standard_normal((size, size, 1)))).astype(np.float32)
        for _ in range(2)
    ]
    made = SimpleNamespace(halves=lambda: tuple(halves), layers=dict)
    made.developed = lambda: made
    cells = np.ones(2 * (size // 16) ** 2, bool)
    told = float(np.sqrt(DenoisedNoise(lambda: made, choose(), method).measure(cells).mean()))
    picture = SimpleNamespace(
        denoise=method, halves=made.halves, layers=dict,
        colours=lambda: sum(halves) / 2, image=lambda: sum(halves) / 2,
        picture=lambda: sum(halves) / 2,
        samples_per_pixel=lambda: np.full((size, size), 2.0),
        form=SimpleNamespace(bands=0, alpha=False),
    )  # fmt: skip
    picture.developed = lambda: picture
    weights = np.array([0.2126, 0.7152, 0.0722])
    wrong = (clpt.DenoisedPicture(picture).colours() - truth) @ weights / (truth @ weights)
    left = float(np.sqrt(np.mean(wrong**2)))
    # pixels of one colour are half of all, so that what they tell is more than what is left
    print(method, told, left)
    assert 0.6 * left < told < 3.0 * left and told < 0.15
    part = cells & (np.arange(len(cells)) < 2)  # of the first square alone
    assert DenoisedNoise(lambda: made, choose(), method).measure(part)[:2].max() < 0.15**2


def test_a_limit_is_for_what_is_left():
    """Fewer samples than before denoising; pieces, several devices and a file come to the same."""
    with clpt.Renderer(box(noise=LIMIT)) as noisy:
        noisy.run(MOST, noise=LIMIT)
        before = noisy.samples_per_pixel()
    with clpt.Renderer(box(noise=LIMIT), denoise="statistical") as renderer:
        assert renderer.run(MOST, noise=LIMIT)
        film, active = renderer.film.get(), renderer.active
        assert film[..., 3].min() >= 16 and film[..., 3].mean() < before.mean() / 2
        renderer.reset().wait()
        renderer.run(20, noise=LIMIT)
        saved = renderer.saved_film()
        renderer.reset().wait()
        renderer._restore(saved)
        renderer.run(MOST - 20, noise=LIMIT)
        np.testing.assert_array_equal(renderer.film.get(), film)
        assert renderer.active == active
    with clpt.MultiRenderer(box(noise=LIMIT), [0], denoise="statistical") as several:
        several.run(MOST, noise=LIMIT)
        np.testing.assert_array_equal(several.samples_per_pixel(), film[..., 3])


def test_halves_are_wanted_and_light_paths_told():
    pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")
    renderer = clpt.Renderer(box(), denoise="oidn")
    with renderer, pytest.raises(SceneError, match="halves=True"):
        renderer.run(16, noise=LIMIT)
    lit = box(noise=LIMIT, integrator=Path(light_paths=1))
    with clpt.Renderer(lit, denoise="oidn") as renderer:
        assert any("before it is denoised" in one for one in renderer.warnings)
