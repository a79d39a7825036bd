"""`clpt scenes`, and clpt's own scenes by names that are nearly right, from any folder."""

from __future__ import annotations

import json
from pathlib import Path
from urllib.parse import urlparse
from urllib.request import url2pathname

import jsonschema
import pytest

from clpt import load
from clpt.__main__ import run
from clpt.errors import SceneError
from clpt.formats import locate, own_scenes


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_each_scene_is_listed_once_and_can_be_read(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["scenes", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert sorted(row["path"] for row in rows) == own_scenes.paths()
    for row in rows:
        assert locate(row["path"]).is_file() and row["text"] and "](" not in row["text"]
    prism = next(row for row in rows if row["path"] == "scenes/prism")
    assert tuple(prism["size"]) == load("scenes/prism").film.size
    assert run(["scenes"]) == 0
    told = capsys.readouterr().out
    assert all(row["path"] in told for row in rows)


@pytest.mark.parametrize("path", own_scenes.paths())
def test_a_wrong_letter_is_forgiven(path: str) -> None:
    wrong = path[:-1] + "q"
    for name in (wrong, wrong.removeprefix("scenes/"), path.removeprefix("scenes/")):
        with pytest.raises(SceneError, match=rf"did you mean .*{path}\b"):
            locate(name)


def test_the_folder_of_all_scenes_says_where_they_are_listed(elsewhere: Path) -> None:
    for name in ("scenes", "scenes/nothing-like-it"):
        with pytest.raises(SceneError, match="clpt scenes lists"):
            locate(name)
    with pytest.raises(SceneError, match=r"no such file$"):
        locate(elsewhere / "nothing-like-it")


def test_the_schema_is_found_from_anywhere(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["scenes", "--schema"]) == 0
    address = capsys.readouterr().out.strip()
    assert address.startswith("file://")
    schema = json.loads(Path(url2pathname(urlparse(address).path)).read_text())
    jsonschema.validate({"$schema": address, "camera": {"type": "perspective"}}, schema)
