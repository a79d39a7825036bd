"""The tables of a scene: arrays of words and floats that lowering fills, and arrays on a device.

After an edit most of a scene is the same: a cache holds the costly parts of lowerings.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import pyopencl as cl
import pyopencl.array as cl_array
from numpy.typing import ArrayLike

from clpt.arrays import Words, on_device
from clpt.errors import SceneError
from clpt.files import budget
from clpt.records import TABLES
from clpt.scene.params import fields_of
from clpt.scene.pixels import image_file

MOST_ELEMENTS = 2**31 - 1  # of a table: kernels have indices of 32 bits with a sign
DTYPES = {"float": np.float32, "uint": np.uint32}


def as_words(values: ArrayLike) -> Words:
    """Return float32 values as the words that hold them."""
    return np.ascontiguousarray(values, np.float32).view(np.uint32)


class TableStore:
    """The read-only tables of a scene, by the names in clpt.records.TABLES.

    device_grids: densities whose bricks kernels put into `images`, see
    `clpt.render.media.grids`.
    """

    def __init__(self) -> None:
        self.device_grids: list[Any] = []
        self._parts: dict[str, list[np.ndarray]] = {name: [] for name in TABLES}
        self._sizes = dict.fromkeys(TABLES, 0)

    @property
    def sizes(self) -> dict[str, int]:
        """The number of elements in each table."""
        return dict(self._sizes)

    def size(self, name: str) -> int:
        """Return the number of elements in a table."""
        return self._sizes[name]

    def append(self, name: str, words: ArrayLike) -> int:
        """Append words to a table of `uint`; return the index of the first.

        Raises SceneError if the table has more than MOST_ELEMENTS then.
        """
        return self._append(name, "uint", words)

    def append_floats(self, name: str, values: ArrayLike) -> int:
        """Append values to a table of `float`; return the index of the first.

        Raises SceneError if the table has more than MOST_ELEMENTS then.
        """
        return self._append(name, "float", values)

    def _append(self, name: str, element: str, values: ArrayLike) -> int:
        if TABLES[name][0] != element:
            raise TypeError(f"table {name!r} holds {TABLES[name][0]}, not {element}")
        budget.check_time()
        first, size = self._sizes[name], np.size(values)
        if first + size > MOST_ELEMENTS:
            raise SceneError(
                f"fills the table {name!r} with {first + size:,} numbers; kernels reach "
                f"{MOST_ELEMENTS:,}: use smaller images or meshes, or fewer bands"
            )
        array = np.ascontiguousarray(values, DTYPES[element]).reshape(-1)
        self._parts[name].append(array)
        self._sizes[name] += array.size
        return first

    def arrays(self) -> dict[str, np.ndarray]:
        """Return every table as a single array, and drop the parts.

        An empty table becomes a single zero, because OpenCL has no empty buffers.
        """
        arrays = {name: self._joined(name) for name in TABLES}
        self._parts = {name: [] for name in TABLES}
        return arrays

    def _joined(self, name: str) -> np.ndarray:
        parts = self._parts[name]
        if not self._sizes[name]:
            return np.zeros(1, DTYPES[TABLES[name][0]])
        return parts[0] if len(parts) == 1 else np.concatenate(parts)


# Arrays of shapes by name: numbers in a row (0: the array is flat), and their type.
COLUMNS: dict[str, tuple[int, type]] = {
    "vertices": (3, np.float32),
    "normals": (3, np.float32),
    "uvs": (2, np.float32),
    "tangents": (4, np.float32),
    "faces": (3, np.uint32),
    "centers": (3, np.float32),
    "radii": (0, np.float32),
}


def is_table(values: object, kind: str) -> bool:
    """Return whether values are a device array that can be a table; kind: numpy kinds of words."""
    return (
        isinstance(values, cl_array.Array)
        and values.dtype.itemsize == 4
        and values.dtype.kind in kind
        and values.flags.c_contiguous
        and values.offset == 0
    )


def fresh_view(values: Any) -> Any:
    """Return another object for the same memory on a device, whose contents may have changed."""
    if isinstance(values, cl_array.Array):
        return values.view()
    return cl.Buffer.from_int_ptr(values.int_ptr)


def as_array(values: Any, name: str, queue: cl.CommandQueue, where: str) -> Any:
    """Return an array that `on_host` can read: of a buffer an array of COLUMNS, on the queue.

    Host arrays come back as they are. Raises SceneError for memory of another context, and for a
    buffer of no whole number of rows.
    """
    if not on_device(values):
        return values
    buffer = values.base_data if isinstance(values, cl_array.Array) else values
    if buffer is None or buffer.context != queue.context:
        raise SceneError(
            f"{name} lie in another OpenCL context than the renderer's; make both of one context, "
            "or give them as numpy arrays",
            where=where,
        )
    if isinstance(values, cl_array.Array):
        return values if values.queue is not None else values.with_queue(queue)
    if name not in COLUMNS:
        message = f"a buffer does not tell the width of {name!r}: give a pyopencl.array.Array"
        raise SceneError(message, where=where)
    columns, dtype = COLUMNS[name]
    row = 4 * max(columns, 1)
    if values.size == 0 or values.size % row:
        message = f"{name} must be rows of {row} bytes, found a buffer of {values.size}"
        raise SceneError(message, where=where)
    shape = (values.size // row, columns) if columns else (values.size // row,)
    return cl_array.Array(queue, shape, dtype, data=values)


def readable(shape: Any, queue: cl.CommandQueue, where: str) -> dict[str, Any]:
    """Return the fields of a shape that `as_array` replaces, by name."""
    fields = {name: value for name, value in fields_of(shape).items() if name in COLUMNS}
    arrays = {name: as_array(values, name, queue, where) for name, values in fields.items()}
    changed = {name: values for name, values in arrays.items() if values is not fields[name]}
    former = shape.attributes
    attributes = {name: as_array(values, name, queue, where) for name, values in former.items()}
    if any(attributes[name] is not former[name] for name in former):
        changed["attributes"] = attributes
    return changed


T = TypeVar("T")
_BY_VALUE = (str, bytes, int, float, bool, type(None), type)


class LoweringCache:
    """A cache of the results of pure functions, by their arguments.

    Numbers and texts are compared by value, other arguments by identity: an array that is the same
    object is taken to hold the same values. former: the cache of the lowering before; a result that
    is asked for again moves here, and `settle` drops the others. beside: of a similar scene.
    """

    def __init__(self, former: LoweringCache | None = None, beside: LoweringCache | None = None):
        self._former = {} if former is None else former._results
        self._beside = {} if beside is None else beside._results
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
            known = self._former.get(key) or self._beside.get(key)
            self._results[key] = known or (function(*arguments), by)
        return self._results[key][0]

    def settle(self) -> None:
        """Drop results of the other caches that were not asked for."""
        self._former, self._beside = {}, {}


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
