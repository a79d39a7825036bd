"""Triangle meshes from PLY files (Turk 1994), also gzip's: ascii, and binary of both byte orders.

Polygons and strips become triangles; corners of faces may have texture coordinates of their own, as
photogrammetry has them.

Rows of equal length are read at once. A table is {column: values}; a list column is a pair of
lengths, and all values in a row.
"""

from __future__ import annotations

import dataclasses
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats.meshes.triangles import Triangles, indices, see_through
from clpt.formats.reading import read_bytes
from clpt.geometry.polygons import triangulate

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
        words = input_files.decode(line).split()
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
                textures.append(input_files.decode(line).split(None, 2)[2].strip())
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                shown = input_files.decode(line)[:60]
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
    words = input_files.numbers(data, start)
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


NORMAL = ("nx", "ny", "nz")
UVS = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
CORNERS = ("vertex_indices", "vertex_index")
ELEMENTS = ("vertex", "face", "tristrips")
RESTART = -1  # between the strips of a list
LEFT_OUT = ("material_index", "ambient_red", "specular_red", "specular_power")
PER_BYTE = 8  # bytes of memory for each of the file, while it is read
MOST_CORNERS = 1 << 16  # of a polygon


def read(path: Path) -> Triangles:
    """Read a file. Raises SceneError if it is broken, or has no vertices or faces."""
    data = input_files.plain(read_bytes(path))
    budget.check(PER_BYTE * len(data), "its tables", path)
    try:
        return _triangles(*read_tables(data))
    except SceneError as error:
        message = f"cannot be read as a .ply mesh: {error.message}"
        raise SceneError(message, file=path, line=error.line) from None


def _triangles(header: Header, tables: Columns) -> Triangles:
    vertex, face = _plain(tables.get("vertex", {})), tables.get("face", {})
    if not all(name in vertex for name in "xyz"):
        raise SceneError("it holds no triangles: it has no vertices with x, y and z")
    uvs = next((pair for pair in UVS if all(name in vertex for name in pair)), None)
    normals = NORMAL if all(name in vertex for name in NORMAL) else None
    known = {*"xyz", *(normals or ()), *(uvs or ())}
    counts, corners = _corners(face)
    vertices = _columns(vertex, "xyz")
    triangles, polygon = triangulate(vertices, counts, corners)
    strips = _strips(tables.get("tristrips", {}))
    if not (len(strips) or any(name in face for name in CORNERS)):
        held = ", ".join(repr(element.name[:40]) for element in header.elements[:5])
        raise SceneError(f"it holds no triangles: its elements are {held}")
    rows = np.r_[polygon, np.full(len(strips), len(counts))]
    mesh = Triangles(
        vertices=vertices,
        faces=np.concatenate([corners[triangles], strips]),
        normals=None if normals is None else _columns(vertex, normals),
        uvs=None if uvs is None else _columns(vertex, uvs),
        columns={
            "vertex": {name: values for name, values in vertex.items() if name not in known},
            "face": {name: _of_faces(values)[rows] for name, values in _plain(face).items()},
        },
        polygons=np.r_[polygon, len(counts) + np.arange(len(strips))],
        textures=header.textures,
        warnings=_left_out(tables),
    )
    if "texcoord" in face and (uvs is None or header.textures):
        _with_corner_uvs(mesh, counts, face["texcoord"], triangles, len(strips))
    return mesh


def _of_faces(values: NDArray[Any]) -> NDArray[Any]:
    """Return a column of polygons with a zero more, which is that of strips."""
    return np.append(values, np.zeros(1, values.dtype))


def _corners(face: dict[str, Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return how many corners each polygon has, and the vertices of all."""
    lists = next((face[name] for name in CORNERS if name in face), None)
    if not isinstance(lists, tuple):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    counts = lists[0].astype(np.int64)
    if len(counts) and counts.max() > MOST_CORNERS:
        raise SceneError(f"a polygon has {counts.max()} corners, more than {MOST_CORNERS}")
    return counts, indices(lists[1])


def _strips(table: dict[str, Any]) -> NDArray[np.int64]:
    """Return the triangles (m, 3) of lists of strips: of each vertex with the two before it.

    -1 begins another strip; triangles that name a vertex twice only join two parts.
    """
    lists = next((table[name] for name in CORNERS if name in table), None)
    if not isinstance(lists, tuple) or not len(lists[1]):
        return np.zeros((0, 3), np.int64)
    values = indices(lists[1])
    begins = np.zeros(len(values), np.bool_)
    begins[(np.cumsum(lists[0]) - lists[0]).astype(np.int64)[lists[0] > 0]] = True
    begins[1:] |= values[:-1] == RESTART
    at = np.arange(len(values))
    place = at - np.maximum.accumulate(np.where(begins, at, 0))  # in the strip
    last = np.flatnonzero((place >= 2) & (values != RESTART))
    odd = place[last] % 2 == 1
    a, b, c = values[last - 2], values[last - 1], values[last]
    corners = np.stack([np.where(odd, b, a), np.where(odd, a, b), c], axis=1)
    return corners[(a != b) & (b != c) & (c != a)]


def _with_corner_uvs(
    mesh: Triangles,
    counts: NDArray[np.int64],
    texcoord: Any,
    triangles: NDArray[np.int32],
    strips: int,
) -> None:
    """Give a mesh the uvs that its faces list for their corners; split vertices with several."""
    lengths, values = texcoord
    complete = (lengths == 2 * counts) & (counts > 0)
    if (~complete & (counts > 2)).any() or strips:
        mesh.warnings.append("faces without texture coordinates have those of one point")
    if not complete.any():
        return
    uvs = np.zeros((int(counts.sum()), 2), np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        face_uvs = values[np.repeat(complete, lengths)].reshape(-1, 2).astype(np.float32)
    uvs[np.repeat(complete, counts)] = face_uvs
    uvs = np.concatenate([uvs[triangles.reshape(-1)], np.zeros((3 * strips, 2), np.float32)])
    _, uv = np.unique(np.ascontiguousarray(uvs).view(np.uint64), return_inverse=True)
    vertex = mesh.faces.reshape(-1)
    if len(vertex) and (vertex.min() < 0 or vertex.max() >= len(mesh.vertices)):
        return  # refused later, by its number
    _, first, faces = np.unique(
        vertex * (uv.max(initial=0) + 1) + uv.reshape(-1), return_index=True, return_inverse=True
    )
    named = vertex[first]
    mesh.vertices, mesh.faces, mesh.uvs = mesh.vertices[named], faces.reshape(-1, 3), uvs[first]
    mesh.normals = None if mesh.normals is None else mesh.normals[named]
    mesh.columns["vertex"] = {n: column[named] for n, column in mesh.columns["vertex"].items()}


def _left_out(tables: Columns) -> list[str]:
    """Return warnings of a file's visible properties that are not read."""
    messages = [f"element {name[:40]!r} left out" for name in tables if name not in ELEMENTS]
    for element in ("vertex", "face"):
        columns = _plain(tables.get(element, {}))
        messages += [f"{element} {name} left out" for name in LEFT_OUT if name in columns]
        if see_through(columns):
            messages.append(f"{element} alpha left out")
    return messages


def _plain(table: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the columns that are no lists."""
    return {name: values for name, values in table.items() if isinstance(values, np.ndarray)}


def _columns(table: dict[str, Any], names: Sequence[str]) -> NDArray[np.float32]:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.stack([np.asarray(table[name], np.float32) for name in names], axis=1)
