"""The end of a command: a failure in a single line, an exit status, signals such as Ctrl-C."""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

import click

from clpt.files import output_files

from ...errors import ClptError, one_line, traceback_of
from . import terminal

BAD_INPUT, BUG = 2, 1


def message_of(error: Exception) -> tuple[str, int]:
    """Return the message of an error, and the exit status: of bad input, or of a fault of clpt.

    A fault keeps its traceback in a file.
    """
    if isinstance(error, ClptError):
        return str(error), BAD_INPUT
    if isinstance(error, click.ClickException):
        return error.format_message(), BAD_INPUT
    return f"{type(error).__name__}: {one_line(str(error))}{_keep_traceback(error)}", BUG


def complain(message: str) -> None:
    """Print an error as a single line."""
    terminal.clear_line()
    terminal.say(f"clpt: error: {message}")


def _keep_traceback(error: Exception) -> str:
    """Write the traceback of an error to clpt's log folder; return a phrase with its path."""
    import platformdirs

    from ...files import disk_cache  # here: most commands end without a fault

    try:
        logs = Path(platformdirs.user_log_dir("clpt", appauthor=False))
    except RuntimeError:  # a user without a home
        logs = disk_cache.temporary_folder()
    path = logs / "traceback.txt"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        output_files.write_text(path, traceback_of(error))
    except OSError:
        return ""
    return f" (a fault of clpt; please report it with {path})"


@contextmanager
def extra(name: str, purpose: str) -> Iterator[None]:
    """Guard an import of packages that an extra of clpt installs.

    Raises ClptError, which names the extra, where a package is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package == "clpt":
            raise
        message = f'{purpose} needs {package}: install it by pip install "clpt[{name}]"'
        raise ClptError(message) from error


GRACE = 1.0  # seconds that KeyboardInterrupt has to end a process by itself
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


def interrupt_behind(error: BaseException) -> KeyboardInterrupt | None:
    """Return the KeyboardInterrupt that an error comes of, or None.

    click turns it into Abort, and an extension whose import it ends into ImportError.
    """
    at: BaseException | None = error
    while at is not None and not isinstance(at, KeyboardInterrupt):
        at = at.__cause__ or at.__context__
    return at


def ended_by(interrupt: KeyboardInterrupt) -> int:
    """Say that a signal ends the command, and return the exit status."""
    tell()
    return STATUS + int(interrupt.args[0] if interrupt.args else signal.SIGINT)


def tell() -> None:
    """Say that a signal ends the command, on a terminal whose cursor a bar may have hidden."""
    terminal.show_cursor()
    complain("interrupted")


@contextmanager
def stops() -> Iterator[list[int]]:
    """Yield a list that gets the first signal's number; a second signal acts as always."""
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


def end_at_second() -> None:
    """From now on a second signal ends the process soon, whatever a kernel on a device does.

    Python raises KeyboardInterrupt when a call of C returns, and a kernel may take hours. GRACE
    after the second signal a thread ends the process.
    """
    if sys.platform == "win32" or threading.current_thread() is not threading.main_thread():
        return
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    threading.Thread(target=_watch, args=(reader, _nothing, 2), daemon=True).start()
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)


def _nothing() -> None:
    pass


@contextmanager
def prompt(last: Callable[[], None]) -> Iterator[None]:
    """Meanwhile a signal ends the process soon, though a driver compiles: nothing may be lost.

    Python raises KeyboardInterrupt when a call of C returns, and a driver's compiler takes minutes.
    After GRACE, or at a second signal, a thread calls `last` and ends the process.
    """
    if sys.platform == "win32" or threading.current_thread() is not threading.main_thread():
        yield
        return
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    threading.Thread(target=_watch, args=(reader, last, 1), daemon=True).start()
    before = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.close(writer)


def _watch(reader: int, last: Callable[[], None], bound: int) -> None:
    """Read the numbers of signals until the pipe is closed; end the process if that takes long.

    bound: signals to wait for; GRACE after them, or at a further signal, the process ends.
    """
    number, count = 0, 0
    while select.select([reader], [], [], GRACE if count >= bound else None)[0]:
        read = os.read(reader, 1)
        if not read:
            os.close(reader)
            return
        if read[0] in (signal.SIGINT, *ENDING):
            number, count = read[0], count + 1
            if count > bound:
                break
    last()
    tell()
    os._exit(STATUS + number)


def _raise(number: int, frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt(number)
