"""What the commands say of mistakes that people make: one line, and what to do."""

from __future__ import annotations

import json
import logging
from pathlib import Path

import click
import pytest

import clpt
from clpt.__main__ import run
from clpt.cli.options.records import Handler
from clpt.cli.options.values import MOST_SAMPLES, Count, Noise
from clpt.device import choosing
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower

ROOT = Path(__file__).resolve().parents[2]
CORNELL = str(ROOT / "scenes" / "cornell_box")


@pytest.mark.parametrize(
    "words, nearest",
    [(["rendr", "x"], "'render'"), (["inspct"], "'inspect'"), (["cluster", "strt"], "start")],
)
def test_the_nearest_command(words, nearest, capsys):
    assert run(words) == 2
    told = capsys.readouterr().err
    assert words[-2 if words[0] == "rendr" else -1] in told and "did you mean" in told.lower()
    assert nearest in told and told.count("\n") == 1


def test_the_nearest_file_or_folder(tmp_path):
    (tmp_path / "cornell_box").mkdir()
    (tmp_path / "pawn.ply").touch()
    (tmp_path / "pawn.txt").touch()
    for given, meant in (
        ("cornel_box", "cornell_box"), ("pawn.pyl", "pawn.ply"), ("cornel_box/scene.json", None),
    ):  # fmt: skip
        with pytest.raises(SceneError) as raised:
            clpt.load(tmp_path / given)
        assert str(raised.value).endswith(f"did you mean {tmp_path / (meant or 'cornell_box')}?")
    with pytest.raises(SceneError, match=r"there is no such file$"):
        clpt.load(tmp_path / "something else")


@pytest.mark.parametrize(
    "text, share", [("2%", 0.02), ("2 %", 0.02), ("0.02", 0.02), (".5", 0.5), ("0", 0.0)]
)
def test_noise(text, share):
    assert Noise()(text) == pytest.approx(share)


@pytest.mark.parametrize("text, advice", [("2", "write 2% or 0.02"), ("60%", "above 50%")])
def test_so_much_noise_is_no_limit(text, advice):
    with pytest.raises(click.BadParameter, match=advice):
        Noise()(text)


@pytest.mark.parametrize(
    "text, number", [("256", 256), ("1k", 1000), ("1.5k", 1500), ("1M", 10**6)]
)
def test_counts(text, number):
    assert Count()(text) == number


@pytest.mark.parametrize("text", ["0", "1.5", "1K", "-1", "k", f"{MOST_SAMPLES + 1}", "9000M"])
def test_no_counts(text):
    with pytest.raises(click.BadParameter, match=r"such as 256, 1k or 1M|outside of 1 to"):
        Count()(text)


def test_half_an_orbit(capsys):
    assert run(["render", CORNELL, "--camera", "45"]) == 2
    assert "such as 45,20" in capsys.readouterr().err


def scene(tmp_path: Path, **parts: object) -> Path:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps({"camera": {"type": "perspective"}, **parts}))
    return path


@pytest.mark.parametrize(
    "parts, message",
    [
        ({"film": {"spp": 4}}, "film.spp: stands at the top of the file, beside 'film'"),
        ({"width": 4}, "width: stands inside of 'film'"),
        ({"materials": {"a": {"type": "diffuse", "reflectance": [140, 0, 0]}}},
         "140.0 is outside [0, 1]; colours are 0 to 1, linear"),
        ({"materials": {"a": {"type": "diffuse", "reflectance": "#aa202"}}},
         'no colour such as "#aa2020"'),
        ({"materials": {"a": {"type": "dielectric", "int_ior": "#aa2020"}}}, "unknown glass"),
    ],
)  # fmt: skip
def test_mistakes_in_a_scene(tmp_path, parts, message):
    with pytest.raises(SceneError) as raised:
        clpt.load(scene(tmp_path, **parts))
    assert message in str(raised.value)


def test_colours_of_a_colour_picker(tmp_path):
    """#aa2020 is sRGB: 170 / 255 is a linear 0.402."""
    shape = {"type": "sphere", "material": {"type": "diffuse", "reflectance": "#aa2020"}}
    light = {"type": "point", "position": [0, 0, 1], "intensity": "#ffffff"}
    made = clpt.load(scene(tmp_path, shapes=[shape], lights=[light]))
    colour = made.shapes[0].material.reflectance
    assert (colour.r, colour.g, colour.b) == pytest.approx((0.40198, 0.01444, 0.01444), abs=1e-5)
    assert made.lights[0].intensity.r == 1.0


def test_a_syntax_error_is_quoted(tmp_path):
    path = tmp_path / "scene.json"
    path.write_text('{"camera": {},\n "spp": 4 "film": {}}')
    with pytest.raises(SceneError) as raised:
        clpt.load(path)
    assert str(raised.value).startswith(f"{path}:2: column 11: is not JSON: Expecting ',' ")
    assert str(raised.value).endswith('in: "spp": 4 "film": {}}')


def test_no_device_is_one_line(monkeypatch, capsys):
    monkeypatch.setattr(choosing, "devices", lambda: ())
    monkeypatch.setattr("clpt.device.devices", lambda: ())
    assert run(["devices"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("clpt: error: no OpenCL device: install") and told.count("\n") == 1


def test_messages_of_the_log_are_like_others(capsys):
    record = logging.LogRecord("clpt", logging.WARNING, "", 0, "%s is odd", ("it",), None)
    Handler().emit(record)
    assert capsys.readouterr().err == "clpt: warning: it is odd\n"


def test_what_the_log_says_more(capsys, monkeypatch):
    """-v, as a user of the command has it, whose process has no other handlers."""
    monkeypatch.setattr(logging.getLogger(), "handlers", [])
    assert run(["-v", "devices"]) == 0
    logging.getLogger("clpt").info("it is %s", "odd")
    assert "clpt: info: it is odd\n" in capsys.readouterr().err


def test_rgb_leaves_dispersion_out():
    sphere = {
        name: clpt.scene.shapes.Sphere(material=clpt.scene.materials.Dielectric(int_ior=index))
        for name, index in (("named", "bk7"), ("plain", 1.5))
    }
    rgb = clpt.scene.integrators.Film(mode="rgb", width=8, height=8)
    for name, shape in sphere.items():
        made = clpt.Scene(camera=clpt.scene.cameras.Perspective(), film=rgb, shapes=[shape])
        warnings = lower(made).warnings
        told = [text for text in warnings if "glass does not disperse" in text]
        assert len(told) == (name == "named")
