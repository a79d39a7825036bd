"""`-o -`: a picture for a pipe."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clpt.__main__ import run

ROOT = Path(__file__).resolve().parents[2]
CORNELL = str(ROOT / "scenes" / "cornell_box")
COMMON = ["render", CORNELL, "--size", "8x6", "--spp", "1", "--mode", "rgb"]


def test_the_picture_and_nothing_else(capsysbinary, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run([*COMMON, "-o", "-", "-o", "a.npy", "--format", "npy"]) == 0
    out, err = capsysbinary.readouterr()
    assert np.array_equal(np.load(io.BytesIO(out)), np.load("a.npy"))
    assert b"standard output\na.npy\n1 spp, " in err and b"clpt-picture" not in err
    assert run([*COMMON, "-o", "-"]) == 0
    picture = Image.open(io.BytesIO(capsysbinary.readouterr().out))
    assert (picture.format, picture.size) == ("PNG", (8, 6))
    assert [path.name for path in tmp_path.iterdir()] == ["a.npy"]


def test_checkpoints_have_the_name_of_the_scene(capsysbinary, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run([*COMMON, "-o", "-", "--format", "film", "--checkpoint", "1h"]) == 0
    assert len(capsysbinary.readouterr().out) > 1000
    assert [path.name for path in tmp_path.iterdir()] == ["cornell_box.resume.exr"]


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_a_reader_that_is_gone(tmp_path):
    """One line, status 2, and no complaint of Python's at the exit."""
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [sys.executable, "-m", "clpt", *COMMON, "-o", "-", "--quiet"],
        cwd=ROOT, stdout=write, stderr=subprocess.PIPE, text=True, check=False,
    )  # fmt: skip
    os.close(write)
    assert (done.returncode, done.stderr) == (2, "clpt: error: -: its reader is gone\n")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["-o", "-", "-o", "-"], "-o - can be given once"),
        (["-o", "a.png", "--format", "exr"], "--format is for -o -"),
        (["-o", "-", "--format", "gif"], "'gif' is not one of 'exr', 'png'"),
        (["-o", "-", CORNELL], "-o - is for one picture"),
        (["-o", "-", "--frames", "1:2"], "-o - is for one picture"),
    ],
)
def test_bad_values_are_one_line(capsys, options, told):
    assert run([*COMMON, *options]) == 2
    error = capsys.readouterr().err
    assert told in error and error.count("\n") == 1


def test_a_terminal_shows_no_picture(capsys, monkeypatch):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert run([*COMMON, "-o", "-"]) == 2
    assert "-o - > picture.png" in capsys.readouterr().err
