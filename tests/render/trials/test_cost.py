"""What small pictures tell of a way to render a scene."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from clpt.render import trials
from clpt.render.flow.scene_to_tables import lower
from clpt.render.trials import Trial
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Vcm

ROUNDS, SIZE = 4, (32, 64)


def pictures(variance: float, seed: int) -> np.ndarray:
    """Even pictures with noise."""
    drawn = np.random.default_rng(seed).normal(1.0, np.sqrt(variance), (ROUNDS, *SIZE, 3))
    return np.asarray(drawn)


def test_a_cost_is_variance_times_the_time_of_rays() -> None:
    """The ratio of two variances of 24,576 numbers is off by more than 6 % once in 1e5 times."""
    unlike = [Trial(pictures(0.04, 1), 1000), Trial(pictures(0.01, 2), 500, 1.5)]
    assert trials.costs(unlike) == pytest.approx([1.0, 1.5 * 0.25 * 0.5], rel=0.06)
    even = [Trial(pictures(0.0, 1), 1000), Trial(pictures(0.0, 2), 500)]
    assert trials.costs(even) == [1.0, 1.0]


def test_light_that_is_never_found_is_not_taken_for_little_noise() -> None:
    """One way has found a caustic in every picture, the other one in none, so without noise."""
    found, missed = pictures(1e-4, 1), pictures(1e-4, 2)
    found[:, 8:16, 8:16] += 1.0
    variances = trials.variances([Trial(found, 1), Trial(missed, 1)])
    assert variances[0] < 1e-3
    blocks = SIZE[0] * SIZE[1] / trials.BLOCK**2
    once = trials.BLOCK**2 * ROUNDS  # over the square of the block's mean, which is 1.5
    assert variances[1] == pytest.approx(once / 1.5**2 / blocks, rel=0.1)


def test_a_bright_sample_of_one_way_says_nothing_of_another() -> None:
    noisy, quiet = pictures(1e-4, 1), pictures(1e-4, 2)
    alone = trials.variances([Trial(quiet, 1), Trial(noisy, 1)])
    noisy[2, 11, 13] += 50.0
    assert trials.variances([Trial(quiet, 1), Trial(noisy, 1)])[0] <= alone[0]


def test_the_small_film_shows_the_whole_picture() -> None:
    film = Film(width=400, height=200, crop=(10, 20, 30, 40), mode="rgb")
    whole = dataclasses.replace(film, crop=None)
    made = [lower(Scene(camera=Perspective(), film=one)).settings for one in (film, whole)]
    small = [trials.small_settings(one) for one in made]
    assert small[0] == small[1]
    assert (small[0]["width"], small[0]["height"]) == (64, 32)


def test_photons_of_a_small_film_are_as_dense_in_their_disks() -> None:
    film = Film(width=400, height=200, mode="rgb")
    scene = Scene(camera=Perspective(), film=film, integrator=Vcm(radius=0.01))
    large = lower(scene).settings
    small = trials.small_settings(large, 512)
    assert small["photon_pixels"] == small["padded_pixels"] == 512
    density = [one["photon_pixels"] * one["radius"] ** 2 for one in (large, small)]
    assert density[0] == pytest.approx(density[1], rel=0.01)
