"""What a folder means where a scene is asked for."""

import pytest

from clpt.errors import SceneError
from clpt.formats import load

TEXT = 'WorldBegin Shape "sphere" "float radius" [ {} ]'


def radius(folder) -> float:
    return load(folder).shapes[0].radius


def test_a_folder_means_the_scene_in_it(tmp_path):
    folder = tmp_path / "kitchen"
    folder.mkdir()
    with pytest.raises(SceneError, match=r"kitchen: this folder holds no scene\.json and no"):
        load(folder)
    (folder / "notes.json").write_text("{}")
    (folder / "part.pbrt").write_text(TEXT.format(1))
    assert radius(folder) == 1.0
    (folder / "other.pbrt").write_text(TEXT.format(2))
    with pytest.raises(SceneError, match=r"several scenes, name one: other\.pbrt, part\.pbrt$"):
        load(folder)
    (folder / "kitchen.pbrt").write_text(TEXT.format(3))
    assert radius(folder) == 3.0
    (folder / "scene.pbrt").write_text(TEXT.format(4))
    assert radius(folder) == 4.0
    for i in range(9):
        (tmp_path / f"{i}.xml").write_text("<scene/>")
    with pytest.raises(SceneError, match=r"7\.xml and 1 more"):
        load(tmp_path)
