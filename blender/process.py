# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that renders: another Python, so that a driver's crash leaves Blender alive."""

from __future__ import annotations

import importlib.util
import json
import os
import secrets
import subprocess
import sys
import time
import weakref
from contextlib import suppress
from multiprocessing import AuthenticationError
from multiprocessing.connection import Connection, Listener
from pathlib import Path
from typing import Any

WORKER = Path(__file__).with_name("worker.py")
STARTS_WITHIN = 60.0  # [s]
NOT_THERE = "clpt does not start; name a Python that has clpt in the preferences of the add-on"
PYTHON = "CLPT_PYTHON"  # the environment variable that names a Python with clpt


class ProcessError(Exception):
    """The process could not start, or ended; the message is for people."""


class Process:
    """A process of clpt, which loads it at once, and the connection to it, made when it is used."""

    def __init__(self, python: str = ""):
        self.python = python or interpreter()
        self._connection: Connection | None = None
        _known.add(self)
        key = secrets.token_bytes(32)
        self._listener = Listener(("127.0.0.1", 0), authkey=key)
        self._listener._listener._socket.settimeout(0.5)  # accept() has no limit of its own
        command = [self.python, str(WORKER), str(self._listener.address[1])]
        try:
            self.child = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                env=environment(self.python),
                creationflags=subprocess.CREATE_NO_WINDOW if sys.platform == "win32" else 0,
            )
        except OSError as error:
            self._listener.close()
            raise ProcessError(f"{command[0]} does not start: {error.strerror}") from None
        assert self.child.stdin is not None
        with suppress(BrokenPipeError):  # a child that has ended is told by `connection`
            self.child.stdin.write(key)
            self.child.stdin.close()

    @property
    def connection(self) -> Connection:
        """The connection. Raises ProcessError if the process does not come."""
        end = time.monotonic() + STARTS_WITHIN
        while self._connection is None:
            with suppress(TimeoutError, OSError, AuthenticationError):
                self._connection = self._listener.accept()
                self._listener.close()
            is_over = self.child.poll() is not None or time.monotonic() > end
            if self._connection is None and is_over:
                self.stop()
                raise ProcessError(NOT_THERE)
        return self._connection

    def send(self, message: dict[str, Any]) -> None:
        """Send a message. Raises ProcessError if the process has ended."""
        try:
            self.connection.send_bytes(json.dumps(message).encode())
        except OSError:
            raise ProcessError("clpt has ended") from None

    def receive(self, wait: float) -> tuple[dict[str, Any], list[bytes]] | None:
        """Return a message and the pictures after it, None if none comes within `wait` [s].

        Raises ProcessError if the process has ended, or tells an error.
        """
        try:
            if not self.connection.poll(wait):
                return None
            message = json.loads(self.connection.recv_bytes())
            pictures = [self.connection.recv_bytes() for _ in range(message.get("pictures", 0))]
        except (EOFError, OSError):
            raise ProcessError("clpt has ended; its message is in the terminal") from None
        if "error" in message:
            raise ProcessError(message["error"])
        return message, pictures

    def stop(self) -> None:
        """End the process, if it has not ended."""
        for end in (self._listener, self._connection):
            if end is not None:
                end.close()
        try:
            self.child.wait(2.0)
        except subprocess.TimeoutExpired:
            self.child.kill()
            self.child.wait()


_known: weakref.WeakSet[Process] = weakref.WeakSet()
_idle: list[Process] = []  # one at most, for the next picture: it need not start again


def prepare(python: str = "") -> None:
    """Let a process load clpt before it is needed, while there is none."""
    if not _known:
        with suppress(ProcessError):  # told when a picture is wanted
            give_back(Process(python))


def take(python: str = "") -> Process:
    """Return a process that waits for work. Raises ProcessError."""
    python = python or interpreter()
    while _idle:
        process = _idle.pop()
        if process.python == python and process.child.poll() is None:
            with suppress(ProcessError):
                if process.receive(0.0) is None:
                    return process
        process.stop()
    return Process(python)


def give_back(process: Process) -> None:
    """Keep a process whose work is done, or end it."""
    if _idle:
        process.stop()
    else:
        _idle.append(process)


def end_all() -> None:
    """End processes that wait for work."""
    while _idle:
        _idle.pop().stop()


def environment(python: str) -> dict[str, str]:
    """Return the environment of a process: Blender's Python finds clpt where Blender has it."""
    variables, found = dict(os.environ), importlib.util.find_spec("clpt")
    if python == sys.executable and found is not None and found.origin is not None:
        variables["PYTHONPATH"] = str(Path(found.origin).parents[1])
    return variables


def interpreter() -> str:
    """Return the Python that has clpt: CLPT_PYTHON, or Blender's. Raises ProcessError."""
    if os.environ.get(PYTHON):
        return os.environ[PYTHON]
    if importlib.util.find_spec("clpt") is not None:
        return sys.executable
    raise ProcessError(NOT_THERE)
