"""Pictures by one line: a renderer saves what it has, a scene shows itself in a notebook."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.scene import Film, Scene, cameras, lights

SCENE = Scene(
    camera=cameras.Perspective(),
    film=Film(size=(6, 4), mode="rgb"),
    lights=[lights.Constant(radiance=0.5)],
    spp=2,
)


def test_a_renderer_saves_its_picture(tmp_path: Path, one_context: None) -> None:
    with clpt.Renderer(SCENE) as renderer:
        renderer.run(1)
        renderer.save(tmp_path / "a.exr")
        np.testing.assert_allclose(clpt.read_image(tmp_path / "a.exr"), renderer.image(), rtol=1e-3)
        renderer.save(tmp_path / "a.png", exposure=1.0)
        assert clpt.read_image(tmp_path / "a.png").min() == pytest.approx(1.0, abs=1e-2)
        with pytest.raises(SceneError, match=r"a\.what"):
            renderer.save(tmp_path / "a.what")


def test_a_scene_shows_itself(one_context: None) -> None:
    shown = clpt.Scene(**vars(SCENE))._repr_png_()
    assert shown is not None and shown.startswith(b"\x89PNG")
    width, height = (int.from_bytes(shown[at : at + 4], "big") for at in (16, 20))
    assert (width, height) == (6, 4)
