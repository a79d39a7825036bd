"""Text files in the encodings that programs write: UTF-8, UTF-16 with a byte order mark, Latin-1.

Readers of words and numbers in bulk take `plain` bytes and decode only the names that they keep.
"""

from __future__ import annotations

import codecs
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, input_files

UTF_16 = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
FILLING = b"\0\x1a"  # what some programs write behind the end of a text
COMMA = re.compile(r"\d,\d")


def plain(data: bytes) -> bytes:
    """Return a text without byte order mark, in an encoding that contains ASCII.

    UTF-16 becomes UTF-8; anything else is returned as it is.
    """
    if data.startswith(codecs.BOM_UTF8):
        return data[len(codecs.BOM_UTF8) :]
    if data[:2] in UTF_16:
        return data[2:].decode(UTF_16[data[:2]], "replace").encode("utf-8", "replace")
    return data


def decode(data: bytes) -> str:
    """Decode a text, or a part of a plain text: UTF-8, or else Latin-1."""
    data = plain(data)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def read(path: str | Path) -> str:
    """Read a text file; ends of lines become "\\n". Raises SceneError if it is missing."""
    data = input_files.read_bytes(Path(path))
    budget.check(8 * len(data), "its text", Path(path))
    return decode(data).replace("\r\n", "\n").replace("\r", "\n")


def comma_message(line: str) -> str | None:
    """Return what is wrong with a line of numbers with decimal commas; None if it has none.

    For formats without commas between numbers.
    """
    if COMMA.search(line) is None:
        return None
    return f"write numbers with a decimal point, not a comma: {line.strip()[:60]!r}"


def numbers(data: bytes, start: int = 0) -> NDArray[np.float64]:
    """Return the numbers of a plain text from a byte on, divided by blanks and ends of lines.

    Raises SceneError with the line of the first word that is none.
    """
    try:
        return np.array(data[start:].split(), np.float64)
    except ValueError:
        first = 1 + len(data[:start].splitlines())
        first -= start > 0 and data[start - 1] not in b"\r\n"
        lines = data[start:].splitlines()
        number, line = next((i, line) for i, line in enumerate(lines, first) if not _all(line))
        shown = decode(line).strip()
        message = comma_message(shown) or f"not all words are numbers: {shown[:60]!r}"
        raise SceneError(message, line=number) from None


def _all(line: bytes) -> bool:
    """Return whether all words of a line are numbers."""
    try:
        np.array(line.split(), np.float64)
    except ValueError:
        return False
    return True
