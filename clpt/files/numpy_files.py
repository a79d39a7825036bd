"""NumPy's files (.npy, .npz) of strangers: nothing is unpickled, and no header's word is taken."""

from __future__ import annotations

import io
import math
import os
import zipfile
from collections.abc import Collection
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, input_files

_SUFFIX = ".npy"  # of the members of an .npz


def array(path: Path) -> NDArray[Any]:
    """Return the array of a .npy file, in memory: the file may change or go afterwards.

    Raises SceneError if it is not such a file, and where it would take too much memory.
    """
    with input_files.opened(path) as file:
        try:
            start, dtype, shape, fortran = _header(file)
        except Exception as error:  # NumPy's parser raises tokenize's own, and more
            raise _broken(path, ".npy", error) from None
        size = math.prod(shape) * dtype.itemsize
        _check_bytes(path, size, os.fstat(file.fileno()).st_size - start)
        budget.check(size, "its array", path)
        values = np.empty(math.prod(shape), dtype)
        if size:  # no map of the file: whoever writes it anew would change or end the process
            _check_bytes(path, size, _read_into(file, values.view(np.uint8)))
    return values.reshape(shape, order="F" if fortran else "C")


def arrays(path: Path, names: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
    """Return the arrays of an .npz file by name, those of `names` alone if it is given.

    Raises SceneError if it is not such a file, and where they would take too much memory.
    """
    with input_files.opened(path) as file:
        try:
            with zipfile.ZipFile(file) as members:
                infos = [info for info in members.infolist() if info.filename.endswith(_SUFFIX)]
                named = {info.filename.removesuffix(_SUFFIX): info for info in infos}
                chosen = {k: v for k, v in named.items() if names is None or k in names}
                size = sum(info.file_size for info in chosen.values())
                budget.check(2 * size, "what it holds", path)
                budget.take(size, "what it holds", path)
                return {name: _member(path, members, info) for name, info in chosen.items()}
        except (SceneError, MemoryError):
            raise
        except Exception as error:  # zipfile's, and of each way to pack, such as zlib.error
            raise _broken(path, ".npz", error) from None


def _read_into(file: BinaryIO, target: NDArray[np.uint8]) -> int:
    """Fill an array from a file, and return how many bytes there were."""
    done = 0
    while done < len(target) and (count := file.readinto(target[done:].data)):  # type: ignore[attr-defined]
        done += count
    return done


def _member(path: Path, members: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    with members.open(member) as packed:
        file = io.BytesIO(packed.read(member.file_size))
    start, dtype, shape, fortran = _header(file)
    size = math.prod(shape) * dtype.itemsize
    _check_bytes(path, size, len(file.getbuffer()) - start)
    values = np.frombuffer(file.getbuffer(), dtype, math.prod(shape), start)
    return values.reshape(shape, order="F" if fortran else "C").copy()


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


def _check_bytes(path: Path, needed: int, held: int) -> None:
    """Raise SceneError for an array that is larger than its file."""
    if needed > held:
        message = f"is cut short: its header tells of {needed:,} bytes, {max(held, 0):,} are there"
        raise SceneError(message, file=path)


def _broken(path: Path, suffix: str, error: Exception) -> SceneError:
    reason = str(error) or type(error).__name__
    return SceneError(f"is no {suffix} file that can be read: {reason}", file=path)
