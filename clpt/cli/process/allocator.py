"""Memory: large blocks go back to the system, and cycles are sought only where that pays."""

from __future__ import annotations

import atexit
import ctypes
import gc
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # glibc's M_TRIM_THRESHOLD, M_MMAP_THRESHOLD
_LARGE, _KEPT = 1 << 20, 1 << 17  # [bytes]: a block of its own, the free end of the heap
_LARGE_INSIDE, _KEPT_INSIDE = 1 << 22, 1 << 24  # [bytes]: of `reusing`; glibc maps larger blocks
_STARTED = 200_000  # objects: modules have 120,000

_inside = 0  # how many threads are in `reusing`
_lock = threading.Lock()


def return_large_blocks() -> None:
    """Let the C library give each large block back as soon as it is freed; only glibc is asked.

    By itself it keeps ever larger blocks, up to 32 MiB, as blocks are freed. Memory of decoders and
    parsers then leaves holes: a tenth of the peak of a scene with images.
    """
    _set(_LARGE, _KEPT)


@contextmanager
def reusing() -> Iterator[None]:
    """Reuse large blocks that are freed inside; in the end all go back.

    New memory of the system costs a page fault for each 4 KiB: for many arrays of a scene more than
    their computation. Threads may be inside at once: all goes back when the last thread leaves.
    """
    global _inside
    with _lock:
        _inside += 1
        _set(_LARGE_INSIDE, _KEPT_INSIDE)
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if not _inside:
                _set(_LARGE, _KEPT)
                _ask("malloc_trim", 0)


def _set(large: int, kept: int) -> None:
    """Set the smallest block that is mapped for itself, and the most free memory at the end."""
    _ask("mallopt", _MMAP_THRESHOLD, large)
    _ask("mallopt", _TRIM_THRESHOLD, kept)


def _ask(function: str, *numbers: int) -> None:
    """Call a function of glibc, where that is the C library."""
    if sys.platform == "linux":
        glibc_function = getattr(ctypes.CDLL(None), function, None)
        if glibc_function is not None:
            glibc_function(*numbers)


def collect_later() -> None:
    """Put the first collection of cycles off until there are more objects than modules have.

    Modules stay, so collections during imports find nothing; they take a tenth of a warm start.
    Collections at the process's end take a fifth of a warm start, and free memory that the system
    frees anyway: there are none after the calls of `atexit`.
    """
    atexit.register(gc.freeze)
    usual = gc.get_threshold()

    def begin(phase: str, info: dict[str, Any]) -> None:
        gc.callbacks.remove(begin)
        gc.set_threshold(*usual)

    gc.callbacks.append(begin)
    gc.set_threshold(_STARTED, *usual[1:])
