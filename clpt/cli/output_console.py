"""The console that tables are printed on."""

from __future__ import annotations

from rich.console import Console


def output_console() -> Console:
    """Return a console on stdout, wide where that is a file or a pipe: these wrap nothing."""
    console = Console()
    return console if console.is_terminal else Console(width=200)
