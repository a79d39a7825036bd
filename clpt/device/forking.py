"""Repair of a forked process, which has a single thread of its parent's.

Without PoCL's threads its commands never end, and a lock that another thread held stays locked.
"""

from __future__ import annotations

import contextlib
import os
import weakref
from pathlib import Path
from typing import Any, TypeVar

import pyopencl as cl

from ..errors import DeviceError

_lost = False  # whether PoCL was loaded at a fork of this process or an ancestor
_locks: weakref.WeakSet[Any] = weakref.WeakSet()
_Lock = TypeVar("_Lock")


def renewed(lock: _Lock) -> _Lock:
    """Return a lock of threading that is free in every later forked process."""
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
    """Note whether the parent has loaded PoCL."""
    global _lost
    with contextlib.suppress(OSError):  # a system without such a file
        _lost = _lost or "libpocl" in Path("/proc/self/maps").read_text(errors="replace")


def _renew_locks() -> None:
    for lock in list(_locks):
        lock._at_fork_reinit()  # like locks of threading and logging


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_loss)
    os.register_at_fork(after_in_child=_renew_locks)
