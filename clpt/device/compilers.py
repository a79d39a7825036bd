"""Processes that compile beside this one, for drivers that compile one text at a time.

PoCL compiles under one lock, so threads do not help. Nothing here is needed: where a process does
not start, or dies, the caller compiles by itself.
"""

from __future__ import annotations

import logging
import pickle
import signal
import subprocess
import sys
import threading
import weakref
from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from clpt.device import compile_limits, runtimes
from clpt.files import child_processes

log = logging.getLogger(__name__)

_PROGRAM = Path(__file__).with_name("compiler_process.py")
_MOST = 4  # processes: more than parts of a loop that take long


@dataclass(frozen=True)
class Job:
    """A text that a process compiles to a binary.

    name: of the program; seconds: of the processor that its compiler may take; platform, device:
    their names; options: of the compiler.
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
    """End all processes that compile for this one, before it ends itself."""
    for one in _running:
        one.kill_processes()


class Compilers:
    """Some processes, that start when there is something to do for them.

    count: how many there are at most. With `with` they end after what they are at, or at once where
    an exception is raised.
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
        """Let a process do a job, if none has the key yet.

        first: before all that wait. done: called by a thread when the job has been done.
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
        """Return a job's binary; None if it has not begun, and never will, or has failed.

        It waits for a job that has begun. Raises KernelBuildError if its compiler was ended at its
        limit.
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
        """Forget a job; it is not done if it has not begun."""
        with self._changed:
            task = self._tasks.pop(key, None)
            if task is not None and task in self._waiting:
                self._waiting.remove(task)

    def close(self) -> None:
        """Let the processes do what was submitted, then end them, and wait for that."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        for thread in self._threads:
            thread.join()

    def kill_processes(self) -> None:
        """Let the processes end at once; it waits for nothing."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            for process in self._processes:
                process.kill()

    def kill(self) -> None:
        """End the processes at once."""
        self.kill_processes()
        self.close()
        for process in self._processes:
            process.wait()

    def __enter__(self) -> Compilers:
        return self

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        self.close() if kind is None else self.kill()

    def _serve(self) -> None:
        """Start a process and give it jobs, one after the other."""
        try:
            process = subprocess.Popen(
                _command(),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=runtimes.environment(),
                start_new_session=True,  # Ctrl-C is for this process
            )
        except OSError as error:
            log.debug("nothing is compiled in another process: %s", error)
            return
        with self._changed:
            self._processes.append(process)
        try:
            while task := self._next():
                try:
                    task.result.set_result(_answer(process, task.job))
                except BaseException:
                    if _was_ended_at_limit(process):
                        task.result.set_exception(
                            compile_limits.failure(task.job.name, task.job.seconds)
                        )
                    else:
                        task.result.set_result(None)
                    raise
        except Exception as error:  # a process that died
            log.debug("nothing is compiled in another process: %s", error)
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
    """Let a process end, and wait for it."""
    for pipe in (process.stdin, process.stdout):
        assert pipe is not None
        with suppress(OSError):
            pipe.close()
    process.wait()


def _was_ended_at_limit(process: subprocess.Popen[bytes]) -> bool:
    """Whether the system has ended a process that no longer answers for its processor time."""
    with suppress(subprocess.TimeoutExpired):
        process.wait(1.0)
    return sys.platform != "win32" and process.returncode == -signal.SIGXCPU


def spare_cores() -> int:
    """Return how many processes may compile beside this one: a core each."""
    return child_processes.cores() - 1


def _command() -> list[str]:
    """The command of a process that compiles."""
    return child_processes.command(f"import runpy; runpy.run_path({str(_PROGRAM)!r})['main']()")


def _answer(process: subprocess.Popen[bytes], job: Job) -> bytes | None:
    assert process.stdin is not None
    assert process.stdout is not None
    request = job.seconds, job.platform, job.device, job.options, job.text
    pickle.dump(request, process.stdin)
    process.stdin.flush()
    binary: bytes | None = pickle.load(process.stdout)  # from our own program
    return binary
