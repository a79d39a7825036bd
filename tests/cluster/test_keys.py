"""Keys are the only way in: what listens, who gets an answer, and what lies in which folder."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import itertools
import os
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import pytest

pytest.importorskip("distributed")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="modes of POSIX")

sys.path.insert(0, str(Path(__file__).parent))
from machines import ENVIRONMENT, LONGEST, ROOT, machines, wait_until  # noqa: E402

from clpt.cluster import processes  # noqa: E402
from clpt.errors import ClusterError  # noqa: E402

BOX = str(ROOT / "scenes/cornell_box")
SMALL = ("--size", "8x6", "--spp", "2", "--checkpoint", "0", "-o", "a.npy")


def context(folder: Path | None) -> ssl.SSLContext:
    """That of somebody with the keys of a folder, or with none."""
    found = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    found.check_hostname, found.verify_mode = False, ssl.CERT_NONE
    if folder is not None:
        found.load_cert_chain(folder / processes.KEYS_FILE)
    return found


def answer(port: int, tls: ssl.SSLContext | None, request: bytes, seconds: float = 0.5) -> bytes:
    """What a listener says to a request: nothing, where it hangs up, or waits for some seconds."""
    with ExitStack() as resources:
        try:
            one = resources.enter_context(socket.create_connection(("127.0.0.1", port), 30))
            one.settimeout(seconds)
            if tls is not None:
                one = resources.enter_context(tls.wrap_socket(one))
            one.sendall(request)
            return one.recv(1000)
        except OSError:  # which TLS's errors are
            return b""


def listening(*started: subprocess.Popen) -> set[tuple[int, int]]:
    """The processes and ports that processes, and those that they started, listen at."""
    import psutil

    family = [psutil.Process(one.pid) for one in started]
    family += [child for one in family for child in one.children(recursive=True)]
    found = set()
    for one in family:
        try:
            udp, tcp = one.net_connections("udp"), one.net_connections("tcp")
        except psutil.NoSuchProcess:  # a compiler that has ended since
            continue
        assert not [c for c in udp if c.laddr], "a socket of datagrams"
        own = [c for c in tcp if c.status == psutil.CONN_LISTEN]
        assert all(c.laddr.ip in ("127.0.0.1", "::1") for c in own)
        found |= {(one.pid, c.laddr.port) for c in own}
    return found


def run(*words: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "clpt", *words], env={**ENVIRONMENT, **environment}, cwd=cwd,
        text=True, capture_output=True, timeout=LONGEST, check=False,
    )  # fmt: skip


@pytest.fixture
def three(tmp_path):
    """The commands of the docs, as they are typed there: a scheduler, a worker, and how to render.

    Yields processes of scheduler, worker and a render with workers of its own; the address of the
    scheduler; the folder of its keys; and a function that renders there.
    """
    environment = {**ENVIRONMENT, "XDG_STATE_HOME": str(tmp_path / "state")}
    started: list[subprocess.Popen] = []

    def start(*words, **more):
        command = [sys.executable, "-m", "clpt", *words]
        more = {"env": environment, "stderr": subprocess.DEVNULL, "cwd": tmp_path, **more}
        started.append(subprocess.Popen(command, text=True, **more))
        return started[-1]

    try:
        scheduler = start("cluster", "start", "--port", "0", stdout=subprocess.PIPE)
        address = scheduler.stdout.readline().strip()
        start("worker", address, "--threads", "1")
        start("render", BOX, "--cluster", "local:1", "--spp", "1000000", "-o", "b.npy")

        def render(*more):
            return run("render", BOX, *SMALL, *more, cwd=tmp_path, XDG_STATE_HOME=environment[
                "XDG_STATE_HOME"])  # fmt: skip

        yield started, address, tmp_path / "state/clpt/cluster", render
    finally:
        processes.end(started)
        for one in started:
            one.wait()


@pytest.mark.long
def test_nobody_without_the_keys_gets_an_answer(three, tmp_path):
    """Four processes listen at one port each; a stranger is heard by none of them."""
    started, address, folder, render = three
    assert address.startswith("tls://127.0.0.1:")
    wait_until(lambda: len(listening(*started)) == 4, "four listeners")
    found = listening(*started)
    assert len({process for process, _ in found}) == 4, "a process listens at two ports"
    processes.make_keys(tmp_path / "foreign")
    strangers = None, context(None), context(tmp_path / "foreign")  # TCP, TLS, with other keys
    requests = (b"GET /info/main/workers.html HTTP/1.0\r\n\r\n", bytes(8), b"")
    asked = list(itertools.product((port for _, port in found), strangers, requests))
    with ThreadPoolExecutor(len(asked)) as pool:  # most wait: all at once
        assert set(pool.map(lambda one: answer(*one), asked)) == {b""}
        ports = [port for _, port in found]
        heard = pool.map(lambda port: answer(port, context(folder), bytes(8), 30.0), ports)
        own = {port for port, said in zip(ports, heard, strict=True) if said}
    assert int(address.rpartition(":")[2]) in own and len(own) == 2, "theirs, not of local:1"
    assert len(listening(*started)) == 4, "and nothing has ended"
    processes.end([started.pop()])  # which takes samples all the time
    done = render("--cluster", address)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.npy").is_file()
    for wrong, reason in (
        (["--cluster", address, "--keys", "foreign"], "no scheduler at"),
        (["--cluster", address, "--keys", "none"], "none has no keys of a cluster"),
        (["--cluster", address.replace("tls", "tcp")], "neither tls://HOST:PORT nor local:N"),
    ):
        done = render(*wrong)
        assert done.returncode == 2 and reason in done.stderr, done.stderr
        assert done.stderr.count("error:") == 1
    assert len(listening(*started)) == 2, "and nothing has ended"


def listener(name, handler, heard):
    """A handler that notes when this test asks for it."""

    @functools.wraps(handler)
    def called(*arguments, asked=False, **more):
        if asked:
            heard.append(name)
        return handler(*arguments, **more)

    return called


async def everything_asked(folder: Path, foreign: Path, scratch: Path) -> list[str]:
    """Ask a scheduler and a worker for all that they can do, without their keys.

    Returns what they can do; raises AssertionError where one begins to do it.
    """
    from distributed.comm import connect
    from distributed.comm.registry import get_backend

    connector, stranger = get_backend("tls").get_connector(), context(foreign)
    processes.configure()
    for part in ("scheduler", "worker"):
        (scratch / part).mkdir(mode=0o700)
    names, heard = [], []
    scheduler = processes.new_scheduler("127.0.0.1", 0, folder, str(scratch / "scheduler"))
    async with scheduler:
        worker = processes.new_worker(scheduler.address, folder, str(scratch / "worker"))
        async with worker:
            for node in (scheduler, worker):
                kind = type(node).__name__
                assert Path(node.local_directory).is_relative_to(scratch)
                assert not node.services, "a web server"
                assert len(node.listeners) == 1
                own = [*node.handlers, *node.stream_handlers, *getattr(node, "extensions", {})]
                names += sorted(f"{kind}.{name}" for name in own)
                for table in (node.handlers, node.stream_handlers):
                    for name in table:
                        table[name] = listener(name, table[name], heard)
            for node in (scheduler, worker):
                for name in [*node.handlers, *node.stream_handlers]:
                    with pytest.raises(OSError, match=r"handshake|closed|certificate|unknown ca"):
                        comm = await connector.connect(
                            node.address.removeprefix("tls://"), ssl_context=stranger,
                            require_encryption=True,
                        )  # fmt: skip
                        await comm.write(comm.handshake_info())
                        await comm.write({"op": name, "reply": True, "asked": True})
                        await asyncio.wait_for(comm.read(), 5)
            assert not heard
            mine = processes.security(folder).get_connection_args("client")
            comm = await connect(scheduler.address, **mine)
            await comm.write({"op": "identity", "reply": True, "asked": True})
            assert (await comm.read())["type"] == "Scheduler"
            assert heard == ["identity"], "who has the keys is heard"
            comm.abort()
    return names


def test_whatever_dask_can_do_is_behind_the_keys(tmp_path, capsys):
    """Every handler of scheduler and worker, with those of their extensions, by name."""
    processes.make_keys(tmp_path / "own")
    processes.make_keys(tmp_path / "foreign")
    names = asyncio.run(everything_asked(tmp_path / "own", tmp_path / "foreign", tmp_path))
    print(*names, sep="\n")
    assert {"Scheduler.identity", "Worker.run", "Worker.update_data"} <= set(names)
    assert len(names) > 100


def recording(port: int, said: list[bytearray]) -> socket.socket:
    """A listener that passes one connection on to a port, and notes what its client says."""
    there = socket.create_server(("127.0.0.1", 0))

    def copy(source, target, note):
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                note(data)
                target.sendall(data)
        target.close()

    def serve():
        with contextlib.suppress(OSError):
            while True:
                one, other = there.accept()[0], socket.create_connection(("127.0.0.1", port))
                said.append(bytearray())
                for ends in ((one, other, said[-1].extend), (other, one, len)):
                    threading.Thread(target=copy, args=ends, daemon=True).start()

    threading.Thread(target=serve, daemon=True).start()
    return there


def tell_again(path: Path) -> None:
    """Write a word more into a file."""
    with path.open("a") as file:
        file.write("once")


def test_what_was_said_cannot_be_said_again(tmp_path):
    """All that a client with the keys sends, sent again by a stranger who has listened."""
    from distributed import Client

    told, said = tmp_path / "told", []
    with processes.local_scheduler() as (client, folder):
        port = int(client.scheduler.address.rpartition(":")[2])
        with recording(port, said) as there:
            address = f"tls://127.0.0.1:{there.getsockname()[1]}"
            with Client(address, security=processes.security(folder)) as other:
                other.run_on_scheduler(tell_again, told)
        assert told.read_text() == "once" and sum(map(len, said)) > 2000
        for bytes_of_one in said:
            answer(port, None, bytes_of_one)
        assert client.run_on_scheduler(lambda: 3) == 3
    assert told.read_text() == "once"


def test_who_has_the_keys_may_do_what_dask_does():
    """As docs/distributed.md says: the keys are an account on the machines."""
    with machines(1) as found:
        told = found.client.run(os.getpid)
        assert list(told.values()) == [found.started[0].pid]


def test_a_folder_that_others_made_is_not_used(tmp_path, monkeypatch):
    """Neither that of Dask in the temporary folder, nor one of keys that others can change."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "dask-scratch-space").symlink_to(tmp_path / "elsewhere")
    with processes.local_scheduler() as (client, folder):
        assert folder.is_relative_to(tmp_path) and folder.parent.stat().st_mode & 0o777 == 0o700
        local = client.run_on_scheduler(lambda dask_scheduler: dask_scheduler.local_directory)
        assert Path(local).is_relative_to(folder.parent)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["dask-scratch-space"]


def test_keys_are_this_user_s_alone(tmp_path):
    folder = tmp_path / "keys"
    processes.make_keys(folder)
    path = folder / processes.KEYS_FILE
    content = path.read_bytes()
    processes.make_keys(folder)
    assert path.read_bytes() == content, "they stay"
    assert [path] == list(folder.iterdir())
    assert folder.stat().st_mode & 0o777 == 0o700 and path.stat().st_mode & 0o777 == 0o600
    assert processes.security(folder).require_encryption
    path.chmod(0o640)
    with pytest.raises(ClusterError, match="is open to others"):
        processes.security(folder)
    path.chmod(0o600)
    folder.chmod(0o770)
    with pytest.raises(ClusterError, match="is open to others"):
        processes.security(folder)
    folder.chmod(0o700)
    path.write_text("no keys")
    with pytest.raises(ClusterError, match="holds no keys"):
        processes.security(folder)
    with pytest.raises(ClusterError, match="clpt cluster start makes them"):
        processes.security(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(ClusterError, match="keys cannot be written"):
        processes.make_keys(tmp_path / "file")
