"""Values of a JSON file that know their location: "shapes[3].material.alpha_u", file and line.

The standard library parses the file. The line of a value is searched for only when a message needs
it, by walking the text along the value's path.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clpt.arrays import is_number
from clpt.errors import SceneError, UnusedParameterError
from clpt.files import budget
from clpt.files import input_files as text_files
from clpt.formats.reading import Located

LARGEST_INTEGER = 2**31 - 1
PER_LETTER = 16  # bytes of memory for each letter of JSON, while it is read
QUOTED = 40  # letters on each side of a mistake that a message quotes
SKIPPED = re.compile(r"[\s,:]*")
NAMES = {
    dict: "an object", list: "a list", str: "a string", bool: "true or false", float: "a number",
    int: "a number", type(None): "null",
}  # fmt: skip


@dataclass(frozen=True)
class DuplicateKey:
    """Stands for an object with a repeated key."""

    key: str


@dataclass(frozen=True)
class Cursor(Located):
    """A value of a JSON file and the keys that lead to it.

    file: None for a value that comes from no file: it can name none either.
    confined: whether it can name only files of its own folder.
    """

    value: Any
    file: Path | None
    text: str
    path: tuple[str | int, ...] = ()
    confined: bool = False

    def location(self) -> dict[str, Any]:
        where = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in self.path)
        line = _line(self.text, self.path)
        return {"file": self.file, "line": line, "where": where.removeprefix(".") or None}

    def relocated(self, error: SceneError) -> SceneError:
        """Return an error at this value, or at that of its keys that `error` names."""
        key = (error.where or "").rpartition(".")[2]
        named = isinstance(self.value, dict) and key in self.value
        return (self.at(key) if named else self).error(error.message)

    def check_keys(self, kind: str, known: Collection[str], needed: Collection[str] = ()) -> None:
        """Raise UnusedParameterError for an unknown key, SceneError for a missing key."""
        for key in self.expect(dict):
            if key not in known:
                raise UnusedParameterError(kind, key, known, **self.at(key).location())
        for key in needed:
            if key not in self.value:
                raise self.error(f"needs the parameter {key!r}")

    def expect(self, kind: type, expected: str = "") -> Any:
        """Return the value, which must be of a type."""
        if isinstance(self.value, DuplicateKey):
            raise self.error(f"the key {self.value.key!r} is given twice")
        if not isinstance(self.value, kind):
            actual = NAMES.get(type(self.value), "something else")
            raise self.error(f"must be {expected or NAMES[kind]}, not {actual}")
        return self.value

    def at(self, key: str | int) -> Cursor:
        """Return the value of a key or an index."""
        return Cursor(self.value[key], self.file, self.text, (*self.path, key), self.confined)

    def items(self) -> Iterator[tuple[str, Cursor]]:
        """Yield the keys and values of an object."""
        for key in self.expect(dict):
            yield key, self.at(key)

    def entries(self, count: int = 0) -> list[Cursor]:
        """Return the values of a list, `count` of them unless that is 0."""
        values = self.expect(list)
        if count and len(values) != count:
            raise self.error(f"must have {count} entries, not {len(values)}")
        return [self.at(i) for i in budget.steps(range(len(values)))]

    def number(self) -> float:
        """Return a finite number."""
        if not is_number(self.value):
            self.expect(str if isinstance(self.value, DuplicateKey) else float, "a number")
            raise self.error("must be a number, not true or false")
        try:
            value = float(self.value)
        except OverflowError:
            value = math.inf
        if not math.isfinite(value):
            raise self.error("must be a finite number")
        return value

    def integer(self) -> int:
        """Return a whole number below 2^31."""
        value = self.number()
        if value != int(value) or abs(value) > LARGEST_INTEGER:
            raise self.error(f"must be a whole number below 2^31, not {value:g}")
        return int(value)

    def numbers(self, count: int = 0) -> list[float]:
        """Return a list of finite numbers, `count` of them unless that is 0."""
        return [entry.number() for entry in self.entries(count)]


ReadCursor = Callable[[Cursor], Any]  # reads the value at a cursor


def parse(path: Path, confined: bool = False) -> Cursor:
    """Read a JSON file whose outermost value is an object.

    confined: whether it can name only files of its own folder. Raises SceneError with the line that
    is not JSON.
    """
    text = text_files.read(path)
    try:
        budget.check(PER_LETTER * len(text), "its JSON", path)
        value = json.loads(text, object_pairs_hook=_object)
    except json.JSONDecodeError as error:
        raise _syntax_error(error, path) from None
    except RecursionError:
        raise SceneError("is nested too deeply", file=path) from None
    except SceneError as error:  # the time is spent
        raise SceneError(str(error), file=path) from None
    except ValueError as error:
        raise SceneError(f"is not JSON: {str(error)[:100]}", file=path) from None
    cursor = Cursor(value, path, text, confined=confined)
    cursor.expect(dict)
    return cursor


def _syntax_error(error: json.JSONDecodeError, path: Path) -> SceneError:
    """Return an error with line and column, and the text around it."""
    lines = error.doc.splitlines()
    line = lines[error.lineno - 1] if error.lineno <= len(lines) else ""
    start = max(0, min(error.colno - 1, len(line)) - QUOTED)
    quoted = line[start : error.colno - 1 + QUOTED].strip()
    where = f" in: {quoted}" if quoted else ""
    message = f"column {error.colno}: is not JSON: {error.msg}{where}"
    return SceneError(message, file=path, line=error.lineno)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any] | DuplicateKey:
    budget.check_time()
    values = dict(pairs)
    if len(values) == len(pairs):
        return values
    keys = [key for key, _ in pairs]
    return DuplicateKey(next(key for i, key in enumerate(keys) if key in keys[:i]))


def _line(text: str, path: tuple[str | int, ...]) -> int:
    """Return the line where the value at `path` begins, in a text that is valid JSON."""
    decoder = json.JSONDecoder()
    at = _skip(text, 0)
    for wanted in path:
        at, count = _skip(text, at + 1), 0
        while True:
            key: str | int = count
            if isinstance(wanted, str):
                key, at = decoder.raw_decode(text, at)
                at = _skip(text, at)
            if key == wanted:
                break
            at, count = _skip(text, decoder.raw_decode(text, at)[1]), count + 1
    return text.count("\n", 0, at) + 1


def _skip(text: str, at: int) -> int:
    match = SKIPPED.match(text, at)
    return match.end() if match else at
