"""Files of many spheres (.npz), and of curves as Mitsuba has them."""

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


PER_BYTE = 64  # bytes of memory for each of the file, while it is read


def read_strands(path: Path) -> dict[str, Any]:
    """Return `points` (n, 4) float32 and `lengths` (k,) int64, as `Curves` takes them.

    Raises SceneError with the line that is not four numbers, and for an empty file.
    """
    data = input_files.plain(input_files.read_bytes(path))
    budget.check(PER_BYTE * len(data), "its points", path)
    rows = [line.split() for line in data.split(b"\n")]
    columns = np.array([len(row) for row in rows])
    short = (columns > 0) & (columns < 4)
    if short.any():
        line = 1 + int(np.argmax(short))
        raise SceneError("needs x, y, z and a radius", file=path, line=line)
    occupied = columns > 0
    if not occupied.any():
        raise SceneError("has no points", file=path)
    words = [word for row in rows for word in row[:4]]
    try:
        points = np.array(words).astype(np.float64).reshape(-1, 4)
    except ValueError:
        line = _wrong(rows)
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


def _wrong(rows: list[list[bytes]]) -> int:
    """Return the first line with a word among its first four that is no number."""
    for line, row in enumerate(rows, 1):
        for word in row[:4]:
            try:
                float(word)
            except ValueError:
                return line
    return len(rows)
