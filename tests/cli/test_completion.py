"""`clpt completion`: the script of each shell, where it goes, and what TAB then completes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from clpt.__main__ import run
from clpt.cli.completion import SHELLS, file_of

CODE = "from clpt.__main__ import run; import sys; sys.exit(run([]))"


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


@pytest.mark.parametrize("shell", SHELLS)
def test_it_is_installed_by_one_command(home, shell, capsys):
    assert run(["completion", shell, "--print"]) == 0
    script = capsys.readouterr().out
    assert "_CLPT_COMPLETE" in script and not list(home.iterdir())
    assert run(["completion", shell]) == 0
    told = capsys.readouterr().out
    path = file_of(shell)
    assert path.is_relative_to(home) and path.read_text() + "\n" == script
    assert told.startswith(f"{path}  ") and shell in told
    if shutil.which(shell):
        subprocess.run([shell, "-n", str(path)], check=True)


def test_a_folder_that_cannot_be_written(home, capsys):
    (home / ".local").touch()
    assert run(["completion", "bash"]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert run(["completion", "ksh"]) == 2


@pytest.mark.parametrize(
    ("line", "found", "left_out"),
    [
        ("clpt comp", {"compare", "completion"}, "render"),
        ("clpt info scenes/cor", {"scenes/cornell_box"}, "scenes/prism"),
        ("clpt warm scenes/pri", {"scenes/prism", "scenes/prism_mirror"}, "scenes/pool"),
        ("clpt render --no", {"--noise", "--no-resume"}, "--spp"),
        ("clpt render --tone a", {"agx", "aces"}, "neutral"),
    ],
)
def test_what_is_completed(line, found, left_out):
    words = {"COMP_WORDS": line, "COMP_CWORD": str(len(line.split()) - 1)}
    done = subprocess.run(
        [sys.executable, "-c", CODE],
        env={**os.environ, **words, "_CLPT_COMPLETE": "bash_complete"},
        capture_output=True,
        text=True,
        check=True,
    )
    offered = {row.partition(",")[2] for row in done.stdout.splitlines()}
    assert found <= offered and left_out not in offered


def test_the_folders_of_the_user_are_heeded(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    assert file_of("zsh") == Path(tmp_path / "data/zsh/site-functions/_clpt")
