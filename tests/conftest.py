"""Fixtures that every test may use."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pyopencl as cl
import pytest

from clpt import device
from clpt.device import choosing
from clpt.files import child_processes
from tests import slow_tests

# the processes that tests start take a second each to parse all sources, where none keeps bytecode
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
os.environ.setdefault("POCL_WORK_GROUP_SPECIALIZATION", "0")  # both as of the command
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
gc.disable()  # what collection makes stays: to seek garbage in it takes a third of the time
HERE = Path(__file__).resolve().parent
# Tests that start processes, and wait for what the machine's other work may hold up.
PROCESSES = [HERE / name for name in ("benchmark", "cli", "cluster", "device", "embedding")]
PROCESSES += [HERE / name for name in ("faults", "test_output_files.py", "view")]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One more than there are cores: tests that wait for processes and disks use no core."""
    return child_processes.cores() + 1


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session: pytest.Session) -> None:
    """Let workers import test files in different orders: what one has compiled others load."""
    config = session.config
    if not hasattr(config, "workerinput") or config.args_source.name != "TESTPATHS":
        return
    number = int(config.workerinput["workerid"].removeprefix("gw"))
    files = sorted(HERE.rglob("test_*.py"))
    first = number * len(files) // config.workerinput["workercount"]
    for path in [*files[first:], *files[:first]]:
        with suppress(Exception, pytest.skip.Exception):  # collection tells of it
            import_module(".".join(path.relative_to(HERE.parent).with_suffix("").parts))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what is listed as slow, let long tests be the first, and quick tests of processes try
    twice more.

    The summary tells of each that did so. Who asks for slow tests gets each failure: `make
    test-all`, `-m slow`, `-m ""`.
    """
    for item in items:
        if item.nodeid in slow_tests.listed():
            item.add_marker(pytest.mark.slow)
    items.sort(key=lambda item: item.get_closest_marker("long") is None)
    if config.getoption("markexpr") != "not slow":
        return
    retried = {path for path in {item.path for item in items} if _starts_processes(path)}
    for item in items:
        if item.path in retried:
            item.add_marker(pytest.mark.flaky(reruns=2))


def _starts_processes(path: Path) -> bool:
    return any(path.is_relative_to(folder) for folder in PROCESSES)


def pytest_collection_finish() -> None:
    """Collect cycles from now on, but among what tests make alone."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session")
def assets() -> Path:
    """Third-party test scenes: `shared/assets` beside the checkout, or $CLPT_ASSETS."""
    beside = HERE.parent.parent / "shared" / "assets"
    folder = Path(os.environ.get("CLPT_ASSETS", beside))
    if not folder.is_dir():
        pytest.skip("no shared/assets beside the checkout, and CLPT_ASSETS is not set")
    return folder


@pytest.fixture(scope="session")
def scenes() -> Path:
    """The folder of the small scenes that belong to the tests."""
    return HERE / "scenes"


@pytest.fixture
def no_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    """No trial of the device has been made; those of a test are remembered in it."""
    kept: dict[str, tuple[str, bytes]] = {}
    memory = SimpleNamespace(load=kept.get, store=lambda key, *what: kept.update({key: what}))
    monkeypatch.setattr(choosing, "disk_cache", memory)


@cache
def _first() -> device.Device:
    return device.choose()


@pytest.fixture(scope="module")
def one_context() -> Iterator[None]:
    """Open one context for all renderers that are given no device, each with a queue of its own.

    Programs are then built, or loaded, once a process.
    """
    first, opened = _first(), device.choose

    def choose(which: str | int | None = None, **more: Any) -> device.Device:
        if which is not None or any(more.values()):
            return opened(which, **more)
        queue = cl.CommandQueue(first.context, first.info.cl_device)
        return device.Device(first.context, queue, first.info)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(device, "choose", choose)
        yield
