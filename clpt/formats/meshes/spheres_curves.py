"""Files of many spheres (.npz), and of curves as Mitsuba 3 and 0.x have them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from clpt.errors import SceneError
from clpt.files import budget, input_files, numpy_files, output_files
from clpt.scene.shapes import Spheres
from clpt.scene.textures import ATTRIBUTES

ARRAYS = ("centers", "radii")


def read_spheres(path: Path) -> dict[str, Any]:
    """Return the parameters of `spheres` that are in a file. Raises SceneError."""
    arrays = numpy_files.arrays(path)
    for name in arrays:
        if name not in ARRAYS and not name.startswith(ATTRIBUTES):
            message = (
                f"holds {name!r}; there may be centers, radii and attributes {ATTRIBUTES[0]}..."
            )
            raise SceneError(message, file=path)
    if "centers" not in arrays:
        raise SceneError("has no array 'centers'", file=path)
    geometry: dict[str, Any] = {name: arrays.pop(name) for name in ARRAYS if name in arrays}
    return {**geometry, "attributes": arrays}


def write_spheres(path: Path, spheres: Spheres) -> None:
    """Write what `read` returns of spheres. Raises OSError."""
    with output_files.replacing(path) as partial:
        np.savez(partial, centers=spheres.centers, radii=spheres.radii, **spheres.attributes)


BINARY_HAIR = b"BINARY_HAIR"
PER_BYTE = 64  # bytes of memory for each of the file, while it is read


def read_hair(path: Path) -> dict[str, Any]:
    """Return `points` (n, 3) float32 and `lengths` (k,) int64 of a file of Mitsuba 0.x's `hair`.

    A binary file has a count of points, and floats where infinity begins a strand; a text file has
    a point a line: src/shapes/hair.cpp. Raises SceneError for a file that is broken or empty.
    """
    data = input_files.read_bytes(path)
    if not data.startswith(BINARY_HAIR):
        return read_strands(path, "x, y and z")
    body = data[len(BINARY_HAIR) :]
    count = int.from_bytes(body[:4], "little")
    values = np.frombuffer(body, "<f4", (len(body) - 4) // 4, 4) if len(body) > 4 else np.empty(0)
    first = np.flatnonzero(np.isinf(values))
    points = np.delete(values, first)
    if count == 0 or points.size < 3 * count:
        raise SceneError(f"names {count} points, and holds {points.size // 3}", file=path)
    starts = np.unique(np.r_[0, (first - np.arange(first.size)) // 3])
    budget.take(4 * points.size, "its points", path)
    lengths = np.diff(np.r_[starts[starts < count], count])
    return {"points": points[: 3 * count].reshape(-1, 3).copy(), "lengths": lengths}


def read_strands(path: Path, names: str = "x, y, z and a radius") -> dict[str, Any]:
    """Return `points` (n, 4) float32 and `lengths` (k,) int64, as `Curves` takes them.

    names: of the numbers of a point; without a radius there are three. Raises SceneError with the
    line that has fewer numbers, and for an empty file.
    """
    width = len(names.replace(" and", ",").split(","))
    data = input_files.plain(input_files.read_bytes(path))
    budget.check(PER_BYTE * len(data), "its points", path)
    rows = [line.split() for line in data.split(b"\n")]
    columns = np.array([len(row) for row in rows])
    short = (columns > 0) & (columns < width)
    if short.any():
        line = 1 + int(np.argmax(short))
        raise SceneError(f"needs {names}", file=path, line=line)
    occupied = columns > 0
    if not occupied.any():
        raise SceneError("has no points", file=path)
    words = [word for row in rows for word in row[:width]]
    try:
        points = np.array(words).astype(np.float64).reshape(-1, width)
    except ValueError:
        line = _wrong(rows, width)
        comma = input_files.comma_message(input_files.decode(b" ".join(rows[line - 1])))
        raise SceneError(comma or "is not all numbers", file=path, line=line) from None
    starts = np.flatnonzero(occupied & ~np.r_[False, occupied[:-1]])
    ends = np.flatnonzero(occupied & ~np.r_[occupied[1:], False])
    with np.errstate(over="ignore"):  # lowering refuses what is not finite
        budget.take(4 * points.size, "its points", path)
        return {"points": points.astype(np.float32), "lengths": ends - starts + 1}


def write_strands(path: Path, points: object, lengths: Any) -> None:
    """Write strands such that `read` gives the same float32 back."""
    rows = [" ".join(f"{x:.9g}" for x in row) for row in np.asarray(points, np.float32).tolist()]
    ends = np.cumsum(lengths if len(lengths) else [len(rows)])
    strands = ["\n".join(rows[a:b]) for a, b in zip([0, *ends], ends, strict=False)]
    output_files.write_text(path, "\n\n".join(strands) + "\n")


def _wrong(rows: list[list[bytes]], width: int) -> int:
    """Return the first line with a word among its first `width` that is no number."""
    for line, row in enumerate(rows, 1):
        for word in row[:width]:
            try:
                float(word)
            except ValueError:
                return line
    return len(rows)
