"""The signals that end a command: Ctrl-C, and those by which a system ends a process."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn

ENDING = tuple(
    getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)
)  # as Ctrl-C, which is SIGINT
STATUS = 128  # added to the number of a signal, as shells do


def raise_at_signals() -> None:
    """Let the signals that end a process raise KeyboardInterrupt(number), as Ctrl-C does."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in ENDING:
        if signal.getsignal(number) is signal.SIG_DFL:  # nohup ignores SIGHUP
            signal.signal(number, _raise)


def status(error: BaseException | None) -> int:
    """Return the exit status of a process that a KeyboardInterrupt ends."""
    number = error.args[0] if error is not None and error.args else signal.SIGINT
    return STATUS + int(number)


@contextmanager
def stops() -> Iterator[list[int]]:
    """Yield a list that the first signal's number is put into; a second one acts as always."""
    caught: list[int] = []
    before: dict[int, Any] = {}

    def stop(number: int, frame: FrameType | None) -> None:
        caught.append(number)
        restore()

    def restore() -> None:
        for number, action in before.items():
            signal.signal(number, action)

    if threading.current_thread() is threading.main_thread():  # Python's rule for signals
        for number in (signal.SIGINT, *ENDING):
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop)
    try:
        yield caught
    finally:
        restore()


def _raise(number: int, frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt(number)
