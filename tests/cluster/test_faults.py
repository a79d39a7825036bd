"""Processes that are killed or stopped, and networks that fail: the picture, or a message."""

from __future__ import annotations

import asyncio
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

pytest.importorskip("distributed")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX"),
]

sys.path.insert(0, str(Path(__file__).parent))
from machines import (  # noqa: E402
    ENVIRONMENT,
    LONGEST,
    ROOT,
    client_of,
    digest_of_one_process,
    machines,
    scene,
    wait_until,
)

from clpt.cluster import processes, tasks  # noqa: E402
from clpt.cluster.cluster_renderer import ClusterRenderer  # noqa: E402
from clpt.errors import ClusterError  # noqa: E402

SAMPLES = 3000  # some seconds of two workers
SCHEDULES = int(os.environ.get("CLPT_SCHEDULES", "100"))
# What a worker does at the n-th call of a function, for each phase of its work.
DIES = """
import functools, os, random, signal, threading, time
from pathlib import Path
from clpt.cluster import bundle, tasks
tasks.Store = functools.partial(bundle.Store, Path({folder!r}))
def dies(function, number, after):
    def called(*a, **k):
        nonlocal number
        number -= 1
        if not number:
            threading.Thread(target=lambda: (time.sleep(after), os.kill(os.getpid(), 9))).start()
        return function(*a, **k)
    return called
phase, number, after = {phase!r}, {number!r}, {after!r}
if phase == "fetching":
    tasks.Store = lambda: type("S", (), dict(
        lacks=lambda s, b: bundle.Store(Path({folder!r})).lacks(b),
        add=dies(bundle.Store(Path({folder!r})).add, 1, 0.0),
        opened=lambda s, b: bundle.Store(Path({folder!r})).opened(b)))()
elif phase == "building":
    tasks._Job.__init__ = dies(tasks._Job.__init__, 1, after)
elif phase == "rendering":
    tasks._Job.block = dies(tasks._Job.block, number, after)
elif phase == "sending":
    tasks.state_to_arrays = dies(tasks.state_to_arrays, number, after / 20)
"""
PHASES = ("fetching", "building", "rendering", "sending", "none")


@pytest.fixture(scope="module")
def hub():
    """A scheduler without workers."""
    with machines() as found:
        yield found


@pytest.fixture(scope="module")
def expected():
    """The digest of the film of one process."""
    return digest_of_one_process(SAMPLES)


def digest(renderer):
    return tasks.film_digest(renderer.film_state())


@pytest.mark.parametrize("seed", range(SCHEDULES))
def test_workers_that_are_killed(seed, hub, expected, tmp_path):
    """Random workers die in random phases, others come: the film is that of one process."""
    dice = random.Random(seed)

    def start():
        how = {
            "phase": dice.choice(PHASES), "number": dice.randint(1, 6),
            "after": dice.uniform(0.0, 0.5), "folder": str(tmp_path / "cache" / "bundles"),
        }  # fmt: skip
        return hub.start(DIES.format(**how))

    for _ in range(2):
        start()
    left, deadline = dice.randint(1, 3), time.monotonic() + LONGEST

    def replace(progress):
        nonlocal left
        assert time.monotonic() < deadline
        for process in [one for one in hub.started if one.poll() is not None]:
            hub.started.remove(process)
            left -= 1
            if left > 0:
                start()
            elif not hub.started:
                hub.start()
        if hub.started and dice.random() < 0.02 and left > 0:
            os.kill(dice.choice(hub.started).pid, signal.SIGKILL)

    try:
        with ClusterRenderer(scene(), hub.client) as renderer:
            assert renderer.run(SAMPLES, replace)
            assert digest(renderer) == expected
    finally:
        for process in list(hub.started):
            process.kill()
            process.wait()
        hub.started.clear()
        hub.wait(0)


def test_eight_workers_are_one(hub, expected):
    started = [hub.start() for _ in range(8)]
    try:
        hub.wait(8)
        with ClusterRenderer(scene(), hub.client) as renderer:
            assert renderer.run(SAMPLES)
            assert digest(renderer) == expected
            assert len(renderer.workers) == 8
    finally:
        for process in started:
            hub.end(process)


def test_a_worker_that_is_stopped(hub, expected):
    """Its blocks are rendered by others, once the scheduler gives it up."""
    started = [hub.start() for _ in range(2)]
    try:
        hub.wait(2)
        with ClusterRenderer(scene(), hub.client) as renderer:
            stopped = []

            def stop(progress):
                if progress.samples > 100 and not stopped:
                    stopped.append(time.monotonic())
                    os.kill(started[0].pid, signal.SIGSTOP)

            assert renderer.run(SAMPLES, stop)
            assert stopped
            assert digest(renderer) == expected
    finally:
        for process in started:
            hub.end(process)


@contextmanager
def scheduler(keys, *options):
    """A scheduler in a process of its own; yields it and its address. keys: a folder for them."""
    options = "--keys", str(keys), *options
    process = subprocess.Popen(
        [sys.executable, "-m", "clpt", "cluster", "start", "--port", "0", *options],
        env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait()


def keyed(folder):
    """The option that names a folder of keys."""
    return ["--keys", str(folder)]


@contextmanager
def workers(address, number, *options):
    """Workers in processes of their own."""
    arguments = [sys.executable, "-m", "clpt", "worker", address, "--threads", "1", "--quiet"]
    started = [
        subprocess.Popen([*arguments, *options], env=ENVIRONMENT, stderr=subprocess.DEVNULL)
        for _ in range(number)
    ]
    try:
        yield started
    finally:
        for process in started:
            process.kill()
        for process in started:
            process.wait()


def test_a_scheduler_that_is_killed(tmp_path):
    """The client ends with a message, and keeps what was rendered; workers end too."""
    from distributed import Client

    processes.configure()
    with (
        scheduler(tmp_path) as (process, address),
        workers(address, 2, *keyed(tmp_path)) as started,
    ):
        security = processes.security(tmp_path)
        client = Client(address, security=security)
        with client, ClusterRenderer(scene(), client) as renderer:

            def kill(progress):
                if progress.samples > 20:
                    process.kill()

            began = time.monotonic()
            with pytest.raises(ClusterError, match="scheduler is gone; what was rendered"):
                renderer.run(10**7, kill)
            assert time.monotonic() - began < LONGEST
            assert renderer.samples > 20
            state = renderer.film_state()
            assert sum(end - first for first, end in state.taken) == renderer.samples
        wait_until(lambda: all(one.poll() is not None for one in started), "workers to end")


def test_a_client_that_is_killed(tmp_path):
    """Its workers stop rendering for it, and serve the next one."""
    from distributed import Client

    processes.configure()
    command = ["render", str(ROOT / "scenes/cornell_box"), "-o", str(tmp_path / "a.png")]
    with scheduler(tmp_path) as (_, address), workers(address, 2, *keyed(tmp_path)):
        more = ["--cluster", address, *keyed(tmp_path), "--spp", "1000000", "--size", "64x48"]
        with client_of([*command, *more], tmp_path) as client:
            while "spp/s" not in (line := client.stderr.readline()) and "samples" not in line:
                assert line, client.wait()
        other = Client(address, security=processes.security(tmp_path))
        with other, ClusterRenderer(scene(), other) as renderer:
            began = time.monotonic()
            assert renderer.run(100)
            assert time.monotonic() - began < 40
            assert digest(renderer) == digest_of_one_process(100)


class Lossy:
    """Passes TCP on, as a network that loses a share of its packets: each comes later then.

    Now and then a connection is cut.
    """

    def __init__(self, to_port, loss, cuts, seed):
        self.to_port, self.loss, self.cuts = to_port, loss, cuts
        self.dice, self.port = random.Random(seed), 0
        self.loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()
        self._ready.wait()

    def _run(self):
        asyncio.set_event_loop(self.loop)
        server = self.loop.run_until_complete(
            asyncio.start_server(self._connected, "127.0.0.1", self.port)
        )
        self.port = server.sockets[0].getsockname()[1]
        self._ready.set()
        self.loop.run_forever()

    async def _connected(self, reader, writer):
        try:
            other = await asyncio.open_connection("127.0.0.1", self.to_port)
        except OSError:
            writer.close()
            return
        await asyncio.gather(
            self._pass(reader, other[1]), self._pass(other[0], writer), return_exceptions=True
        )

    async def _pass(self, reader, writer):
        while data := await reader.read(65536):
            wait = 0.2  # the least time after which TCP sends a packet again; then twice that
            while self.dice.random() < self.loss:
                await asyncio.sleep(wait)
                wait *= 2
            if self.dice.random() < self.cuts:
                break
            writer.write(data)
            await writer.drain()
        writer.close()

    def close(self):
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join()


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


BEHIND = """
import distributed
class Worker(distributed.Worker):
    def __init__(self, *arguments, **options):
        there = "tls://127.0.0.1:{proxy}"
        super().__init__(*arguments, port={port}, contact_address=there, **options)
distributed.Worker = Worker
"""


@pytest.mark.parametrize(("loss", "cuts"), [(0.2, 0.0), (0.2, 0.002)])
def test_a_network_that_loses_packets(loss, cuts, expected):
    """All of it: worker and scheduler, client and scheduler, client and worker.

    Where connections are cut too a worker may be lost: another one comes, as systemd or Slurm
    would see to.
    """

    with machines() as found:
        proxies = [Lossy(int(found.address.rpartition(":")[2]), loss, 0.0, 1)]
        found.address = f"tls://127.0.0.1:{proxies[0].port}"
        proxies[0].cuts = cuts

        def start():
            port = free_port()
            proxies.append(Lossy(port, loss, cuts, len(proxies)))
            found.start(BEHIND.format(port=port, proxy=proxies[-1].port))

        try:
            for _ in range(2):
                start()

            def replace(progress):
                for process in [one for one in found.started if one.poll() is not None]:
                    found.started.remove(process)
                    start()

            with ClusterRenderer(scene(), found.client) as renderer:
                assert renderer.run(SAMPLES, replace)
                assert digest(renderer) == expected
        finally:
            for process in found.started:
                process.kill()
            for proxy in proxies:
                proxy.close()


def run_cli(*arguments, cwd, **more):
    return subprocess.run(
        [sys.executable, "-m", "clpt", *arguments], env=ENVIRONMENT, cwd=cwd, text=True,
        capture_output=True, timeout=LONGEST, check=False, **more,
    )  # fmt: skip


def test_ctrl_c_writes_the_picture_so_far(tmp_path):
    command = [sys.executable, "-m", "clpt", "render", str(ROOT / "scenes/cornell_box")]
    more = ["--cluster", "local:2", "--spp", "1000000", "--size", "32x24", "-o", "a.png"]
    process = subprocess.Popen(
        [*command, *more], env=ENVIRONMENT, cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    try:
        lines = [process.stderr.readline()]
        while "rays/s" not in lines[-1] or lines[-1].startswith("0/"):
            lines.append(process.stderr.readline())
            assert lines[-1], lines
        process.send_signal(signal.SIGINT)
        rest = process.stderr.read()
        assert process.wait(LONGEST) == 130, rest
    finally:
        process.kill()
        process.wait()
    assert (tmp_path / "a.png").is_file()
    assert "Traceback" not in rest


def test_time_limits_and_local_workers(tmp_path):
    more = ["--cluster", "local:2", "--time", "20s", "--size", "32x24", "-o", "a.exr"]
    done = run_cli("render", str(ROOT / "scenes/cornell_box"), *more, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.exr").is_file()
    assert "2 workers, 0 lost" in done.stderr
