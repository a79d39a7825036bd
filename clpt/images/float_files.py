"""Pictures as plain numbers: portable float maps (.pfm), and NumPy's arrays (.npy).

A portable float map is a text header, then floats, rows from the bottom (Debevec's description).
The scale's sign says the order of bytes, its absolute value is a factor. "PF4", of four channels,
is an extension of ImageMagick and others.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats32
from clpt.errors import SceneError
from clpt.files import budget, numpy_files, output_files
from clpt.images import checks
from clpt.images.stored import Stored

HEADER = re.compile(rb"(P[Ff]|PF4)\s+(\d+)\s+(\d+)\s+([-+]?[.\deE+-]+)\s")
HEADER_BYTES = 256
CHANNELS = {b"Pf": 1, b"PF": 3, b"PF4": 4}


def read_pfm(path: Path) -> Stored:
    """Read a file. Raises SceneError if it is not a PFM, or ends early."""
    with path.open("rb") as file:
        header = HEADER.match(file.read(HEADER_BYTES))
    if header is None:
        message = "not a PFM image: its header is not 'PF' or 'Pf', width, height, scale"
        raise SceneError(message, file=path)
    width, height, channels = int(header[2]), int(header[3]), CHANNELS[header[1]]
    scale = _scale(path, header[4])
    checks.check_size(path, width, height)
    count = width * height * channels
    budget.check(8 * count, "its pixels", path)
    begin, size = header.end(), path.stat().st_size
    if size - begin == 4 * count + 1 and header[0].endswith(b"\r"):
        begin += 1  # a header of Windows's lines
    if size - begin < 4 * count:
        message = f"the file ends early: {width}x{height} pixels are announced"
        raise SceneError(message, file=path)
    values = np.fromfile(path, "<f4" if scale < 0.0 else ">f4", count, offset=begin)
    rows = values.reshape(height, width, channels)[::-1].astype(np.float32)
    return Stored(rows if abs(scale) == 1.0 else rows * np.float32(abs(scale)), encoded=False)


def _scale(path: Path, text: bytes) -> float:
    try:
        scale = float(text)
    except ValueError:
        scale = math.nan
    if not math.isfinite(scale) or scale == 0.0:
        said = text.decode("ascii", "replace")
        raise SceneError(f"its scale must be a number other than 0, not {said!r}", file=path)
    return scale


def write_pfm(path: Path, pixels: Floats32) -> None:
    """Write (h, w, 1, 3 or 4), without alpha."""
    pixels = pixels[..., :3]
    kind = "PF" if pixels.shape[2] == 3 else "Pf"
    head = f"{kind}\n{pixels.shape[1]} {pixels.shape[0]}\n-1.0\n"
    output_files.write(path, head.encode() + pixels[::-1].astype("<f4").tobytes())


def read_npy(path: Path) -> Stored:
    """Read (h, w) or (h, w, c) of any number, bytes as in a .png. Raises SceneError for others."""
    array = numpy_files.array(path)
    if array.ndim > 1:
        checks.check_size(path, *array.shape[1::-1])
    if array.ndim not in (2, 3) or array.dtype.kind not in "fiu":
        message = f"not an image: an array of {array.dtype}, shape {array.shape}"
        raise SceneError(message, file=path)
    budget.check(4 * array.size, "its array", path)
    shaped = array if array.ndim == 3 else array[..., None]
    if array.dtype == np.uint8:
        return Stored(np.array(shaped), encoded=True)
    notes: tuple[str, ...] = ()
    if array.dtype.kind in "iu":
        notes = (f"its numbers of type {array.dtype} are taken as they are: divide them by white",)
    return Stored(np.array(shaped, np.float32), encoded=False, colour_notes=notes)


def write_npy(path: Path, array: NDArray[Any]) -> None:
    """Write an array with axes as .npy. Raises OSError.

    Not by `np.save`, which does not tell that the last bytes were refused, as by a full disk.
    """
    array = np.ascontiguousarray(array)
    with output_files.replacing(path) as partial, partial.open("wb") as file:
        header = np.lib.format.header_data_from_array_1_0(array)
        np.lib.format.write_array_header_1_0(file, header)
        file.write(array.data)
