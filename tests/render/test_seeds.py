"""Seeds and numbers of samples: what kernels cannot count is refused, never cut."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.scene import Scene, lights
from clpt.scene.cameras import Perspective
from tests.pictures.support import with_film

WRONG = [-1, 2**32, 2**64, True, 1.0, "1"]


def sky(**parts: object) -> Scene:
    scene = Scene(camera=Perspective(), lights=[lights.Constant()], **parts)
    return with_film(scene, width=4, height=3, mode="rgb")


@pytest.fixture(scope="module")
def renderer():
    with clpt.Renderer(sky()) as made:
        yield made


@pytest.mark.parametrize("seed", WRONG)
def test_seeds_beyond_32_bits_are_refused(renderer, seed) -> None:
    told = r"seed: must be a whole number from 0 to 4294967295, not "
    with pytest.raises(SceneError, match=told):
        sky(seed=seed)
    with pytest.raises(SceneError, match=told):
        renderer.reset(seed=seed)
    changed = sky()
    changed.seed = seed
    with pytest.raises(SceneError, match=told):
        clpt.Renderer(changed)


def test_the_last_seed_is_taken(renderer, tmp_path: Path) -> None:
    renderer.reset(seed=2**32 - 1)
    renderer.run(1)
    renderer.save_state(tmp_path / "a.film")
    with clpt.Renderer(sky(seed=2**32 - 1)) as other:
        other.load_state(tmp_path / "a.film")
        np.testing.assert_array_equal(other.image(), renderer.image())


@pytest.mark.parametrize("number", [-1, -5, 2**31, 2**32, True, 0.5])
def test_first_samples_that_are_none_are_refused(renderer, number) -> None:
    with pytest.raises(SceneError, match=r"first_sample: must be a whole|cannot have more than"):
        renderer.reset(first_sample=number)
    with pytest.raises(SceneError, match=r"first_sample: must be a whole|cannot have more than"):
        clpt.Renderer(sky(), first_sample=number)
