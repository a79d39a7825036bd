"""Rows of kernel text for a preprocessor: with continuations, without comments."""

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
_WITHIN = "\0"  # at the end of a row inside a comment


@dataclass(eq=False, slots=True)  # frozen takes three times as long for ten thousand
class Row:
    """A row, with the rows that a comment or a backslash joins to it.

    number: of the first line; text: all lines; lines: their number; code: the text without
    comments; directive, argument: the words after `#`, "" without `#`; macro: of a `#define`, the
    name with arguments, and the value.
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
    text = match[0]
    if text[0] != "/":
        return text
    return " " + f"{_WITHIN}\n" * text.count("\n")


@lru_cache(maxsize=2048)
def rows_of(text: str, first: int = 1) -> tuple[Row, ...]:
    """Return the rows of a text; first: the number of its first line."""
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
            if row.directive == "define" and (define := _DEFINE.match(row.argument)):
                row.macro = define[1], define[2]
        rows.append(row)
        at = end
    return tuple(rows)


def joined(rows: Sequence[Row]) -> tuple[Row, ...]:
    """Return rows with consecutive rows joined."""
    groups: list[Row] = []
    start = 0
    for at in range(1, len(rows) + 1):
        if at == len(rows) or rows[at].number != rows[at - 1].number + rows[at - 1].lines:
            text = "\n".join([row.text for row in rows[start:at]])
            lines = rows[at - 1].number + rows[at - 1].lines - rows[start].number
            groups.append(Row(rows[start].number, text, text, lines))
            start = at
    return tuple(groups)


@lru_cache(maxsize=512)
def renamed(row: Row, directive: str) -> Row:
    """Return a row with another directive, such as `#if` for `#elif`."""
    text = row.text.replace(row.directive, directive, 1)
    code = row.code.replace(row.directive, directive, 1)
    return replace(row, text=text, code=code, directive=directive)
