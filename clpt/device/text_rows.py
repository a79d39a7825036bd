"""Rows of kernel text as a preprocessor takes them: with their continuations, without comments."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

_COMMENT = re.compile(
    r"""//[^\n]*|/\*.*?(?:\*/|\Z)|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'""", re.DOTALL
)
_DIRECTIVE = re.compile(r"\s*#\s*(\w*)\s*(.*)", re.DOTALL)
_DEFINE = re.compile(r"(\w+(?:\([^)]*\))?)\s*(.*)", re.DOTALL)
_WITHIN = "\0"  # ends a row whose comment goes on


@dataclass(eq=False, slots=True)  # not frozen, which takes thrice as long: there are ten thousand
class Row:
    """A row, and those that a comment or a backslash at its end joins to it.

    number: of its first line; text: its lines as they stand; lines: how many; code: the text
    without comments; directive, argument: what stands behind `#`, "" where there is none; macro:
    the name of a `#define` with its arguments, and the value.
    """

    number: int
    text: str
    code: str
    lines: int = 1
    directive: str = ""
    argument: str = ""
    macro: tuple[str, str] = ("", "")

    @property
    def is_comment(self) -> bool:
        return not self.code.strip() and bool(self.text.strip())


def _spaces(match: re.Match[str]) -> str:
    found = match[0]
    if found[0] != "/":
        return found
    return " " + f"{_WITHIN}\n" * found.count("\n")


@lru_cache(maxsize=2048)
def rows_of(text: str, first: int = 1) -> tuple[Row, ...]:
    """Return the rows of a text, most of which are in many programs; first: its first number."""
    text = text.replace("\r\n", "\n").removesuffix("\n")
    plain = text.split("\n") if text else []
    codes = _COMMENT.sub(_spaces, text).split("\n") if "/" in text else plain
    rows: list[Row] = []
    at = 0
    while at < len(plain):
        end, code = at + 1, codes[at]
        while end < len(plain) and codes[end - 1].endswith((_WITHIN, "\\")):
            end += 1
        if end == at + 1:
            row = Row(first + at, plain[at], code)
        else:
            code = "\n".join(codes[at:end]).replace(_WITHIN, "")
            row = Row(first + at, "\n".join(plain[at:end]), code, end - at)
        if "#" in code and (match := _DIRECTIVE.match(code)):
            row.directive = match[1] or "#"
            row.argument = match[2].replace("\\\n", " ").strip()
            if row.directive == "define" and (told := _DEFINE.match(row.argument)):
                row.macro = told[1], told[2]
        rows.append(row)
        at = end
    return tuple(rows)


def joined(rows: Sequence[Row]) -> tuple[Row, ...]:
    """Return rows that follow one another as one."""
    found: list[Row] = []
    start = 0
    for at in range(1, len(rows) + 1):
        if at == len(rows) or rows[at].number != rows[at - 1].number + rows[at - 1].lines:
            text = "\n".join([row.text for row in rows[start:at]])
            lines = rows[at - 1].number + rows[at - 1].lines - rows[start].number
            found.append(Row(rows[start].number, text, text, lines))
            start = at
    return tuple(found)


@lru_cache(maxsize=512)
def renamed(row: Row, directive: str) -> Row:
    """Return a directive's row with another one in its place, such as `#if` for `#elif`."""
    text = row.text.replace(row.directive, directive, 1)
    code = row.code.replace(row.directive, directive, 1)
    return replace(row, text=text, code=code, directive=directive)
