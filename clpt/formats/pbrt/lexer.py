"""The words of a PBRT file: directives, strings, and runs of numbers, which may be long.

A file is kept as bytes and scanned once. The numbers between brackets, nearly all of a large file,
are parsed at once.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError, did_you_mean
from clpt.files import budget, input_files
from clpt.formats.pbrt.params import ALIASES, TYPES, Parameter
from clpt.formats.reading import read_bytes

WORD = re.compile(rb'(?:[ \t\r\n]+|#[^\n]*)*("[^"\n]*"|[\[\]]|[^ \t\r\n\[\]"#]+)?')
OLD_TYPES = ("color", "xyz")
COMMA = re.compile(rb'("[^"\n]*")|,')
UPGRADE = "PBRT version 3's; convert the file by pbrt-v4's --upgrade"


class Lexer:
    """The words of a file, in order; `line` is the line of the word last taken.

    Raises SceneError with the file and line for an invalid word.
    """

    def __init__(self, path: Path):
        self.path, self.data = path, input_files.plain(read_bytes(path))
        self.at = 0  # after the blanks before the next word
        self._ahead: bytes | None = None
        self._counted, self._line = 0, 1
        self.old = False

    def take_old(self) -> None:
        """Read words of versions 2 and 3, where commas between numbers are blanks."""
        self.old = True
        if b"," in self.data:
            self.data = COMMA.sub(lambda match: match[1] or b" ", self.data)

    @property
    def line(self) -> int:
        """The line of the last word taken."""
        self._line += self.data.count(b"\n", self._counted, self.at)
        self._counted = self.at
        return self._line

    def error(self, message: str) -> SceneError:
        """Return an error at this line."""
        return SceneError(message, file=self.path, line=self.line)

    def peek(self) -> bytes:
        """The next word, or nothing at the end of the file."""
        if self._ahead is None:
            match = WORD.match(self.data, self.at)
            word = match.group(1) if match else None
            self.at = (match.end() if match else self.at) - len(word or b"")
            if word is None and self.at < len(self.data):
                raise self.error("a string in quotes does not end on its line")
            self._ahead = word or b""
        return self._ahead

    def skip(self) -> None:
        """Go to the end of the file."""
        self.at, self._ahead = len(self.data), None

    def next(self, label: str) -> bytes:
        """Take the next word; `what` says what is missing at the end of the file."""
        word = self.peek()
        if not word:
            raise self.error(f"the file ends where {label} should follow")
        self.at, self._ahead = self.at + len(word), None
        return word

    def string(self, label: str) -> str:
        """Take a string in quotes."""
        word = self.next(label)
        if not word.startswith(b'"'):
            raise self.error(f"{label} must stand in quotes, not {_shown(word)}")
        return input_files.decode(word[1:-1])

    def numbers(self, count: int, label: str) -> NDArray[np.float64]:
        """Take `count` finite numbers, which may stand in brackets."""
        bracket = self.peek() == b"["
        values = self._bracketed() if bracket else [self.next("a number") for _ in range(count)]
        if not isinstance(values, np.ndarray):
            values = np.array([self._number(word) for word in values], np.float64)
        if len(values) != count:
            raise self.error(f"{label} needs {count} numbers, not {len(values)}")
        if not np.isfinite(values).all():
            raise self.error(f"{label} needs finite numbers")
        return values

    def parameters(self, where: str) -> list[Parameter]:
        """Take the parameters that follow a directive; `where` is its name for messages."""
        parameters: list[Parameter] = []
        while self.peek().startswith(b'"'):
            parameters.append(self._parameter(where))
        return parameters

    def _parameter(self, where: str) -> Parameter:
        declaration = self.string("a parameter").split()
        line = self.line
        if len(declaration) != 2:
            shown = " ".join(declaration)[:60]
            raise self.error(f'{where}: "{shown}" is not a type and a name')
        kind, name = declaration
        if kind in OLD_TYPES and self.old:
            return Parameter(kind, name, self._values(), self.path, line, where)
        if kind in OLD_TYPES:
            raise self.error(f"{where}: the type {kind!r} is {UPGRADE}")
        if kind not in TYPES:
            raise self.error(
                f"{where}: unknown type {kind!r} of {name!r}{did_you_mean(kind, TYPES)}"
            )
        values = self._values()
        return Parameter(ALIASES.get(kind, kind), name, values, self.path, line, where)

    def _values(self) -> Any:
        if self.peek() != b"[":
            return self._typed([self.next("a value")])
        values = self._bracketed()
        return values if isinstance(values, np.ndarray) else self._typed(values)

    def _bracketed(self) -> NDArray[np.float64] | list[bytes]:
        """Take the contents of brackets: numbers at once, anything else as words."""
        start = self.at + 1
        end = self.data.find(b"]", start)
        inside = self.data[start:end] if end >= 0 else b""
        budget.check(12 * len(inside), "a list of numbers", self.path)
        if end >= 0 and b"#" not in inside and b'"' not in inside:
            values = _floats(inside)
            if values is not None:
                budget.take(values.nbytes, "its lists of numbers", self.path)
                self.at, self._ahead = end + 1, None
                return values
        self.next("[")
        words: list[bytes] = []
        while (word := self.next("']'")) != b"]":
            if word == b"[":
                raise self.error("brackets cannot stand in brackets")
            words.append(word)
        return words

    def _typed(self, words: list[bytes]) -> Any:
        """Return words as texts, truths or numbers, by the first word."""
        if words and words[0].startswith(b'"'):
            if not all(word.startswith(b'"') for word in words):
                raise self.error("strings and other values are mixed")
            return [input_files.decode(word[1:-1]) for word in words]
        if words and all(word in (b"true", b"false") for word in words):
            return [word == b"true" for word in words]
        return np.array([self._number(word) for word in words], np.float64)

    def _number(self, word: bytes) -> float:
        try:
            return float(word)
        except ValueError:
            comma = input_files.comma_message(input_files.decode(word))
            raise self.error(comma or f"expected a number, found {_shown(word)}") from None


def _floats(inside: bytes) -> NDArray[np.float64] | None:
    """The numbers of a text, or None where it holds anything else."""
    try:
        return np.array(inside.split(), np.float64)
    except ValueError:
        return None


def _shown(word: bytes) -> str:
    return repr(input_files.decode(word[:40]))
