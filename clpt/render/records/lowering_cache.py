"""A cache of costly parts of lowerings: after an edit most of a scene is the same."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from clpt.arrays import on_device
from clpt.scene.pixels import image_file

Made = TypeVar("Made")
_BY_VALUE = (str, bytes, int, float, bool, type(None), type)


class LoweringCache:
    """A cache of the results of pure functions, by their arguments.

    Numbers and texts count by value, whatever else by identity: an array that is the same object is
    taken to hold the same. former: the cache of the lowering before, whose results are taken on
    when they are asked for again; `settle` lets go of the others.
    """

    def __init__(self, former: LoweringCache | None = None):
        self._former = {} if former is None else former._made
        self._made: dict[Any, tuple[Any, Any]] = {}

    def __call__(
        self, make: Callable[..., Made], *given: object, by: tuple[Any, ...] | None = None
    ) -> Made:
        """Return make(*given); the same object as before for what was given before.

        by: what it follows from, where that is not all of what is given.
        """
        by = given if by is None else by
        key = make, *map(_mark, by)
        if key not in self._made:
            # what is known by identity stays alive, so that no other object gets its id
            self._made[key] = self._former.get(key) or (make(*given), by)
        return self._made[key][0]

    def settle(self) -> None:
        """Forget what was not asked for."""
        self._former = {}


def _mark(given: object) -> Any:
    """Return the key of an argument; memory of a device has a new one each time.

    Kernels may have written there since.
    """
    if isinstance(given, _BY_VALUE):
        return given
    return object() if on_device(given) else (id(given),)


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
    """Return what stands for the values of arrays, where these are made anew each time."""
    digest = hashlib.blake2b()
    for array in arrays:
        digest.update(np.ascontiguousarray(array).data.cast("B") if array.size else b"")
    return digest.digest()
