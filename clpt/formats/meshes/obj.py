"""Wavefront OBJ files ("Appendix B1. Object Files"): faces, and what they name.

A file is read in pieces of whole lines. In each, numpy finds the lines of every kind and parses
their numbers at once; only names, and what is seldom, are read line by line.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import DTypeLike, NDArray

from clpt.arrays import Bytes, Floats32, Integers
from clpt.errors import SceneError
from clpt.files import budget, input_files

PER_BYTE = 8  # bytes of memory for each of the file, while it is read
PIECE = 1 << 19  # bytes that are parsed at a time: they and their arrays fit a processor's cache
BLANK, NEWLINE, HASH, SLASH, POINT, MINUS = 32, 10, 35, 47, 46, 45
EXACT = 2**53  # whole numbers below it, and powers of ten up to 22, are exact in float64
POWERS = 10.0 ** np.arange(23)
BLANKS = bytes(32 if code < 32 and code not in (9, 10, 13) else code for code in range(256))
OTHER, VERTEX, UV, NORMAL, FACE = range(5)  # kinds of lines
NAMES = {VERTEX: "v", UV: "vt", NORMAL: "vn"}
LEAST = {VERTEX: 3, UV: 1, NORMAL: 3}  # numbers in a line
NUMBERS, INDICES = b"0123456789+-.eE \t\n", b"0123456789+- \t\n"
# A comment is not continued, nor is a name whose last letter ends in a backslash in Shift-JIS.
CONTINUED = re.compile(rb"#[^\n]*|(?<![\x80-\xff])\\\n")
LINES = {VERTEX: re.compile(rb"\n[ \t]*v[ \t]"), FACE: re.compile(rb"\n[ \t]*fo?[ \t]")}
DIGITS = b"0123456789"
INDEX = re.compile(rb"[+-]?\d+")
NUMBER = re.compile(rb"[+-]?((\d+\.?\d*|\.\d+)(e[+-]?\d+)?|nan|inf(inity)?)", re.IGNORECASE)
NOT_FINITE = re.compile(rb"[+-]?1\.#(q?nan|snan|ind|inf)\d*", re.IGNORECASE)  # of Microsoft's C
CHANGING = {"usemtl": -1, "s": 0}  # what lines say of the faces after them, and what holds first
SILENT = {"g", "o", "lod", "bevel", "c_interp", "d_interp", "shadow_obj", "trace_obj", "vp"}
SILENT |= {"deg", "bmat", "step", "parm", "trim", "hole", "scrv", "sp", "end", "ctech", "stech"}
LEFT_OUT = {
    "p": "points", "l": "lines", "cstype": "curves and surfaces", "curv": "curves",
    "curv2": "curves", "surf": "surfaces", "usemap": "images of faces", "maplib": "images of faces",
    "call": "other files", "csh": "commands", "mg": "merging groups", "con": "connections",
    **dict.fromkeys(("bzp", "bsp", "cdc", "cdp", "res"), "patches"),
}  # fmt: skip
MOST_TOLD = 6  # statements that a warning names


@dataclass
class Contents:
    """The faces of a file.

    vertices (n, 3); colours (n, 3) as the file has them, NaN where a vertex has none, or None; uvs
    (k, 2); normals (l, 3). counts (p,): corners of each face. corners (sum of counts, 3) int32: the
    vertex, uv and normal of each, -1 where it has none. labels: of each face (p,); "usemtl": its
    material in `materials`, -1 where none is named; "s": its smoothing group, 0 for none.
    """

    vertices: Floats32
    colours: Floats32 | None
    uvs: Floats32
    normals: Floats32
    counts: Integers
    corners: NDArray[np.int32]
    labels: dict[str, Integers]
    materials: list[str]
    libraries: list[str]
    warnings: list[str]


def read(path: Path) -> Contents:
    """Read a file. Raises SceneError with the line that is not as the format has it."""
    data = input_files.plain(input_files.read_bytes(path))
    budget.check(PER_BYTE * len(data), "its numbers", path)
    reader = _Reader(path, data)
    reader.read()
    return reader.contents()


@dataclass
class _Lines:
    """The lines of a piece that are not empty.

    start, stop: where each begins, and its end with the newline; head: where its first word does;
    words: how many it has; kind: OTHER, VERTEX and so on.
    """

    start: Integers
    stop: Integers
    head: Integers
    words: Integers
    kind: NDArray[np.int8]


@dataclass
class _Reader:
    path: Path
    data: bytes
    rows: dict[int, list[Floats32]] = field(default_factory=lambda: {key: [] for key in NAMES})
    counted: dict[int, int] = field(default_factory=lambda: dict.fromkeys(NAMES, 0))
    colours: list[tuple[int, Floats32]] = field(default_factory=list)
    counts: list[Integers] = field(default_factory=list)
    corners: list[NDArray[np.int32]] = field(default_factory=list)
    labels: dict[str, list[Integers]] = field(default_factory=lambda: {k: [] for k in CHANGING})
    now: dict[str, int] = field(default_factory=lambda: dict(CHANGING))
    materials: dict[str, int] = field(default_factory=dict)
    libraries: list[str] = field(default_factory=list)
    left_out: dict[str, None] = field(default_factory=dict)
    unknown: dict[str, None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if b"\r" in self.data:
            self.data = self.data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
        # Each line has a newline on both sides, even if the last line is continued.
        self.data = b"".join((b"\n", self.data, b"\n\n")).translate(BLANKS)
        self.lines = self.data
        if b"\\\n" in self.data:  # the same length: positions agree
            self.data = CONTINUED.sub(_joined, self.data)

    def read(self) -> None:
        """Read all pieces."""
        first, last = 0, len(self.data) - 1
        while first < last:
            end = self.data.rfind(b"\n", first + 1, first + PIECE)
            if end < 0:
                end = self.data.index(b"\n", first + 1)
            self.piece(first, np.frombuffer(self.data, np.uint8, end + 1 - first, first))
            first = end

    def contents(self) -> Contents:
        """Return what was read, checked."""
        colours = None
        if self.colours:
            colours = np.full((self.counted[VERTEX], 3), np.nan, np.float32)
            for start, values in self.colours:
                colours[start : start + len(values)] = values
        contents = Contents(
            vertices=np.concatenate([np.zeros((0, 3), np.float32), *self.rows[VERTEX]]),
            colours=colours,
            uvs=np.concatenate([np.zeros((0, 2), np.float32), *self.rows[UV]]),
            normals=np.concatenate([np.zeros((0, 3), np.float32), *self.rows[NORMAL]]),
            counts=np.concatenate([np.zeros(0, np.int64), *self.counts]),
            corners=np.concatenate([np.zeros((0, 3), np.int32), *self.corners]),
            labels={k: np.concatenate([np.zeros(0, np.int64), *v]) for k, v in self.labels.items()},
            materials=list(self.materials),
            libraries=self.libraries,
            warnings=[],
        )
        if self.left_out:
            contents.warnings.append(f"left out: {_listed(self.left_out)}")
        if self.unknown:
            contents.warnings.append(f"left out what OBJ does not know: {_listed(self.unknown)}")
        if short := int((contents.counts < 3).sum()):
            contents.warnings.append(f"left out {short} faces of fewer than three corners")
        self.check(contents)
        return contents

    def check(self, contents: Contents) -> None:
        """Raise SceneError for indices out of range and vertices that are not finite."""
        for column, kind in enumerate(NAMES):
            named = contents.corners[:, column]
            if not len(named) or named.max() < self.counted[kind]:
                continue
            if kind != VERTEX and not self.counted[kind]:
                contents.warnings.append(
                    f"left out the numbers of {NAMES[kind]!r}: the file has none"
                )
                named[:] = -1
                continue
            bad = int(np.argmax(named >= self.counted[kind]))
            count = self.counted[kind]
            message = f"'f' names the {NAMES[kind]!r} {named[bad] + 1} of {count}"
            face = int(np.searchsorted(np.cumsum(contents.counts), bad, "right"))
            self.fail(self.place(FACE, face), message)
        finite: NDArray[Any] = np.asarray(np.isfinite(contents.vertices).all(axis=1))
        if not finite.all() and not (good := np.take(finite, contents.corners[:, 0])).all():
            vertex = int(contents.corners[np.argmin(good), 0])
            self.fail(self.place(VERTEX, vertex), "'v' is not finite")

    def place(self, kind: int, number: int) -> int:
        """Return where the line of a kind begins, by its number."""
        return next(islice(LINES[kind].finditer(self.data), number, None)).start()

    def fail(self, place: int, message: str) -> NoReturn:
        """Raise an error about the line that begins behind a newline."""
        raise SceneError(message, file=self.path, line=self.lines.count(b"\n", 0, place + 1))

    def piece(self, at: int, piece: Bytes) -> None:
        """Read a piece of the data, which has a newline at both ends and begins at `at`."""
        lines = _split(piece)
        if b"#" in piece.tobytes():
            piece, lines = _without_comments(piece, lines)
        plain = piece.copy()
        known = lines.kind != OTHER
        for letter in (0, 1):
            heads = lines.head[known] + letter
            plain[heads[plain[heads] != NEWLINE]] = BLANK
        before = dict(self.counted)
        changes = self.names(piece, lines)
        for kind in NAMES:
            self.numbers(at, kind, plain, lines)
        if (lines.kind == FACE).any():
            self.faces(at, plain, lines, before, changes)
        self.now = {name: labels[-1] for name, (_, labels) in changes.items()}

    def numbers(self, at: int, kind: int, plain: Bytes, lines: _Lines) -> None:
        """Read the lines of a kind of numbers."""
        rows = np.flatnonzero(lines.kind == kind)
        if not len(rows):
            return
        words = lines.words[rows] - 1
        cut, count = _cut(plain, lines, rows), int(words.sum())
        values = _decimals(cut, count)
        if values is None:
            values = _parsed(cut, NUMBERS, np.float32, count)
        if values is None or words.min() < LEAST[kind]:
            values = self.each_number(at, kind, plain, lines, rows)
        self.rows[kind].append(_columns(values, words, 0, 2 if kind == UV else 3))
        if kind == VERTEX and words.max() >= 6:
            colours = _columns(values, words, 3, 6)
            colours[words < 6] = np.nan
            self.colours.append((self.counted[kind], colours))
        self.counted[kind] += len(rows)

    def each_number(
        self, at: int, kind: int, plain: Bytes, lines: _Lines, rows: Integers
    ) -> Floats32:
        """Return the numbers of lines, read singly. Raises SceneError for the first bad number."""
        values: list[float] = []
        for start, stop in zip(lines.start[rows].tolist(), lines.stop[rows].tolist(), strict=True):
            line = plain[start:stop].tobytes()
            words = [b"nan" if NOT_FINITE.fullmatch(word) else word for word in line.split()]
            for word in words:
                if not NUMBER.fullmatch(word):
                    message = f"{input_files.decode(word)[:40]!r} is not a number"
                    comma = input_files.comma_message(input_files.decode(line))
                    self.fail(at + start - 1, comma or message)
            if len(words) < LEAST[kind]:
                message = f"{NAMES[kind]!r} needs {LEAST[kind]} numbers, and has {len(words)}"
                self.fail(at + start - 1, message)
            values += map(float, words)
        with np.errstate(over="ignore"):
            return np.array(values).astype(np.float32)

    def faces(
        self,
        at: int,
        plain: Bytes,
        lines: _Lines,
        before: dict[int, int],
        changes: dict[str, tuple[list[int], list[int]]],
    ) -> None:
        """Read the faces of a piece; before: how many of each kind of numbers precede the piece."""
        rows = np.flatnonzero(lines.kind == FACE)
        cut = _cut(plain, lines, rows)
        counts = lines.words[rows] - 1
        indices = _alike(cut, len(rows), int(counts.sum()))
        if indices is None:
            indices = _named(cut, int(counts.sum()))
        if indices is None:
            self.explain(at, plain, lines, rows)
        corners = np.empty((int(counts.sum()), 3), np.int32)
        for column, kind in enumerate(NAMES):
            named = indices[column]
            if named.min(initial=0) < 0:
                precede = before[kind] + np.cumsum(lines.kind == kind)[rows]
                counted = np.repeat(precede, counts) + named + 1
                if ((named < 0) & (counted < 1)).any():
                    bad = int(np.argmax((named < 0) & (counted < 1)))
                    face = np.searchsorted(np.cumsum(counts), bad, "right")
                    message = f"'f' counts {-named[bad]} back, beyond the first {NAMES[kind]!r}"
                    self.fail(at + int(lines.start[rows[face]]) - 1, message)
                named = np.where(named < 0, counted, named)
            corners[:, column] = np.minimum(named, 2**31 - 1) - 1
        for name, (places, labels) in changes.items():
            self.labels[name].append(np.array(labels, np.int64)[np.searchsorted(places, rows)])
        self.counts.append(counts)
        self.corners.append(corners)

    def explain(self, at: int, plain: Bytes, lines: _Lines, rows: Integers) -> NoReturn:
        """Raise SceneError for the first corner of faces that is wrong."""
        for start, stop in zip(lines.start[rows].tolist(), lines.stop[rows].tolist(), strict=True):
            for word in plain[start:stop].tobytes().split():
                first, *more = word.split(b"/")
                whole = len(more) < 3 and all(INDEX.fullmatch(part) for part in more if part)
                if not whole or not INDEX.fullmatch(first):
                    known = "1, 1/2, 1//3 or 1/2/3"
                    message = f"{input_files.decode(word)[:40]!r} is no corner such as {known}"
                    self.fail(at + start - 1, message)
                if not all(int(part) for part in (first, *more) if part):
                    message = f"{input_files.decode(word)[:40]!r} names 0, but numbers begin at 1"
                    self.fail(at + start - 1, message)
        raise AssertionError("every corner is right")

    def names(self, piece: Bytes, lines: _Lines) -> dict[str, tuple[list[int], list[int]]]:
        """Read the lines of a piece that are neither numbers nor faces.

        Return the lines of changes of materials and smoothing groups, and the labels before the
        first change and after each change.
        """
        changes: dict[str, tuple[list[int], list[int]]]
        changes = {name: ([], [label]) for name, label in self.now.items()}
        others = np.flatnonzero((lines.kind == OTHER) & (piece[lines.head] != HASH))
        for line in others.tolist():
            words = piece[lines.head[line] : lines.stop[line]].tobytes().split(None, 1)
            name, operands = input_files.decode(words[0]), words[1] if len(words) > 1 else b""
            if name in changes:
                changes[name][0].append(line)
                changes[name][1].append(self.label(name, input_files.decode(operands).strip()))
            elif name == "mtllib":
                self.libraries.append(input_files.decode(operands).strip())
            elif name in LEFT_OUT:
                self.left_out[f"{LEFT_OUT[name]} ({name})"] = None
            elif name not in SILENT:
                self.unknown[name[:20]] = None
        return changes

    def label(self, name: str, operand: str) -> int:
        """Return the number of a material or a smoothing group."""
        if name == "usemtl":
            return self.materials.setdefault(operand, len(self.materials)) if operand else -1
        word = operand.split()[0] if operand else "off"
        return 0 if word == "off" else int(word) if word.isdecimal() and len(word) < 18 else 1


def _joined(match: re.Match[bytes]) -> bytes:
    """Return blanks for the continuation of a line, and a comment as it is."""
    return b"  " if match[0].startswith(b"\\") else match[0]


def _listed(names: dict[str, None]) -> str:
    more = f" and {len(names) - MOST_TOLD} more" if len(names) > MOST_TOLD else ""
    return ", ".join(islice(names, MOST_TOLD)) + more


def _split(piece: Bytes) -> _Lines:
    solid = piece > BLANK
    words = np.flatnonzero(solid[1:] > solid[:-1]) + 1
    newlines = np.flatnonzero(piece == NEWLINE)
    first = np.searchsorted(words, newlines)
    counts = np.diff(first)
    full = np.flatnonzero(counts)
    head = words[first[full]]
    letters = [piece[np.minimum(head + i, len(piece) - 1)] for i in range(3)]
    second, third = letters[1] <= BLANK, letters[2] <= BLANK
    kind = np.zeros(len(head), np.int8)
    of_v = letters[0] == ord("v")
    kind[of_v & second] = VERTEX
    kind[of_v & (letters[1] == ord("t")) & third] = UV
    kind[of_v & (letters[1] == ord("n")) & third] = NORMAL
    kind[(letters[0] == ord("f")) & (second | ((letters[1] == ord("o")) & third))] = FACE
    return _Lines(newlines[full] + 1, newlines[full + 1] + 1, head, counts[full], kind)


def _without_comments(piece: Bytes, lines: _Lines) -> tuple[Bytes, _Lines]:
    """Blank the comments behind numbers and corners; 1.#QNAN is a number of Microsoft's."""
    hashes = np.flatnonzero(piece == HASH)
    hashes = hashes[piece[hashes - 1] != POINT]
    line = np.searchsorted(lines.start, hashes, "right") - 1
    behind = lines.kind[line] != OTHER
    if not behind.any():
        return piece, lines
    line, first = np.unique(line[behind], return_index=True)
    steps = np.zeros(len(piece), np.int8)
    steps[hashes[behind][first]] = 1
    steps[lines.stop[line] - 1] = -1
    piece = np.where(np.cumsum(steps, dtype=np.int8) > 0, np.uint8(BLANK), piece)
    return piece, _split(piece)


def _cut(plain: Bytes, lines: _Lines, rows: Integers) -> bytes:
    """Return the text of some lines."""
    start, stop = lines.start[rows], lines.stop[rows]
    breaks = np.flatnonzero(start[1:] != stop[:-1])
    if not len(breaks):
        return plain[start[0] : stop[-1]].tobytes()
    begins, ends = start[np.r_[0, breaks + 1]].tolist(), stop[np.r_[breaks, len(rows) - 1]].tolist()
    view = plain.data
    return b"".join([view[a:b] for a, b in zip(begins, ends, strict=True)])


def _parsed(cut: bytes, letters: bytes, dtype: DTypeLike, count: int) -> NDArray[Any] | None:
    """Return all numbers of a text; None where it does not hold `count` of them alone."""
    if not count:
        return np.zeros(0, dtype)
    if cut.translate(None, letters):
        return None
    try:
        values = np.fromstring(cut, dtype, sep=" ")
    except ValueError:
        return None
    return values if len(values) == count else None


def _decimals(cut: bytes, count: int) -> Floats32 | None:
    """Return all numbers of a text without exponents; None of others, and of long numbers.

    Each is a whole number over a power of ten. Both are exact in float64, so that the quotient is
    rounded as that of `strtod`, which takes three times as long.
    """
    whole = _parsed(cut.replace(b".", b""), INDICES, np.int64, count)
    if whole is None or not count or whole.max() >= EXACT or whole.min() <= -EXACT:
        return None
    letters = np.frombuffer(cut, np.uint8)
    solid = letters > BLANK
    ends = np.flatnonzero(solid[:-1] > solid[1:]) + 1
    points, signs = np.flatnonzero(letters == POINT), np.flatnonzero(letters == MINUS)
    number = np.searchsorted(ends, points, "right")
    places = np.zeros(count, np.int64)
    if len(ends) != count or not (number[1:] > number[:-1]).all():
        return None
    places[number] = ends[number] - points - 1
    if places.max() >= len(POWERS):
        return None
    values = (whole / POWERS[places]).astype(np.float32)
    negative = np.searchsorted(ends, signs, "right")
    values[negative] = -np.abs(values[negative])  # also of -0
    return values


def _columns(values: Floats32, words: Integers, first: int, last: int) -> Floats32:
    """Return numbers `first` to `last` of each line, (n, last - first); 0 where it has fewer."""
    if words.min() == words.max() >= last:
        return values.reshape(len(words), -1)[:, first:last]
    begins = np.cumsum(words) - words
    columns = np.zeros((len(words), last - first), np.float32)
    for column in range(first, last):
        has = words > column
        columns[has, column - first] = values[begins[has] + column]
    return columns


def _alike(cut: bytes, faces: int, corners: int) -> NDArray[np.int64] | None:
    """Return the indices (3, corners) of faces that are all written alike; None of others.

    A corner has a vertex, an uv and a normal, or fewer from the first on; 0 stands for the rest.
    """
    marks = cut.translate(None, DIGITS)
    line = marks[: marks.find(b"\n") + 1]
    each, odd = divmod(line.count(b"/") * faces + corners, max(corners, 1))
    if b"//" in cut or odd or not 1 <= each <= 3:
        return None
    if len(marks) != len(line) * faces or marks != line * faces:
        return None
    if not {b"/" * (each - 1)}.issuperset(line.split()):
        return None
    values = _parsed(cut.replace(b"/", b" "), INDICES, np.int64, each * corners)
    if values is None or not values.all():
        return None
    indices = np.zeros((3, corners), np.int64)
    indices[:each] = values.reshape(-1, each).T
    return indices


def _named(cut: bytes, corners: int) -> NDArray[np.int64] | None:
    """Return the indices (3, corners) of faces, 0 where a corner names none; None if one is
    wrong."""
    fields = _fields(cut)
    values = _parsed(cut.replace(b"/", b" "), INDICES, np.int64, len(fields))
    vertex = fields == 0
    if values is None or (fields < 0).any() or not values.all() or vertex.sum() != corners:
        return None
    indices = np.zeros((3, corners), np.int64)
    indices[fields, np.cumsum(vertex) - 1] = values
    return indices


def _fields(cut: bytes) -> NDArray[np.int8]:
    """Return for each number of faces what it names.

    0: a vertex, 1: an uv, 2: a normal; -1: more than a corner can have.
    """
    letters = np.frombuffer(cut, np.uint8)
    solid = (letters > BLANK) & (letters != SLASH)
    starts = np.flatnonzero(solid[1:] > solid[:-1]) + 1
    slash = letters[starts - 1] == SLASH
    fields = slash.astype(np.int8)
    if slash.any():
        twice = slash & (letters[starts - 2] == SLASH)
        after = np.zeros_like(slash)  # a number behind a single slash precedes
        after[1:] = slash[:-1] & ~twice[:-1]
        fields[twice | (slash & after)] = 2
        before = np.zeros_like(fields)
        before[1:] = fields[:-1]
        fields[(slash & (before == 2)) | (twice & (before != 0))] = -1
    if b"///" in cut or b" /" in cut or b"\t/" in cut:
        fields[:1] = -1
    return fields
