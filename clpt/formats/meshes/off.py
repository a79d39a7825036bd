"""Triangle meshes from OFF files, as Geomview's manual has them (Phillips and others, OFF(5)).

Numbers are divided by blanks or ends of lines; only the colour of a face ends with its line.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, Integers
from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats.meshes.triangles import Triangles, indices, see_through
from clpt.formats.reading import read_bytes
from clpt.geometry.polygons import triangulate

HEADER = re.compile(rb"\s*((?:ST)?C?N?4?n?(?:OFF|Off|off))?(\s+BINARY\b)?")
PER_BYTE = 32  # bytes of memory for each of the file, while it is read
COMMENT = re.compile(rb"#[^\r\n]*")
COLOUR = ("red", "green", "blue", "alpha")
GREY = (203, 0.6)  # of a mesh without colours: in bytes of sRGB, and linear


def read(path: Path) -> list[Triangles]:
    """Read a file. Raises SceneError with the line of a word that is not a number."""
    data = COMMENT.sub(b"", input_files.plain(read_bytes(path))).rstrip(input_files.FILLING)
    budget.check(PER_BYTE * len(data), "its numbers", path)
    try:
        return [_read(data)]
    except SceneError as error:
        message = f"cannot be read as a .off mesh: {error.message}"
        raise SceneError(message, file=path, line=error.line) from None


@dataclass
class _Numbers:
    """The numbers of a file, and where those of each line end; at: how many have been taken."""

    words: list[bytes]
    values: Floats
    ends: Integers
    at: int = 0

    def take(self, count: int, quantity: str) -> Floats:
        """Return the next numbers."""
        if count > len(self.values) - self.at:
            raise SceneError(f"it ends within its {quantity}")
        self.at += count
        return self.values[self.at - count : self.at]

    def count(self, quantity: str) -> int:
        """Return the next number, which says how many of something follow."""
        value = float(self.take(1, quantity)[0])
        if not (0.0 <= value < 2.0**31 and value == int(value)):
            raise SceneError(f"it has {value:g} {quantity}")
        return int(value)

    def rest(self) -> int:
        """Return how many numbers are left on the line of the last number taken."""
        return int(self.ends[np.searchsorted(self.ends, self.at)]) - self.at

    def width(self) -> int:
        """Return how many numbers the next line has; 0 at the end."""
        line = int(np.searchsorted(self.ends, self.at, "right"))
        return int(self.ends[line]) - self.at if line < len(self.ends) else 0


def _read(data: bytes) -> Triangles:
    head = HEADER.match(data)
    assert head is not None  # all of it may be missing
    if head[2]:
        raise SceneError("it is a binary OFF file; save it as text")
    kind = (head[1] or b"").decode()
    values = input_files.numbers(data, head.end(1) if head[1] else 0)
    body = data[head.end(1) if head[1] else 0 :]
    widths = np.array([len(line.split()) for line in body.splitlines()], np.int64)
    numbers = _Numbers(body.split(), values, np.cumsum(widths[widths > 0]))
    dimensions = numbers.count("dimensions") if "n" in kind else 3
    if not 1 <= dimensions <= 3:
        raise SceneError(f"its vertices have {dimensions} dimensions, not 3")
    vertices, faces = numbers.count("vertices"), numbers.count("faces")
    if numbers.rest() or numbers.width() == 1:  # some programs leave it out
        numbers.count("edges")
    warnings: list[str] = []
    points, attributes = _vertices(numbers, kind, dimensions, vertices, warnings)
    counts, corners, colours = _faces(numbers, faces, warnings)
    triangles, polygon = triangulate(points, counts, corners)
    return Triangles(
        vertices=points,
        faces=corners[triangles],
        columns={
            "vertex": attributes.pop("colours"),
            "face": {n: c[polygon] for n, c in colours.items()},
        },
        warnings=warnings,
        **attributes,
    )


def _vertices(
    numbers: _Numbers, kind: str, dimensions: int, count: int, warnings: list[str]
) -> tuple[NDArray[np.float32], dict[str, Any]]:
    """Return places (n, 3), and by name normals, uvs and the columns of colours."""
    homogeneous, coloured = "4" in kind, "C" in kind
    sizes = [dimensions + homogeneous, 3 * ("N" in kind), 0, 2 * ("ST" in kind)]
    width = numbers.width()
    if coloured:
        sizes[2] = 3 if width == sum(sizes) + 3 else 4
    stride = sum(sizes)
    lines = np.diff(_lines(numbers, count))
    if width > stride and len(lines) == count and (lines == width).all():
        warnings.append(f"{width - stride} further numbers of each vertex left out")
        stride = width
    rows = numbers.take(stride * count, f"{count} vertices").reshape(count, stride)
    places, normals, colours, uvs = np.split(rows[:, : sum(sizes)], np.cumsum(sizes)[:-1], axis=1)
    points = np.zeros((count, 3))
    with np.errstate(all="ignore"):
        points[:, :dimensions] = places[:, :dimensions] / (places[:, -1:] if homogeneous else 1.0)
        attributes = {
            "normals": normals.astype(np.float32) if sizes[1] else None,
            "uvs": uvs.astype(np.float32) if sizes[3] else None,
            "colours": _columns(colours, bool((colours > 1.0).any()), "vertex", warnings),
        }
        return points.astype(np.float32), attributes


def _lines(numbers: _Numbers, count: int) -> Integers:
    """Return where the next lines begin, and the last line ends; fewer at the end of the file."""
    line = int(np.searchsorted(numbers.ends, numbers.at, "right"))
    return np.r_[numbers.at, numbers.ends[line : line + count]]


def _faces(
    numbers: _Numbers, count: int, warnings: list[str]
) -> tuple[Integers, Integers, dict[str, NDArray[Any]]]:
    """Return how many corners each face has, the vertices of all, and the columns of colours."""
    begins, ends = _places(numbers, count)
    counts = numbers.values[begins].astype(np.int64)
    starts = np.cumsum(counts) - counts
    places = np.repeat(begins + 1 - starts, counts) + np.arange(counts.sum())
    corners = indices(numbers.values[places])
    more = ends - begins - 1 - counts
    if (more == 1).any():
        warnings.append("colours of faces by their number in a list left out")
    coloured = np.flatnonzero((more == 3) | (more == 4))
    if not len(coloured):
        return counts, corners, {}
    first = (begins + 1 + counts)[coloured]
    exact = any(numbers.words[i + k].strip(b"-+0123456789") for i in first for k in range(3))
    colours = np.tile([*[GREY[exact]] * 3, 1.0 if exact else 255.0], (count, 1))
    for k in range(4):
        some = more[coloured] > k
        colours[coloured[some], k] = numbers.values[first[some] + k]
    return counts, corners, _columns(colours, not exact, "face", warnings)


def _places(numbers: _Numbers, count: int) -> tuple[Integers, Integers]:
    """Return where each face begins, by its count of corners, and where its numbers end.

    A face has its line to itself, or goes on over several.
    """
    values, lines = numbers.values, _lines(numbers, count)
    if len(lines) == count + 1:
        begins, widths = lines[:-1], np.diff(lines)
        if ((values[begins] >= 0) & (values[begins] < widths)).all():
            return begins, lines[1:]
    rows = []
    for _ in range(count):
        begin = numbers.at
        numbers.take(numbers.count("corners"), f"{count} faces")
        remaining = numbers.rest()
        numbers.at += remaining if remaining in (1, 3, 4) else 0
        rows.append((begin, numbers.at))
    extents = np.array(rows, np.int64).reshape(-1, 2)
    return extents[:, 0], extents[:, 1]


def _columns(
    colours: Floats, bytes_: bool, element: str, warnings: list[str]
) -> dict[str, NDArray[Any]]:
    """Return colours (n, 3 or 4) as columns: bytes, or floats."""
    stored = np.clip(np.nan_to_num(colours), 0, 255).astype(np.uint8) if bytes_ else colours
    columns = {name: stored[:, i] for i, name in enumerate(COLOUR[: colours.shape[1]])}
    if see_through(columns):
        warnings.append(f"{element} alpha left out")
    columns.pop("alpha", None)
    return columns
