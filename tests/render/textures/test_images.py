"""Images of files: decoded once, let go of when packed, and not read again for what is known."""

from __future__ import annotations

import numpy as np

from clpt import images
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene, cameras, materials, shapes
from clpt.scene.textures import Bitmap


def test_pixels_are_let_go_and_words_are_parts_of_the_table(tmp_path, monkeypatch):
    rng = np.random.default_rng(5)
    paths = [tmp_path / f"{i}.png" for i in range(2)]
    for path in paths:
        images.write_stored(path, rng.integers(0, 256, (8, 4, 3), np.uint8))
    read = []
    stored = images.read_stored
    monkeypatch.setattr(images, "read_stored", lambda path: read.append(path) or stored(path))

    def scene(*roughness: float) -> Scene:
        made = Scene(camera=cameras.Perspective())
        for path in paths:
            colour = Bitmap(image=path)
            made.shapes.append(shapes.Sphere(material=materials.Diffuse(reflectance=colour)))
        made.shapes += [
            shapes.Sphere(material=materials.RoughPlastic(alpha=alpha)) for alpha in roughness
        ]
        return made

    first = lower(scene(0.1))
    assert len(read) == 2
    second = lower(scene(0.1, 0.2), former=first)
    assert len(read) == 2
    np.testing.assert_array_equal(first.tables["images"], second.tables["images"])
    placed = second.encoder.textures.images._placed
    assert len(placed) == 2
    for _, packed in placed:
        assert np.shares_memory(packed.words, second.tables["images"])
    third = Scene(camera=cameras.Perspective())
    alpha = Bitmap(image=paths[0], raw=True, channel="g")  # another role: it is read again
    third.shapes = [shapes.Sphere(material=materials.RoughPlastic(alpha=alpha))]
    np.testing.assert_array_equal(
        lower(third, former=second).tables["images"], lower(third).tables["images"]
    )
