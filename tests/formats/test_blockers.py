"""All that keeps a scene from being read is listed at once, each with its line."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from clpt.cli import cli as main
from clpt.errors import SceneError
from clpt.formats import errors_of, load, reading

XML = """<scene version="3.0.0">
<sensor type="fisheye"/>
<integrator type="magic"/>
<emitter type="portal"/>
<bsdf type="ofafork" id="m"/>
<shape type="sphere"><float name="width" value="1"/><ref id="m"/></shape>
<shape type="cube"><bsdf type="twosided"><bsdf type="velvet"/></bsdf></shape>
<shape type="cube"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
<string name="filename" value="none.png"/></texture></bsdf></shape>
<shape type="blob"/>
</scene>
"""
PBRT = """Camera "perspective"
WorldBegin
Material "ofafork"
Shape "sphere"
Material "velvet"
Shape "disk"
Shape "blob"
Shape "sphere" "float radius" -1
LightSource "portal"
"""
WORDS = {
    "a.xml": {"fisheye": 2, "magic": 3, "portal": 4, "ofafork": 5, "width": 6, "velvet": 7,
              "none.png": 9, "blob": 10},
    "a.pbrt": {"ofafork": 3, "velvet": 5, "blob": 7, "positive": 8, "portal": 9},
}  # fmt: skip


@pytest.fixture(params=WORDS)
def path(request, tmp_path):
    path = tmp_path / request.param
    path.write_text(XML if request.param == "a.xml" else PBRT)
    return path


def test_all_errors_are_collected(path):
    errors = errors_of(path)
    assert len(errors) == len(WORDS[path.name])
    for word, line in WORDS[path.name].items():
        (error,) = [one for one in errors if word in one.message]
        assert error.line == line
    with pytest.raises(SceneError):  # and none afterwards
        load(path)


def test_info_lists_them(path):
    result = CliRunner().invoke(main, ["info", str(path)])
    shown = result.output + str(result.exception)
    assert result.exit_code != 0 and f"{len(WORDS[path.name])} things above" in shown
    assert all(word in result.output for word in WORDS[path.name])


def test_a_file_without_errors_has_none(tmp_path):
    (tmp_path / "a.xml").write_text('<scene version="3.0.0"><shape type="cube"/></scene>')
    assert errors_of(tmp_path / "a.xml") == []


def test_hostile_files_have_a_limited_list(tmp_path):
    many = "".join(f'<bsdf type="a{i}"/>' for i in range(3 * reading.MOST))
    (tmp_path / "a.xml").write_text(f'<scene version="3.0.0">{many}</scene>')
    assert len(errors_of(tmp_path / "a.xml")) == reading.MOST + 1


def test_other_formats_have_their_first(tmp_path):
    (tmp_path / "a.json").write_text(json.dumps({"shapes": [{"type": "blob"}]}))
    assert len(errors_of(tmp_path / "a.json")) == 1
