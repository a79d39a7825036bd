"""Processes that compile in parallel, for drivers that compile a single text at a time; limits.

PoCL compiles under a lock, so threads do not help. If a process does not start, or dies, the caller
compiles.

LLVM has passes that never end on some texts. A limit is in seconds of processor time, independent
of other processes, and grows with the text. The system ends a compiler process at its limit. A
compiler inside this process cannot be stopped: `at_limit` is called.
"""

from __future__ import annotations

import logging
import math
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections import deque
from collections.abc import Callable, Hashable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from clpt.device import runtimes
from clpt.files import child_processes

from ..errors import DeviceError, KernelBuildError
from .source import Source

log = logging.getLogger(__name__)

VARIABLE = "CLPT_COMPILE_SECONDS"
LEAST = 60.0  # [s]; a small text takes less than 1 s
CHARACTERS = 5000  # of a text, for each further second; large texts take a tenth of that

# Called with a message when a compiler in this process reaches its limit.
at_limit: Callable[[str], None] = log.warning

_PROGRAM = Path(__file__).with_name("compiler_process.py")
_MOST = 4  # processes; a loop has fewer parts that take long


def seconds_for(source: Source) -> float:
    """Return the limit of a text [s of processor time], infinite without a limit.

    Raises DeviceError if the variable is no number.
    """
    text = os.environ.get(VARIABLE)
    if text is None:
        return LEAST + len(source.text) / CHARACTERS
    try:
        seconds = float(text)
        if not seconds >= 0.0:
            raise ValueError
    except ValueError:
        raise DeviceError(f"{VARIABLE} is a number of seconds, not {text!r}") from None
    return seconds or math.inf


def message(name: str, seconds: float) -> str:
    """Return the message for a compiler that has reached its limit."""
    return (
        f"the driver's compiler has been at the program {name!r} for {seconds:.0f} s of the "
        f"processor, and seems to hang; try another driver or device, or {VARIABLE}=N for N "
        "seconds, 0 for any"
    )


def failure(name: str, seconds: float) -> KernelBuildError:
    """Return the error for a compiler that was ended at its limit."""
    return KernelBuildError(name, None, None, f"error: {message(name, seconds)}", None)


@contextmanager
def watched(source: Source) -> Iterator[None]:
    """Call `at_limit` if this process compiles a program beyond its limit."""
    seconds, done = seconds_for(source), threading.Event()
    if math.isfinite(seconds):
        threading.Thread(target=_watch, args=(source.name, seconds, done), daemon=True).start()
    try:
        yield
    finally:
        done.set()


def _watch(name: str, seconds: float, done: threading.Event) -> None:
    end, cores = time.process_time() + seconds, os.cpu_count() or 1
    while (left := end - time.process_time()) > 0.0:
        if done.wait(max(left / cores, 0.1)):
            return
    at_limit(message(name, seconds))


@dataclass(frozen=True)
class Job:
    """A text that a process compiles to a binary.

    name: of the program; seconds: limit of processor time; platform, device: names; options: of
    the compiler.
    """

    name: str
    seconds: float
    platform: str
    device: str
    options: str
    text: str


@dataclass
class _Task:
    job: Job
    result: Future[bytes | None] = field(default_factory=Future)


_running: weakref.WeakSet[Compilers] = weakref.WeakSet()


def kill_compilers() -> None:
    """Kill all compiler processes of this process."""
    for compilers in _running:
        compilers.kill_processes()


class Compilers:
    """Compiler processes, which start when jobs arrive.

    count: the largest number of processes. At the end of a `with` they finish their jobs, or end at
    once after an exception.
    """

    def __init__(self, count: int):
        self.count = min(count, _MOST)
        self._tasks: dict[Hashable, _Task] = {}
        self._waiting: deque[_Task] = deque()
        self._changed = threading.Condition()
        self._processes: list[subprocess.Popen[bytes]] = []
        self._threads: list[threading.Thread] = []
        self._closed = False
        _running.add(self)

    def submit(
        self,
        key: Hashable,
        job: Job,
        *,
        first: bool = False,
        done: Callable[[], None] = lambda: None,
    ) -> None:
        """Queue a job, unless its key is known.

        first: before all waiting jobs. done: called by a thread after the job.
        """
        with self._changed:
            if self._closed or key in self._tasks:
                return
            task = self._tasks[key] = _Task(job)
            task.result.add_done_callback(lambda _: done())
            self._waiting.insert(0 if first else len(self._waiting), task)
            self._changed.notify()
            if len(self._threads) < min(self.count, len(self._waiting)):
                thread = threading.Thread(target=self._serve, daemon=True)
                self._threads.append(thread)
                thread.start()

    def take(self, key: Hashable) -> bytes | None:
        """Return a job's binary; None if the job failed, or has not started and is cancelled now.

        Waits for a running job. Raises KernelBuildError if its compiler was ended at its limit.
        """
        with self._changed:
            task = self._tasks.pop(key, None)
            if task is None:
                return None
            if task in self._waiting:
                self._waiting.remove(task)
                return None
        return task.result.result()

    def drop(self, key: Hashable) -> None:
        """Forget a job; cancel it if it has not started."""
        with self._changed:
            task = self._tasks.pop(key, None)
            if task is not None and task in self._waiting:
                self._waiting.remove(task)

    def close(self) -> None:
        """Wait for all submitted jobs and for the end of the processes."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        for thread in self._threads:
            thread.join()

    def kill_processes(self) -> None:
        """Kill the processes without waiting for them."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            for process in self._processes:
                process.kill()

    def kill(self) -> None:
        """Kill the processes and wait for them."""
        self.kill_processes()
        self.close()
        for process in self._processes:
            process.wait()

    def __enter__(self) -> Compilers:
        return self

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        self.close() if kind is None else self.kill()

    def _serve(self) -> None:
        """Start a process and send it jobs in turn."""
        try:
            process = subprocess.Popen(
                _command(),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=runtimes.environment(),
                start_new_session=True,  # Ctrl-C reaches the parent only
            )
        except OSError as error:
            log.debug("no compiler process: %s", error)
            return
        with self._changed:
            self._processes.append(process)
        try:
            while task := self._next():
                try:
                    task.result.set_result(_answer(process, task.job))
                except BaseException:
                    if _was_ended_at_limit(process):
                        task.result.set_exception(failure(task.job.name, task.job.seconds))
                    else:
                        task.result.set_result(None)
                    raise
        except Exception as error:  # the process died
            log.debug("no compiler process: %s", error)
        finally:
            _end(process)

    def _next(self) -> _Task | None:
        with self._changed:
            while not self._waiting:
                if self._closed:
                    return None
                self._changed.wait()
            return self._waiting.popleft()


def _end(process: subprocess.Popen[bytes]) -> None:
    """Close a process's pipes, which ends it, and wait."""
    for pipe in (process.stdin, process.stdout):
        assert pipe is not None
        with suppress(OSError):
            pipe.close()
    process.wait()


def _was_ended_at_limit(process: subprocess.Popen[bytes]) -> bool:
    """Return whether the system has ended a process at its limit of processor time."""
    with suppress(subprocess.TimeoutExpired):
        process.wait(1.0)
    return sys.platform != "win32" and process.returncode == -signal.SIGXCPU


def spare_cores() -> int:
    """Return the number of cores for further compiler processes."""
    return child_processes.cores() - 1


def _command() -> list[str]:
    return child_processes.command(f"import runpy; runpy.run_path({str(_PROGRAM)!r})['main']()")


def _answer(process: subprocess.Popen[bytes], job: Job) -> bytes | None:
    assert process.stdin is not None
    assert process.stdout is not None
    request = job.seconds, job.platform, job.device, job.options, job.text
    pickle.dump(request, process.stdin)
    process.stdin.flush()
    binary: bytes | None = pickle.load(process.stdout)  # from compiler_process.py
    return binary
