"""Kernel files as figures and rules of the house see them: functions and conditions."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

CONDITION = re.compile(r"^\s*#\s*(?:if|ifdef|ifndef|elif)\b", re.MULTILINE)
BEGINNING = re.compile(r"[a-z_][\w\s*]*?(\w+)\s*\(")


@dataclass(frozen=True)
class KernelFunction:
    """A function of a kernel file: its lines, and how many #if, #ifdef and #elif stand in it."""

    name: str
    line: int
    lines: int
    conditions: int


def conditions(text: str) -> int:
    """How many #if, #ifdef, #ifndef and #elif a text has."""
    return len(CONDITION.findall(text))


def functions(path: Path) -> list[KernelFunction]:
    """Return the functions of a file, from the line of the name to the last bracket."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*", _blank, path.read_text(encoding="utf-8"), flags=re.DOTALL)
    functions_: list[KernelFunction] = []
    depth, start, name = 0, 0, ""
    lines = text.split("\n")
    for number, line in enumerate(lines, 1):
        if re.match(r"\s*#", line):
            continue
        if depth == 0 and (begun := BEGINNING.match(line)):
            start, name = number, begun[1]
        depth += line.count("{") - line.count("}")
        if depth == 0 and name and "}" in line:
            inside = conditions("\n".join(lines[start - 1 : number]))
            functions_.append(KernelFunction(name, start, number - start + 1, inside))
            name = ""
    return functions_


def _blank(comment: re.Match[str]) -> str:
    """Only the ends of lines of a comment: what follows keeps its line."""
    return "\n" * comment[0].count("\n")
