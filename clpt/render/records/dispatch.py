"""Dispatch in lanes: OpenCL text that serves each kind in the lanes of that kind.

Lanes may differ in their kind, so a `switch` cannot choose. A case is skipped where no lane has its
kind; else all lanes compute it, and a mask chooses which of them keep it. A lane without the kind
must still read valid memory: `active` gives it index 0.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from clpt.records.layout import select_name


@dataclass(frozen=True)
class Case:
    """A value for some lanes.

    test: the mask of these lanes; "": all. value: an expression that may use the mask as `m`.
    before: statements that the value needs.
    """

    test: str
    value: str
    before: tuple[str, ...] = ()

    @property
    def in_all_lanes(self) -> bool:
        """Whether it needs no mask."""
        return not self.test and not re.search(r"\bm\b", " ".join((self.value, *self.before)))


@dataclass(frozen=True)
class Function:
    """A function whose value is that of the last case that holds, in every lane.

    signature: type, name and parameters; otherwise: the value where no case holds; before:
    statements that the cases need; result: the returned expression of `value`.
    """

    signature: str
    otherwise: str
    cases: Iterable[Case]
    before: tuple[str, ...] = ()
    result: str = "value"

    def text(self) -> str:
        """Return the definition."""
        type_, cases = self.signature.split()[0], [*self.cases]
        body = [*self.before, f"{type_} value = {self.otherwise};"]
        if all(case.in_all_lanes for case in cases) and len(cases) < 2:
            before, value = (cases[0].before, cases[0].value) if cases else ((), self.otherwise)
            value = re.sub(r"\bvalue\b", value, self.result)
            return function(self.signature, *self.before, *before, f"return {value};")
        body += choose("value", type_, *cases)
        return function(self.signature, *body, f"return {self.result};")


def active(index: str) -> str:
    """Return the expression for `index` in the lanes of the mask `m`, 0 in the others."""
    return f"sel_i(m, {index}, (integer)(0))"


def choose(target: str, type_: str, *cases: Case) -> list[str]:
    """Return statements that set `target` of a type in the lanes of each case."""
    rows = []
    for case in cases:
        chosen = f"{target} = {select_name(type_)}(m, {case.value}, {target});"
        rows += masked(case.test, *case.before, chosen)
    return rows


def masked(test: str, *body: str) -> list[str]:
    """Return statements that run `body` if a lane has the mask `test`, `m` there; "": always."""
    if not test:
        return ["{", *indented("mask m = (integer)(-1);", *body), "}"]
    return [
        "{",
        *indented(f"mask m = {test};", "if (any(m)) {", *indented(*body), "}"),
        "}",
    ]


def function(signature: str, *body: str, how: str = "inline") -> str:
    """Return a definition with these statements; how: "inline" or "called", see core/lanes.cl."""
    return "\n".join([f"{how} {signature}", "{", *indented(*body), "}", ""])


def indented(*rows: str) -> list[str]:
    """Return rows four columns further to the right."""
    return [f"    {row}" for row in rows]
