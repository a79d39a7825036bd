"""The table of commands: checks that hold for every command in it."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from clpt.view.messages import (
    COMMANDS,
    Choice,
    CommandError,
    Flag,
    Name,
    Number,
    Optional,
    Type,
    Value,
    Whole,
    parse,
)
from clpt.view.session import Session

PARAMETERS = [(name, key) for name, one in COMMANDS.items() for key in one.parameters]


def valid(kind: Type) -> Any:
    """Return a value that a type takes."""
    if isinstance(kind, Number):
        return (kind.low + kind.high) / 2
    if isinstance(kind, Whole):
        return kind.low
    if isinstance(kind, Choice):
        return kind.names[0]
    return {Flag: True, Name: "a-word", Value: [1, {"b": 2.5}], Optional: None}[type(kind)]


def invalid(kind: Type) -> list[Any]:
    """Return values that a type refuses."""
    if isinstance(kind, Optional):
        return [value for value in invalid(kind.type) if value is not None]
    deep: Any = 0.0
    for _ in range(30):
        deep = [deep]
    wrong: dict[type, list[Any]] = {
        Number: ["1", True, None, [], {}, math.nan, math.inf, 1e308, 10**400],
        Whole: ["1", True, None, 0.5, -(2**70), 2**70, [0]],
        Choice: ["", "nothing", None, 0, ["none"], "a" * 50],
        Flag: [0, 1, "true", None],
        Name: ["", "a/b", "..", ".a", "a b", "-a", "a" * 41, "a\n", "é", "a\0", None, 1, "C:"],
        Value: [deep, 1e308, [10**400], [0] * 10_000, {"a": math.nan}],
    }
    return wrong[type(kind)]


def message(name: str, /, **changed: Any) -> str:
    values = {key: valid(kind) for key, kind in COMMANDS[name].parameters.items()}
    return json.dumps({"do": name, **values, **changed})


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_is_taken_and_somebody_does_it(name: str) -> None:
    request = parse(message(name))
    assert request.name == name and request.values.keys() == COMMANDS[name].parameters.keys()
    assert COMMANDS[name].doc
    assert name in ("shown", "steer", "invite") or hasattr(Session, f"_do_{name}")


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("key", ["other", "do_", "__class__", ""])
def test_an_unknown_key_is_refused(name: str, key: str) -> None:
    with pytest.raises(CommandError, match="has no parameter"):
        parse(message(name, **{key: 1}))


@pytest.mark.parametrize(("name", "key"), PARAMETERS)
def test_values_out_of_range_are_refused(name: str, key: str) -> None:
    kind = COMMANDS[name].parameters[key]
    for value in invalid(kind):
        with pytest.raises(CommandError):
            parse(message(name, **{key: value}))


@pytest.mark.parametrize(("name", "key"), PARAMETERS)
def test_what_is_missing_is_refused_unless_it_is_optional(name: str, key: str) -> None:
    values = json.loads(message(name))
    del values[key]
    if isinstance(COMMANDS[name].parameters[key], Optional):
        assert parse(json.dumps(values)).values[key] is None
    else:
        with pytest.raises(CommandError, match=f"needs {key}"):
            parse(json.dumps(values))


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "null", "1", '"orbit"', "{}", '{"do": 1}', '{"do": null}', '{"do": "nothing"}',
     '{"do": "__init__"}', '{"do": "_do_orbit"}', "[" * 60_000, "x" * 65_537,
     '{"do": "dolly", "by": NaN}', '{"do": "dolly", "by": Infinity}', b"{}"],
)  # fmt: skip
def test_what_is_no_command(text: str | bytes) -> None:
    with pytest.raises(CommandError):
        parse(text)
