"""What a folder means where a scene is asked for."""

from pathlib import Path

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


@pytest.mark.parametrize(
    ("asked", "meant"),
    [
        ("scenes/cornel_box", "scenes/cornell_box"),
        ("scenes/cornel_box/scene.json", "scenes/cornell_box"),
        ("scenes/cornell_box/scne.json", "scenes/cornell_box/scene.json"),
        ("scens", "scenes"),
    ],
)
def test_a_missing_file_names_the_nearest(tmp_path: Path, asked: str, meant: str) -> None:
    (tmp_path / "scenes" / "cornell_box").mkdir(parents=True)
    (tmp_path / "scenes" / "cornell_box" / "scene.json").write_text("{}")
    (tmp_path / "scenes" / "room.ply").write_text("")
    with pytest.raises(SceneError, match="no such file; did you mean") as caught:
        load(tmp_path / asked)
    assert str(caught.value).endswith(f"did you mean {tmp_path / meant}?")


def test_a_missing_file_like_no_other(tmp_path: Path) -> None:
    (tmp_path / "scene.json").write_text("{}")
    with pytest.raises(SceneError, match=r"no such file$"):
        load(tmp_path / "teapot.xml")


def test_misspelt_arguments_of_load(tmp_path: Path) -> None:
    (tmp_path / "scene.json").write_text("{}")
    with pytest.raises(SceneError, match=r"'progres' means nothing; did you mean 'progress'\?"):
        load(tmp_path, progres=print)
    with pytest.raises(SceneError, match=r"'spp' means nothing$"):
        load(tmp_path, spp=4)
