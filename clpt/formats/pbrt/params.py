"""The words of a PBRT file, and the parameters of a directive: typed values by name.

Words are directives, strings, and runs of numbers, which may be long. A file is kept as bytes and
scanned once. The numbers between brackets, nearly all of a large file, are parsed at once. Each
parameter knows its file and line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError, did_you_mean
from clpt.files import budget, input_files
from clpt.formats.reading import Located, read_bytes

SIZES = {  # how many numbers a value of a type has
    "integer": 1, "float": 1, "blackbody": 1, "point2": 2, "vector2": 2, "point3": 3,
    "vector3": 3, "normal": 3, "rgb": 3,
}  # fmt: skip
ALIASES = {"point": "point3", "vector": "vector3", "normal3": "normal"}
TEXTS = ("string", "texture")
TYPES = (*SIZES, *ALIASES, *TEXTS, "bool", "spectrum")
LARGEST_INTEGER = 2**31 - 1


@dataclass(eq=False)
class Parameter(Located):
    """A `"type name" [values]`; `values` are float64 numbers, texts, or truths."""

    type: str
    name: str
    values: NDArray[np.float64] | list[str] | list[bool]
    file: Path
    line: int
    where: str = ""
    used: bool = False

    def location(self) -> dict[str, Any]:
        return {"file": self.file, "line": self.line, "where": f"{self.where}: {self.name!r}"}

    @property
    def is_text(self) -> bool:
        """Whether the values are strings: a file's or a spectrum's name, for instance."""
        return isinstance(self.values, list) and all(isinstance(v, str) for v in self.values)

    def text(self) -> str:
        """Return the single string."""
        if not self.is_text or len(self.values) != 1:
            raise self.error("must be one string in quotes")
        return str(self.values[0])

    def texts(self) -> list[str]:
        """Return all strings."""
        if not self.is_text:
            raise self.error("must be strings in quotes")
        return [str(value) for value in self.values]

    def truth(self) -> bool:
        """Return the single true or false; older files quote it."""
        value = self.values[0] if len(self.values) == 1 else None
        if isinstance(value, str) and value in ("true", "false"):
            return value == "true"
        if not isinstance(value, bool):
            raise self.error("must be true or false")
        return value

    def numbers(self, count: int = 0) -> list[float]:
        """Return finite numbers, `count` of them unless that is 0."""
        values = self.array()
        if count and len(values) != count:
            raise self.error(f"must be {count} numbers, not {len(values)}")
        return [float(value) for value in values]

    def array(self) -> NDArray[np.float64]:
        """Return finite numbers (n,)."""
        if not isinstance(self.values, np.ndarray):
            raise self.error("must be numbers")
        if not np.isfinite(self.values).all():
            raise self.error("must be finite numbers")
        return self.values

    def whole(self) -> NDArray[np.int64]:
        """Return whole numbers (n,) of 32 bits."""
        values = self.array()
        if (np.abs(values) > LARGEST_INTEGER).any() or (values != np.floor(values)).any():
            raise self.error("must be whole numbers of 32 bits")
        return values.astype(np.int64)

    def rows(self) -> Any:
        """Return all values: (n,) or (n, 2) or (n, 3) as the type has it, or a list of texts."""
        if self.type in TEXTS or self.is_text:
            return self.texts()
        if self.type == "bool":
            return [bool(value) for value in self.values]
        values = self.whole() if self.type == "integer" else self.array()
        size = SIZES.get(self.type, 1)
        if len(values) % size:
            raise self.error(f"has {len(values)} numbers, which is no multiple of {size}")
        return values if size == 1 else values.reshape(-1, size)


@dataclass(eq=False)
class Parameters(Located):
    """All parameters of a directive; `unused` has those that nothing has read.

    `label` names the directive for messages: `Shape "sphere"`. `defaults` are those that an
    `Attribute` directive gave for the target; they count where the directive has none of that name,
    and may stay unused.
    """

    label: str
    file: Path
    line: int
    given: list[Parameter] = field(default_factory=list)
    defaults: tuple[Parameter, ...] = ()

    def __post_init__(self) -> None:
        self._named = {parameter.name: parameter for parameter in self.defaults}
        self._asked: set[str] = set()
        self._named |= {parameter.name: parameter for parameter in self.given}

    def location(self) -> dict[str, Any]:
        return {"file": self.file, "line": self.line, "where": self.label}

    def __contains__(self, name: str) -> bool:
        return name in self._named

    def find(self, name: str, *types: str) -> Parameter | None:
        """Take a parameter of any of the types, None without it; an integer counts as a float.

        Raises SceneError for another type.
        """
        self._asked.add(name)
        parameter = self._named.get(name)
        if parameter is None:
            return None
        parameter.used = True
        as_float = parameter.type == "integer" and "float" in types
        if types and parameter.type not in types and not as_float:
            raise parameter.error(f"must be of the type {' or '.join(types)}, not {parameter.type}")
        return parameter

    def one(self, name: str, type: str, default: object) -> Any:
        """Take a single value, or `default`: a float, int, bool, str, or an array (2,) or (3,)."""
        parameter = self.find(name, type)
        if parameter is None:
            return default
        if type == "bool":
            return parameter.truth()
        if type in TEXTS:
            return parameter.text()
        size = SIZES[type]
        if type == "integer":
            whole = parameter.whole()
            if len(whole) != 1:
                raise parameter.error(f"must be one whole number, not {len(whole)}")
            return int(whole[0])
        values = parameter.numbers(size)
        return values[0] if size == 1 else np.array(values)

    def several(self, name: str, type: str) -> Any:
        """Take all values, or None: (n,), (n, 2) or (n, 3) as the type has it, or a list of str."""
        parameter = self.find(name, type)
        return None if parameter is None else parameter.rows()

    def choice(self, name: str, default: str, choices: Iterable[str]) -> str:
        """Take a string among `choices`."""
        value = self.one(name, "string", default)
        if value not in choices:
            source: Located = self._named.get(name, self)
            raise source.error(f"{value[:40]!r} is none of {', '.join(choices)}")
        return str(value)

    def above_zero(self, name: str, default: float) -> float:
        """Take a number that must be positive."""
        value = float(self.one(name, "float", default))
        if not 0.0 < value < math.inf:
            raise self._named[name].error(f"must be positive, not {value:g}")
        return value

    def ignore(self, *names: str) -> None:
        """Take parameters that change no picture."""
        for name in names:
            self.find(name)

    def unused(self) -> list[Parameter]:
        """The directive's own parameters that nothing asked for."""
        return [parameter for parameter in self.given if not parameter.used]

    @property
    def asked(self) -> set[str]:
        """The names that something asked for."""
        return self._asked


WORD = re.compile(rb'(?:[ \t\r\n]+|#[^\n]*)*("[^"\n]*"|[\[\]]|[^ \t\r\n\[\]"#]+)?')
OLD_TYPES = ("color", "xyz")
COMMA = re.compile(rb'("[^"\n]*")|,')
UPGRADE = "PBRT version 3's; convert the file by pbrt-v4's --upgrade"


class Lexer:
    """The words of a file, in order; `line` is the line of the word last taken.

    Raises SceneError with the file and line for an invalid word.
    """

    def __init__(self, path: Path, outer: Lexer | None = None):
        self.path, self.data = path, input_files.plain(read_bytes(path))
        self.outer = outer  # of the file that includes this one, behind the name of this one
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
        """Take the parameters that follow a directive; `where` is its name for messages.

        At the end of an included file they go on behind its Include, as in pbrt, whose tokens come
        from a stack of files (pbrt-v4: src/pbrt/parser.cpp, nextToken).
        """
        parameters: list[Parameter] = []
        while self.peek().startswith(b'"'):
            parameters.append(self._parameter(where))
        if self.outer is not None and not self.peek():
            parameters += self.outer.parameters(where)
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
