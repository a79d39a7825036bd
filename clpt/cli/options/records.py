"""Options of a command as records: each takes the values of the options that its fields name."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar, cast

Command = TypeVar("Command", bound=Callable[..., Any])
Made = TypeVar("Made")


def with_options(command: Command, options: Sequence[Callable[[Any], Any]]) -> Command:
    """Give a command options, which its help shows in this order."""
    for option in reversed(options):
        command = option(command)
    return command


def with_records(**forms: Callable[..., Any]) -> Callable[[Command], Command]:
    """Let a command take records by these names in the place of the options that they name.

    forms: frozen dataclasses, or functions that make them, see `record_of`. Two records may take
    the same option.
    """
    taken = {name for form in forms.values() for name in _names(form)}

    def decorate(command: Command) -> Command:
        @functools.wraps(command)
        def with_them(**given: Any) -> Any:
            made = {name: record_of(form, given) for name, form in forms.items()}
            rest = {name: value for name, value in given.items() if name not in taken}
            return command(**made, **rest)

        return cast(Command, with_them)

    return decorate


def record_of(form: Callable[..., Made], given: Mapping[str, Any]) -> Made:
    """Return a record of the options that its fields name; a field may be a record of others.

    An option that the command does not have leaves the field's default.
    """
    made: dict[str, Any] = {}
    for name, inner in _fields(form).items():
        if inner is not None:
            made[name] = record_of(inner, given)
        elif name in given:
            made[name] = given[name]
    return form(**made)


def _names(form: Callable[..., Any]) -> Iterator[str]:
    """Yield the names of the options that a record takes."""
    for name, inner in _fields(form).items():
        if inner is not None:
            yield from _names(inner)
        else:
            yield name


def _fields(form: Callable[..., Any]) -> dict[str, Callable[..., Any] | None]:
    """Return the fields of a record by their names, with the record that is the type of each.

    A record is looked up in the form's module; other types may not be imported yet.
    """
    known = vars(sys.modules[form.__module__])
    fields: dict[str, Any] = {}
    for name, parameter in inspect.signature(form).parameters.items():
        found = known.get(parameter.annotation)
        fields[name] = found if dataclasses.is_dataclass(found) else None
    return fields
