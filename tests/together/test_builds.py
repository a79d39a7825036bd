"""Random scenes of everything together: each is refused in words, or all its programs compile."""

from __future__ import annotations

import hypothesis
import pytest

from clpt.errors import SceneError
from clpt.render.lowering.scene import lower
from clpt.scene import Scene
from tests.front_end import CLANG, errors
from tests.together.builds import Way, texts
from tests.together.strategies import WAYS, scenes, shown

SCENES = 60


@pytest.mark.skipif(CLANG is None, reason="clang is not installed")
@hypothesis.seed(1)
@hypothesis.settings(
    max_examples=SCENES,
    deadline=None,
    database=None,
    print_blob=False,
    report_multiple_bugs=False,
    suppress_health_check=list(hypothesis.HealthCheck),
)
@hypothesis.given(scenes(), WAYS)
def test_scenes_build(scene: Scene, way: Way) -> None:
    try:
        features = lower(scene).features
    except SceneError as error:
        assert error.where and "\n" not in str(error)
        hypothesis.reject()
    except Exception as error:
        error.add_note(shown(scene)) if hasattr(error, "add_note") else None
        raise
    for error in errors(texts(features, way)):
        assert not error, f"{error[:2000]}\n{way}\n{shown(scene)}"
