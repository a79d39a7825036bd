"""Ctrl-C and SIGTERM: one line, the picture so far where there is one, and nothing else stays."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from clpt import images
from clpt.__main__ import run
from clpt.cli import opening
from clpt.cli.files import checkpoints, outputs, targets
from clpt.cli.options import scene_options
from clpt.cli.process import ending
from clpt.cli.render import picture
from tests.cli import interrupting

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

# Where a signal comes, and whether there is a picture then.
POINTS = {
    "outputs are checked": (targets, "checked", False),
    "a film is looked for": (checkpoints, "find", False),
    "the device is opened": (opening, "share_compilers", False),
    "the scene is read": (scene_options, "load", False),
    "the scene is checked": (opening, "check", False),
    "kernels are built": (opening, "new_renderer", False),
    "checkpoints begin": (checkpoints.Checkpoints, "__init__", False),
    "samples are taken": (picture, "render_samples", False),
    "a film is saved": (checkpoints.Checkpoints, "save", True),
    "a picture is made": (outputs, "metadata", True),
    "a picture is written": (outputs, "write", True),
    "checkpoints end": (checkpoints.Checkpoints, "finish", True),
}


@pytest.fixture
def heeded():
    """The signals as a command has them."""
    numbers = signal.SIGINT, *ending.ENDING
    before = {number: signal.signal(number, signal.SIG_DFL) for number in numbers}
    ending.raise_at_signals()
    yield
    for number, action in before.items():
        signal.signal(number, action)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda n: n.name)
@pytest.mark.parametrize("point", POINTS)
def test_a_signal_at_each_point(tmp_path, monkeypatch, capsys, heeded, point, number):
    owner, name, pictured = POINTS[point]
    reached = getattr(owner, name)

    def signalled(*given, **named):
        monkeypatch.setattr(owner, name, reached)
        signal.raise_signal(number)
        return reached(*given, **named)

    monkeypatch.setattr(owner, name, signalled)
    path = tmp_path / "a.exr"
    command = ["render", interrupting.SCENE, "-o", str(path), "--mode", "rgb", "--size", "8x8"]
    assert run([*command, "--spp", "1"]) == 128 + number
    said = capsys.readouterr().err.splitlines()
    assert sum("clpt: error: interrupted" in line for line in said) == (not path.exists())
    assert path.exists() or not pictured
    assert {one.name for one in tmp_path.iterdir()} <= {"a.exr"}
    if path.exists():
        assert images.read(path).shape == (8, 8, 3)


BUILDING = """
import hashlib, sys
import clpt.cli.opening as opening
from clpt.__main__ import main
def build(*_, **__):  # C, that no signal ends
    print("builds", file=sys.stderr, flush=True)
    hashlib.pbkdf2_hmac("sha256", b"", b"", 2_000_000_000)
opening.new_renderer = build
main()
"""


@pytest.mark.parametrize(("number", "presses"), [(signal.SIGINT, 2), (signal.SIGTERM, 1)])
def test_a_compiler_does_not_keep_a_process_from_ending(tmp_path, number, presses):
    path = tmp_path / "a.exr"
    process = subprocess.Popen(
        [sys.executable, "-c", BUILDING, "render", interrupting.SCENE, "-o", str(path)],
        cwd=interrupting.ROOT, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),
    )  # fmt: skip
    said = []
    for line in process.stderr:
        said.append(line)
        if line == "builds\n":
            time.sleep(0.3)  # it is in C then: before, Python itself would end it at the first one
            for _ in range(presses):
                process.send_signal(number)
                time.sleep(0.05)  # the first one takes LLVM's own handlers away, which a driver has
    assert process.wait(300) == 128 + number
    assert said[-1] == "clpt: error: interrupted\n" and "".join(said).count("clpt:") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="finds processes by /proc")
def test_renders_that_are_interrupted():
    figures = interrupting.interrupt(10, seed=3, root=Path(interrupting.ROOT))
    assert not figures.faults
