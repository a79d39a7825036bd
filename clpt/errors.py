"""Errors of clpt, written for people: what is wrong, where, and what to do.

ClptError
├── SceneError              a ValueError: a scene, mesh or image file, or a scene built in Python
│   ├── UnknownKindError    a name that no kind has; gives the nearest names
│   └── UnusedParameterError  a parameter that the kind does not have
├── DeviceError             a RuntimeError: no OpenCL device, or it cannot do what is asked
│   └── MemoryBudgetError   a MemoryError too: asked, available, what to lower
├── KernelBuildError        a RuntimeError: a kernel did not compile: stage, file, line, log
└── ClusterError            a RuntimeError: workers that cannot go on, or that disagree

All of them can be pickled, with their attributes: an error of a worker reaches its parent whole.

Messages of the log "clpt", and tracebacks, are cleaned of characters that control a terminal.
"""

from __future__ import annotations

import difflib
import logging
import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import Any


class ClptError(Exception):
    """Base of everything that clpt raises on purpose.

    Its text is a line of at most LONGEST characters, without control characters.
    """

    def __str__(self) -> str:
        return one_line(self.whole)

    @property
    def whole(self) -> str:
        """The text before it is cut, for whoever takes parts out of it first."""
        return super().__str__()

    def __reduce__(self) -> tuple[Any, ...]:
        # Python would call the class with the message, which is not what the class takes.
        return _restored, (type(self), self.args), self.__dict__


def _restored(cls: type[ClptError], args: tuple[Any, ...]) -> ClptError:
    """Return an error without calling its constructor; its attributes follow."""
    return cls.__new__(cls, *args)


LONGEST, LONGEST_PLACE = 300, 120  # characters of an error about a file, and of where it is
LONGEST_WARNING = 1000  # characters of a warning
LONGEST_KEPT = 1 << 14  # characters of a message that an error keeps


def one_line(text: str, longest: int = LONGEST) -> str:
    """Return a text as a single line without control characters; a long text loses its middle."""
    if len(text) > 8 * longest:  # the rest is never shown, and may be megabytes
        text = f"{text[: 4 * longest]} {text[-4 * longest :]}"
    if not text.isprintable():
        text = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    if len(text) <= longest:
        return text
    end = longest // 3
    return f"{text[: longest - end - 5]} ... {text[-end:]}"


def lines(text: str) -> str:
    """Return a text of several lines, such as a traceback, each as `one_line` makes it.

    Blanks at the beginning of a line stay.
    """
    rows = text.split("\n")
    return "\n".join(row[: len(row) - len(row.lstrip(" "))] + one_line(row) for row in rows)


class SceneError(ClptError, ValueError):
    """Bad input, with the file, line and element it stands in where these are known.

    message: the text without these places, before it is cut.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | Path | None = None,
        line: int | None = None,
        where: str | None = None,
    ):
        self.message, self.file, self.line = one_line(message, LONGEST_KEPT), file, line
        super().__init__()
        self.place_at(where)

    def place_at(self, where: str | None) -> None:
        """Replace the element or the parameter that the message names."""
        self.where = None if where is None else one_line(where, LONGEST_KEPT)
        place = one_line(str(self.file), LONGEST_PLACE) if self.file is not None else ""
        if self.line is not None:
            place += f":{self.line}"
        parts = place, one_line(self.where or "", LONGEST_PLACE)
        before = "".join(f"{part}: " for part in parts if part)
        self.args = (before + one_line(self.message, max(LONGEST - len(before), 40)),)

    @property
    def whole(self) -> str:
        """The element, if it is known, and the message, before they are cut."""
        return ": ".join(part for part in (self.where, self.message) if part)

    def __str__(self) -> str:
        return str(self.args[0])


LONGEST_NAME = 80  # characters that are compared


def nearest(name: str, known: Iterable[str]) -> str:
    """Return the end of a message: the known names that are near a name, or else all of them."""
    known = sorted(known)
    return did_you_mean(name, known) or ("; known: " + ", ".join(known) if known else "")


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the end of a message: the known names that are near a name, "" where there is none."""
    near = difflib.get_close_matches(name[:LONGEST_NAME], sorted(known), n=3, cutoff=0.5)
    return "; did you mean " + " or ".join(map(repr, near)) + "?" if near else ""


class UnknownKindError(SceneError):
    """A `type` that is not in the table of kinds."""

    def __init__(self, category: str, name: str, known: Iterable[str], **place: Any):
        super().__init__(f"unknown {category} {name!r}" + nearest(name, known), **place)


class UnusedParameterError(SceneError):
    """A parameter that the kind does not have."""

    def __init__(self, kind: str, name: str, known: Iterable[str], **place: Any):
        super().__init__(f"{kind} has no parameter {name!r}" + nearest(name, known), **place)


class DeviceError(ClptError, RuntimeError):
    """No device, or the device cannot do what is asked."""


def _size(nbytes: int) -> str:
    """A size of memory for people to read."""
    return f"{nbytes / 2**20:.0f} MiB" if nbytes >= 2**20 else f"{nbytes / 2**10:.0f} KiB"


class MemoryBudgetError(DeviceError, MemoryError):
    """More device memory is needed than there is.

    asked, available: bytes; None where the driver does not tell.
    """

    def __init__(self, subject: str, asked: int | None, available: int | None, advice: str):
        self.asked, self.available = asked, available
        needs = "more memory" if asked is None else _size(asked)
        has = "no more" if available is None else _size(available)
        super().__init__(f"{subject} needs {needs}, the device has {has}: {advice}")


class KernelBuildError(ClptError, RuntimeError):
    """A kernel did not compile: our file and line, the compiler's log, where the text was kept."""

    def __init__(self, stage: str, file: str | None, line: int | None, log: str, kept: str | None):
        self.stage, self.file, self.line, self.log, self.kept = stage, file, line, log, kept
        place = f" at {file}:{line}" if file else ""
        text = f"; its text is in {kept}" if kept else ""
        first = next((row for row in log.splitlines() if "error" in row), "no log")
        super().__init__(f"kernel program {stage!r} did not build{place}: {first.strip()}{text}")


class ClusterError(ClptError, RuntimeError):
    """A render on several devices or machines that cannot go on; what was done is kept."""


class Cleaning(logging.NullHandler):
    """Cleans each message before the handlers of the program get it; prints nothing.

    It is a handler of the logger "clpt". Python calls the handlers of parent loggers later.
    """

    def handle(self, record: logging.LogRecord) -> bool:
        clean(record)
        return True


def clean(record: logging.LogRecord) -> None:
    """Reduce a message to a line of at most LONGEST_WARNING characters.

    Messages for debugging keep their lines, such as the log of a compiler.
    """
    try:
        text = record.getMessage()
    except Exception:  # the program's handlers tell of it
        return
    debug = record.levelno <= logging.DEBUG
    record.msg = lines(text).replace("\n", "\n    ") if debug else one_line(text, LONGEST_WARNING)
    record.args = ()
    if record.exc_info and record.exc_info[1] is not None:
        record.exc_text = traceback_of(record.exc_info[1])


def traceback_of(error: BaseException) -> str:
    """Return the traceback of an error, with the error's message on a single line."""
    parts = traceback.format_exception(error)
    of_python = (" ", "\n", "Traceback")  # other parts are the error's message
    rows = [lines(part) if part.startswith(of_python) else one_line(part) + "\n" for part in parts]
    return "".join(rows).rstrip("\n")
