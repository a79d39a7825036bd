"""Triangle meshes from STL files (3D Systems 1988), text and binary, with some programs' colours.

The content tells which it is: a binary file has the size that its count of triangles asks for, or
more; a text has words where the other has numbers. Both may begin with "solid".
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats.meshes.triangles import Triangles
from clpt.formats.reading import read_bytes
from clpt.geometry.polygons import triangulate

HEAD = 84  # bytes of a binary file before its triangles: a comment, and their number
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
CHUNK = 1 << 24  # bytes of a text whose words are told apart at a time
BEGINNING = 1 << 12  # bytes that hold the first words of a text
WORDS = re.compile(rb"\b(solid|facet)\b", re.IGNORECASE)
# "solid", or "endsolid", and a name up to the end of the line or the first facet; in lower case.
SOLID = re.compile(rb"solid(?:(?<!\Ssolid)|(?<=endsolid))\b((?:(?!\bfacet[ \t]+normal\b)[^\n])*)")
END = re.compile(rb"end[ \t]*\Z")
ROW = (
    b"facet normal x y z outer loop vertex x y z vertex x y z vertex x y z endloop endfacet".split()
)
PER_BYTE = 16  # bytes of memory for each of the file, while it is read
KEYWORDS = [i for i, word in enumerate(ROW) if word not in (b"x", b"y", b"z")]
PLACES = [i for i, word in enumerate(ROW) if word in (b"x", b"y", b"z")][3:]
PLAIN = 203  # of 255 in sRGB: the grey of a mesh without colours
OWN, RED, GREEN, BLUE = 1 << 15, 10, 5, 0  # of an attribute: a flag, and shifts of 5 bits


def read(path: Path) -> list[Triangles]:
    """Read the solids of a file. Raises SceneError with the broken line."""
    data = read_bytes(path)
    budget.check(PER_BYTE * len(data), "its triangles", path)
    try:
        return _text(input_files.plain(data)) if _is_text(data) else [_binary(data)]
    except SceneError as error:
        message = f"cannot be read as a .stl mesh: {error.message}"
        raise SceneError(message, file=path, line=error.line) from None


def _is_text(data: bytes) -> bool:
    if len(data) >= HEAD and len(data) == HEAD + FACET.itemsize * _count(data):
        return False
    beginning = input_files.plain(data[:BEGINNING])
    return b"\0" not in beginning[:HEAD] and WORDS.search(beginning) is not None


def _count(data: bytes) -> int:
    return int.from_bytes(data[HEAD - 4 : HEAD], "little")


def _binary(data: bytes) -> Triangles:
    if len(data) < HEAD:
        raise SceneError("it ends within its header")
    count, held = _count(data), (len(data) - HEAD) // FACET.itemsize
    if held < count:
        raise SceneError(f"it ends early: it holds {held} of {count} triangles")
    facets = np.frombuffer(data, FACET, count, HEAD)
    mesh = _soup(facets["corners"].reshape(-1, 3))
    more = len(data) - HEAD - count * FACET.itemsize
    if more and data[HEAD + count * FACET.itemsize :].strip(b"\0\r\n \t"):
        mesh.warnings.append(f"{more} bytes after the {count} triangles left out")
    colours = _colours(data[: HEAD - 4], facets["attribute"])
    if colours is not None:
        names = ("red", "green", "blue")
        mesh.columns["face"] = {name: colours[:, i] for i, name in enumerate(names)}
    return mesh


def _colours(head: bytes, attributes: NDArray[np.uint16]) -> NDArray[np.uint8] | None:
    """Return bytes (n, 3) of sRGB; None for a file without colours.

    Materialise's Magics writes a default colour into the header, and in an attribute of two bytes
    red first, without the flag. VisCAM has no default, and blue first, with the flag.
    """
    magics = head.find(b"COLOR=")
    flagged = (attributes & OWN) > 0
    if magics < 0 and not flagged.any():
        return None
    shifts = (BLUE, GREEN, RED) if magics >= 0 else (RED, GREEN, BLUE)
    specific = ~flagged if magics >= 0 else flagged
    fives = np.stack([attributes >> shift & 31 for shift in shifts], axis=1).astype(np.int64)
    default = np.frombuffer(head[magics + 6 : magics + 9].ljust(3, b"\0"), np.uint8)
    other = default if magics >= 0 else np.full(3, PLAIN, np.uint8)
    return np.where(specific[:, None], (fives * 255 + 15) // 31, other).astype(np.uint8)


def _text(data: bytes) -> list[Triangles]:
    """Return a mesh for each solid of a text."""
    data = data.rstrip(input_files.FILLING).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    lower = data.lower()
    solids, name, start = [], "", 0
    for solid in [*SOLID.finditer(lower), None]:
        stop = len(data) if solid is None else solid.start()
        closes = END.search(lower[max(start, stop - 8) : stop])
        part = slice(start, stop - (len(closes[0]) if closes else 0))
        if lower[part].strip():
            corners = _facets(lower[part])
            first = 1 + data.count(b"\n", 0, start)
            solids.append(_loops(data[part], first) if corners is None else _soup(corners))
            solids[-1].name = name
        if solid is not None:
            start = solid.end()
            name = name if closes else input_files.decode(data[slice(*solid.span(1))]).strip()
    return solids


def _facets(data: bytes) -> NDArray[np.float64] | None:
    """Return the corners (3n, 3) of a text of whole facets, in lower case; None for any other."""
    at, vertices = 0, []
    while at < len(data):
        end = data.find(ROW[-1], at + CHUNK)
        end = len(data) if end < 0 else end + len(ROW[-1])
        words = data[at:end].split()
        columns = [words[i :: len(ROW)] for i in range(len(ROW))]
        count, at = len(columns[0]), end
        if any(columns[i].count(ROW[i]) < count for i in KEYWORDS) or len(words) % len(ROW):
            return None
        try:
            places = [np.array(columns[i], np.float64) for i in PLACES]
        except ValueError:
            return None
        vertices.append(np.stack(places, axis=1).reshape(-1, 3))
    return np.concatenate(vertices)


def _loops(data: bytes, line: int) -> Triangles:
    """As `_facets`, line by line; loops may have more than 3 corners. line: number of the first.

    Raises SceneError with the line.
    """
    corners: list[list[float]] = []
    counts: list[int] = []
    open_ = False
    for number, content in enumerate(data.split(b"\n"), line):
        words = content.split()
        if not words:
            continue
        shown = input_files.decode(content).strip()[:60]
        match words[0].lower():
            case b"outer":
                open_, first = True, len(corners)
            case b"endloop" if open_:
                open_ = False
                counts.append(len(corners) - first)
            case b"vertex" if open_:
                corners.append(_numbers(words[1:], shown, number))
            case word if word not in (b"facet", b"endfacet"):
                raise SceneError(f"a line begins with {shown!r}", line=number)
    if open_:
        raise SceneError("it ends within a facet", line=number)
    vertices = np.array(corners, np.float64).reshape(-1, 3)
    triangles, _ = triangulate(vertices, np.array(counts, np.int64), np.arange(len(vertices)))
    return Triangles(_float32(vertices), triangles.astype(np.int64))


def _numbers(words: list[bytes], shown: str, line: int) -> list[float]:
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != 3:
        comma = input_files.comma_message(shown)
        raise SceneError(comma or f"a vertex needs three numbers: {shown!r}", line=line)
    return numbers


def _soup(corners: NDArray[np.float64] | NDArray[np.float32]) -> Triangles:
    faces = np.arange(len(corners), dtype=np.int64).reshape(-1, 3)
    return Triangles(_float32(corners), faces)


def _float32(corners: NDArray[np.float64] | NDArray[np.float32]) -> NDArray[np.float32]:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.ascontiguousarray(corners, np.float32)
