"""The console that tables are printed on."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.text import Text

from .process.terminal import LONGEST


def output_console() -> Console:
    """Return a console on stdout, wide where that is a file or a pipe: these wrap nothing."""
    console = Console()
    return console if console.is_terminal else Console(width=200)


def shown(value: object) -> Text:
    """Return a value of a table of facts: parts of a list have a line each.

    What a file says is no markup, and controls no terminal.
    """
    return Text(_text(value))


def _text(value: object) -> str:
    if value is None or isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        return ", ".join(f"{_plain(key)}: {_part(part)}" for key, part in value.items()) or "none"
    if isinstance(value, list) and value and isinstance(value[0], list):
        return " to ".join("(" + ", ".join(f"{x:g}" for x in corner) + ")" for corner in value)
    if isinstance(value, list):
        return "\n".join(_plain(entry) for entry in value) or "none"
    return f"{value:,}" if isinstance(value, int) else _plain(value)


def _part(value: Any) -> str:
    """Return a value inside of others."""
    several = isinstance(value, (list, tuple))
    return " ".join(map(_plain, value)) if several else _plain(value)


def _plain(value: object) -> str:
    """Return a text that controls no terminal: another character marks what is left out."""
    text = str(value)[:LONGEST]
    return "".join(c if c.isprintable() else "\ufffd" for c in text)
