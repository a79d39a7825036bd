"""Repair of a forked process, which has only one of its parent's threads.

Without those of PoCL its commands never end, and a lock that one of them held is never given back.
"""

from __future__ import annotations

import contextlib
import os
import weakref
from pathlib import Path
from typing import Any, TypeVar

import pyopencl as cl

from ..errors import DeviceError

_lost = False  # whether PoCL was loaded when this process, or one it descends from, was forked
_locks: weakref.WeakSet[Any] = weakref.WeakSet()
_Lock = TypeVar("_Lock")


def renewed(lock: _Lock) -> _Lock:
    """Return a lock of threading, which nobody holds in a process that is forked later."""
    _locks.add(lock)
    return lock


def check(queue: cl.CommandQueue) -> None:
    """Raise DeviceError for a queue of PoCL in a process that was forked after PoCL was loaded."""
    if _lost and "pocl" in queue.device.version.casefold():
        raise DeviceError(
            "PoCL does not run in a process that was forked after OpenCL was used: begin processes "
            "by the start method spawn or forkserver of multiprocessing"
        )


def _note_loss() -> None:
    """Note whether the parent has loaded PoCL, by clpt or without it."""
    global _lost
    with contextlib.suppress(OSError):  # of a system without such a file
        _lost = _lost or "libpocl" in Path("/proc/self/maps").read_text(errors="replace")


def _renew_locks() -> None:
    for lock in list(_locks):
        lock._at_fork_reinit()  # as the locks of threading and logging are


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_loss)
    os.register_at_fork(after_in_child=_renew_locks)
