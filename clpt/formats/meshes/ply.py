"""Triangle meshes from PLY files (Turk 1994): ascii and binary of both byte orders, also gzip's.

Rows of the same length are read in one go; polygons become fans.
"""

from __future__ import annotations

import dataclasses
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.formats.gzip_file import LARGEST, read_bytes

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
NORMAL = ("nx", "ny", "nz")
UVS = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
CORNERS = ("vertex_indices", "vertex_index")
LONGEST_HEADER = 1 << 16
MOST_CORNERS = 1 << 12  # of one polygon


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
class Triangles:
    """vertices (n, 3), faces (m, 3) int64, normals (n, 3) or None, uvs (n, 2) or None.

    columns: further numbers of each "vertex" and "face" by name; a polygon's are those of all its
    triangles. polygons: the number of the polygon of each triangle, (m,).
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.int64]
    normals: NDArray[np.float32] | None
    uvs: NDArray[np.float32] | None
    columns: dict[str, dict[str, NDArray[Any]]]
    polygons: NDArray[np.int64]
    warnings: list[str] = field(default_factory=list)


def read(path: Path, largest: int = LARGEST) -> Triangles:
    """Read a file; largest: bytes that one of gzip may have, unpacked.

    Raises SceneError for one that is larger, broken, or has no vertices or faces.
    """
    data = read_bytes(path, largest)
    try:
        order, elements, start = _header(data)
        if not order:
            return _triangles(_ascii(data, elements, start))
        return _triangles(_binary(data, elements, start, order))
    except SceneError as error:
        raise SceneError(f"cannot be read as a .ply mesh: {error.message}", file=path) from None


def _header(data: bytes) -> tuple[str, list[Element], int]:
    end = data.find(b"end_header", 0, LONGEST_HEADER)
    line_end = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
    if line_end is None or end < 0:
        raise SceneError("it has no header")
    stop = data.find(line_end[1], end)
    order, elements = None, []
    for line in data[:end].decode("latin-1").splitlines()[1:]:
        match line.split():
            case ["format", name, _] if name in FORMATS:
                order = FORMATS[name]
            case ["element", name, count] if count.isdecimal() and len(count) < 12:
                elements.append(Element(name, int(count)))
            case ["property", type, name] if type in TYPES and elements:
                elements[-1].properties.append(Property(name, TYPES[type]))
            case ["property", "list", n, type, name] if {n, type} <= {*TYPES} and elements:
                elements[-1].properties.append(Property(name, TYPES[type], TYPES[n]))
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise SceneError(f"its header has the line {line[:60]!r}")
    if order is None:
        raise SceneError("its header names no format")
    for element in elements:
        names = [column.name for column in element.properties]
        if len(set(names)) < len(names) or (element.count and not names):
            raise SceneError(f"its element {element.name[:40]!r} has no columns, or one twice")
    return order, elements, stop + len(line_end[1]) if stop >= 0 else len(data)


def _binary(
    data: bytes, elements: list[Element], start: int, order: str
) -> dict[str, dict[str, Any]]:
    """Return every table as {column: values}; a list column as lengths and all values in a row."""
    tables: dict[str, dict[str, Any]] = {}
    for element in elements:
        rows, used = _even_rows(data, element, start, order)
        if rows is None:
            rows, used = _uneven_rows(data, element, start, order)
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
            count = _number(data, at, order + column.length) if element.count else 0
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


def _number(data: bytes, at: int, dtype: str) -> int:
    if at + np.dtype(dtype).itemsize > len(data):
        raise SceneError("it ends too early")
    count = int(np.frombuffer(data, dtype, 1, at)[0])
    if not 0 <= count <= MOST_CORNERS:
        raise SceneError(f"a list has {count} values")
    return count


def _uneven_rows(
    data: bytes, element: Element, start: int, order: str
) -> tuple[dict[str, Any], int]:
    """As `_even_rows`, row by row."""
    result = _empty(element)
    columns = [
        (c.name, c.length and order + c.length, order + c.type, np.dtype(c.type).itemsize)
        for c in element.properties
    ]
    at = start
    for _ in range(element.count):
        for name, length, type, size in columns:
            count = _number(data, at, length) if length else 1
            at += np.dtype(length).itemsize if length else 0
            if at + count * size > len(data):
                raise SceneError(f"it ends within {element.count} rows of {element.name[:40]!r}")
            lengths, values = result[name]
            lengths.append(count)
            values.append(np.frombuffer(data, type, count, at))
            at += count * size
    return _joined(element, result), at - start


def _ascii(data: bytes, elements: list[Element], start: int) -> dict[str, dict[str, Any]]:
    """As `_binary`, of an ascii file.

    Rows may have more words than the header tells, if each row is a line; the first words count.
    """
    try:
        words = np.array(data[start:].split(), np.float64)
    except ValueError:
        raise SceneError("it holds words that are no numbers") from None
    lines = [line for line in data[start:].splitlines() if line.strip()]
    if len(lines) != sum(element.count for element in elements):
        return _ascii_tables(words, elements)
    try:
        return _ascii_tables(words, elements, to_the_end=True)
    except SceneError:
        return _ascii_tables(_told_words(lines, elements), elements)


def _ascii_tables(
    words: NDArray[np.float64], elements: list[Element], to_the_end: bool = False
) -> dict[str, dict[str, Any]]:
    tables: dict[str, dict[str, Any]] = {}
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
            own = np.array(line.split(), np.float64)
            words.append(own[: _ascii_rows(own, row)[1]])
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
            if not (0 <= count <= MOST_CORNERS and count == int(count)):
                raise SceneError(f"a list has {count:g} values")
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
    made: dict[str, Any] = {}
    for column in element.properties:
        lengths, values = rows[column.name]
        joined = np.concatenate(values or [np.zeros(0)])
        whole = (np.array(lengths, np.int64), joined)
        made[column.name] = whole if column.length else _typed(joined, column)
    return made


def _typed(values: NDArray[Any], column: Property) -> NDArray[Any]:
    """Return values of the type uchar as bytes: as colours they mean other values than floats."""
    if column.type != "u1" or values.dtype == np.uint8:
        return values
    return np.clip(np.nan_to_num(values), 0, 255).astype(np.uint8)


def _triangles(tables: dict[str, dict[str, Any]]) -> Triangles:
    vertex, face = _plain(tables.get("vertex", {})), tables.get("face", {})
    if not all(name in vertex for name in "xyz"):
        raise SceneError("it holds no triangles")
    corners = next((face[name] for name in CORNERS if name in face), None)
    if not isinstance(corners, tuple):
        raise SceneError("it holds no triangles")
    uvs = next((pair for pair in UVS if all(name in vertex for name in pair)), None)
    normals = NORMAL if all(name in vertex for name in NORMAL) else None
    known = {*"xyz", *(normals or ()), *(uvs or ())}
    further = {name: values for name, values in vertex.items() if name not in known}
    return Triangles(
        vertices=_columns(vertex, "xyz"),
        faces=_fans(*corners),
        normals=None if normals is None else _columns(vertex, normals),
        uvs=None if uvs is None else _columns(vertex, uvs),
        columns={"vertex": further, "face": _per_triangle(face, corners[0])},
        polygons=np.repeat(np.arange(len(corners[0])), _triangle_counts(corners[0])),
        warnings=["texture coordinates of faces left out"] if "texcoord" in face else [],
    )


def _plain(table: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the columns that are no lists."""
    return {name: values for name, values in table.items() if isinstance(values, np.ndarray)}


def _per_triangle(face: dict[str, Any], lengths: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Return the columns of polygons, for each triangle of their fans."""
    counts = _triangle_counts(lengths)
    return {name: np.repeat(values, counts) for name, values in _plain(face).items()}


def _triangle_counts(lengths: NDArray[Any]) -> NDArray[np.int64]:
    return np.maximum(lengths.astype(np.int64) - 2, 0)


def _columns(table: dict[str, Any], names: Any) -> NDArray[np.float32]:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.stack([np.asarray(table[name], np.float32) for name in names], axis=1)


def _fans(lengths: NDArray[Any], corners: NDArray[Any]) -> NDArray[np.int64]:
    """Return polygons as triangles around their first corners."""
    lengths, corners = lengths.astype(np.int64), corners.astype(np.int64)
    if len(lengths) and (lengths == 3).all():
        return corners.reshape(-1, 3)
    starts = np.cumsum(lengths) - lengths
    count = np.maximum(lengths - 2, 0)
    first = np.repeat(starts, count)
    step = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    return corners[np.stack([first, first + step + 1, first + step + 2], axis=1)]
