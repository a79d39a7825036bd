"""`clpt kernels`: whole programs, without a device."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from clpt import device
from clpt.__main__ import run
from clpt.bench import agreement
from clpt.bench.scenes import PICTURES
from clpt.choices import PICTURE_SCENES

SCENES = Path(__file__).resolve().parents[2] / "scenes"


def test_a_file_for_every_program(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(device, "choose", lambda *a, **k: pytest.fail("a device was asked for"))
    folder = tmp_path / "new" / "sources"
    assert run(["kernels", str(SCENES / "three_spheres"), "-o", str(folder), "--lanes", "1"]) == 0
    told = capsys.readouterr().out.splitlines()
    made = {path.stem: path.read_text("utf-8") for path in folder.iterdir()}
    assert len(made) == len(told)
    assert {"generate", "intersect", "append", "shade_plastic", "accumulate"} <= made.keys()
    for text in made.values():
        assert re.search(r"\bkernel\b.* void ", text) and "#include" not in text


def test_lanes(tmp_path):
    for lanes in ("1", "16"):
        arguments = ["-o", str(tmp_path), "--lanes", lanes, "--layout", "binary"]
        assert run(["kernels", str(SCENES / "cornell_box"), *arguments]) == 0
        assert f"#define LANES {lanes}\n" in (tmp_path / "shade_diffuse.cl").read_text("utf-8")


def test_bad_input_is_one_line(tmp_path, capsys):
    (tmp_path / "file").touch()
    scene = str(SCENES / "cornell_box")
    for arguments in ([scene], ["no.json", "-o", "x"], [scene, "-o", str(tmp_path / "file")]):
        assert run(["kernels", *arguments]) == 2
        error = capsys.readouterr().err
        assert error.startswith("clpt: error: ") and error.count("\n") == 1


def test_a_stage_as_a_program_of_its_own(tmp_path, monkeypatch, capsys):
    """Of a scene of the benchmark; which stages there are is told."""
    monkeypatch.setattr(agreement, "SLOTS", 1024)
    folder = tmp_path / "fault"
    given = ["kernels", "cornell", "-o", str(folder), "--repro"]
    assert run([*given, "shadow"]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("shadow on ") and ": right, beside " in told[0]
    assert {"kernel.cl", "launch.c", "launch.py", "launch.txt", "README.txt"} <= {
        path.name for path in folder.iterdir()
    }
    assert run([*given, "shadows"]) == 2
    assert "did you mean 'shadow'" in capsys.readouterr().err
    monkeypatch.setattr(agreement, "checked", lambda *given: iter(()))
    assert run([*given, "first"]) == 2
    assert "no stage is wrong beside" in capsys.readouterr().err


def test_scenes_of_the_benchmark_have_their_names():
    assert tuple(PICTURES) == PICTURE_SCENES
