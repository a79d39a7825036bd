"""The parameters of a directive: typed values by name, each with its file and line."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.formats.reading import Located

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
