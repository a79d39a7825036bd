"""Tables of PLY files (Turk 1994): ascii and binary of both byte orders.

Rows of equal length are read at once. A table is {column: values}; a list column is a pair of
lengths, and all values in a row.
"""

from __future__ import annotations

import dataclasses
import re
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import text

Columns = dict[str, dict[str, Any]]  # of each table, by its name and theirs
TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
HEADER = re.compile(
    rb"ply[ \t]*(\r\n|\n|\r).*?(?P<end>(?<=[\r\n])[ \t]*end_header[ \t]*(?:\1|\r\n|\n|\r|\Z))",
    re.DOTALL,
)
LONGEST_HEADER = 1 << 16
EVEN = 1 << 12  # values of a list whose rows are read at once


@dataclass
class Property:
    """A column of an element: a number in each row, or a list, with the type of its length."""

    name: str
    type: str
    length: str = ""


@dataclass
class Element:
    """A table of a file."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)


@dataclass
class Header:
    """The header of a file.

    order: of bytes, "" for ascii; textures: names of image files; length [bytes].
    """

    order: str
    elements: list[Element]
    textures: list[str]
    length: int


def read_tables(data: bytes) -> tuple[Header, Columns]:
    """Return what the header says, and all tables by their names. Raises SceneError."""
    header = _header(data)
    read = _binary if header.order else _ascii
    return header, read(data, header)


def _header(data: bytes) -> Header:
    header = HEADER.match(data[:LONGEST_HEADER])
    if header is None:
        raise SceneError("it has no header")
    order, elements, textures = None, [], []
    for number, line in enumerate(data[: header.start("end")].splitlines()[1:], 2):
        words = text.decode(line).split()
        match words:
            case ["format", name, _] if name in FORMATS:
                order = FORMATS[name]
            case ["element", name, count] if count.isdecimal() and len(count) < 12:
                elements.append(Element(name, int(count)))
            case ["property", type, name] if type in TYPES and elements:
                elements[-1].properties.append(Property(name, TYPES[type]))
            case ["property", "list", n, type, name] if _whole(n) and type in TYPES and elements:
                elements[-1].properties.append(Property(name, TYPES[type], TYPES[n]))
            case ["comment", "TextureFile", _, *_]:
                textures.append(text.decode(line).split(None, 2)[2].strip())
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                shown = text.decode(line)[:60]
                raise SceneError(f"its header has the line {shown!r}", line=number)
    if order is None:
        raise SceneError("its header names no format")
    for element in elements:
        names = [column.name for column in element.properties]
        if len(set(names)) < len(names) or (element.count and not names):
            raise SceneError(f"its element {element.name[:40]!r} has no columns, or one twice")
    return Header(order, elements, textures, header.end())


def _whole(name: str) -> bool:
    """Return whether a type is a whole number."""
    return TYPES.get(name, "f")[0] != "f"


def _binary(data: bytes, header: Header) -> Columns:
    tables: Columns = {}
    start = header.length
    for element in header.elements:
        rows, used = _even_rows(data, element, start, header.order)
        if rows is None:
            rows, used = _uneven_rows(data, element, start, header.order)
        tables[element.name] = rows
        start += used
    return tables


def _even_rows(
    data: bytes, element: Element, start: int, order: str
) -> tuple[dict[str, Any] | None, int]:
    """Return the columns of a table and its bytes; None where lists differ in length."""
    fields: list[Any] = []
    at = start
    for column in element.properties:
        if not column.length:
            fields.append((column.name, order + column.type))
        else:
            count = 0
            if element.count:
                count = _number(data, at, order + column.length, np.dtype(column.type).itemsize)
            if count > EVEN:
                return None, 0
            fields.append((f"{column.name} n", order + column.length))
            fields.append((column.name, order + column.type, (count,)))
        at = start + np.dtype(fields).itemsize
    dtype = np.dtype(fields)
    size = dtype.itemsize * element.count
    if start + size > len(data):
        if any(column.length for column in element.properties):
            return None, 0
        raise SceneError(f"it ends within {element.count} rows of {element.name[:40]!r}")
    rows = np.frombuffer(data, dtype, element.count, start)
    result: dict[str, Any] = {}
    for column in element.properties:
        if column.length:
            lengths = rows[f"{column.name} n"]
            if element.count and (lengths != lengths[0]).any():
                return None, 0
            result[column.name] = lengths, rows[column.name].reshape(-1)
        else:
            result[column.name] = rows[column.name]
    return result, size


def _number(data: bytes, at: int, dtype: str, size: int) -> int:
    """Return how many values a list has, all within the file; size: bytes of each value."""
    first = at + np.dtype(dtype).itemsize
    if first > len(data):
        raise SceneError("it ends too early")
    count = int(np.frombuffer(data, dtype, 1, at)[0])
    _check_length(count, size, len(data) - first)
    return count


def _check_length(count: int, size: int, left: int) -> None:
    """Raise SceneError for a list that is longer than the rest of the file [bytes]."""
    if count < 0:
        raise SceneError(f"a list has {count} values")
    if count * size > left:
        raise SceneError(f"it ends within a list of {count} values")


def _uneven_rows(
    data: bytes, element: Element, start: int, order: str
) -> tuple[dict[str, Any], int]:
    """As `_even_rows`, by walking from list to list, row by row; then all is gathered at once."""
    rows = _Lists(order, element.properties)
    at, end = start, len(data)
    begins = []
    try:
        for _ in range(element.count):
            begins.append(at)
            for before, unpack, head, size, places, lengths in rows.lists:
                at += before
                (count,) = unpack(data, at)
                at += head
                if not 0 <= count * size <= end - at:
                    _check_length(count, size, end - at)
                places.append(at)
                lengths.append(count)
                at += count * size
            at += rows.after
    except struct.error:
        at = end + 1
    if at > end:
        raise SceneError(f"it ends within {element.count} rows of {element.name[:40]!r}")
    return _gathered(data, element, order, rows, np.array(begins, np.int64)), at - start


class _Lists:
    """Where the lists of an element's rows lie.

    lists: for each the bytes before it, what reads its length, the bytes of that and of a value,
    and for all rows where its values begin and how many there are. after: bytes behind the last.
    """

    def __init__(self, order: str, properties: list[Property]):
        self.lists: list[Any] = []
        self.after = 0
        for column in properties:
            size = np.dtype(column.type).itemsize
            if not column.length:
                self.after += size
                continue
            length = struct.Struct(order + np.dtype(column.length).char)
            self.lists.append((self.after, length.unpack_from, length.size, size, [], []))
            self.after = 0


def _gathered(
    data: bytes, element: Element, order: str, rows: _Lists, at: NDArray[np.int64]
) -> dict[str, Any]:
    """Return the columns of rows that have been walked over; at: where each row begins."""
    raw = np.frombuffer(data, np.uint8)
    lists = iter(rows.lists)
    columns: dict[str, Any] = {}
    for column in element.properties:
        dtype = np.dtype(order + column.type)
        size = dtype.itemsize
        if column.length:
            *_, places, lengths = next(lists)
            first, counts = np.array(places, np.int64), np.array(lengths, np.int64)
            total, starts = int(counts.sum()), np.cumsum(counts) - counts
            positions = np.repeat(first - size * starts, counts) + size * np.arange(total)
            columns[column.name] = counts, _at(raw, positions, dtype)
            at = first + size * counts
        else:
            columns[column.name] = _at(raw, at, dtype)
            at = at + size
    return columns


def _at(raw: NDArray[np.uint8], places: NDArray[np.int64], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return the numbers (n,) that begin at places (n,) among bytes."""
    return raw[places[:, None] + np.arange(dtype.itemsize)].reshape(-1).view(dtype)


def _ascii(data: bytes, header: Header) -> Columns:
    """Rows that are lines may have more words than the header tells; the first words count."""
    start, elements = header.length, header.elements
    words = text.numbers(data, start)
    lines = [line for line in data[start:].splitlines() if line.strip()]
    if len(lines) != sum(element.count for element in elements):
        return _ascii_tables(words, elements)
    try:
        return _ascii_tables(words, elements, to_the_end=True)
    except SceneError:
        return _ascii_tables(_told_words(lines, elements), elements)


def _ascii_tables(
    words: NDArray[np.float64], elements: list[Element], to_the_end: bool = False
) -> Columns:
    tables: Columns = {}
    at = 0
    for element in elements:
        tables[element.name], used = _ascii_rows(words[at:], element)
        at += used
    if to_the_end and at < len(words):
        raise SceneError("it holds more words than its header tells")
    return tables


def _told_words(lines: list[bytes], elements: list[Element]) -> NDArray[np.float64]:
    """Return the words of each line that the header tells of."""
    words, at = [], 0
    for element in elements:
        row = dataclasses.replace(element, count=1)
        for line in lines[at : at + element.count]:
            numbers = np.array(line.split(), np.float64)
            words.append(numbers[: _ascii_rows(numbers, row)[1]])
        at += element.count
    return np.concatenate([*words, np.zeros(0)])


def _ascii_rows(words: NDArray[np.float64], element: Element) -> tuple[dict[str, Any], int]:
    short = SceneError(f"it ends within {element.count} rows of {element.name[:40]!r}")
    width = len(element.properties)
    if not any(column.length for column in element.properties):
        if len(words) < width * element.count:
            raise short
        rows = words[: width * element.count].reshape(-1, width)
        return {c.name: _typed(rows[:, i], c) for i, c in enumerate(element.properties)}, rows.size
    result = _empty(element)
    at = 0
    for _ in range(element.count):
        for column in element.properties:
            if at >= len(words):
                raise short
            count = words[at] if column.length else 1
            if not (0 <= count < np.inf and count == int(count)):
                raise SceneError(f"a list has {count:g} values")
            if count > len(words) - at:
                raise short
            at += 1 if column.length else 0
            result[column.name][0].append(int(count))
            result[column.name][1].append(words[at : at + int(count)])
            at += int(count)
        if at > len(words):
            raise short
    return _joined(element, result), at


def _empty(element: Element) -> dict[str, Any]:
    return {column.name: ([], []) for column in element.properties}


def _joined(element: Element, rows: dict[str, Any]) -> dict[str, Any]:
    """Columns of lengths and values, row by row, as `_binary` has them."""
    columns: dict[str, Any] = {}
    for column in element.properties:
        lengths, values = rows[column.name]
        joined = np.concatenate(values or [np.zeros(0)])
        whole = (np.array(lengths, np.int64), joined)
        columns[column.name] = whole if column.length else _typed(joined, column)
    return columns


def _typed(values: NDArray[Any], column: Property) -> NDArray[Any]:
    """Return whole numbers in their type: as colours they mean other values than floats."""
    dtype = np.dtype(column.type)
    if dtype.kind == "f" or values.dtype.kind != "f":
        return values
    limits = np.iinfo(dtype)
    return np.clip(np.nan_to_num(values), limits.min, limits.max).astype(dtype)
