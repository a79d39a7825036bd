"""A stranger's folder: whatever is run there, nothing of it is imported or executed."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from clpt.cli import COMMANDS
from clpt.files import child_processes

ROOT = Path(__file__).resolve().parents[2]
LONGEST = 120.0  # seconds
PLANTED = (
    "numpy", "clpt", "clpt_command", "usercustomize", "sitecustomize", "conftest", "distributed",
    "dask", "tornado", "trustme", "pyopencl", "runpy", "click", "json", "pickle", "PIL", "OpenEXR",
)  # fmt: skip
SMALL = ("--size", "4x4", "--spp", "1", "--checkpoint", "0")
RENDER = ("render", "scene", *SMALL, "-o")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a scene and one for outputs, with modules that tell of an import."""
    where = tmp_path / "strange"
    shutil.copytree(ROOT / "scenes/cornell_box", where / "scene")
    (where / "out").mkdir()
    (tmp_path / "told").mkdir()
    for place in (where, where / "scene", where / "out"):
        for name in PLANTED:
            told = tmp_path / "told" / f"{place.name}-{name}"
            (place / f"{name}.py").write_text(f"open({str(told)!r}, 'w').close()\n")
        told = tmp_path / "told" / f"{place.name}-pth"
        (place / "strange.pth").write_text(f"import os; open({str(told)!r}, 'w').close()\n")
    # The command `clpt`, as pip writes it: a file in a folder of its own.
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin/clpt").write_text("from clpt_command import main\nmain()\n")
    return where


def imported(folder: Path) -> list[str]:
    """What was imported of a folder."""
    return sorted(path.name for path in (folder.parent / "told").iterdir())


def start(folder: Path, *words: str, module: bool = False) -> subprocess.Popen[str]:
    """Start `clpt` in a folder; module: as `python -m clpt`."""
    program = ["-m", "clpt"] if module else [str(folder.parent / "bin/clpt")]
    state = {"XDG_STATE_HOME": str(folder.parent / "state"), "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, *program, *words], cwd=folder, env={**os.environ, **state}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip


def run(folder: Path, *words: str, module: bool = False) -> None:
    """Run `clpt` in a folder to its end."""
    with start(folder, *words, module=module) as process:
        told = process.communicate(timeout=LONGEST)[0]
    assert process.returncode == 0, told


@pytest.mark.long
def test_commands_that_end(folder: Path) -> None:
    """Each of them, with a small job; the first makes what the others read."""
    run(folder, *RENDER, "out/a.film", "-o", "out/a.exr", "-o", "out/a.png")
    (folder / "out/points.csv").write_text("0, 0, 0\n", "utf-8")
    ended = set()
    for words in (
        ("merge", "out/a.film", "-o", "out/b.exr"),
        ("warm", "scene", "--size", "4x4"),
        ("devices",),
        ("scenes",),
        ("info", "scene"),
        ("measure", "scene", "--at", "out/points.csv", "--samples", "16", "-o", "out/lux.csv"),
        ("inspect", "out/a.exr", "--json"),
        ("convert", "out/a.exr", "out/c.png"),
        ("compare", "out/a.film", "out/a.exr", "-o", "out/d.png"),
        ("completion", "bash", "--print"),
        ("kernels", "scene", "-o", "out/kernels"),
        ("mie", "5", "--radii", "2", "--wavelengths", "500,600,50", "-o", "out/fog.json"),
        ("lens", "double_gauss"),
        ("bench", "--list"),
    ):
        run(folder, *words)
        assert imported(folder) == [], words
        ended.add(words[0])
    assert set(COMMANDS) == {"render", "view", "worker", "cluster", *ended}, "a new command"


def test_commands_that_start_workers(folder: Path) -> None:
    """A scheduler, a worker and a render, all in such a folder; local:1 is below."""
    pytest.importorskip("distributed")
    scheduler = start(folder, "cluster", "start", "--port", "0")
    started = [scheduler]
    try:
        address = scheduler.stdout.readline().strip()
        started.append(start(folder, "worker", address, "--quiet"))
        run(folder, *RENDER, "out/a.exr", "--cluster", address)
    finally:
        for process in started:
            process.terminate()
            process.communicate()
    assert imported(folder) == []


def test_the_page(folder: Path) -> None:
    process = start(folder, "view", "scene", "--no-browser", "--port", "0", "--size", "4x4")
    try:
        for line in process.stdout:
            if "http" in line:
                break
        time.sleep(1.0)
        assert process.poll() is None
    finally:
        process.terminate()
        process.communicate()
    assert imported(folder) == []


@pytest.mark.slow
def test_processes_that_are_measured(folder: Path) -> None:
    run(folder, "bench", "--stage", "start", "--scene", "cornell", "--rounds", "1")
    assert imported(folder) == []


def test_the_module(folder: Path) -> None:
    """`python -m clpt`: Python itself looks here for `runpy` and `clpt`, but clpt for nothing."""
    pytest.importorskip("distributed")
    for name in ("clpt", "runpy"):
        (folder / f"{name}.py").unlink()
    run(folder, *RENDER, "out/a.exr", "--cluster", "local:1", module=True)
    assert imported(folder) == []


def test_a_checkout_is_where_clpt_is() -> None:
    """There `python -m clpt` works without an install."""
    command = [sys.executable, "-m", "clpt", "--help"]
    environment = {name: v for name, v in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, timeout=LONGEST)
    assert done.returncode == 0, done.stderr


def test_a_child_finds_what_this_process_does(folder: Path, monkeypatch) -> None:
    """But for what is relative to the current folder, and before any code of it runs."""
    monkeypatch.setattr(sys, "path", ["", ".", *sys.path, str(folder.parent)])
    monkeypatch.setenv("PYTHONPATH", str(folder))
    (folder.parent / "own.py").write_text("")
    code = "import own, runpy, json, numpy, clpt; print(sys.argv[1:], *sys.path, sep='\\n')"
    command = child_processes.command(code, "a b", "c")
    told = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout
    arguments, *paths = told.splitlines()
    assert arguments == "['a b', 'c']"
    assert paths and all(os.path.isabs(path) for path in paths) and str(folder) not in paths
    assert imported(folder) == []


def test_python_is_started_in_one_place() -> None:
    """A module that starts a Python does so by `child_processes`."""
    starts = re.compile(r"sys\.executable|import multiprocessing|ProcessPoolExecutor")
    named = [
        path.relative_to(ROOT).as_posix()
        for path in sorted((ROOT / "clpt").rglob("*.py"))
        if starts.search(path.read_text())
    ]
    assert named == ["clpt/files/child_processes.py"]
