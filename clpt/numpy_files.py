"""NumPy's files (.npy, .npz) of strangers: nothing is unpickled, and no header's word is taken."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Collection
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from clpt import budget, input_files
from clpt.errors import SceneError

_SUFFIX = ".npy"  # of the members of an .npz


def array(path: Path) -> NDArray[Any]:
    """Return the array of a .npy file, which stays on the disk until it is looked at.

    Raises SceneError if it is not such a file.
    """
    with input_files.opened(path) as file:
        try:
            start, dtype, shape, fortran = _header(file)
        except Exception as error:  # NumPy's parser raises tokenize's own, and more
            raise _broken(path, ".npy", error) from None
    _check_bytes(path, dtype, shape, path.stat().st_size - start)
    order: Literal["C", "F"] = "F" if fortran else "C"
    if math.prod(shape) == 0:
        return np.zeros(shape, dtype, order)
    return np.memmap(path, dtype, "r", start, shape, order)


def arrays(path: Path, names: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
    """Return the arrays of an .npz file by name, those of `names` alone if it is given.

    Raises SceneError if it is not such a file, and where they would take too much memory.
    """
    with input_files.opened(path) as file:
        try:
            with zipfile.ZipFile(file) as members:
                found = [one for one in members.infolist() if one.filename.endswith(_SUFFIX)]
                named = {one.filename.removesuffix(_SUFFIX): one for one in found}
                chosen = {k: v for k, v in named.items() if names is None or k in names}
                size = sum(one.file_size for one in chosen.values())
                budget.check(2 * size, "what it holds", path)
                budget.take(size, "what it holds", path)
                return {name: _member(path, members, one) for name, one in chosen.items()}
        except (SceneError, MemoryError):
            raise
        except Exception as error:  # zipfile's, and of each way to pack, such as zlib.error
            raise _broken(path, ".npz", error) from None


def _member(path: Path, members: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    with members.open(member) as packed:
        file = io.BytesIO(packed.read(member.file_size))
    start, dtype, shape, fortran = _header(file)
    _check_bytes(path, dtype, shape, len(file.getbuffer()) - start)
    made = np.frombuffer(file.getbuffer(), dtype, math.prod(shape), start)
    return made.reshape(shape, order="F" if fortran else "C").copy()


def _header(file: BinaryIO) -> tuple[int, np.dtype[Any], tuple[int, ...], bool]:
    """Return where the numbers begin, their type and shape, and whether columns come first."""
    version = np.lib.format.read_magic(file)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }.get(version)
    if read is None:
        raise ValueError(f"its version is {version[0]}.{version[1]}; 1.0 and 2.0 are read")
    shape, fortran, dtype = read(file)
    if dtype.hasobject or dtype.itemsize == 0 or min(shape, default=0) < 0:
        raise ValueError(f"it holds no numbers, but {dtype}")
    if any(type(length) is not int for length in shape):  # True is a length for NumPy's parser
        raise ValueError(f"its shape is {shape}")
    return file.tell(), dtype, shape, fortran


def _check_bytes(path: Path, dtype: np.dtype[Any], shape: tuple[int, ...], held: int) -> None:
    """Raise SceneError for an array that is larger than its file."""
    needed = math.prod(shape) * dtype.itemsize
    if needed > held:
        message = f"is cut short: its header tells of {needed:,} bytes, {max(held, 0):,} are there"
        raise SceneError(message, file=path)


def _broken(path: Path, suffix: str, error: Exception) -> SceneError:
    reason = str(error) or type(error).__name__
    return SceneError(f"is no {suffix} file that can be read: {reason}", file=path)
