"""Buffers: what goes up comes down, and the budget speaks before the driver."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

from clpt.device import Buffers, large_pages
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


@pytest.mark.parametrize("without", [False, True])
def test_a_large_array_comes_back(device, without, monkeypatch):
    """Where a system has large pages, and where it has none."""
    if without:
        monkeypatch.setattr(large_pages, "pay", lambda *_: False)
    buffers = Buffers(device)
    array = np.arange(3 << 20, dtype=np.float32).reshape(3, -1)
    buffer = buffers.upload("a", array[:, 1:])
    np.testing.assert_array_equal(
        buffers.download(buffer, array[:, 1:].shape, np.float32), array[:, 1:]
    )
    assert buffers.used == array[:, 1:].nbytes


LARGE_PAGES = Path("/sys/kernel/mm/transparent_hugepage")


@pytest.mark.skipif(not LARGE_PAGES.exists(), reason="large pages are Linux's")
def test_a_large_buffer_of_a_processor_asks_for_large_pages(device):
    if not device.info.is_cpu:
        pytest.skip("large pages are for processors")
    buffer = Buffers(device).allocate("a", 16 << 20)
    flags = cl.map_flags.READ
    view, _ = cl.enqueue_map_buffer(device.queue, buffer, flags, 0, buffer.size, np.uint8)
    middle = view.ctypes.data + buffer.size // 2
    assert "hg" in flags_of_memory(middle)
    view.base.release(device.queue)


def flags_of_memory(address: int) -> list[str]:
    """The kernel's flags of the mapping that holds an address."""
    inside = False
    for line in Path("/proc/self/smaps").read_text().splitlines():
        bounds = re.match(r"([0-9a-f]+)-([0-9a-f]+) ", line)
        if bounds:
            inside = int(bounds[1], 16) <= address < int(bounds[2], 16)
        elif inside and line.startswith("VmFlags:"):
            return line.split()[1:]
    return []
