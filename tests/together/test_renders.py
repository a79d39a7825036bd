"""Random scenes of everything together are rendered: nothing breaks, and the film is finite."""

from __future__ import annotations

import random

import numpy as np
import pytest

from clpt import Renderer
from clpt.errors import SceneError
from clpt.render.flow.check import check
from tests.together.strategies import scene_of, shown

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("one_context")]


@pytest.mark.parametrize("seed", range(12))
def test_scenes_render(seed: int) -> None:
    """The first scene of a seed that is not refused. Each compiles programs of its own."""
    choose = random.Random(seed)
    while True:
        scene = scene_of(lambda most: choose.randint(0, most))
        try:
            check(scene)
            break
        except SceneError:
            continue
    renderer = Renderer(scene)
    try:
        renderer.run(1)
        picture = np.asarray(renderer.image())
    except Exception as error:
        raise AssertionError(f"{error!r} of\n{shown(scene)}") from error
    assert np.isfinite(picture).all(), shown(scene)
