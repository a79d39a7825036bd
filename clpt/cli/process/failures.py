"""Failures as the user reads them: one line, and an exit status."""

from __future__ import annotations

import sys
import traceback
from pathlib import Path

import click

from ... import output_files
from ...errors import ClptError

BAD_INPUT, BUG = 2, 1


def message_of(error: Exception) -> tuple[str, int]:
    """Return what to say of an error, and the exit status: of bad input, or of a fault of clpt.

    To be called where the error is handled: a fault keeps its traceback in a file.
    """
    if isinstance(error, ClptError):
        return str(error), BAD_INPUT
    if isinstance(error, click.ClickException):
        return error.format_message(), BAD_INPUT
    return f"{type(error).__name__}: {error}{_keep_traceback()}", BUG


def complain(message: str) -> None:
    """Print an error as one line."""
    clear_line()
    click.echo(f"clpt: error: {' '.join(message.split())}", err=True)


def clear_line() -> None:
    """Remove what a display has left in the line of the cursor, on a terminal."""
    if sys.stderr.isatty():
        click.echo("\r\x1b[2K", err=True, nl=False)


def _keep_traceback() -> str:
    """Write the current traceback to clpt's log folder; a phrase that tells where."""
    import platformdirs

    from ...device import disk_cache  # here: most commands end without a fault, some without OpenCL

    try:
        logs = Path(platformdirs.user_log_dir("clpt", appauthor=False))
    except RuntimeError:  # a user without a home
        logs = disk_cache.temporary_folder()
    path = logs / "traceback.txt"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        output_files.write_text(path, traceback.format_exc())
    except OSError:
        return ""
    return f" (a fault of clpt; please report it with {path})"
