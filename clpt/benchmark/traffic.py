"""Memory traffic: what each stage of a bounce reads and writes of the state of a path.

Counted in the text that the compiler gets: the loads and stores of the slabs of clpt/records.py
that the text's conditions leave. What a stage fetches from the scene's tables and trees depends on
the rays and is not counted: a figure is the least that must move.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from clpt.records import SLABS
from clpt.render.codegen import blocks, programs
from clpt.render.contract.features import Features

_WORD = 4  # bytes
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_DEFINE = re.compile(r"\s*#\s*define\s+(\w+)(?:\s+(\w+))?\s*$")
_CONDITION = re.compile(r"\s*#\s*(if|ifdef|ifndef|elif|else|endif)\b(.*)")
_TERM = re.compile(
    r"(?P<not>!)?\s*(?:(?P<defined>defined)\s*\(?\s*)?(?P<left>\w+)(?P<asked>\(\w+\))?\)?"
    r"(?:\s*(?P<compare>==|>)\s*(?P<right>\w+))?"
)
_COMPARE = {"==": operator.eq, ">": operator.gt}
_CALL = re.compile(r"(?<!\w)(?P<verb>load|store)_(?P<member>\w+)\((?!Slab )")
_QUEUED = {"append": (0, 1), "shade": (1, 0)}  # words read and written of a queue


@dataclass(frozen=True)
class Moved:
    """Bytes that one item of a stage reads and writes; all branches taken."""

    read: int
    written: int

    @property
    def total(self) -> int:
        return self.read + self.written


def traffic(features: Features, layout: str, *, queued: bool = False) -> dict[str, Moved]:
    """Return what a slot's part of each program moves, by the names of `programs.sources`.

    An item is a slot that has work there: in `generate` a path that ends and the one that begins,
    in `intersect` and `shade_...` a ray and its hit, in `shadow` a shadow ray, in `append` a slot.
    """
    texts = programs.sources(features, layout, 1, queued=queued)
    unused = blocks.unused(features)
    sizes = {
        f"{record.name.lower()}_{member.name}": member.words
        - (member.type == "spectrum" and not features.spectra.spectral)
        for record in SLABS
        for member in record.members
        if member.name not in unused
    }
    return {name: _moved(name, source.text, sizes) for name, source in texts.items()}


def _moved(name: str, text: str, sizes: Mapping[str, int]) -> Moved:
    """What an item moves; sizes: in words, of the members of slabs."""
    words: dict[str, set[str]] = {"load": set(), "store": set()}
    for line in kept_lines(text):
        for call in _CALL.finditer(line):
            if call["member"] in sizes:
                words[call["verb"]].add(call["member"])
    read, written = (sum(sizes[member] for member in words[verb]) for verb in ("load", "store"))
    if name == "append" or "#define QUEUED 1\n" in text:
        own = _QUEUED[name.split("_")[0]]
        read, written = read + own[0], written + own[1]
    return Moved(_WORD * read, _WORD * written)


def kept_lines(text: str) -> Iterator[str]:
    """Return the lines of a program, without comments, that its conditions leave."""
    defined: dict[str, str] = {}
    stack: list[tuple[bool, bool]] = []  # whether lines are kept, whether some branch was taken
    for line in _COMMENT.sub("", text).splitlines():
        condition = _CONDITION.match(line)
        if condition is None:
            if all(keeps for keeps, _ in stack):
                if define := _DEFINE.match(line):
                    defined[define[1]] = define[2] or ""
                yield line
            continue
        word, rest = condition[1], condition[2].strip()
        if word.startswith("if"):
            prefix = {"ifdef": "defined ", "ifndef": "!defined "}.get(word, "")
            holds = _holds(prefix + rest, defined)
            stack.append((holds, holds))
        elif word == "endif":
            stack.pop()
        else:
            taken = stack[-1][1]
            holds = not taken and (word == "else" or _holds(rest, defined))
            stack[-1] = (holds, taken or holds)


def _holds(condition: str, defined: Mapping[str, str]) -> bool:
    """Whether a condition holds: terms that are joined by &&, and these by ||.

    Raises ValueError for one of another form.
    """
    alternatives = [part.split("&&") for part in condition.split("||")]
    return any(all(_term(term.strip(), defined) for term in terms) for terms in alternatives)


def _term(term: str, defined: Mapping[str, str]) -> bool:
    """Whether a term holds: [!]NAME, [!]defined(NAME), or two names or numbers that are compared.

    What only compilers know, as __has_attribute(NAME), does not hold.
    """
    found = _TERM.fullmatch(term)
    if found is None:
        raise ValueError(f"the condition {term!r} is not of ! defined == > and names")
    if found["defined"]:
        holds = found["left"] in defined
    elif found["compare"]:
        left, right = (_number(found[side], defined) for side in ("left", "right"))
        holds = _COMPARE[found["compare"]](left, right)
    else:
        holds = not found["asked"] and _number(found["left"], defined) != 0
    return holds != bool(found["not"])


def _number(name: str, defined: Mapping[str, str]) -> int:
    """The number that a name stands for; 0 where it stands for nothing."""
    for _ in range(4):  # names that stand for names
        name = defined.get(name, name)
    return int(name) if name.isdigit() else 0
