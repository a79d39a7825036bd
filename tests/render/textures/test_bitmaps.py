"""Images of files: a file that has changed on the disk is read again, any other is not."""

from __future__ import annotations

import os

import numpy as np
import pytest

from clpt import images
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, lights, materials, shapes
from clpt.scene.cameras import Perspective
from clpt.scene.textures import Bitmap

USES = {
    "colour": lambda path: {"material": materials.Diffuse(reflectance=Bitmap(image=path))},
    "number": lambda path: {"material": materials.RoughConductor(alpha_u=Bitmap(image=path))},
    "emission": lambda path: {"emission": lights.Area(radiance=Bitmap(image=path))},
    "envmap": lambda path: {"light": lights.Envmap(image=path)},
}
TABLES = {"envmap": "texels"}


def scene(use: str, path, mode: str) -> Scene:
    given = USES[use](path)
    lamps = [given.pop("light")] if "light" in given else []
    film = Film(width=4, height=4, mode=mode)
    shape = shapes.Rectangle(**given)
    return Scene(camera=Perspective(), shapes=[shape], lights=lamps, film=film)


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("kind", [str, lambda path: path], ids=["str", "Path"])
def test_a_file_that_changed_is_read_again(tmp_path, monkeypatch, use, mode, kind):
    path = tmp_path / "image.png"
    images.write(path, np.full((4, 8, 3), 0.2))
    read = []
    read_stored = images.read_stored
    monkeypatch.setattr(images, "read_stored", lambda p: read.append(p) or read_stored(p))
    first = lower(scene(use, kind(path), mode))
    again = lower(scene(use, kind(path), mode), former=first)
    assert len(read) == 1 or use == "emission"  # whose power on each triangle is read apart
    table = TABLES.get(use, "images")
    assert np.array_equal(first.table(table), again.table(table))
    images.write(path, np.full((4, 8, 3), 0.8))
    os.utime(path, (1e9, 1e9))  # not the time of the first one, however coarse a clock is
    changed = lower(scene(use, kind(path), mode), former=again)
    fresh = lower(scene(use, kind(path), mode))
    assert np.array_equal(changed.table(table), fresh.table(table))
    assert not np.array_equal(changed.table(table), first.table(table))
