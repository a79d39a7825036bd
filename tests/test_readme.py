"""What README.md says is so: links lead somewhere, its Python runs, its commands run as typed."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import clpt
from clpt.cli import cli
from tests import pages

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text("utf-8")
COMMANDS = pages.commands(ROOT / "README.md")
WAITS = "clpt view"  # until Ctrl-C; tests/cli/test_view.py runs it
QUICK = ("clpt render scenes/cornell_box", "clpt info", "clpt devices")


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stand in a folder that looks like the repository's root; what is written stays there."""
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_links_lead_somewhere():
    links = re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", README)
    local = [link for link in links if not link.startswith("http")]
    assert len(local) > 10
    assert [link for link in local if not (ROOT / link).exists()] == []


def test_it_is_short():
    assert len(README.split()) <= 1200


def test_its_python_runs_from_the_first_line_to_the_last(clone: Path):
    names: dict = {}
    for code in pages.blocks(ROOT / "README.md", "python"):
        code = code.replace("sun_elevation=20.0, ", "")  # the sky of other tests: it takes seconds
        exec(code.replace("width=320, height=240", "width=16, height=12"), names)
    image = names["image"]
    assert image.shape == (12, 16, 3) and np.isfinite(image).all()
    assert image[0, 0, 2] > 1.2 * image[0, 0, 0] > 0  # the sky is blue, gold in the middle yellow
    assert image[6, 8, 0] > 1.2 * image[6, 8, 2]
    assert clpt.read_image("gold.png").shape == (12, 16, 3)
    assert names["picture"].shape == (12, 16, 4)


def test_commands_and_options_exist():
    assert len(COMMANDS) > 5
    assert [f"{line}: {pages.unknown(line)}" for line in COMMANDS if pages.unknown(line)] == []


@pytest.mark.parametrize(
    "line",
    [
        pytest.param(line, marks=[] if line.startswith(QUICK) else [pytest.mark.slow])
        for line in COMMANDS
        if not line.startswith(WAITS)
    ],
)
def test_a_command_runs_as_typed(line: str, clone: Path):
    words = pages.smaller(line, spp=2)  # a denoiser needs two samples
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == 0, done.output
    written = [name for option, name in pairwise(words) if option == "-o"]
    assert [name for name in written if not (clone / name).exists()] == []
