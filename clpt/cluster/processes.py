"""The processes of a cluster: a scheduler, workers, and both on this machine."""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import logging
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt.cluster import keys, restricted
from clpt.errors import ClusterError

if TYPE_CHECKING:
    from distributed import Client

LOOPBACK = "127.0.0.1"
SETTINGS = {
    "distributed.scheduler.worker-ttl": "30 s",  # of a worker that is silent
    "distributed.scheduler.allowed-failures": 1000,  # the client counts failures itself
    "distributed.scheduler.work-stealing": False,  # and says who renders what
    "distributed.scheduler.active-memory-manager.start": False,
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": False,
    "distributed.worker.profile.enabled": False,
    "distributed.worker.http.routes": [],
    "distributed.scheduler.http.routes": [],
    "distributed.admin.large-graph-warning-threshold": "10 GB",
    "distributed.comm.timeouts.connect": "10 s",
    "distributed.comm.timeouts.tcp": "30 s",
}
START_SECONDS = 60.0  # in which a worker finds its scheduler
END_SECONDS = 5.0  # in which a process ends by itself


def configure() -> None:
    """Set Dask's options, and restrict what this process accepts. Raises ClusterError."""
    try:
        import dask
        import distributed  # noqa: F401
    except ImportError:
        raise ClusterError("a cluster needs Dask: pip install 'clpt[cluster]'") from None
    dask.config.set(SETTINGS)
    restricted.restrict()
    for name in ("distributed", "tornado", "asyncio"):  # clpt says what there is to know
        logging.getLogger(name).setLevel(max(logging.WARNING, logging.getLogger().level))
    logging.getLogger("asyncio").addFilter(_is_no_left_over)


def _is_no_left_over(record: logging.LogRecord) -> bool:
    """Whether a record is of something else than a wait that Dask leaves behind: it does so when a
    film is no longer wanted whose worker has gone.
    """
    return not (record.exc_info and getattr(record.exc_info[0], "__name__", "") == "AllExit")


def run_worker(
    address: str,
    *,
    host: str | None = None,
    folder: Path | None = None,
    name: str | None = None,
    tell: Callable[[str], None] = lambda text: None,
) -> int:
    """Render for a scheduler until it ends, or a signal comes; return the exit status.

    host: the address of this machine at which others reach it; folder: of the keys, for tls://.
    """
    configure()
    return asyncio.run(_worker(address, host, folder, name, tell))


async def _worker(
    address: str, host: str | None, folder: Path | None, name: str | None, tell: Any
) -> int:
    from distributed import Worker

    with tempfile.TemporaryDirectory(prefix="clpt-worker-") as scratch:
        worker = Worker(
            address, nthreads=1, host=host or (LOOPBACK if is_loopback(address) else None),
            name=name, security=keys.security(address, folder), memory_limit=0, dashboard=False,
            dashboard_address=f"{LOOPBACK}:0", local_directory=scratch,
            death_timeout=START_SECONDS,
        )  # fmt: skip
        signals = _signals()
        try:
            await worker
        except (OSError, asyncio.TimeoutError, TimeoutError) as error:
            raise ClusterError(f"there is no scheduler at {address}: {error}") from None
        tell(f"working for {address} as {worker.address}")
        ended = asyncio.create_task(worker.finished())
        stopped = asyncio.create_task(signals.wait())
        await asyncio.wait([ended, stopped], return_when=asyncio.FIRST_COMPLETED)
        _leave_soon()
        status = 0 if signals.number is None else 128 + signals.number
        await worker.close(reason="clpt worker ends")
        return status


class _Signals:
    """Signals that end a process, in an event loop."""

    def __init__(self) -> None:
        self.number: int | None = None
        self._came = asyncio.Event()

    def note(self, number: int) -> None:
        self.number = number
        self._came.set()

    async def wait(self) -> None:
        await self._came.wait()


def _signals() -> _Signals:
    found, loop = _Signals(), asyncio.get_running_loop()
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            with contextlib.suppress(NotImplementedError):  # Windows
                loop.add_signal_handler(number, found.note, number)
    return found


def _leave_soon() -> None:
    """End this process in some seconds, whatever a driver is doing then."""
    timer = threading.Timer(END_SECONDS, os._exit, (1,))
    timer.daemon = True
    timer.start()


def run_scheduler(
    host: str,
    port: int,
    *,
    folder: Path | None = None,
    tell: Callable[[str], None] = lambda text: None,
) -> int:
    """Run a scheduler until a signal comes; return the exit status.

    folder: of the keys, which are made where they are missing; without, connections are not
    encrypted. tell: is called with the address. Raises ClusterError for a host of other machines
    without keys, and where the port is not free.
    """
    configure()
    return asyncio.run(_scheduler(host, port, folder, tell))


async def _scheduler(host: str, port: int, folder: Path | None, tell: Any) -> int:
    from distributed import Scheduler

    if folder is not None:
        keys.make(folder)
    elif not is_loopback(host):
        raise ClusterError(f"{host} is not this machine alone: give a folder for keys")
    protocol = "tcp" if folder is None else "tls"
    try:
        scheduler = Scheduler(
            host=host, port=port, protocol=f"{protocol}://", dashboard=False,
            dashboard_address=f"{LOOPBACK}:0", security=keys.security(f"{protocol}://", folder),
        )  # fmt: skip
        await scheduler
    except OSError as error:
        raise ClusterError(f"{host}:{port} cannot be used: {error.strerror or error}") from None
    signals = _signals()
    tell(scheduler.address)
    await signals.wait()
    _leave_soon()
    await scheduler.close()
    return 128 + (signals.number or 0)


def is_loopback(address: str) -> bool:
    """Whether an address, perhaps with scheme and port, is of this machine alone."""
    host = address.rpartition("://")[2]
    host = host[1:].partition("]")[0] if host.startswith("[") else host.partition(":")[0]
    try:
        return ipaddress.ip_address(socket.gethostbyname(host)).is_loopback
    except (OSError, ValueError):
        return False


@contextmanager
def local_cluster(
    workers: int, *, device: str | None = None, threads: int | None = None
) -> Iterator[tuple[Client, list[subprocess.Popen[bytes]]]]:
    """Yield a client of a scheduler in this process, and its workers on this machine.

    threads: of each worker; by default the cores are divided. All of it listens on the loopback
    interface alone, and ends with the context, or with this process.
    """
    configure()
    from distributed import Client, LocalCluster

    each = threads or max(1, _cores() // workers)
    options = ["--threads", str(each)] + (["--device", device] if device else [])
    with LocalCluster(
        n_workers=0, host=LOOPBACK, dashboard_address=f"{LOOPBACK}:0", silence_logs=False
    ) as cluster:
        address = cluster.scheduler_address
        started = [start_worker(address, *options) for _ in range(workers)]
        try:
            with Client(address) as client:
                yield client, started
        finally:
            end(started)


def start_worker(address: str, *options: str, **more: Any) -> subprocess.Popen[bytes]:
    """Start a process that works for a scheduler."""
    command = [sys.executable, "-m", "clpt", "worker", address, *options, "--quiet"]
    return subprocess.Popen(command, **more)


def end(processes: list[subprocess.Popen[bytes]]) -> None:
    """End processes: asked first, then made to."""
    for process in processes:
        with contextlib.suppress(OSError):
            process.terminate()
    deadline = time.monotonic() + END_SECONDS
    for process in processes:
        try:
            process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
