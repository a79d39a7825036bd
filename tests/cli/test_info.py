"""`clpt info`: what it counts, and that bad input is one line."""

from __future__ import annotations

import base64
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from clpt.__main__ import run
from clpt.cli.files.scene_contents import summary, tidy
from clpt.formats import load
from clpt.scene import Film


def test_the_cornell_box(scenes, capsys):
    assert run(["info", str(scenes / "cornell.xml"), "--json", "-D", "res=9"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["format"] == "mitsuba"
    assert found["shapes"] == {"rectangle": 6, "cube": 2}
    assert found["triangles"] == found["triangles_instanced"] == 6 * 2 + 2 * 12
    assert found["cameras"] == ["perspective"]
    assert (found["spp"], found["integrator"]) == (16, "path")
    assert (found["sampler"], found["sampler_in_file"]) == ("sobol", "independent")
    assert found["animations"] == []
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


def test_all_cameras(scenes, tmp_path):
    text = (scenes / "cornell.xml").read_text()
    second = '<sensor type="orthographic"/></scene>'
    (tmp_path / "two.xml").write_text(text.replace("</scene>", second))
    assert summary(load(tmp_path / "two.xml"))["cameras"] == ["perspective", "orthographic"]


def test_animations(tmp_path):
    triangle = base64.b64encode(np.float32([0, 0, 0, 1, 0, 0, 0, 1, 0]).tobytes()).decode()
    document = {
        "asset": {"version": "2.0"},
        "buffers": [
            {"byteLength": 36, "uri": f"data:application/octet-stream;base64,{triangle}"}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
             "min": [0, 0, 0], "max": [1, 1, 0]}
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "animations": [{"name": "walk", "channels": [], "samplers": []},
                       {"channels": [], "samplers": []}],
    }  # fmt: skip
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    assert summary(load(tmp_path / "a.gltf"))["animations"] == ["walk", "1"]
    document["accessors"][0] |= {"type": "SCALAR", "min": [0], "max": [1.5]}
    document["meshes"] = document["nodes"][0] = {}
    document["animations"][0]["samplers"] = [{"input": 0, "output": 0}]
    document["asset"] |= {"generator": "a program", "copyright": 7}
    document["scenes"] *= 2
    del document["meshes"]
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    found = summary(load(tmp_path / "a.gltf"))
    assert found["animations"] == ["walk, 1.5 s", "1"]
    assert (found["asset"], found["scenes"]) == ({"generator": "a program"}, ["0", "1"])


def test_what_a_file_may_say_besides(scenes, tmp_path):
    found = summary(load(scenes / "cornell.xml", res=9))
    assert found["variables"] == {"spp": "16", "res": "9", "max_depth": "6"}
    scene = load(scenes / "bowl.obj")
    film = Film(width=9, height=8, crop=(1, 2, 3, 4), bands=5, alpha=True)
    found = summary(dataclasses.replace(scene, film=film))["film"]
    assert found == {
        "width": 3, "height": 4, "crop": [1, 2, 3, 4], "of": [9, 8], "mode": "spectral",
        "filter": "box", "bands": 5, "alpha": True,
    }  # fmt: skip


def test_people_are_told_what_there_is_only(tmp_path, capsys):
    """No zeros, nothing twice, and bounds without the noise of floats; JSON has it all."""
    scene = str(Path(__file__).resolve().parents[2] / "scenes" / "prism")
    assert run(["info", scene, "--json"]) == 0
    whole = json.loads(capsys.readouterr().out)
    assert whole["triangles_instanced"] == whole["triangles"] and whole["spheres"] == 0
    assert run(["info", scene]) == 0
    told = capsys.readouterr().out
    assert "(-6, 0, -6) to (6, 1.05, 6)" in told
    for words in ("instanced", "spheres", "in file", "none", "e-16", "animations"):
        assert words not in told
    flat = tidy({"bounds": [[0.0, 1.0, 2.0], [0.0, 1.0, 2.0]], "spp": 4, "warnings": []})
    assert flat == {"bounds": [[0.0, 1.0, 2.0], [0.0, 1.0, 2.0]], "spp": 4}
