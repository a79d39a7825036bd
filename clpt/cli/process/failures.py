"""Failures as the user reads them: a single line, and an exit status."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

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

    from ...device import disk_cache  # here: most commands end without a fault, some without OpenCL

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
