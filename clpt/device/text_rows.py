"""Rows of kernel text as a preprocessor takes them: with their continuations, without comments."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import lru_cache

_COMMENT = re.compile(
    r"""//[^\n]*|/\*.*?(?:\*/|\Z)|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'""", re.DOTALL
)
_DIRECTIVE = re.compile(r"\s*#\s*(\w*)\s*(.*)", re.DOTALL)
_DEFINE = re.compile(r"(\w+(?:\([^)]*\))?)\s*(.*)", re.DOTALL)
_WITHIN = "\0"  # ends a row whose comment goes on


@dataclass(eq=False, slots=True)  # not frozen: there are ten thousand, and that takes thrice as long
class Row:
    """A row, and those that a comment or a backslash at its end joins to it.

    number: of its first line; text: its lines as they stand; code: the same without comments.
    directive, argument: what stands behind `#`, "" where there is none.
    """

    number: int
    text: str
    code: str
    directive: str = ""
    argument: str = ""

    @property
    def lines(self) -> int:
        return self.text.count("\n") + 1

    @property
    def is_comment(self) -> bool:
        return not self.code.strip() and bool(self.text.strip())

    def defined(self) -> tuple[str, str]:
        """Return the name of a `#define`, with its arguments, and the value."""
        match = _DEFINE.match(self.argument)
        return (match[1], match[2].strip()) if match else ("", "")


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
        end = at
        while end + 1 < len(plain) and codes[end].endswith((_WITHIN, "\\")):
            end += 1
        if end == at:
            raw, code = plain[at], codes[at]
        else:
            raw = "\n".join(plain[at : end + 1])
            code = "\n".join(codes[at : end + 1]).replace(_WITHIN, "")
        rows.append(_row(first + at, raw, code))
        at = end + 1
    return tuple(rows)


def _row(number: int, text: str, code: str) -> Row:
    match = _DIRECTIVE.match(code) if "#" in code else None
    if match is None:
        return Row(number, text, code)
    return Row(number, text, code, match[1] or "#", match[2].replace("\\\n", " ").strip())


@lru_cache(maxsize=512)
def renamed(row: Row, directive: str) -> Row:
    """Return a directive's row with another one in its place, such as `#if` for `#elif`."""
    text = row.text.replace(row.directive, directive, 1)
    code = row.code.replace(row.directive, directive, 1)
    return replace(row, text=text, code=code, directive=directive)

