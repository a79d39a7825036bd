"""Memory traffic: what each stage of a bounce reads and writes of the state of a path.

Counted in the text that the compiler gets, from the loads and stores of clpt/records.py that are
left when its conditions are decided. What stages fetch from the scene's tables and trees depends on
the rays and is not in it: figures are what must move at least.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from clpt.records import SLABS
from clpt.render.codegen import programs
from clpt.render.contract.features import Features
from clpt.render.wavefront import queues

_WORD = 4  # bytes
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_DEFINE = re.compile(r"\s*#\s*define\s+(\w+)(?:\s+(\w+))?\s*$")
_CONDITION = re.compile(r"\s*#\s*(if|ifdef|ifndef|elif|else|endif)\b(.*)")
_CALL = re.compile(r"(?<!\w)(?P<verb>load|store)_(?P<member>\w+)\((?!Slab )")
_QUEUED = {"sort": (0, 1), "append": (0, 1), "shade": (1, 0)}  # words read and written of a queue


@dataclass(frozen=True)
class Moved:
    """Bytes that one item of a stage reads and writes; all branches taken."""

    read: int
    written: int

    @property
    def total(self) -> int:
        return self.read + self.written


def traffic(features: Features, layout: str, *, queued: bool | str = False) -> dict[str, Moved]:
    """Return what a slot's part of each program moves, by the names of `programs.sources`.

    An item is a slot that has work there: in `generate` a path that ends and the one that begins,
    in `intersect` and `shade_...` a ray and its hit, in `shadow` a shadow ray, in `append` and
    `sort` a slot, whose key `sort` reads twice.
    """
    texts = programs.sources(features, layout, 1, queued=queued)
    return {name: _moved(name, source.text, features.mode) for name, source in texts.items()}


def _moved(name: str, text: str, mode: str) -> Moved:
    sizes = {
        f"{record.name.lower()}_{member.name}": member.words
        - (member.type == "spectrum" and mode == "rgb")
        for record in SLABS
        for member in record.members
    }
    words: dict[str, set[str]] = {"load": set(), "store": set()}
    for line in _kept(_COMMENT.sub("", text).splitlines()):
        for call in _CALL.finditer(line):
            if call["member"] in sizes:
                words[call["verb"]].add(call["member"])
    read, written = (sum(sizes[member] for member in words[verb]) for verb in ("load", "store"))
    if name == "sort":
        read *= 2
    if name in queues.WAYS or "#define QUEUED 1\n" in text:
        own = _QUEUED[name.split("_")[0]]
        read, written = read + own[0], written + own[1]
    return Moved(_WORD * read, _WORD * written)


def _kept(lines: list[str]) -> Iterator[str]:
    """The lines that conditions of the preprocessor leave, of such as kernels have."""
    defined: dict[str, str] = {}
    stack: list[tuple[bool, bool]] = []  # whether lines are kept, whether some branch was taken
    for line in lines:
        condition = _CONDITION.match(line)
        if condition is None:
            if all(keeps for keeps, _ in stack):
                if define := _DEFINE.match(line):
                    defined[define[1]] = define[2] or ""
                yield line
            continue
        word, rest = condition[1], condition[2].strip()
        if word.startswith("if"):
            prefix = {"ifdef": "defined ", "ifndef": "! defined "}.get(word, "")
            holds = _holds(prefix + rest, defined)
            stack.append((holds, holds))
        elif word == "endif":
            stack.pop()
        else:
            taken = stack[-1][1]
            holds = not taken and (word == "else" or _holds(rest, defined))
            stack[-1] = (holds, taken or holds)


def _holds(condition: str, defined: dict[str, str]) -> bool:
    """Whether a condition of numbers, names, comparisons and && || ! holds."""
    text = re.sub(r"\bdefined\s*\(?\s*(\w+)\s*\)?", lambda m: str(int(m[1] in defined)), condition)
    text = re.sub(r"\b\w+\(\w+\)", "0", text)  # __has_attribute(...), __has_builtin(...)
    for _ in range(4):  # names that stand for names
        text = re.sub(r"\b[A-Za-z_]\w*\b", lambda m: defined.get(m[0], "0") or "0", text)
    text = text.replace("&&", " and ").replace("||", " or ")
    return bool(eval(re.sub(r"!(?!=)", " not ", text), {"__builtins__": {}}))
