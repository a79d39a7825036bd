"""Processes that compile: what they make is what this process makes, and nobody depends on them."""

from __future__ import annotations

import logging
import math
import secrets
import subprocess
import sys
import threading

import numpy as np
import pyopencl as cl
import pytest

from clpt import device as dev
from clpt.device import compilers, native_programs
from clpt.device.compilers import Compilers, Job
from clpt.device.program import Argument
from clpt.errors import DeviceError, KernelBuildError
from clpt.files import disk_cache

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


def job(info: dev.DeviceInfo, text: str) -> Job:
    """A text for a process, which may take a minute."""
    return Job("part", 60.0, info.platform, info.name, "-w", text)


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
        pool.submit("a", job(info, PARTS["part"]))
        pool.submit("b", job(info, "this is wrong"))
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

    def submit(self, key: str, job: Job, **options: object) -> None:
        pass

    def drop(self, key: str) -> None:
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
    pool.submit("a", job(info, PARTS["part"]))
    pool.kill()
    assert not any(thread.is_alive() for thread in pool._threads)
    assert all(process.poll() is not None for process in pool._processes)


HANGS = """
import runpy, sys
process = runpy.run_path(sys.argv[1])
def compile_(*of):
    while True:
        pass
process["main"].__globals__.update(_compile=compile_, _device=lambda *of: None)
process["cl"].Context = lambda devices: None
process["main"]()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of the processor are POSIX's")
def test_a_compiler_that_hangs_is_ended_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    command = [sys.executable, "-c", HANGS, str(compilers._PROGRAM)]
    monkeypatch.setattr(compilers, "_command", lambda: command)
    with Compilers(1) as pool:
        pool.submit("a", Job("shade", 0.2, "platform", "device", "", ""))
        while pool._waiting:
            pass
        with pytest.raises(KernelBuildError, match=r"'shade'.* hang.*CLPT_COMPILE_SECONDS"):
            pool.take("a")


def test_a_compiler_of_this_process_that_hangs_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(compilers, "at_limit", said.append)
    monkeypatch.setenv(compilers.VARIABLE, "0.05")
    source = dev.Source("stage/shade.cl", "", ())
    with compilers.watched(source):
        while not said:
            pass
    assert "'stage/shade.cl'" in said[0]
    monkeypatch.setenv(compilers.VARIABLE, "0")
    assert compilers.seconds_for(source) == math.inf
    monkeypatch.setenv(compilers.VARIABLE, "long")
    with pytest.raises(DeviceError, match="CLPT_COMPILE_SECONDS is a number of seconds"):
        compilers.seconds_for(source)


def test_python_goes_on_while_a_binary_is_made(opened: dev.Device) -> None:
    """Another thread runs while a driver compiles, so that Ctrl-C can end the process."""
    if not opened.info.is_pocl:
        pytest.skip("other drivers compile when they build")
    source = dev.assemble("stage/trial.cl", defines={"LANES": 16, "TRIAL_NODES": 512})
    text = f"{source.text}uint own_{secrets.token_hex()}(void) {{ return 1u; }}\n"  # in no cache
    program = native_programs.build(opened.context, opened.info.cl_device, text)
    turns, done = [0], threading.Event()

    def count() -> None:
        while not done.wait(0.001):
            turns[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    before = turns[0]
    binary = native_programs.binary(program)
    after = turns[0]
    done.set()
    thread.join()
    assert binary == program.get_info(cl.program_info.BINARIES)[0]
    assert after > before + 2  # one alone may come before the driver is asked


def test_what_another_process_makes_is_waited_for(opened: dev.Device, tmp_path) -> None:
    """The second process compiles nothing: it finds what the first has made."""
    made = []
    with disk_cache.exclusive("entry"):
        assert disk_cache.is_being_built("entry")

        def second() -> None:
            with disk_cache.exclusive("entry"):
                made.append(disk_cache.load("entry"))

        thread = threading.Thread(target=second)
        thread.start()
        disk_cache.store("entry", "{}", b"binary")
        assert not made
    thread.join(60)
    assert made == [("{}", b"binary")]
    assert not disk_cache.is_being_built("entry") and not [*(tmp_path / "locks").iterdir()]
