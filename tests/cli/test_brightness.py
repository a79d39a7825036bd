"""A picture in which little is seen says why, and what to do."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from clpt.__main__ import run

EYE = [{"look_at": {"origin": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0]}}]
BALL = {"type": "sphere", "material": {"type": "diffuse", "reflectance": 0.8}}


def scene(folder: Path, *strengths: float | dict[str, Any], z: float = 4.0) -> str:
    """A ball under lamps, as a file; a number is an intensity."""
    lamps = [
        {"type": "point", "position": [0.0, 3.0 * bool(z), z]}
        | (value if isinstance(value, dict) else {"intensity": value})
        for value in strengths
    ]
    path = folder / "ball.json"
    made = {
        "camera": {"type": "perspective", "to_world": EYE}, "spp": 2, "shapes": [BALL],
        "film": {"width": 16, "height": 16, "mode": "rgb"}, "lights": lamps,
    }  # fmt: skip
    path.write_text(json.dumps(made))
    return str(path)


def told(capsys: pytest.CaptureFixture[str]) -> str:
    return "".join(line for line in capsys.readouterr().err.splitlines(True) if "warning" in line)


def test_a_white_picture(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = scene(tmp_path, 54351.0)
    assert run(["render", path, "-o", "a.png"]) == 0
    said = told(capsys)
    assert "of what is lit is white: --exposure auto, -1" in said and said.count("\n") == 1
    assert run(["render", path, "-o", "a.png", "--exposure", "auto"]) == 0
    captured = capsys.readouterr().err
    assert "exposure -1" in captured and "warning" not in captured
    assert 90 < Image.open("a.png").convert("L").getpixel((8, 6)) < 220
    assert run(["render", path, "-o", "a.exr"]) == 0  # which keeps all light
    assert not told(capsys)


@pytest.mark.parametrize(
    "lamps, z, words",
    [
        ([1e-4], 4.0, "of the picture is black: --exposure auto, +1"),
        ([1.0], 0.0, "the picture is black: no path has found a light"),
        ([20.0, 0.001], 4.0, "lights[0] (point) is 20,000 times as strong as any other lamp"),
        (
            [{"lumens": 800}, {"lumens": 8e6}],
            4.0,
            "lights[1] (point) is 10,000 times as strong as any other lamp",
        ),
        (
            [{"power": 1e5}, {"power": 20, "temperature": 2700}],
            4.0,
            "lights[0] (point) is 5,000 times as strong as any other lamp",
        ),
    ],
)
def test_others(tmp_path, capsys, monkeypatch, lamps, z, words):
    monkeypatch.chdir(tmp_path)
    assert run(["render", scene(tmp_path, *lamps, z=z), "-o", "a.png"]) == 0
    said = told(capsys)
    assert words in said and said.count("\n") == 1


def test_a_good_picture_says_nothing(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["render", scene(tmp_path, 20.0, 10.0), "-o", "a.png"]) == 0
    assert not told(capsys)


def test_lamps_of_one_strength_given_two_ways(tmp_path, capsys, monkeypatch):
    """800 lm are an intensity of 9e-4: neither outshines the other."""
    monkeypatch.chdir(tmp_path)
    path = scene(tmp_path, {"lumens": 800}, 8.7e-4, {"candela": 64, "intensity": "F11"})
    assert run(["render", path, "-o", "a.png", "--exposure", "8"]) == 0
    assert not told(capsys)


def test_options_for_screens_of_light_alone(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = scene(tmp_path, 20.0)
    assert run(["render", path, "-o", "a.exr", "--exposure", "-5"]) == 0
    assert "--exposure ignored: for .png .jpg .jpeg .webp only" in told(capsys)
    assert run(["render", path, "-o", "a.exr", "-o", "a.jpg", "--exposure", "-5"]) == 0
    assert "ignored" not in told(capsys)
