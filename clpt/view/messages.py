"""Messages to viewers: JSON, which has no infinity, and errors of one line without folders."""

from __future__ import annotations

import json
import logging
import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from clpt.errors import ClptError, KernelBuildError, SceneError, one_line

log = logging.getLogger(__name__)

QUOTED_FOLDER = re.compile(r"""(?<=['"])(?:[A-Za-z]:)?[/\\][^'"\n]*[/\\]""")
FOLDER = re.compile(r"""(?<![\w.~-])(?:[A-Za-z]:)?[/\\][^\s'"]*[/\\]""")
# A folder that `one_line` has cut, in an error that quotes the text of another.
CUT_NAME = re.compile(r"""(?<=['"])(?:[A-Za-z]:)?[/\\][^'"\n]* \.\.\. (?:[^'"]*[/\\])?""")
CUT_FOLDER = re.compile(r"""(?<= \.\.\. )[^'"]*[/\\]""")

PREPARING: Final[dict[str, Any]] = {"type": "status", "phase": "preparing"}
Reply = Callable[[dict[str, Any]], None]


def as_json(message: object) -> str:
    """Return a message as JSON; what is no finite number is null."""
    try:
        return json.dumps(message, allow_nan=False)
    except ValueError:
        return json.dumps(finite(message))


def finite(value: object) -> Any:
    """Return a message in which what is no finite number is None."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(child) for key, child in value.items()}
    return [finite(child) for child in value] if isinstance(value, (list, tuple)) else value


def error_message(error: BaseException, before: str = "") -> dict[str, Any]:
    """Return what a viewer is told of an error, on one line.

    before: begins the line. Of a file only the name is told, not its folder.
    """
    text = f"{before}{_reason(error)}"
    for folder in (CUT_NAME, QUOTED_FOLDER, FOLDER, CUT_FOLDER):
        text = folder.sub("", text)
    return {"type": "error", "text": one_line(text)}


@contextmanager
def answering(reply: Reply, before: str = "") -> Iterator[None]:
    """Let whatever is raised be an answer: no message, whatever it holds, ends a viewer."""
    try:
        yield
    except Exception as error:
        log.debug("a message failed", exc_info=True)
        reply(error_message(error, before))


def _reason(error: BaseException) -> str:
    if isinstance(error, SceneError):
        line = f"line {error.line}" if error.line is not None else None
        name = None if error.file is None else Path(error.file).name
        return ": ".join(part for part in (name, line, error.whole) if part)
    if isinstance(error, KernelBuildError):
        return f"the kernel program {error.stage!r} did not build"
    if isinstance(error, ClptError):
        return error.whole
    if isinstance(error, MemoryError):
        return "there is not enough memory"
    if isinstance(error, OSError):
        return error.strerror or "a file cannot be read or written"
    return f"a fault of clpt ({type(error).__name__})"
