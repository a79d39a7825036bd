"""Definitions of a kernel text and the names that each uses, to leave out unused definitions.

A definition is a function, a type, a constant or a macro. Kernels, pragmas and unrecognised rows
stay, with all definitions that they use.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import cached_property, lru_cache

from .conditions import BRANCHING, OPENING, Row, joined, rows_of

_WORD = re.compile(r"[A-Za-z_]\w*")
_PASTED_MEMBER = re.compile(r"->(\w*)\s*##\s*(\w*)")
_PASTED = re.compile(r"(?<![.\w])(?<!->)(\w*)\s*##\s*(\w*)")  # without members
_FUNCTION = re.compile(  # types, a name, flat arguments, perhaps a body
    r"\s*(?:[A-Za-z_]\w*[\s*]+)+?(?P<name>[A-Za-z_]\w*)\s*\([^()]*\)\s*(?:\{.*\}|;)\s*\Z", re.DOTALL
)
_TYPE = re.compile(r"\s*typedef\b[^()]*?(?P<name>[A-Za-z_]\w*)\s*;\s*\Z", re.DOTALL)
_MACRO_TYPE = re.compile(r"\s*typedef\s+\w+\([^()]*\)\s+(?P<name>[A-Za-z_]\w*)\s*;\s*\Z")
_CONSTANT = re.compile(
    r"\s*(?:static\s+)?(?:constant|__constant)\b[^=;\[\](){}]*?(?P<name>[A-Za-z_]\w*)\s*"
    r"(?:\[[^\]]*\]\s*)*=[^;]*;\s*\Z",
    re.DOTALL,
)
_IN_MEMORY = re.compile(  # a struct of words: `Record.uniform_text`
    r"typedef struct \{\n(?:    (?:int|uint|float) \w+(?:\[\d+\])?; *\n)+\} \w+;"
)
_MEMBER = re.compile(r"    \w+ (?P<name>\w+)(?:\[(?P<size>\d+)\])?;")
_KERNEL = re.compile(r"\b(?:__)?kernel\b")


@dataclass(eq=False)
class Definition:
    """Rows of a text that stay or go together.

    names: the defined names; empty for rows that always stay.
    """

    rows: Sequence[Row]
    names: frozenset[str]

    @cached_property
    def words(self) -> frozenset[str]:
        """All names in the rows."""
        return frozenset(_WORD.findall("\n".join([row.code for row in self.rows])))

    @cached_property
    def pasted(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Prefixes and suffixes of names that macros of the rows paste together."""
        beginnings, endings = set[str](), set[str]()
        for row in self.rows:
            if "##" in row.code:
                arguments = {"", *_WORD.findall(row.macro[0])}
                for begin, end in _PASTED.findall(row.code):
                    beginnings |= {begin} - arguments
                    endings |= {end} - arguments
        return tuple(beginnings), tuple(endings)

    @cached_property
    def printed(self) -> tuple[Row, ...]:
        """The rows, with consecutive rows joined."""
        return joined(self.rows)


@dataclass(frozen=True, eq=False)
class Paragraph:
    """Definitions without a blank row between them, and the comments in front of them.

    apart: whether a blank row precedes the paragraph.
    """

    comments: tuple[Row, ...]
    definitions: tuple[Definition, ...]
    apart: bool

    def left(self, stay: Mapping[Definition, Sequence[Row]]) -> tuple[list[Row], bool]:
        """Return the paragraph's remaining rows, and whether it is apart.

        stay: the rows of definitions that stay.
        """
        rows = [row for definition in self.definitions for row in stay.get(definition, ())]
        return [*self.comments, *rows] if rows else [], self.apart


@lru_cache(maxsize=2048)
def paragraphs(rows: tuple[Row, ...]) -> tuple[Paragraph, ...]:
    """Return the paragraphs of rows between two includes, without isolated comments."""
    result: list[Paragraph] = []
    comments: list[Row] = []
    definitions: list[Definition] = []
    apart, at = False, 0
    while at < len(rows):
        if rows[at].code.strip():
            definition, at = _definition(rows, at)
            definitions.append(definition)
            continue
        if definitions:
            result.append(Paragraph(tuple(comments), tuple(definitions), apart))
            comments, definitions, apart = [], [], False
        if rows[at].text.strip():
            comments.append(rows[at])
        elif not comments:
            apart = True
        at += 1
    if definitions:
        result.append(Paragraph(tuple(comments), tuple(definitions), apart))
    return tuple(result)


@lru_cache(maxsize=2048)
def whole(rows: tuple[Row, ...]) -> tuple[Paragraph, ...]:
    """Return rows as a single paragraph that stays whole."""
    return (Paragraph((), (Definition(rows, frozenset()),), False),) if rows else ()


def macro(head: str, value: str) -> Definition:
    """Return the definition of a macro; head: name and arguments."""
    return _definition(rows_of(f"#define {head} {value}"), 0)[0]


def _definition(rows: Sequence[Row], at: int) -> tuple[Definition, int]:
    """Return the definition that begins at a row, and the number of the next row."""
    first = rows[at]
    if first.directive in OPENING:
        return _open_conditional(rows, at)
    if first.directive:
        names: frozenset[str] = frozenset()
        if first.directive in ("define", "undef"):
            names = frozenset(_WORD.findall(first.argument)[:1])
        return Definition((first,), names), at + 1
    end = _end(rows, at)
    body = rows[at:end]
    return Definition(body, _name("\n".join(row.code for row in body))), end


def _end(rows: Sequence[Row], at: int) -> int:
    """Return the row after a definition: brackets are closed, and the last sign is ; or }."""
    depth, before = 0, []
    for number in range(at, len(rows)):
        row = rows[number]
        if row.directive:
            if row.directive in OPENING:
                before.append(depth)
            elif row.directive == "endif" and before:
                before.pop()
            elif row.directive in BRANCHING and before:
                depth = before[-1]
            continue
        code = row.code
        depth += code.count("{") + code.count("(") - code.count("}") - code.count(")")
        if depth <= 0 and not before and code.rstrip().endswith((";", "}")):
            return number + 1
    return len(rows)


def _open_conditional(rows: Sequence[Row], at: int) -> tuple[Definition, int]:
    """Return an open `#if` to its `#endif` as a single definition of all its names."""
    depth, end = 0, at
    while end < len(rows):
        depth += (rows[end].directive in OPENING) - (rows[end].directive == "endif")
        end += 1
        if depth == 0:
            break
    names: set[str] = set()
    inner, stays = at + 1, False
    while inner < end - 1:
        row = rows[inner]
        if not row.code.strip() or row.directive in BRANCHING:
            inner += 1
            continue
        definition, inner = _definition(rows[:end], inner)
        stays = stays or not definition.names
        names |= definition.names
    return Definition(rows[at:end], frozenset() if stays else frozenset(names)), end


def _name(code: str) -> frozenset[str]:
    """Return the name that code defines; empty if it is unrecognised or defines several."""
    code = code.strip()
    for pattern in (_FUNCTION, _TYPE, _MACRO_TYPE, _CONSTANT):
        match = pattern.match(code)
        if match and _is_single(code) and not _KERNEL.search(code, 0, match.start("name")):
            return frozenset((match["name"],))
    return frozenset()


def with_gaps(
    definitions: Set[Definition], generated: Iterable[Definition]
) -> dict[Definition, tuple[Row, ...]]:
    """Return rows of definitions; structs in memory lose unused members.

    generated: definitions of generated files, which have such structs. An array replaces
    consecutive unused members, so that other members keep their offsets.
    """
    structs = {
        struct
        for struct in generated
        if struct in definitions
        and _IN_MEMORY.fullmatch("\n".join(row.code for row in struct.rows))
    }
    others = definitions - structs
    words = {word for other in others for word in other.words}
    pasting = [row for other in others for row in other.rows if "##" in row.code]
    for struct in structs:
        words |= {name for row in pasting for name in _pasted_members(row, struct.words)}
    return {d: _gaps(d, words) if d in structs else d.printed for d in definitions}


def _pasted_members(row: Row, names: Iterable[str]) -> set[str]:
    """Return the elements of `names` that a macro pastes together behind an arrow."""
    arguments = {"", *_WORD.findall(row.macro[0])}
    members: set[str] = set()
    for begin, end in _PASTED_MEMBER.findall(row.code):
        begin, end = ("" if part in arguments else part for part in (begin, end))
        members |= {name for name in names if name.startswith(begin) and name.endswith(end)}
    return members


def _gaps(struct: Definition, words: Set[str]) -> tuple[Row, ...]:
    """Return the rows of a struct in memory, with arrays in place of members not in `words`."""
    rows: list[Row] = []
    gap = count = 0
    for row in struct.rows:
        member = _MEMBER.match(row.code)
        if member and member["name"] not in words:
            gap += int(member["size"] or 1)
            continue
        if gap:
            text = f"    int unused_{count}[{gap}];"
            rows.append(Row(row.number, text, text))
            gap, count = 0, count + 1
        rows.append(row)
    return tuple(rows)


def _is_single(code: str) -> bool:
    """Return whether code ends at its first closed bracket, or at its first ; outside."""
    depth = 0
    for match in re.finditer(r"[{};]", code):
        depth += {"{": 1, "}": -1}.get(match[0], 0)
        if depth == 0 and (match[0] == ";" or not code.endswith(";")):
            return match.end() == len(code)
    return False


def named(definitions: Iterable[Definition]) -> set[Definition]:
    """Return the definitions that stay: unnamed definitions, and all that they use in turn."""
    by_name: dict[str, list[Definition]] = defaultdict(list)
    pending: list[Definition] = []
    for definition in definitions:
        for name in definition.names:
            by_name[name].append(definition)
        if not definition.names:
            pending.append(definition)
    unseen, stay = set(by_name), set[Definition]()
    while pending:
        definition = pending.pop()
        if definition in stay:
            continue
        stay.add(definition)
        new = definition.words & unseen
        beginnings, endings = definition.pasted
        if beginnings or endings:
            new |= {n for n in unseen if n.startswith(beginnings) or n.endswith(endings)}
        unseen -= new
        for name in new:
            pending += by_name[name]
    return stay
