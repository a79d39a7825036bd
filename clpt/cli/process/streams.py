"""The standard streams: one that is closed or broken ends no command."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import Any, TextIO


def make_safe() -> None:
    """Open what is closed, print what an encoding lacks as an escape, let stderr fail silently."""
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
