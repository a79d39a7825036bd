"""A cache of costly parts of lowerings: after an edit most of a scene is the same."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from clpt.arrays import on_device
from clpt.files import budget
from clpt.scene.pixels import image_file

T = TypeVar("T")
_BY_VALUE = (str, bytes, int, float, bool, type(None), type)


class LoweringCache:
    """A cache of the results of pure functions, by their arguments.

    Numbers and texts are compared by value, other arguments by identity: an array that is the same
    object is taken to hold the same values. former: the cache of the lowering before; a result that
    is asked for again moves here, and `settle` drops the others.
    """

    def __init__(self, former: LoweringCache | None = None):
        self._former = {} if former is None else former._results
        self._results: dict[Any, tuple[Any, Any]] = {}

    def __call__(
        self, function: Callable[..., T], *arguments: object, by: tuple[Any, ...] | None = None
    ) -> T:
        """Return function(*arguments); for equal arguments the same object as before.

        by: the values that the result depends on, in place of all arguments.
        """
        budget.check_time()
        by = arguments if by is None else by
        key = function, *map(_key, by)
        if key not in self._results:
            # Values that are compared by identity stay alive: no other object gets their id.
            self._results[key] = self._former.get(key) or (function(*arguments), by)
        return self._results[key][0]

    def settle(self) -> None:
        """Drop results of the former cache that were not asked for."""
        self._former = {}


def _key(argument: object) -> Any:
    """Return the key of an argument; a new key for memory of a device, which kernels may write."""
    if isinstance(argument, _BY_VALUE):
        return argument
    return object() if on_device(argument) else (id(argument),)


def version(image: object) -> Any:
    """Return a key of an image: a file's path, time and size; other images themselves."""
    file = image_file(image)
    if file is None:
        return image
    try:
        status = os.stat(file)
    except OSError:  # reading raises the error
        return file
    return f"{file}\0{status.st_mtime_ns}\0{status.st_size}"


def content(*arrays: np.ndarray) -> bytes:
    """Return a digest of the values of arrays, for arrays that are new objects each time."""
    digest = hashlib.blake2b()
    for array in arrays:
        digest.update(np.ascontiguousarray(array).data.cast("B") if array.size else b"")
    return digest.digest()
