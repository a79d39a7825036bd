"""Numbers, whole numbers and flags as callers have them: of Python, of NumPy, arrays without axes.

All checks of callers' values stand here, so that all parts of clpt take the
same values: what is equal in Python and in NumPy is equal here too.
"""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Any, TypeGuard

import numpy as np

from clpt.errors import SceneError

LARGEST = float(np.finfo(np.float32).max)  # number of a parameter, as kernels have float32


_PYTHON = {"b": bool, "i": int, "u": int, "f": float}  # by the kinds of NumPy's types


def plain(value: object) -> Any:
    """Return a scalar of NumPy, or an array without axes, as Python's own; others as they are.

    A masked scalar has no value, and stays as it is.
    """
    if not isinstance(value, (np.generic, np.ndarray)) or value.ndim:
        return value
    masked = isinstance(value, np.ma.MaskedArray) and np.ma.getmaskarray(value).any()
    return value if masked or value.dtype.kind not in _PYTHON else _PYTHON[value.dtype.kind](value)


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a real number, also NaN or infinity; True and False are none."""
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
