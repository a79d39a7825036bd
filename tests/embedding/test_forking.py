"""A process that was forked lowers scenes too: threads of its parent did not come along."""

from __future__ import annotations

import multiprocessing
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt.render.lowering.scene import lower
from clpt.scene import Scene, cameras, materials, shapes, textures


def scene(image: Path) -> Scene:
    paint = materials.Diffuse(reflectance=textures.Bitmap(image=image))
    return Scene(camera=cameras.Perspective(), shapes=[shapes.Rectangle(material=paint)])


def lower_files(folder: Path) -> None:
    for image in sorted(folder.glob("*.png")):
        lower(scene(image))


@pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork"
)
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_images_are_read_after_a_fork(tmp_path: Path) -> None:
    for name in "abc":
        clpt.write_image(tmp_path / f"{name}.png", np.zeros((2, 2, 3)))
    lower_files(tmp_path)
    child = multiprocessing.get_context("fork").Process(target=lower_files, args=(tmp_path,))
    child.start()
    child.join(20.0)
    ended = child.exitcode
    child.kill()
    assert ended == 0
