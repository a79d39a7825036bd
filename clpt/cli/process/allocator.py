"""Memory that is freed goes back to the system."""

from __future__ import annotations

import ctypes
import sys

_MMAP_THRESHOLD = -3  # glibc's M_MMAP_THRESHOLD
_LARGE = 1 << 20  # [bytes]


def return_large_blocks() -> None:
    """Let the C library give each large block back as soon as it is freed; only glibc is asked.

    By itself it raises the size from which it does so with every block that is freed, up to 32 MiB;
    what is decoded and parsed then leaves holes, a tenth of the peak of a scene with images.
    """
    if sys.platform == "linux":
        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
        if mallopt is not None:
            mallopt(_MMAP_THRESHOLD, _LARGE)
