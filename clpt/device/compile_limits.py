"""Limits of compilation: a hanging compiler is reported, and ended where possible.

LLVM has passes that never end on some texts. A limit is in seconds of processor time, independent
of other processes, and grows with the text. The system ends a compiler process at its limit. A
compiler inside this process cannot be stopped: `at_limit` is called.
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
LEAST = 60.0  # [s]; a small text takes less than 1 s
CHARACTERS = 5000  # of a text, for each further second; large texts take a tenth of that

# Called with a message when a compiler in this process reaches its limit.
at_limit: Callable[[str], None] = log.warning


def seconds_for(source: Source) -> float:
    """Return the limit of a text [s of processor time], infinite without a limit.

    Raises DeviceError if the variable is no number.
    """
    text = os.environ.get(VARIABLE)
    if text is None:
        return LEAST + len(source.text) / CHARACTERS
    try:
        seconds = float(text)
        if not seconds >= 0.0:
            raise ValueError
    except ValueError:
        raise DeviceError(f"{VARIABLE} is a number of seconds, not {text!r}") from None
    return seconds or math.inf


def message(name: str, seconds: float) -> str:
    """Return the message for a compiler that has reached its limit."""
    return (
        f"the driver's compiler has been at the program {name!r} for {seconds:.0f} s of the "
        f"processor, and seems to hang; try another driver or device, or {VARIABLE}=N for N "
        "seconds, 0 for any"
    )


def failure(name: str, seconds: float) -> KernelBuildError:
    """Return the error for a compiler that was ended at its limit."""
    return KernelBuildError(name, None, None, f"error: {message(name, seconds)}", None)


@contextmanager
def watched(source: Source) -> Iterator[None]:
    """Call `at_limit` if this process compiles a program beyond its limit."""
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
