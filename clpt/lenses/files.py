"""Readers of lens files by suffix, and the library of lenses that ships with clpt."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from clpt.errors import SceneError, UnknownKindError
from clpt.files import input_files, text
from clpt.lenses import optical_bench, zemax
from clpt.lenses.glasses import AIR, by_number
from clpt.lenses.lines import Line, Row, assembled
from clpt.lenses.prescription import Prescription, Surface

ROOT = Path(__file__).parent / "library"
LARGEST = 1 << 22  # bytes of a file
PBRT_COLUMNS = ("a radius", "a thickness", "an index", "a diameter")


def _pbrt_rows(text: str, file: Path) -> Prescription:
    """Read rows of pbrt's `realistic` camera: radius, thickness, index and diameter [mm].

    The stop is the row whose radius is 0; its index is not read. `#` starts a comment.
    """
    rows, comments = [], []
    for number, written in enumerate(text.splitlines(), 1):
        values, mark, comment = written.partition("#")
        if mark and comment.strip():
            comments.append(comment.strip())
        line = Line(file, number, tuple(values.split()))
        if not line.fields:
            continue
        if len(line.fields) != len(PBRT_COLUMNS):
            raise line.error(f"a row has {len(PBRT_COLUMNS)} numbers, not {len(line.fields)}")
        radius, thickness, index, diameter = (
            line.numeral(i, name) for i, name in enumerate(PBRT_COLUMNS)
        )
        stop = radius == 0.0
        with line.locating():
            glass = AIR if stop or index == 0.0 else by_number(index)
        surface = Surface(radius, thickness, glass, 0.5 * diameter, stop=stop)
        rows.append(Row(line, surface))
    return assembled(rows, file, file.stem, comments[0] if comments else "")


READERS = {".dat": _pbrt_rows, ".zmx": zemax.parse, ".txt": optical_bench.parse}


def names() -> tuple[str, ...]:
    """Return the names of the library's lenses."""
    return tuple(sorted(path.stem for path in ROOT.glob("*.txt")))


@cache
def library(name: str) -> Prescription:
    """Return a lens of the library by its name. Raises UnknownKindError."""
    if name not in names():
        raise UnknownKindError("lens", name, names())
    return read(ROOT / f"{name}.txt")


def read(path: str | Path, aperture: float | None = None) -> Prescription:
    """Read a lens: pbrt's rows (.dat), a sequential Zemax file (.zmx) or Optical Bench text (.txt).

    aperture: diameter of the stop [mm], None: the file's. Raises SceneError with the line.
    """
    path = Path(path)
    if path.suffix.lower() not in READERS:
        raise SceneError(f"a lens file ends in {', '.join(READERS)}", file=path)
    data = input_files.read_bytes(path)
    if len(data) > LARGEST:
        raise SceneError("is too large for a lens", file=path)
    lens = READERS[path.suffix.lower()](text.decode(data), path)
    return lens if aperture is None else lens.with_stop(0.5 * aperture)
