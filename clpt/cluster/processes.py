"""The processes of a cluster: a scheduler, workers, and both on this machine.

Dask trusts every peer that can connect, so every listening socket asks for a certificate. Dask's
web servers ask for none, and are left out.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import logging
import os
import signal
import socket
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import platformdirs

from clpt.errors import ClusterError
from clpt.files import child_processes

if TYPE_CHECKING:
    from distributed import Client, Scheduler, Worker
    from distributed.security import Security

Tell = Callable[[str], object]  # called with a text for people

KEYS_FILE = "clpt-cluster.pem"
LOOPBACK = "127.0.0.1"
SETTINGS = {
    "distributed.scheduler.worker-ttl": "30 s",  # of a silent worker
    "distributed.scheduler.allowed-failures": 10,  # workers that may die with a block
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
START_SECONDS = 60.0  # for a worker to find its scheduler
END_SECONDS = 5.0  # for a process to end by itself


def default_folder() -> Path:
    """Return the default folder of a user's keys on a machine."""
    return platformdirs.user_state_path("clpt", appauthor=False) / "cluster"


def make_keys(folder: Path) -> None:
    """Write the keys of a cluster, unless the folder has them: a file that only this user can read.

    The file holds a certificate, its key, and the authority that signed it. The authority's key is
    not kept, so nobody can issue a second certificate. Copy the folder to the machines of the
    cluster, by ssh for example. Raises ClusterError.
    """
    if (folder / KEYS_FILE).exists():
        return
    try:
        import trustme
    except ImportError:
        raise ClusterError("a cluster needs keys: pip install 'clpt[cluster]'") from None
    authority = trustme.CA(organization_name="clpt cluster")
    certificate = authority.issue_cert("cluster.clpt")
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(dir=folder)  # only this user can read it
        try:
            with open(descriptor, "wb") as file:
                pem = certificate.private_key_and_cert_chain_pem.bytes()
                file.write(pem + authority.cert_pem.bytes())
            os.rename(temporary, folder / KEYS_FILE)
        except BaseException:
            os.unlink(temporary)
            raise
    except OSError as error:
        raise ClusterError(f"{folder}: keys cannot be written: {error.strerror}") from None


def security(folder: Path | None = None) -> Security:
    """Return Dask's security object for the keys of a folder, by default this user's.

    Raises ClusterError without keys, and where other users can read or replace them.
    """
    from distributed.security import Security

    folder = default_folder() if folder is None else folder
    path = folder / KEYS_FILE
    if not path.is_file():
        raise ClusterError(
            f"{folder} has no keys of a cluster: clpt cluster start makes them; "
            "give its folder by --keys on other machines"
        )
    if os.name == "posix":
        for checked, others in ((path, 0o077), (folder, 0o022)):
            if checked.stat().st_uid not in (os.getuid(), 0):
                raise ClusterError(f"{checked} belongs to another user")
            if checked.stat().st_mode & others:
                raise ClusterError(f"{checked} is open to others (see: chmod go= {checked})")
    roles = ("client", "scheduler", "worker")
    try:
        keys = Security(
            require_encryption=True, tls_ca_file=str(path),
            **{f"tls_{role}_cert": str(path) for role in roles},
        )  # fmt: skip
        keys.get_listen_args("scheduler")
    except OSError as error:
        raise ClusterError(f"{path} holds no keys of a cluster: {error}") from None
    return keys


def configure() -> None:
    """Set Dask's options. Raises ClusterError where it is not installed."""
    try:
        import dask
        import distributed  # noqa: F401
    except ImportError:
        raise ClusterError("a cluster needs Dask: pip install 'clpt[cluster]'") from None
    dask.config.set(SETTINGS)
    for name in ("distributed", "tornado", "asyncio"):  # clpt reports the rest
        logging.getLogger(name).setLevel(max(logging.WARNING, logging.getLogger().level))
    logging.getLogger("asyncio").addFilter(_is_relevant)
    logging.getLogger("distributed.worker").addFilter(_is_no_end)


def _is_relevant(record: logging.LogRecord) -> bool:
    """Return False for a wait that Dask abandons when a cancelled film's worker is gone."""
    return not (record.exc_info and getattr(record.exc_info[0], "__name__", "") == "AllExit")


def _is_no_end(record: logging.LogRecord) -> bool:
    """Return whether a record is of something else than a scheduler that has ended.

    A worker ends by itself then, and says so.
    """
    return not record.getMessage().startswith("Failed to communicate with scheduler")


def run_worker(
    address: str,
    *,
    host: str | None = None,
    folder: Path | None = None,
    name: str | None = None,
    tell: Tell = lambda text: None,
) -> int:
    """Render for a scheduler until it ends or a signal arrives; return the exit status.

    host: this machine's address for others; folder: of the keys, by default this user's. Raises
    ClusterError without keys and without a scheduler.
    """
    if not address.startswith("tls://"):
        raise ClusterError(f"{address} is no tls://HOST:PORT, as clpt cluster start prints it")
    configure()
    return asyncio.run(_worker(address, host, folder, name, tell))


async def _worker(
    address: str,
    host: str | None,
    folder: Path | None,
    name: str | None,
    tell: Tell,
) -> int:
    with _scratch() as scratch:
        host = host or (LOOPBACK if is_loopback(address) else None)
        worker = new_worker(address, folder, scratch, host=host, name=name)
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


def new_worker(address: str, folder: Path | None, scratch: str, **options: Any) -> Worker:
    """Return a worker that requires the keys of a folder; scratch: its temporary folder."""
    import distributed

    return _without_web_server(distributed.Worker)(
        address, nthreads=1, memory_limit=0, dashboard=False, local_directory=scratch,
        death_timeout=START_SECONDS, security=security(folder), **options,
    )  # fmt: skip


def _without_web_server(node: Any) -> Any:
    """Return a subclass of Dask's scheduler or worker without a web server."""
    return type(node.__name__, (node,), {"start_http_server": lambda *_, **__: None})


@contextmanager
def _scratch() -> Iterator[str]:
    """Yield a new folder that only this user can enter.

    By default Dask imports from a folder below the temporary directory, even if another user
    created it.
    """
    with tempfile.TemporaryDirectory(prefix="clpt-cluster-", ignore_cleanup_errors=True) as folder:
        yield folder


class _Signals:
    """Signals that end a process, for an event loop."""

    def __init__(self) -> None:
        self.number: int | None = None
        self._came = asyncio.Event()

    def note(self, number: int) -> None:
        self.number = number
        self._came.set()

    async def wait(self) -> None:
        await self._came.wait()


def _signals() -> _Signals:
    signals, loop = _Signals(), asyncio.get_running_loop()
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            with contextlib.suppress(NotImplementedError):  # Windows
                loop.add_signal_handler(number, signals.note, number)
    return signals


def _leave_soon() -> None:
    """End this process after some seconds, even inside a driver's call."""
    timer = threading.Timer(END_SECONDS, os._exit, (1,))
    timer.daemon = True
    timer.start()


def run_scheduler(
    host: str,
    port: int,
    *,
    folder: Path | None = None,
    tell: Tell = lambda text: None,
) -> int:
    """Run a scheduler until a signal arrives; return the exit status.

    folder: of the keys, which are written if missing; by default this user's. tell: called with
    the address. Raises ClusterError where keys cannot be written and where the port is in use.
    """
    configure()
    folder = default_folder() if folder is None else folder
    make_keys(folder)
    return asyncio.run(_scheduler(host, port, folder, tell))


async def _scheduler(host: str, port: int, folder: Path, tell: Tell) -> int:
    with _scratch() as scratch:
        try:
            scheduler = new_scheduler(host, port, folder, scratch)
            await scheduler
        except OSError as error:
            raise ClusterError(f"{host}:{port} cannot be used: {error.strerror or error}") from None
        signals = _signals()
        tell(scheduler.address)
        await signals.wait()
        _leave_soon()
        await scheduler.close()
        return 128 + (signals.number or 0)


def new_scheduler(host: str, port: int, folder: Path, scratch: str) -> Scheduler:
    """Return a scheduler that requires the keys of a folder; scratch: its temporary folder."""
    import distributed

    return _without_web_server(distributed.Scheduler)(
        host=host, port=port, protocol="tls://", dashboard=False, local_directory=scratch,
        security=security(folder),
    )  # fmt: skip


def is_loopback(address: str) -> bool:
    """Whether an address, with or without scheme and port, is a loopback address."""
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

    threads: of each worker; by default the cores are divided. All sockets listen on the loopback
    interface only, and ask for temporary keys.
    """
    each = threads or max(1, child_processes.cores() // workers)
    options = ["--threads", str(each)] + (["--device", device] if device else [])
    with local_scheduler() as (client, folder):
        started: list[subprocess.Popen[bytes]] = []
        try:
            for _ in range(workers):
                started.append(start_worker(client.scheduler.address, folder, *options))
            yield client, started
        finally:
            end(started)


@contextmanager
def local_scheduler() -> Iterator[tuple[Client, Path]]:
    """Yield a client of a scheduler in this process, and the folder of its temporary keys."""
    configure()
    from distributed import Client, SpecCluster

    with _scratch() as scratch:
        folder = Path(scratch) / "keys"
        make_keys(folder)
        secured = security(folder)
        spec = {"cls": partial(new_scheduler, LOOPBACK, 0, folder, scratch)}
        with (
            SpecCluster(scheduler=spec, security=secured, silence_logs=False) as cluster,
            Client(cluster.scheduler_address, security=secured) as client,
        ):
            yield client, folder


def start_worker(address: str, keys: Path, *options: str, **more: Any) -> subprocess.Popen[bytes]:
    """Start a worker process for a scheduler; keys: the folder of its keys."""
    words = ["worker", address, "--keys", str(keys), *options, "--quiet"]
    main = "from clpt.__main__ import main; main()"
    return subprocess.Popen(child_processes.command(main, *words), **more)


def end(processes: list[subprocess.Popen[bytes]]) -> None:
    """Terminate processes; kill them after END_SECONDS."""
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
