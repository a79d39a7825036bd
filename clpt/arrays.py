"""Arrays and numbers as callers have them: of Python, of NumPy, on a device; types of arrays.

All checks of callers' numbers and flags stand here, so that all parts of clpt take the same values:
what is equal in Python and in NumPy is equal here too.
"""

from __future__ import annotations

import math
import mmap
import sys
from numbers import Integral, Real
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.errors import SceneError

Array = NDArray[Any]
Floats = NDArray[np.float64]
Floats32 = NDArray[np.float32]
Integers = NDArray[np.int64]
Words = NDArray[np.uint32]
Bytes = NDArray[np.uint8]
Points = NDArray[np.float32]  # (n, 3), or (n, 2) for uv
Faces = NDArray[np.uint32]  # (n, 3)
Image = NDArray[np.float32]  # (height, width, channels)
Matrix = NDArray[np.float64]  # (rows, columns)
Matrices = NDArray[np.floating]  # (..., rows, columns)
Boxes = NDArray[np.float32]  # (n, 2, 3): lowest and highest corners
Balls = NDArray[np.float32]  # (n, 4): centre and radius

LARGEST = float(np.finfo(np.float32).max)  # number of a parameter, as kernels have float32
SINGLE_ENDS = np.float64(2.0**128 - 2.0**103)  # numbers from here on round to infinity as float32
_PYTHON = {"b": bool, "i": int, "u": int, "f": float}  # by the kinds of NumPy's types


def on_host(values: object) -> Any:
    """Return values in host memory; wait for the copy of an array on a device.

    Raises SceneError for a masked array, and for an array on a device whose rows it cannot follow.
    """
    module = sys.modules.get("pyopencl.array")  # whoever has such an array has imported it
    if not module or not isinstance(values, module.Array):
        check_unmasked(values)
        return values
    flags = values.flags
    return values.get() if flags.c_contiguous or flags.f_contiguous else _strided(values)


def _strided(array: Any) -> Array:
    """Return a pyopencl array whose rows do not follow each other in memory, in host memory.

    The bytes from its first element to its last are copied, and the gaps are left out here.
    """
    reach = [(count - 1) * stride for count, stride in zip(array.shape, array.strides, strict=True)]
    first = array.offset + sum(min(far, 0) for far in reach)
    end = array.offset + sum(max(far, 0) for far in reach) + array.dtype.itemsize
    opencl, memory = sys.modules["pyopencl"], array.base_data
    if not isinstance(memory, opencl.MemoryObjectHolder) or array.queue is None:
        raise SceneError(f"its rows are not contiguous: {array.strides}; copy it")
    copied = np.empty(end - first, np.uint8)
    for event in array.events:
        event.wait()
    opencl.enqueue_copy(array.queue, copied, memory, src_offset=first)
    held = np.ndarray(array.shape, array.dtype, copied, array.offset - first, array.strides)
    return held.copy()


def check_unmasked(values: object, where: str | None = None) -> None:
    """Raise SceneError for an array of NumPy with elements that are masked, which have no value."""
    if _has_masked(values):
        raise SceneError("has masked numbers: fill them, as by array.filled(0)", where=where)


def _has_masked(values: object) -> bool:
    module = sys.modules.get("numpy.ma")  # whoever has such an array has imported it
    if module is None or not isinstance(values, module.MaskedArray):
        return False
    return bool(module.getmaskarray(values).any())


def in_memory(value: object) -> Any:
    """Return an argument of a scene's part with copies of the arrays that are maps of files.

    A file that changes would change the scene; a file that is cut would end the process. Looks
    into mappings and sequences; whatever else holds arrays asks by itself.
    """
    if isinstance(value, np.ndarray):
        return np.array(value, order="K", subok=False) if _is_map(value) else value
    if isinstance(value, dict):
        copies = {name: in_memory(part) for name, part in value.items()}
        return copies if any(copies[name] is not part for name, part in value.items()) else value
    if isinstance(value, (list, tuple)) and any(isinstance(part, np.ndarray) for part in value):
        parts = [in_memory(part) for part in value]
        return tuple(parts) if isinstance(value, tuple) else parts
    return value


def _is_map(array: Array) -> bool:
    """Whether an array's numbers lie in a map of a file."""
    held: object = array
    while isinstance(held, (np.ndarray, memoryview)) and not isinstance(held, np.memmap):
        held = held.obj if isinstance(held, memoryview) else held.base
    return isinstance(held, (np.memmap, mmap.mmap))


def on_device(values: object) -> bool:
    """Return whether values lie in device memory, an array or a buffer."""
    opencl, module = sys.modules.get("pyopencl"), sys.modules.get("pyopencl.array")
    array = module is not None and isinstance(values, module.Array)
    return array or (opencl is not None and isinstance(values, opencl.Buffer))


def single(values: ArrayLike) -> NDArray[np.float32]:
    """Return values as float32, infinite where they are beyond it: whoever asks looks for that."""
    with np.errstate(over="ignore"):
        return np.asarray(values, np.float32)


def vectors(values: ArrayLike, where: str) -> Floats:
    """Return rows (..., 3) of finite numbers, in two axes at least. Raises SceneError."""
    try:
        rows = np.asarray(values, np.float64)
    except (TypeError, ValueError):
        rows = np.zeros(0)
    if rows.ndim < 2 or rows.shape[-1] != 3 or rows.size == 0:
        message = f"must be rows of x, y and z, (n, 3), not of shape {rows.shape}"
        raise SceneError(message, where=where)
    bad = np.flatnonzero(~np.isfinite(rows.reshape(-1, 3)).all(axis=1))
    if bad.size:
        raise SceneError(f"row {bad[0]} is not finite", where=where)
    return rows


def corners_of(points: NDArray[Any]) -> NDArray[Any]:
    """Return the least and the largest corner (2, k) of points (n, k), n above 0.

    NumPy takes ten times as long along the first axis of rows that are short.
    """
    corners = [(column.min(), column.max()) for column in points.T]
    return np.array(corners, points.dtype).T


def fits_single(values: ArrayLike) -> bool:
    """Return whether values are finite as float32 too."""
    return bool((np.abs(values) < SINGLE_ENDS).all())


def plain(value: object) -> Any:
    """Return a scalar of NumPy, or an array without axes, as Python's own; others as they are.

    A masked scalar has no value, and stays as it is.
    """
    if not isinstance(value, (np.generic, np.ndarray)) or value.ndim:
        return value
    masked = _has_masked(value)
    return value if masked or value.dtype.kind not in _PYTHON else _PYTHON[value.dtype.kind](value)


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a real number, also NaN or infinity; True and False are none."""
    if type(value) is float:  # of the many numbers of a spectrum
        return True
    value = plain(value)
    return isinstance(value, Real) and not isinstance(value, (bool, np.generic))


def is_whole(value: object) -> TypeGuard[int]:
    """Return whether a value is of a type of whole numbers; True and False are none."""
    value = plain(value)
    return isinstance(value, Integral) and not isinstance(value, (bool, np.generic))


def is_flag(value: object) -> TypeGuard[bool]:
    """Return whether a value is true or false."""
    return isinstance(plain(value), bool)


def number(value: object, where: str | None = None, words: str = "a number") -> float:
    """Return a finite number that float32 can hold. Raises SceneError.

    words: what messages call it.
    """
    if type(value) is float and -LARGEST <= value <= LARGEST:
        return value
    number = real(value, where, words)
    if not math.isfinite(number):
        raise SceneError(f"must be finite, not {number}", where=where)
    if abs(number) > LARGEST:
        raise SceneError(f"{number:g} is beyond {LARGEST:g}, where float32 ends", where=where)
    return number


def real(value: object, where: str | None = None, words: str = "a number") -> float:
    """Return a number, which may be NaN or infinite, as Python's. Raises SceneError.

    words: what messages call it.
    """
    if not is_number(value):
        raise SceneError(f"must be {words}, not {value!r}", where=where)
    try:
        return float(value)
    except OverflowError:
        raise SceneError(f"is beyond {LARGEST:g}, where float32 ends", where=where) from None


def whole(
    value: object, least: int | None = None, most: int | None = None, *, where: str | None = None
) -> int:
    """Return a whole number within limits, as Python's. Raises SceneError."""
    if is_whole(value):
        number = int(value)
        if (least is None or number >= least) and (most is None or number <= most):
            return number
    limits = "" if least is None else " above zero" if least == 1 else f" from {least}"
    limits = limits if most is None else f" from {least} to {most}"
    raise SceneError(f"must be a whole number{limits}, not {value!r}", where=where)


def flag(value: object, where: str | None = None) -> bool:
    """Return a flag as Python's bool. Raises SceneError for any other value."""
    if not is_flag(value):
        raise SceneError(f"must be true or false, not {value!r}", where=where)
    return bool(value)


def wholes(values: object, count: int) -> tuple[int, ...] | None:
    """Return `count` whole numbers as Python's; None for anything but a list or array of them."""
    listed = isinstance(values, (list, tuple)) or (isinstance(values, np.ndarray) and values.ndim)
    numbers = tuple(values) if listed else ()  # type: ignore[arg-type]
    return (
        tuple(map(int, numbers)) if len(numbers) == count and all(map(is_whole, numbers)) else None
    )
