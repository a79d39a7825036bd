"""What a driver refuses is raised as an error of clpt, whichever command finds it."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
import pytest

from clpt.device import Buffers, Stream, host_buffer, runtimes
from clpt.errors import DeviceError, MemoryBudgetError
from tests.device.bad_device import driver_error

CODE = cl.status_code
COMMANDS = {  # of PyOpenCL: by what of clpt they are called
    "enqueue_fill_buffer": lambda stream, one: stream.fill(one, 7, 0, 64),
    "enqueue_copy": lambda stream, one: stream.copy(one, one, byte_count=4, dst_offset=8),
    "enqueue_copy to it": lambda stream, one: stream.write(one, np.zeros(4)),
    "enqueue_copy from it": lambda stream, one: stream.read(one, np.zeros(4)),
    "enqueue_marker": lambda stream, _: stream.mark(),
    "Buffer": lambda stream, _: host_buffer(stream.queue.context, 0, np.zeros(4)),
}


@pytest.fixture
def stream(device) -> Stream:
    return Stream(cl.CommandQueue(device.context, device.info.cl_device))


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("code", "expected"),
    [
        (CODE.MEM_OBJECT_ALLOCATION_FAILURE, MemoryBudgetError),
        (CODE.OUT_OF_HOST_MEMORY, MemoryBudgetError),
        (CODE.OUT_OF_RESOURCES, DeviceError),
        (CODE.DEVICE_NOT_AVAILABLE, DeviceError),
    ],
)
def test_commands(stream, device, monkeypatch, command, code, expected):
    buffer = Buffers(device).allocate("one", 64)

    def fail(*_, **__):
        raise driver_error(code)

    monkeypatch.setattr(cl, command.split()[0], fail)
    with pytest.raises(DeviceError) as raised:
        COMMANDS[command](stream, buffer)
    assert type(raised.value) is expected
    assert isinstance(raised.value.__cause__, cl.Error)


def test_a_number_of_nvidias_is_explained():
    error = runtimes.refused("a command", driver_error(-9999))
    assert "beyond its buffers" in str(error) and "new process" in str(error)


class Broken:
    """A queue and an event of a device that was lost."""

    properties = 0

    def wait(self):
        raise driver_error(CODE.DEVICE_NOT_AVAILABLE)

    flush = wait


def test_waiting_and_flushing():
    stream = Stream(Broken())
    stream.last = Broken()
    for command in (stream.wait, stream.flush):
        with pytest.raises(DeviceError, match="reset or removed: open it again in a new process"):
            command()


def test_a_command_that_the_driver_refuses_in_earnest(stream, device):
    buffer = Buffers(device).allocate("one", 64)
    with pytest.raises(DeviceError, match=r"a fill failed: .*INVALID_VALUE"):
        stream.fill(buffer, 7, 4096, 64)


def test_the_message_says_how_much_and_what_to_do():
    error = runtimes.refused("a copy", driver_error(CODE.OUT_OF_HOST_MEMORY), 3 << 20)
    assert str(error).startswith("a copy needs 3 MiB, the device has no more: lower the size")
    assert (error.asked, error.available) == (3 << 20, None)
