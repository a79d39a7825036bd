"""NumPy's arrays as images: numbers as they are, rows from the top."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, numpy_files, output_files
from clpt.images import sizes
from clpt.images.stored import Stored


def read(path: Path) -> Stored:
    """Read (h, w) or (h, w, c) of any number, bytes as in a .png. Raises SceneError for others."""
    array = numpy_files.array(path)
    if array.ndim > 1:
        sizes.check_size(path, *array.shape[1::-1])
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


def write(path: Path, array: NDArray[Any]) -> None:
    """Write an array of one axis or more as .npy. Raises OSError.

    Not by `np.save`, which does not tell that the last bytes were refused, as by a full disk.
    """
    array = np.ascontiguousarray(array)
    with output_files.replacing(path) as partial, partial.open("wb") as file:
        header = np.lib.format.header_data_from_array_1_0(array)
        np.lib.format.write_array_header_1_0(file, header)
        file.write(array.data)
