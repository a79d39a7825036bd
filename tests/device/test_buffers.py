"""Buffers: what goes up comes down, and the budget speaks before the driver."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.device import Buffers
from clpt.errors import MemoryBudgetError


def test_round_trip(device):
    buffers = Buffers(device)
    array = np.arange(24, dtype=np.float32).reshape(4, 6)
    buffer = buffers.upload("a", array[:, ::2])
    back = buffers.download(buffer, (4, 3), np.float32)
    np.testing.assert_array_equal(back, array[:, ::2])
    assert buffers.used == 64


@pytest.mark.parametrize("array", [np.zeros((0, 3), np.float32), np.float32([7])])
def test_small_ones_have_something_to_point_at(device, array):
    buffers = Buffers(device)
    whole = buffers.download(buffers.upload("a", array), (16,), np.float32)
    assert whole.tolist() == [*array.ravel().tolist(), *[0] * (16 - array.size)]


def test_the_budget(device):
    buffers = Buffers(device, limit=1000)
    buffer = buffers.allocate("first", 600)
    with pytest.raises(
        MemoryBudgetError, match=r"path state needs .* KiB: use fewer paths"
    ) as raised:
        buffers.allocate("path state", 500, "use fewer paths")
    assert (raised.value.asked, raised.value.available) == (500, 400)
    buffers.release(buffer)
    assert buffers.used == 0
    buffers.allocate("path state", 1000)


def test_no_buffer_beyond_the_largest_allocation(device):
    buffers = Buffers(device, limit=2**60)
    with pytest.raises(MemoryBudgetError):
        buffers.allocate("a", device.info.max_alloc + 1)


def test_what_nobody_holds_counts_no_more(device):
    buffers = Buffers(device)
    kept = buffers.allocate("kept", 1000)
    for _ in range(100):
        buffers.allocate("dropped", 4096)
    assert buffers.used == kept.size == 1000


def test_an_error_frees_what_was_allocated_before_it(device):
    buffers = Buffers(device, limit=1000)
    kept = buffers.allocate("kept", 100)
    with pytest.raises(MemoryBudgetError), buffers.all_or_nothing():
        held = buffers.allocate("first", 600)
        buffers.allocate("second", 600)
    assert buffers.used == kept.size
    del held
