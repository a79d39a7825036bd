"""Files of lenses by their suffix, and the library of those that come with clpt."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from clpt.errors import SceneError, UnknownKindError
from clpt.files import input_files, text
from clpt.lenses import optical_bench, pbrt_rows, zemax
from clpt.lenses.prescription import Prescription

ROOT = Path(__file__).parent / "library"
READERS = {".dat": pbrt_rows.parse, ".zmx": zemax.parse, ".txt": optical_bench.parse}
LARGEST = 1 << 22  # bytes of a file


def names() -> tuple[str, ...]:
    """Names that `library` knows."""
    return tuple(sorted(path.stem for path in ROOT.glob("*.txt")))


@cache
def library(name: str) -> Prescription:
    """Return a lens of the library by its name. Raises UnknownKindError."""
    if name not in names():
        raise UnknownKindError("lens", name, names())
    return read(ROOT / f"{name}.txt")


def read(path: str | Path, aperture: float | None = None) -> Prescription:
    """Read a lens: pbrt's rows (.dat), a sequential Zemax file (.zmx) or Optical Bench text (.txt).

    aperture: diameter of the stop [mm], None: what the file says. Raises SceneError with the line.
    """
    path = Path(path)
    if path.suffix.lower() not in READERS:
        raise SceneError(f"a lens file ends in {', '.join(READERS)}", file=path)
    data = input_files.read_bytes(path)
    if len(data) > LARGEST:
        raise SceneError("is too large for a lens", file=path)
    lens = READERS[path.suffix.lower()](text.decode(data), path)
    return lens if aperture is None else lens.with_stop(0.5 * aperture)
