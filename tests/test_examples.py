"""Every example runs, is short enough to be read at once, and leaves a picture."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

import clpt

FOLDER = Path(__file__).resolve().parents[1] / "examples"
EXAMPLES = sorted(FOLDER.glob("*.py"))
# Quick tests elsewhere have what these show.
LONG = (
    "bin_picking", "canopy", "custom_material", "deforming_mesh", "lidar", "nbody", "office",
    "smoke", "textured_mesh", "turntable",
)  # fmt: skip


@pytest.mark.parametrize(
    "example",
    [pytest.param(e, marks=[pytest.mark.slow] if e.stem in LONG else []) for e in EXAMPLES],
    ids=[example.stem for example in EXAMPLES],
)
def test_it_writes_a_picture(
    example: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
):
    if example.stem == "turntable":
        pytest.importorskip("imageio_ffmpeg", reason="a video needs the extra `video`")
    monkeypatch.setattr(sys, "argv", [str(example), str(tmp_path)])
    runpy.run_path(str(example), run_name="__main__")
    file = tmp_path / f"{example.stem}.png"
    assert f"wrote {file}" in capsys.readouterr().out
    picture = clpt.read_image(file)
    assert picture.shape[0] >= 100 and picture.shape[1] >= 100
    assert 0.02 < picture.mean() < 0.98 and picture.std() > 0.02  # neither black, white nor flat


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_help_is_no_folder(example: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(example), "--help"])
    with pytest.raises(SystemExit, match="0"):
        runpy.run_path(str(example), run_name="__main__")
    assert f"usage: {example.name} [-h] [folder]" in capsys.readouterr().out
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_it_can_be_read_at_once(example: Path):
    lines = example.read_text("utf-8").splitlines()
    assert len(lines) <= 85
    assert lines[0].startswith('"""')
    assert f"`{example.name}`" in (FOLDER / "README.md").read_text("utf-8")
