"""The store of a scene's tables: arrays of words and floats that lowering fills."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clpt.arrays import Words
from clpt.errors import SceneError
from clpt.files import budget
from clpt.records import TABLES

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
