"""Arrays on a device that numpy and other array libraries can read, also by DLPack capsules."""

from __future__ import annotations

import ctypes as c
import sys
import threading
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike, NDArray
from pyopencl.array import Array

from . import forking
from .runtimes import refused, wait

_changing = forking.renewed(threading.Lock())  # held while a list of events changes
# Structures and codes of dlpack.h 0.8. For OpenCL the data pointer is the cl_mem handle.
CPU, OPENCL = 1, 4  # DLDeviceType
_NAME = b"dltensor"  # until a consumer renames it
_CODES = {"i": 0, "u": 1, "f": 2}  # DLDataTypeCode
_Deleter = c.CFUNCTYPE(None, c.c_void_p)


class EventsCopy(list[cl.Event]):
    """A copy of an array's events; shared: the list of the array and its views."""

    def __init__(self, shared: list[cl.Event]):
        super().__init__(shared)
        self.shared = shared


class DeviceArray(Array):
    """A `pyopencl.array.Array` with `__array__` and DLPack, which several threads may use.

    `numpy.asarray(array)` waits for the array's events and copies to the host. `__dlpack__` is for
    numpy.from_dlpack, torch.from_dlpack and jax.dlpack.from_dlpack. On a CPU they get host memory:
    a copy, unless they ask for none. On other devices they get OpenCL's memory, or a copy on the
    host if they ask for the CPU, as numpy.from_dlpack(array, device="cpu") does.
    """

    # PyOpenCL passes this list to the driver while other threads run. If a thread removed an event,
    # it could be freed before the driver has read it. So each use has a copy of the list.
    @property
    def events(self) -> list[cl.Event]:
        """A copy of the events that the content depends on; `add_event` adds an event."""
        return EventsCopy(self._events)

    @events.setter
    def events(self, events: list[cl.Event]) -> None:
        self._events = events.shared if isinstance(events, EventsCopy) else events

    def add_event(self, evt: cl.Event) -> None:
        """Let later commands on the array wait for an event too."""
        with _changing:
            before = list(self._events)  # dropped events are freed after the lock
            self._events[:] = [*unfinished(before), evt]

    def get(self, *args: Any, **named: Any) -> Any:
        """Return a copy on the host, see `pyopencl.array.Array.get`. Raises DeviceError."""
        if self.queue is not None:
            forking.check(self.queue)
        return super().get(*args, **named)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """Wait and return a copy on the host. Raises ValueError for copy=False."""
        if copy is not None and not copy:
            raise ValueError("an array on an OpenCL device becomes numpy's only by a copy")
        host = self.get()
        return host if dtype is None else host.astype(dtype, copy=False)

    def __dlpack_device__(self) -> tuple[int, int]:
        """DLPack's type of the device, 1 for a CPU or 4 for OpenCL, and its number."""
        return (CPU, 0) if self._in_host_memory else self._opencl_device

    def __dlpack__(
        self,
        *,
        stream: object = None,
        max_version: tuple[int, int] | None = None,
        dl_device: tuple[int, int] | None = None,
        copy: bool | None = None,
    ) -> Any:
        """Return a DLPack capsule; wait until the array is valid.

        dl_device: (1, 0) for host memory; (4, number) for the cl_mem, on a CPU too; None for
        `__dlpack_device__`. copy: False for the array's memory. On a CPU it is mapped until the
        consumer releases it, and OpenCL forbids the device to write to it meanwhile.

        Raises BufferError for another device, or where `copy` is not possible.
        """
        wanted = tuple(dl_device or self.__dlpack_device__())
        if wanted == (CPU, 0):
            host = self._mapped() if copy is not None and not copy else self.get()
            versions: dict[str, Any] = {} if max_version is None else {"max_version": max_version}
            return host.__dlpack__(**versions)
        if wanted != self._opencl_device:
            raise BufferError(
                f"DLPack's device of the array is {self._opencl_device}, not {wanted}"
            )
        owner = self.copy() if copy else self
        for event in owner.events:
            wait(event)
        return opencl_capsule(owner, wanted[1])

    @property
    def _in_host_memory(self) -> bool:
        return bool(self.queue.device.type & cl.device_type.CPU)

    @property
    def _opencl_device(self) -> tuple[int, int]:
        return OPENCL, self.context.devices.index(self.queue.device)

    def _mapped(self) -> NDArray[Any]:
        if not self._in_host_memory:
            raise BufferError("memory of this OpenCL device becomes the host's only by a copy")
        try:
            return self.map_to_host()
        except cl.Error as error:
            raise refused("a mapping of an array", error, self.nbytes) from error


def unfinished(events: Iterable[cl.Event]) -> list[cl.Event]:
    """Return the events that have not ended."""
    done = cl.command_execution_status.COMPLETE
    return [event for event in events if event.command_execution_status > done]


def supersede(array: Array, event: cl.Event) -> None:
    """Replace an array's events by a later event.

    Unfinished events of copies to the host stay: PyOpenCL waits when it frees such an event.
    """
    with _changing:
        before = array.events
        shared = before.shared if isinstance(before, EventsCopy) else before
        copies = [e for e in before if isinstance(e, cl.NannyEvent)]
        dropped = list(shared)  # dropped events are freed after the lock
        shared[:] = [*unfinished(copies), event]
    del dropped


class _Tensor(c.Structure):
    _fields_ = (
        ("data", c.c_void_p), ("device_type", c.c_int32), ("device_id", c.c_int32),
        ("ndim", c.c_int32), ("code", c.c_uint8), ("bits", c.c_uint8), ("lanes", c.c_uint16),
        ("shape", c.POINTER(c.c_int64)), ("strides", c.POINTER(c.c_int64)),
        ("byte_offset", c.c_uint64),
    )  # fmt: skip


class _Managed(c.Structure):
    _fields_ = (("tensor", _Tensor), ("manager", c.c_void_p), ("deleter", _Deleter))


_owned: dict[int, tuple[Any, ...]] = {}  # referenced objects by a structure's address

_new = c.pythonapi.PyCapsule_New
_new.restype, _new.argtypes = c.py_object, (c.c_void_p, c.c_char_p, c.c_void_p)
_valid = c.pythonapi.PyCapsule_IsValid
_valid.restype, _valid.argtypes = c.c_int, (c.py_object, c.c_char_p)


@_Deleter
def _delete(managed: int) -> None:
    _owned.pop(managed, None)


def _sweep() -> None:
    """Free capsules without a consumer: they have their first name, and no other reference.

    Python may run a capsule's destructor while a consumer's exception is raised, when a Python
    callback must not run. So clpt sets no destructor.
    """
    # The number of references that this call itself adds differs between Python versions.
    alone = _references({0: (object(),)}, 0)
    for address in list(_owned):
        with suppress(KeyError):  # a consumer's thread freed it meanwhile
            if _references(_owned, address) <= alone and _valid(_owned[address][-1], _NAME):
                _owned.pop(address, None)


def _references(owned: Mapping[int, tuple[Any, ...]], address: int) -> int:
    """Count the references to the last object of an entry, including this call's."""
    return sys.getrefcount(owned[address][-1])


def opencl_capsule(array: Any, device: int) -> Any:
    """Return a capsule that keeps a `pyopencl.array.Array` until the consumer frees it."""
    _sweep()
    dtype, ndim = np.dtype(array.dtype), array.ndim
    if dtype.kind not in _CODES:
        raise BufferError(f"clpt exports no arrays of {dtype} by DLPack")
    sizes = (c.c_int64 * ndim)(*array.shape)
    steps = (c.c_int64 * ndim)(*(stride // dtype.itemsize for stride in array.strides))
    managed = _Managed(
        _Tensor(
            array.base_data.int_ptr, OPENCL, device, ndim,
            _CODES[dtype.kind], 8 * dtype.itemsize, 1, sizes, steps, array.offset,
        ),
        None,
        _delete,
    )  # fmt: skip
    address = c.addressof(managed)
    capsule = _new(address, _NAME, None)
    _owned[address] = managed, sizes, steps, array.base_data, capsule
    return capsule
