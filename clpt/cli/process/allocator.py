"""Memory: large blocks go back to the system, and cycles are not sought before there are any."""

from __future__ import annotations

import ctypes
import gc
import sys
from typing import Any

_MMAP_THRESHOLD = -3  # glibc's M_MMAP_THRESHOLD
_LARGE = 1 << 20  # [bytes]
_STARTED = 200_000  # objects: modules have 120,000


def return_large_blocks() -> None:
    """Let the C library give each large block back as soon as it is freed; only glibc is asked.

    By itself it raises the size from which it does so with every block that is freed, up to 32 MiB;
    what is decoded and parsed then leaves holes, a tenth of the peak of a scene with images.
    """
    if sys.platform == "linux":
        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
        if mallopt is not None:
            mallopt(_MMAP_THRESHOLD, _LARGE)


def collect_later() -> None:
    """Put the first collection of cycles off until there are more objects than modules have.

    Modules stay, so collections while they are imported find nothing; they take a tenth of a warm
    start.
    """
    usual = gc.get_threshold()

    def begin(phase: str, info: dict[str, Any]) -> None:
        gc.callbacks.remove(begin)
        gc.set_threshold(*usual)

    gc.callbacks.append(begin)
    gc.set_threshold(_STARTED, *usual[1:])
