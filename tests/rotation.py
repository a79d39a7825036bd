"""Products of test cases, of which quick tests run a part and slow tests the rest."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import pytest


def rotating(
    names: str,
    first: Sequence[Any],
    *others: Sequence[Any],
    turn: Callable[[Any], Any] | int = 0,
) -> Any:
    """Parametrize a test over a product; each of `first` is quick with one combination of `others`.

    Combinations take turns along `first`; what is not quick is marked slow. turn: the combination
    that the first case begins with, or a function that names the combination of a case.
    """
    combinations = list(itertools.product(*others))
    cases = []
    for i, value in enumerate(first):
        chosen = (turn(value) if callable(turn) else i + turn) % len(combinations)
        for k, combination in enumerate(combinations):
            label = "-".join(str(getattr(v, "kind", v)) for v in (value, *combination))
            marks = () if k == chosen else pytest.mark.slow
            cases.append(pytest.param(value, *combination, marks=marks, id=label))
    return pytest.mark.parametrize(names, cases)
