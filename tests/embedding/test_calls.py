"""Which functions of OpenCL clpt calls, counted below PyOpenCL, in a process of its own."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
HOST = ("clFinish", "clEnqueueReadBuffer", "clEnqueueMapBuffer", "clWaitForEvents")
MAKING = ("clGetPlatformIDs", "clCreateContext", "clCreateCommandQueue")
ENQUEUED = (
    "step after a late event", "step", "camera", "material", "move", "reset", "resolve", "film",
)  # fmt: skip
QUERIES = ("intersect", "occluded", "refit")

Calls = dict[str, dict[str, int]]


@pytest.fixture(scope="module")
def calls(tmp_path_factory: pytest.TempPathFactory, scenes: Path) -> Calls:
    """What tests/embedding/guest.py did -> function -> how often it was called."""
    compiler = shutil.which("cc")
    if compiler is None or not sys.platform.startswith("linux"):
        pytest.skip("there is no C compiler, or no LD_PRELOAD")
    library = tmp_path_factory.mktemp("calls") / "calls.so"
    flags = ["-O1", "-shared", "-fPIC", "-o", str(library)]
    subprocess.run([compiler, *flags, str(HERE / "calls.c"), "-ldl"], check=True)
    root = HERE.parent.parent
    path = os.pathsep.join(filter(None, [str(root), os.environ.get("PYTHONPATH")]))
    done = subprocess.run(
        [sys.executable, "-m", "tests.embedding.guest", str(scenes / "cornell.xml")],
        env={**os.environ, "LD_PRELOAD": str(library), "PYTHONPATH": path},
        cwd=root, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_the_counters_count(calls: Calls) -> None:
    assert calls["picture"]["clEnqueueReadBuffer"] == 1
    assert calls["make"]["clCreateBuffer"] > 10


def test_no_context_queue_or_platform_is_made_or_looked_for(calls: Calls) -> None:
    names = [*MAKING, "clCreateCommandQueueWithProperties", "clFinish"]
    assert {name: calls["make"][name] for name in names} == dict.fromkeys(names, 0)


@pytest.mark.parametrize("what", [*ENQUEUED, *QUERIES])
def test_nothing_is_read_or_waited_for(calls: Calls, what: str) -> None:
    """While the first of them is held up by an event, so a wait would never have ended either."""
    assert {name: calls[what][name] for name in HOST} == dict.fromkeys(HOST, 0)


def test_a_move_reaches_the_device(calls: Calls) -> None:
    """Also when the very array is given again: what is in it may be another matrix."""
    assert calls["move"]["clEnqueueNDRangeKernel"] > 0


def test_a_step_is_few_commands(calls: Calls) -> None:
    """However many samples it adds: the loop over bounces is on the device."""
    assert calls["step"]["clEnqueueNDRangeKernel"] == 2
    assert calls["step"]["clCreateBuffer"] == calls["step"]["clBuildProgram"] == 0


def test_the_second_renderer_of_a_context_builds_nothing(calls: Calls) -> None:
    assert calls["make"]["clBuildProgram"] > 0 == calls["another"]["clBuildProgram"]


def test_no_memory_is_left(calls: Calls) -> None:
    """At once, without Python's collector of cycles: as many buffers were released as taken."""
    assert calls["left"]["buffers"] == calls["left by queries"]["buffers"] == 0
