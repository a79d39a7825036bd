"""Commands of one owner on a queue: in their order, after the caller's, without waiting."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
import pytest

from clpt.device import Stream

ORDERS = {
    "in_order": 0,
    "out_of_order": cl.command_queue_properties.OUT_OF_ORDER_EXEC_MODE_ENABLE,
}


@pytest.mark.parametrize("order", ORDERS)
def test_nothing_begins_before_a_late_event_and_nobody_waits(device, order):
    """A command that is bound to wait, and whose event is dropped, does not stop this thread."""
    queue = cl.CommandQueue(device.context, device.info.cl_device, ORDERS[order])
    stream, late = Stream(queue), cl.UserEvent(device.context)
    buffer = cl.Buffer(device.context, cl.mem_flags.READ_WRITE, 64)
    values = np.arange(16, dtype=np.uint32)
    stream.after([late])
    stream.write(buffer, values)
    values[:] = 0  # a copy of it is written
    stream.fill(buffer, 99, 0, 4)
    read = np.zeros(16, np.uint32)
    event = stream.read_later(buffer, read)
    stream.flush()
    assert event.command_execution_status > cl.command_execution_status.COMPLETE
    assert not read.any()
    late.set_status(cl.command_execution_status.COMPLETE)
    event.wait()
    assert read.tolist() == [99, *range(1, 16)]


def test_events_of_another_queue_come_first(device):
    first, second = (Stream(cl.CommandQueue(device.context)) for _ in range(2))
    buffer = cl.Buffer(device.context, cl.mem_flags.READ_WRITE, 1 << 22)
    for word in range(20):
        second.after([first.fill(buffer, word, 0, 1 << 22)])
        first.flush()
        read = second.read(buffer, np.zeros(1 << 20, np.uint32))
        assert (read == word).all()
