"""Messages of clpt's log, and tracebacks, without what controls a terminal, whoever prints them."""

from __future__ import annotations

import logging
import traceback

from clpt.errors import LONGEST_WARNING, lines, one_line


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
