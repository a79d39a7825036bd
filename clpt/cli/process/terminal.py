"""Text to people on the standard streams: a single line, cut, that controls no terminal."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import Any, TextIO

import click

from ...errors import LONGEST_WARNING, lines, one_line

LONGEST = LONGEST_WARNING  # characters of a line
CLEARED, CURSOR = "\r\x1b[2K", "\x1b[?25h"  # control sequences of clpt itself


def cleaned(text: object) -> str:
    """Return a text as a single line, cut, without control characters."""
    return one_line(str(text), LONGEST)


def say(text: object, *, err: bool = True, nl: bool = True) -> None:
    """Print a text as a single line. nl: whether the line ends."""
    click.echo(cleaned(text), err=err, nl=nl)


def say_lines(text: str, *, err: bool = False) -> None:
    """Print a text of several lines, each as `say` does."""
    click.echo(lines(text), err=err)


def write(text: str) -> None:
    """Print a text of clpt's own as it is: help, a script, JSON, which has escapes of its own."""
    click.echo(text)


def clear_line() -> None:
    """Clear the line of the cursor, on a terminal."""
    if sys.stderr.isatty():
        click.echo(CLEARED, err=True, nl=False)


def show_cursor() -> None:
    """Show the cursor, which a bar may have hidden, on a terminal."""
    if sys.stderr.isatty():
        click.echo(CURSOR, err=True, nl=False)


def make_safe() -> None:
    """Open closed streams, escape characters that an encoding lacks, let stderr fail silently."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:  # closed: no other file may get the stream's number
            nothing = os.open(os.devnull, os.O_RDWR)
            setattr(sys, name, os.fdopen(nothing, "r" if name == "stdin" else "w"))
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    sys.stderr = ForgivingStream(sys.stderr)


class ForgivingStream:
    """A text stream whose reader may go: a closed terminal must not cost the picture."""

    def __init__(self, stream: TextIO):
        self._stream = stream

    def write(self, text: str) -> int:
        try:
            return self._stream.write(text)
        except OSError:
            return len(text)

    def flush(self) -> None:
        with contextlib.suppress(OSError):
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
