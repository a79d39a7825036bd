"""What a forked process has lost: the threads of PoCL, without which its commands never end."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import pyopencl as cl

from ..errors import DeviceError

_lost = False  # whether PoCL was loaded when this process, or one it descends from, was forked


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


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_loss)
