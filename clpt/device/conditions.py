"""Conditions of the preprocessor: the branches of `#if` that a text takes.

A name that the text does not define is 0, as in C, unless compilers or their options may define it.
A condition with such a name is open, and stays for the compiler.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

_COMMENT = re.compile(
    r"""//[^\n]*|/\*.*?(?:\*/|\Z)|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'""", re.DOTALL
)
_DIRECTIVE = re.compile(r"\s*#\s*(\w*)\s*(.*)", re.DOTALL)
_DEFINE = re.compile(r"(\w+(?:\([^)]*\))?)\s*(.*)", re.DOTALL)
_WITHIN = "\0"  # at the end of a row inside a comment
OUTSIDE = re.compile(
    r"_|cl_|CL_|FP_FAST_|NOT_INLINED$"
)  # names that compilers and their options define
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:0[xX][0-9a-fA-F]+|\d+)(?![\w.]))|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<sign>&&|\|\||<<|>>|[<>=!]=|[-+*/%<>!~&|^?:(),]))"
)
_NAME = re.compile(r"[A-Za-z_]")
_DEEPEST = 64  # nested macros

Tokens = tuple[str, ...]
Known = int | None  # None: open

_BINARY: tuple[dict[str, Callable[[int, int], int]], ...] = (  # by rising precedence
    {"|": operator.or_},
    {"^": operator.xor},
    {"&": operator.and_},
    {"==": operator.eq, "!=": operator.ne},
    {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge},
    {"<<": operator.lshift, ">>": operator.rshift},
    {"+": operator.add, "-": operator.sub},
    {"*": operator.mul, "/": lambda a, b: _quotient(a, b), "%": lambda a, b: _remainder(a, b)},
)
_UNARY: dict[str, Callable[[int], int]] = {
    "!": operator.not_, "-": operator.neg, "+": operator.pos, "~": operator.invert,
}  # fmt: skip


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


class Macros:
    """The macros of a text up to a row: defined, undefined, or open."""

    def __init__(self, defines: Mapping[str, str]):
        """Define macros by name, perhaps with arguments, and value."""
        self._values: dict[str, str | None] = {}  # None: a macro with arguments
        self._open: set[str] = set()
        for name, value in defines.items():
            self.define(name, value, sure=True)

    def define(self, head: str, value: str, sure: bool) -> None:
        """Note a `#define`; head: name and arguments; sure: whether no branch around it is open."""
        name, has_arguments, _ = head.partition("(")
        self._note(name, sure)
        self._values[name] = None if has_arguments else value

    def undefine(self, name: str, sure: bool) -> None:
        """Note an `#undef`."""
        self._note(name, sure)
        self._values.pop(name, None)

    def _note(self, name: str, sure: bool) -> None:
        if sure:
            self._open.discard(name)
        else:
            self._open.add(name)

    def value(self, directive: str, condition: str) -> Known:
        """Return the value of a directive's condition, None if it is open."""
        tokens = _condition(directive, condition)
        if tokens is None:
            return None
        expanded: list[str] = []
        self._expand(tokens, expanded, 0)
        return _value(tuple(expanded))

    def _expand(self, tokens: Tokens, expanded: list[str], depth: int) -> None:
        """Append tokens, with names replaced by values; open names stay."""
        remaining = iter(tokens)
        for token in remaining:
            if not _NAME.match(token):
                expanded.append(token)
            elif token == "defined":
                name = next(remaining, "")
                if name == "(":
                    name = next(remaining, "")
                    next(remaining, "")
                expanded.append(self._defined(name))
            elif (value := self._known_value(token)) is None:
                expanded.append(token)
            elif (inner := _tokens(value)) is None or depth == _DEEPEST:
                expanded.append("open")
            else:
                self._expand(inner, expanded, depth + 1)

    def _known_value(self, name: str) -> str | None:
        """Return a macro's value, "0" if undefined; None if it is open or has arguments."""
        if name in self._open:
            return None
        if name in self._values:
            return self._values[name]
        return None if OUTSIDE.match(name) else "0"

    def _defined(self, name: str) -> str:
        if name in self._open:
            return "open"
        if name in self._values:
            return "1"
        return "open" if OUTSIDE.match(name) else "0"


class _Chain:
    """An `#if` with its other branches.

    stays: whether a directive stays because compilers decide; start: its index in the kept rows.
    """

    def __init__(self, lives: bool, sure: bool, start: int):
        self.outer, self.start, self.stays = (lives, sure), start, False
        self._ended = not lives

    def branch(self, row: Row, macros: Macros) -> tuple[bool, Row | None]:
        """Return whether the following rows may be taken, and the directive that replaces it."""
        if self._ended:
            return False, None
        known = macros.value(row.directive, row.argument)
        if known == 0:
            return False, None
        if known is None:
            row = row if self.stays else renamed(row, row.directive.removeprefix("el"))
            self.stays = True
            return True, row
        self._ended = True
        if row.directive == "elif":
            row = Row(row.number, "#else", "#else", row.lines, "else")
        return True, row if self.stays else None


_CONDITIONS = {
    "if": "{}", "ifdef": "defined {}", "ifndef": "!defined {}", "elif": "{}", "else": "1",
}  # fmt: skip
OPENING = ("if", "ifdef", "ifndef")
BRANCHING = (*_CONDITIONS, "endif")


def taken(rows: Iterable[Row | Sequence[Row]], macros: Macros) -> tuple[Row, ...]:
    """Return the rows that conditions keep, and note the macros that they define.

    rows: directives, and groups of other rows. Open conditions stay, without branches that are
    never taken; an open `#if` with empty branches goes. Every `#if` has its end among the rows.
    """
    kept: list[Row] = []
    chains: list[_Chain] = []
    lives = sure = True
    for row in rows:
        if not isinstance(row, Row):
            if lives:
                kept += row
            continue
        directive = row.directive
        if directive == "endif" and chains:
            chain = chains.pop()
            lives, sure = chain.outer
            if all(map(_is_blank, kept[chain.start :])):
                del kept[chain.start :]
            elif chain.stays:
                kept.append(row)
        elif directive in OPENING or (directive in _CONDITIONS and chains):
            if directive in OPENING:
                chains.append(_Chain(lives, sure, len(kept)))
            lives, left = chains[-1].branch(row, macros)
            sure = chains[-1].outer[1] and not chains[-1].stays
            kept += [left] if left else []
        elif lives:
            kept.append(row)
            if directive == "define":
                macros.define(*row.macro, sure)
            elif directive == "undef":
                macros.undefine(row.argument, sure)
    return tuple(kept)


def _is_blank(row: Row) -> bool:
    return row.directive in BRANCHING or not row.text.strip()


@lru_cache(maxsize=4096)
def _condition(directive: str, argument: str) -> Tokens | None:
    return _tokens(_CONDITIONS[directive].format(argument))


@lru_cache(maxsize=4096)
def _tokens(text: str) -> Tokens | None:
    """Return the tokens of an expression; None if a condition cannot contain them."""
    tokens, at, text = [], 0, text.strip()
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            return None
        tokens.append(match[match.lastgroup or 0])
        at = match.end()
    return tuple(tokens)


@lru_cache(maxsize=4096)
def _value(tokens: Tokens) -> Known:
    """Return the value of numbers and open names; None if it is open or invalid."""
    try:
        reader = _Expression(tokens)
        value = reader.choice()
        return value if reader.ended else None
    except (ValueError, ZeroDivisionError, IndexError, OverflowError):
        return None  # the compiler reports it


class _Expression:
    """A recursive descent parser of an expression."""

    def __init__(self, tokens: Tokens):
        self._tokens, self._at = tokens, 0

    @property
    def ended(self) -> bool:
        return self._at == len(self._tokens)

    def choice(self) -> Known:
        """Parse `condition ? a : b`, or an expression without a question mark."""
        condition = self._either()
        if not self._take("?"):
            return condition
        yes = self.choice()
        self._expect(":")
        no = self.choice()
        return None if condition is None else yes if condition else no

    def _either(self) -> Known:
        value = self._both()
        while self._take("||"):
            pair = (value, self._both())
            value = 1 if any(pair) else None if None in pair else 0
        return value

    def _both(self) -> Known:
        value = self._binary(0)
        while self._take("&&"):
            pair = (value, self._binary(0))
            value = 0 if 0 in pair else None if None in pair else 1
        return value

    def _binary(self, level: int) -> Known:
        if level == len(_BINARY):
            return self._unary()
        value = self._binary(level + 1)
        while not self.ended and (apply := _BINARY[level].get(self._tokens[self._at])):
            self._at += 1
            other = self._binary(level + 1)
            value = None if value is None or other is None else int(apply(value, other))
        return value

    def _unary(self) -> Known:
        token = self._tokens[self._at]
        self._at += 1
        if apply := _UNARY.get(token):
            value = self._unary()
            return None if value is None else int(apply(value))
        if token == "(":
            value = self.choice()
            self._expect(")")
            return value
        if token[0].isdigit():
            return int(token, 8 if token.isdigit() and token[0] == "0" else 0)
        if not (token[0].isalpha() or token[0] == "_"):
            raise ValueError(token)
        if self._take("("):  # arguments of an open name, such as __has_builtin
            depth = 1
            while depth:
                depth += {"(": 1, ")": -1}.get(self._tokens[self._at], 0)
                self._at += 1
        return None

    def _take(self, token: str) -> bool:
        matches = not self.ended and self._tokens[self._at] == token
        self._at += matches
        return matches

    def _expect(self, token: str) -> None:
        if not self._take(token):
            raise ValueError(f"no {token}")


def _quotient(a: int, b: int) -> int:
    """Return a / b rounded towards 0, as in C."""
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def _remainder(a: int, b: int) -> int:
    return a - b * _quotient(a, b)
