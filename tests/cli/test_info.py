"""`clpt info`: what it counts, and that bad input is one line."""

from __future__ import annotations

import json

import pytest

from clpt.__main__ import run
from clpt.cli.info import summary
from clpt.formats import load


def test_the_cornell_box(scenes, capsys):
    assert run(["info", str(scenes / "cornell.xml"), "--json", "-D", "res=9"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["format"] == "mitsuba"
    assert found["shapes"] == {"rectangle": 6, "cube": 2}
    assert found["triangles"] == found["triangles_instanced"] == 6 * 2 + 2 * 12
    assert found["cameras"] == ["perspective"]
    assert found["lights"] == {"area": 1}
    assert found["materials"] == {"diffuse": 3}
    assert found["film"] == {"width": 9, "height": 9, "mode": "spectral", "filter": "box"}
    assert found["warnings"] == []
    assert [round(x, 3) for x in found["bounds"][1]] == [1, 1, 1]


def test_textures_are_counted_once(scenes):
    found = summary(load(scenes / "textures.xml"))
    assert found["textures"] == {"checkerboard": 1, "bitmap": 2}
    assert found["materials"] == {"diffuse": 5, "two_sided": 1}


def test_a_bare_mesh_is_told_without_its_studio(scenes, capsys):
    assert run(["info", str(scenes / "bowl.obj"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["format"], found["triangles"]) == ("obj", 288)
    assert found["bounds"] == [[-1, 0, -1], [1, 1, 1]]
    assert (found["cameras"], found["lights"], found["shapes"]) == ([], {}, {"mesh": 1})


def test_the_table(scenes, capsys):
    assert run(["info", str(scenes / "glass_metal.xml")]) == 0
    out = capsys.readouterr().out
    for words in ("rough_conductor: 1", "constant: 1", "perspective", "48"):
        assert words in out


@pytest.mark.parametrize(
    "arguments", [["no.xml"], ["cornell.xml", "-D", "res"], ["cornell.xml", "-D", "q=1"], []]
)
def test_bad_input_is_one_line(scenes, monkeypatch, capsys, arguments):
    monkeypatch.chdir(scenes)
    assert run(["info", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("clpt: error: ") and error.count("\n") == 1
