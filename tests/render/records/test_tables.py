"""The store of tables: what is too large for the kernels' indices is refused by name."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.render.records.tables import MOST_ELEMENTS, TableStore


def test_a_table_that_indices_do_not_reach_is_refused() -> None:
    """An endless array that takes no memory stands for a sky of 256 bands."""
    store = TableStore()
    store.append_floats("texels", np.zeros(3, np.float32))
    few = np.lib.stride_tricks.as_strided(np.zeros(1, np.float32), (MOST_ELEMENTS - 2,), (0,))
    with pytest.raises(SceneError, match=r"texels.* smaller images"):
        store.append_floats("texels", few)
    assert store.size("texels") == 3
