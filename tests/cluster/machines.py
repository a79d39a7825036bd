"""A cluster on this machine for tests: real processes, all of which end with the context."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import clpt
from clpt.cluster import processes, tasks

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}
LONGEST = 120.0  # seconds that anything here may take


def scene(width=32, height=24):
    """A box, tiny."""
    whole = clpt.load(ROOT / "scenes/cornell_box")
    film = dataclasses.replace(whole.film, width=width, height=height)
    return dataclasses.replace(whole, film=film)


def digest_of_one_process(samples, plan=None):
    """The SHA-256 of the film of a Renderer here."""
    with clpt.Renderer(plan or scene(), threads=1) as renderer:
        renderer.run(samples)
        return tasks.film_digest(renderer.film_state())


class Machines:
    """Workers of a scheduler, started and ended by tests."""

    def __init__(self, client, keys):
        self.client, self.keys, self.address = client, keys, client.scheduler.address
        self.started: list[subprocess.Popen] = []

    @property
    def on(self) -> list[str]:
        """The options of a command that renders here."""
        return ["--cluster", self.address, "--keys", str(self.keys)]

    def start(self, code: str = "") -> subprocess.Popen:
        """Start a worker; code: what its process does first, to misbehave."""
        program = f"{code}\nimport clpt.__main__ as m\nm.main()"
        arguments = ["worker", *self.on[1:], "--threads", "1", "--quiet"]
        process = subprocess.Popen(
            [sys.executable, "-c", program, *arguments], env=ENVIRONMENT,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.started.append(process)
        return process

    def end(self, process: subprocess.Popen) -> None:
        """Kill a worker, and wait until the scheduler has noticed.

        The scheduler may have given up more workers: one that was stopped runs, and is no worker.
        """
        process.kill()
        process.wait()
        self.started.remove(process)
        left = sum(one.poll() is None for one in self.started)
        wait_until(lambda: len(self.client.nthreads()) <= left, f"{left} workers")

    def wait(self, number: int) -> None:
        """Wait until there are so many workers."""
        wait_until(lambda: len(self.client.nthreads()) == number, f"{number} workers")


def wait_until(ready, what: str, seconds: float = LONGEST) -> None:
    """Wait for something. Raises AssertionError after some time."""
    deadline = time.monotonic() + seconds
    while not ready():
        assert time.monotonic() < deadline, f"waited in vain for {what}"
        time.sleep(0.05)


@contextmanager
def client_of(command: list[str], folder: Path) -> Iterator[subprocess.Popen]:
    """A process of `clpt` in a folder, that is killed at the end if it still runs."""
    process = subprocess.Popen(
        [sys.executable, "-m", "clpt", *command], env=ENVIRONMENT, cwd=folder,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def machines(workers: int = 0) -> Iterator[Machines]:
    """Yield a scheduler in this process with workers in others; end them all."""
    with processes.local_scheduler() as (client, keys):
        found = Machines(client, keys)
        try:
            for _ in range(workers):
                found.start()
            found.wait(workers)
            yield found
        finally:
            for process in found.started:
                process.kill()
            for process in found.started:
                process.wait()
