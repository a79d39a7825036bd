"""Macros of features: each field that kernels ask for declares the name of its macro.

A record of features is a frozen dataclass. `flag` and `number` declare fields with macros, `macro`
properties; `macros_of` reads them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

Value = str | int | None  # None: the macro is not defined

_Get = TypeVar("_Get", bound=Callable[..., Any])


def flag(name: str, default: object = False) -> Any:
    """Declare a field whose macro is defined where it is neither False nor 0."""
    return dataclasses.field(default=default, metadata={"macro": (name, True)})


def number(name: str, default: object = 0) -> Any:
    """Declare a field whose macro is defined even where it is 0, but not where it is None."""
    return dataclasses.field(default=default, metadata={"macro": (name, False)})


def macro(name: str, *, of_number: bool = False) -> Callable[[_Get], _Get]:
    """Name the macro of a property, which is defined as that of `flag` or `number` is."""

    def named(get: _Get) -> _Get:
        get.macro = name, not of_number  # type: ignore[attr-defined]
        return get

    return named


def macros_of(record: Any) -> Iterator[tuple[str, Value]]:
    """Yield the macros of a record and of the records in it, each with its value."""
    for field in dataclasses.fields(record):
        value = vars(record)[field.name]
        if "macro" in field.metadata:
            yield _value(field.metadata["macro"], value)
        elif dataclasses.is_dataclass(value) and not isinstance(value, type):
            yield from macros_of(value)
    for member in vars(type(record)).values():
        get = member.fget if isinstance(member, property) else None
        if get is not None and "macro" in vars(get):
            yield _value(vars(get)["macro"], get(record))


def _value(named: tuple[str, bool], value: Value) -> tuple[str, Value]:
    """A macro's name and value; in kernels, true is 1."""
    name, is_flag = named
    absent = not value if is_flag else value is None
    return name, None if absent else int(value) if isinstance(value, bool) else value
