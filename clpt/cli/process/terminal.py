"""The one way out for text to people: on one line, cut, without what controls a terminal."""

from __future__ import annotations

import sys

import click

from ...errors import LONGEST_WARNING, lines, one_line

LONGEST = LONGEST_WARNING  # characters of a line
CLEARED, CURSOR = "\r\x1b[2K", "\x1b[?25h"  # what clpt itself tells a terminal


def cleaned(text: object) -> str:
    """Return a text on one line, cut, without control characters."""
    return one_line(str(text), LONGEST)


def say(text: object, *, err: bool = True, nl: bool = True) -> None:
    """Print a text on one line. nl: whether the line ends."""
    click.echo(cleaned(text), err=err, nl=nl)


def say_lines(text: str, *, err: bool = False) -> None:
    """Print a text of several lines, each as `say` does."""
    click.echo(lines(text), err=err)


def write(text: str) -> None:
    """Print a text of clpt's own as it is: help, a script, JSON, which has escapes of its own."""
    click.echo(text)


def clear_line() -> None:
    """Remove what a display has left in the line of the cursor, on a terminal."""
    if sys.stderr.isatty():
        click.echo(CLEARED, err=True, nl=False)


def show_cursor() -> None:
    """Show the cursor, which a bar may have hidden, on a terminal."""
    if sys.stderr.isatty():
        click.echo(CURSOR, err=True, nl=False)
