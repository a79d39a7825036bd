"""The option -v, which is the same before and behind a command's name."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, TypeVar

import click

from ... import clean_logs
from ..process import terminal

LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)
_COUNT = "clpt.verbosity"  # in what nested contexts share

Command = TypeVar("Command", bound=Callable[..., Any])


class Handler(logging.Handler):
    """Prints messages of clpt's log as the commands print theirs: clpt: warning: ..."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print a message, which has more lines where it tells a traceback."""
        clean_logs.clean(record)  # another library's too
        terminal.clear_line()
        terminal.say_lines(f"clpt: {record.levelname.lower()}: {self.format(record)}", err=True)


def verbose_option(text: str) -> Callable[[Command], Command]:
    """Return the option, with its help; the command gets how often it was given in all."""
    return click.option("-v", "--verbose", count=True, callback=_add, help=text)


def _add(ctx: click.Context, param: click.Parameter, value: int) -> int:
    count = ctx.meta[_COUNT] = ctx.meta.get(_COUNT, 0) + value
    logging.getLogger("clpt").setLevel(LEVELS[min(count, len(LEVELS) - 1)])
    return count
