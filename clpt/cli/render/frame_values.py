"""A frame's number and time in names of files and values of variables."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click

from clpt.files import output_files

MOST_FRAMES = 10**6
DIGITS = 4  # of a frame's number in a name that says nothing else

_NUMBER = re.compile(r"#+|%0?(\d?)d")
_BRACES = re.compile(r"\{([^{}]*)\}")
_FORM = re.compile(r"0?\d{0,2}(\.\d{1,2})?[defg]?")
_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv, ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod,
    ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip


class Frames(click.ParamType):
    """FIRST:LAST or FIRST:LAST:STEP, both included, or one number; returned as a range."""

    name = "FIRST:LAST"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> range:
        found = re.fullmatch(r"(\d{1,9})(?::(\d{1,9}))?(?::(\d{1,9}))?", str(value).strip())
        if not found:
            self.fail(f"{value!r} does not look like 1:240, 1:240:2 or 7", param, ctx)
        first, last, step = int(found[1]), int(found[2] or found[1]), int(found[3] or 1)
        if last < first or not step:
            self.fail(f"{value!r} has no frames", param, ctx)
        frames = range(first, last + 1, step)
        if len(frames) > MOST_FRAMES:
            self.fail(f"{value!r} are more than {MOST_FRAMES} frames", param, ctx)
        return frames


def has_number(path: Path) -> bool:
    """Whether a name has a place for a frame's number: #### or %04d."""
    return _NUMBER.search(path.name) is not None


def numbered(path: Path, frame: int) -> Path:
    """Return the name of a frame's file: #### or %04d is its number, or else it gets one."""
    if not has_number(path):
        return output_files.beside(path, f".{frame:0{DIGITS}}{path.suffix}")

    def number(found: re.Match[str]) -> str:
        digits = len(found[0]) if found[0][0] == "#" else int(found[1] or 1)
        return f"{frame:0{digits}}"

    return path.with_name(_NUMBER.sub(number, path.name))


def varies(variables: Mapping[str, str]) -> bool:
    """Whether a value has an expression in braces."""
    return any(_BRACES.search(value) for value in variables.values())


def expanded(variables: Mapping[str, str], frame: int, fps: float) -> dict[str, str]:
    """Return the values of a frame's variables.

    What stands in braces is arithmetic of numbers, `frame` and `time`, which is frame / fps [s],
    by + - * / // % and parentheses; behind a colon the form of the number, as in {frame:04}.

    Raises click.BadParameter.
    """
    names = {"frame": frame, "time": frame / fps}

    def value(found: re.Match[str]) -> str:
        text, _, form = found[1].partition(":")
        try:
            if not _FORM.fullmatch(form):
                raise ValueError(f"{form!r} is no form of a number")
            return format(_computed(ast.parse(text.strip(), mode="eval").body, names), form)
        except (SyntaxError, ValueError, ArithmeticError, RecursionError, MemoryError) as error:
            why = "it is no arithmetic" if isinstance(error, SyntaxError) else error
            raise click.BadParameter(f"{found[0]}: {why}", param_hint="-D") from error

    return {name: _BRACES.sub(value, text) for name, text in variables.items()}


def _computed(node: ast.expr, names: Mapping[str, float]) -> float:
    """The value of an expression. Raises ValueError for what is more than arithmetic."""
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return node.value
    if isinstance(node, ast.Name):
        if node.id not in names:
            raise ValueError(f"there is no {node.id!r}; known: {', '.join(names)}")
        return names[node.id]
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
        return _OPERATORS[type(node.op)](_computed(node.operand, names))
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
        sides = _computed(node.left, names), _computed(node.right, names)
        return _OPERATORS[type(node.op)](*sides)
    raise ValueError("only numbers, frame, time, + - * / // % and parentheses are known")
