"""`clpt warm`: a later process compiles nothing, and renders what it renders without."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from clpt.__main__ import run

SCENES = Path(__file__).parents[2] / "scenes"
CORNELL, SPHERES = str(SCENES / "cornell_box"), str(SCENES / "three_spheres")
OPTIONS = ("--size", "16x12", "--mode", "rgb", "--quiet")


def clpt(folder: Path, *arguments: str) -> str:
    """What a command of a process with caches in a folder of its own prints."""
    caches = ("XDG_CACHE_HOME", "POCL_CACHE_DIR", "CUDA_CACHE_PATH", "NEO_CACHE_DIR")
    variables = {name: str(folder / name) for name in caches}
    for path in variables.values():
        Path(path).mkdir(exist_ok=True)
    command = [sys.executable, "-m", "clpt", *arguments]
    environment = {**os.environ, **variables, "CLPT_DEVICE": os.environ.get("CLPT_DEVICE", "0")}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout


def programs(folder: Path) -> set[Path]:
    """The compiled programs in the caches: what drivers and clpt run."""
    return {path for path in folder.rglob("*") if path.suffix == ".so" or "programs" in path.parts}


@pytest.mark.slow
def test_a_second_process_compiles_nothing(tmp_path):
    told = clpt(tmp_path, "warm", CORNELL, *OPTIONS)
    assert told.startswith(f"{CORNELL}: 2 programs, 0 of them found, in ")
    before = programs(tmp_path)
    assert before
    clpt(tmp_path, "render", CORNELL, *OPTIONS, "--spp", "2", "-o", str(tmp_path / "a.png"))
    assert programs(tmp_path) == before


@pytest.mark.slow
def test_it_tells_of_each_scene_and_writes_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["warm", CORNELL, SPHERES, *OPTIONS]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(": ")[0] for line in lines] == [CORNELL, SPHERES]
    assert all(" programs, " in line for line in lines)
    assert not [*tmp_path.iterdir()]


def test_a_scene_that_is_not_there(capsys):
    assert run(["warm", "no.json"]) == 2
    assert "no.json" in capsys.readouterr().err


@pytest.mark.slow
def test_every_set_of_kinds_is_compiled(tmp_path):
    """Of three kinds there are seven sets; a scene of two of them then compiles nothing."""
    told = clpt(tmp_path, "warm", CORNELL, *OPTIONS, "--kinds", "diffuse,plastic,conductor")
    programs, found = map(int, re.findall(r"\d+", told.removeprefix(f"{CORNELL}: "))[:2])
    assert programs >= 7 and found == 0
    told = clpt(tmp_path, "warm", CORNELL, *OPTIONS, "--kinds", "conductor,diffuse")
    programs, found = map(int, re.findall(r"\d+", told.removeprefix(f"{CORNELL}: "))[:2])
    assert found == programs >= 3


@pytest.mark.parametrize(
    ("kinds", "message"),
    [("glas", "glas"), (",".join(["diffuse"] * 99), "99 kinds need as many shapes")],
)
def test_kinds_that_cannot_be_compiled(kinds, message, capsys):
    assert run(["warm", CORNELL, *OPTIONS, "--kinds", kinds]) == 2
    assert message in capsys.readouterr().err
