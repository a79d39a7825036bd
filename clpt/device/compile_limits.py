"""Limits of compilation: a compiler that hangs is named, and ended where that can be.

LLVM has passes that never end on some texts. A limit is in seconds of the processor, so that
neighbours on a machine do not count, and grows with the text. In a process that only compiles the
system ends it. In this process nobody can stop a driver's compiler: `at_limit` is called.
"""

from __future__ import annotations

import logging
import math
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ..errors import DeviceError, KernelBuildError
from .source import Source

log = logging.getLogger(__name__)

VARIABLE = "CLPT_COMPILE_SECONDS"
LEAST = 60.0  # [s]; a small text takes less than one
CHARACTERS = 5000  # of a text, for each second more; the largest take a tenth of that

# What is done when a compiler in this process reaches its limit, with what there is to say.
at_limit: Callable[[str], None] = log.warning


def seconds_for(source: Source) -> float:
    """Return how long a compiler may be at a text [s of the processor], infinite without a limit.

    Raises DeviceError for a variable that is no number.
    """
    given = os.environ.get(VARIABLE)
    if given is None:
        return LEAST + len(source.text) / CHARACTERS
    try:
        seconds = float(given)
        if not seconds >= 0.0:
            raise ValueError
    except ValueError:
        raise DeviceError(f"{VARIABLE} is a number of seconds, not {given!r}") from None
    return seconds or math.inf


def message(name: str, seconds: float) -> str:
    """Return what to say of a compiler that has reached its limit at a program."""
    return (
        f"the driver's compiler has been at the program {name!r} for {seconds:.0f} s of the "
        f"processor, and seems to hang; try another driver or device, or {VARIABLE}=N for N "
        "seconds, 0 for any"
    )


def failure(name: str, seconds: float) -> KernelBuildError:
    """Return the error of a compiler that was ended at its limit."""
    return KernelBuildError(name, None, None, f"error: {message(name, seconds)}", None)


@contextmanager
def watched(source: Source) -> Iterator[None]:
    """Call `at_limit` if this process compiles a program for longer than it may."""
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
