"""Errors of drivers as errors of clpt, with advice."""

from __future__ import annotations

import pyopencl as cl

from ..errors import DeviceError, MemoryBudgetError

MEMORY_ADVICE = "lower the size of the image or simplify the scene, or choose another device"

_code = cl.status_code
_NO_MEMORY = (_code.MEM_OBJECT_ALLOCATION_FAILURE, _code.OUT_OF_HOST_MEMORY)
_ADVICE = {
    _code.OUT_OF_RESOURCES: "the device has no resources left, or its driver stopped a kernel "
    "that took too long: take a smaller picture or fewer slots, and make a new object",
    **dict.fromkeys(
        (_code.DEVICE_NOT_AVAILABLE, _code.INVALID_COMMAND_QUEUE, _code.INVALID_CONTEXT),
        "the device was reset or removed: open it again in a new process; if that fails too, the "
        "system's log may tell why",
    ),
    -9999: "a kernel read or wrote beyond its buffers, as NVIDIA's driver says by this number: a "
    "fault of clpt or of the compiler, which to report; go on in a new process",
    _code.EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST: "a command or an event that it waits for "
    "failed before it: look at that one",
}  # fmt: skip


def refused(
    subject: str,
    error: cl.Error,
    nbytes: int | None = None,
    available: int | None = None,
    advice: str = MEMORY_ADVICE,
) -> DeviceError:
    """Return clpt's error for a driver's error.

    It is a MemoryBudgetError if memory of the device or the host has run out. Drivers of GPUs
    allocate late, so any command may fail so.

    subject: of the message, such as "a copy"; nbytes: needed, available: free, where known; advice:
    for missing memory.
    """
    if error.code in _NO_MEMORY or isinstance(error, cl.MemoryError):
        return MemoryBudgetError(subject, nbytes, available, f"{advice} ({error})")
    known = _ADVICE.get(error.code)
    return DeviceError(f"{subject} failed: {f'{known} ({error})' if known else error}")


def failed_before(event: cl.Event) -> DeviceError:
    """Return the error for a caller's event that has already failed."""
    status = event.command_execution_status
    name = cl.status_code.to_string(status, "%d")
    return DeviceError(f"an event in `wait_for` has failed with {name}: nothing can wait for it")


def wait(event: cl.Event, subject: str = "a command") -> None:
    """Wait until an event has ended. Raises DeviceError, MemoryBudgetError."""
    try:
        event.wait()
    except cl.Error as error:
        raise refused(subject, error) from error
