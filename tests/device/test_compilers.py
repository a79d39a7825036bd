"""Processes that compile: what they make is what this process makes, and nobody depends on them."""

from __future__ import annotations

import logging
import subprocess
import sys

import numpy as np
import pyopencl as cl
import pytest

from clpt import device as dev
from clpt.device import compilers, disk_cache, native_programs
from clpt.device.compilers import Compilers, Job
from clpt.device.program import Argument

PARTS = {
    "main": "uint seven(void);\n"
    "kernel void main_(global uint *out) { out[get_global_id(0)] = seven(); }\n",
    "part": "uint seven(void) { return 7u; }\n",
}
SIGNATURES = {"main_": (Argument("out", "uint*", "global"),)}


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch, tmp_path) -> dev.Device:
    """A device with a context of its own and an empty cache folder."""
    info = dev.choose().info
    monkeypatch.setattr(disk_cache, "folder", lambda: tmp_path)
    return dev.Device.open(info)


def answer(on: dev.Device, mark: str) -> list[int]:
    """What a program of two parts computes; mark: a comment that makes its texts new."""
    sources = {n: dev.Source(n, f"{t}// {mark}\n", (n,)) for n, t in PARTS.items()}
    dev.compile_ahead(on, sources, "main")
    program = dev.link(on, sources, "main", SIGNATURES)
    out, stream = dev.Buffers(on).allocate("out", 16), dev.Stream(on.queue)
    stream.run(program.kernel("main_").bind(out=out), (4,), (1,))
    return list(stream.read(out, np.empty(4, np.uint32)))


def test_parts_of_another_process_are_linked_and_kept(opened: dev.Device, tmp_path) -> None:
    with Compilers(1) as opened.compilers:
        assert answer(opened, "a") == [7, 7, 7, 7]
    assert len([*(tmp_path / "programs").iterdir()]) == 3  # two parts, and the whole
    again = dev.Device.open(opened.info)
    assert answer(again, "a") == [7, 7, 7, 7]
    assert again.builds.cached == 1


def test_a_process_gives_a_binary(opened: dev.Device) -> None:
    info = opened.info
    with Compilers(1) as pool:
        pool.submit("a", Job(info.platform, info.name, "-w", PARTS["part"]))
        pool.submit("b", Job(info.platform, info.name, "-w", "this is wrong"))
        while pool._waiting:
            pass
        assert pool.take("a")
        assert pool.take("b") is None
        assert pool.take("unknown") is None


@pytest.mark.parametrize("command", [["nothing-of-this-name"], [sys.executable, "-c", ""]])
def test_without_processes_the_caller_compiles(
    opened: dev.Device, command: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where none starts, and where it ends at once."""
    monkeypatch.setattr(compilers, "_command", lambda: command)
    with Compilers(2) as opened.compilers:
        assert answer(opened, command[0][-9:]) == [7, 7, 7, 7]


class Given:
    """In the place of `Compilers`: each part is the given binary."""

    def __init__(self, binary: bytes):
        self.binary = binary

    def submit(self, key: str, job: Job) -> None:
        pass

    def take(self, key: str) -> bytes:
        return self.binary


@pytest.mark.parametrize("kind", ["nonsense", "a program that is whole"])
def test_a_part_that_the_driver_refuses_is_compiled_here(
    opened: dev.Device, kind: str, caplog: pytest.LogCaptureFixture
) -> None:
    """Nonsense is refused at once, a whole program when it is linked."""
    if not opened.info.compiles_singly:
        pytest.skip("other drivers are given no part of another process; two of them crash")
    binary = b"nonsense"
    if kind != "nonsense":
        whole = native_programs.build(opened.context, opened.info.cl_device, PARTS["part"])
        binary = whole.get_info(cl.program_info.BINARIES)[0]
    opened.compilers = Given(binary)
    assert answer(opened, kind) == [7, 7, 7, 7]
    opened.compilers = None
    again = dev.Device.open(opened.info)
    assert answer(again, kind) == [7, 7, 7, 7]  # of parts in the cache folder, which are good now
    assert not [record for record in caplog.records if record.levelno > logging.DEBUG]


def test_processes_end_with_who_started_them() -> None:
    command = compilers._command()
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdin.close()
        assert process.wait(60) == 0


def test_killed_processes_are_waited_for(opened: dev.Device) -> None:
    pool = Compilers(1)
    info = opened.info
    pool.submit("a", Job(info.platform, info.name, "-w", PARTS["part"]))
    pool.kill()
    assert not any(thread.is_alive() for thread in pool._threads)
    assert all(process.poll() is not None for process in pool._processes)
