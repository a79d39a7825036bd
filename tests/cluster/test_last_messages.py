"""What a worker says when its scheduler has gone: that it ends, and no traceback of Dask's."""

from __future__ import annotations

import asyncio
import logging
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

distributed = pytest.importorskip("distributed")

sys.path.insert(0, str(Path(__file__).parent))
from machines import ENVIRONMENT, LONGEST  # noqa: E402

from clpt.cluster import processes  # noqa: E402

LOGGER = logging.getLogger("distributed.worker")


def worker_without_scheduler() -> Any:
    """As much of a worker as a heartbeat needs, whose scheduler does not answer."""

    async def gone(**_: object) -> None:
        raise OSError("in <TLS ConnectionPool.heartbeat_worker>: Stream is closed")

    async def metrics() -> dict[str, object]:
        return {}

    return SimpleNamespace(
        address="tls://127.0.0.1:1", contact_address="tls://127.0.0.1:1", get_metrics=metrics,
        scheduler=SimpleNamespace(heartbeat_worker=gone), active_keys=(), extensions={},
        state=SimpleNamespace(tasks={}),
    )  # fmt: skip


@contextmanager
def without_filters() -> Iterator[None]:
    before = LOGGER.filters[:]
    LOGGER.filters.clear()
    try:
        yield
    finally:
        LOGGER.filters[:] = before


def beat() -> None:
    """Let Dask's own code log a heartbeat that fails."""
    asyncio.run(distributed.Worker.heartbeat(worker_without_scheduler()))


def test_a_heartbeat_without_scheduler_says_nothing(caplog: pytest.LogCaptureFixture) -> None:
    processes.configure()
    beat()
    assert not caplog.records
    with without_filters():  # Dask still says it, by this logger: the filter is needed
        beat()
    (record,) = caplog.records
    assert record.exc_info is not None and "Stream is closed" in str(record.exc_info[1])


def test_other_messages_come_through(caplog: pytest.LogCaptureFixture) -> None:
    processes.configure()
    for text in ("Scheduler was unaware of this worker", "Unexpected exception during heartbeat"):
        LOGGER.warning(text)
    assert len(caplog.records) == 2


def started(*words: str, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "clpt", *words], env={**ENVIRONMENT, **environment}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_worker_whose_scheduler_is_killed(tmp_path: Path) -> None:
    place = {"XDG_STATE_HOME": str(tmp_path)}
    processes_of_both = [started("cluster", "start", "--port", "0", **place)]
    try:
        (scheduler,) = processes_of_both
        assert scheduler.stdout is not None
        address = scheduler.stdout.readline().strip()
        worker = started("worker", address, "--threads", "1", **place)
        processes_of_both.append(worker)
        assert worker.stdout is not None
        while "working for" not in (row := worker.stdout.readline()):
            assert row, "the worker ended"
        scheduler.send_signal(signal.SIGKILL)
        said, _ = worker.communicate(timeout=LONGEST)
    finally:
        for process in processes_of_both:
            process.kill()
            process.wait()
    assert worker.returncode == 0
    assert "Traceback" not in said and "heartbeat" not in said
