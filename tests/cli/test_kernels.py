"""`clpt kernels`: whole programs, without a device."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from clpt import device
from clpt.__main__ import run

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
