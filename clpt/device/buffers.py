"""Device memory within a budget, and a flag that kernels read while they run."""

from __future__ import annotations

import functools
import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import ArrayLike, DTypeLike, NDArray

from clpt.device import large_pages

from ..errors import MemoryBudgetError
from .context import Device
from .runtimes import MEMORY_ADVICE, refused

_SMALLEST = 64  # [bytes] OpenCL has no empty buffers


class CountedBuffer(cl.Buffer):
    """A buffer with weak references, which `pyopencl.Buffer` lacks."""


def host_buffer(context: cl.Context, flags: int, array: NDArray) -> cl.Buffer:
    """Return a buffer of a C-contiguous array of the host that is not empty.

    flags: of `pyopencl.mem_flags`; they decide on a copy. Raises MemoryBudgetError, DeviceError.
    """
    try:
        return cl.Buffer(context, flags, hostbuf=array)
    except cl.Error as error:
        raise refused("a buffer", error, array.nbytes) from error


class AllOrNothing:
    """See `Buffers.all_or_nothing`.

    A class, since a generator that an interrupt suspends would continue when it is freed.
    """

    def __init__(self, buffers: Buffers):
        self._buffers, self._before = buffers, buffers.live()

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._buffers.release(*(self._buffers.live() - self._before))


class Buffers:
    """Buffers on a device within a budget.

    limit: bytes of all buffers together; by default the device's free memory.
    A buffer counts until its last reference is gone; `release` frees it at once.
    """

    def __init__(self, device: Device, limit: int | None = None):
        self.device = device
        self.limit = device.free_memory() if limit is None else limit
        self._live: weakref.WeakSet[CountedBuffer] = weakref.WeakSet()
        self._most = 0  # that live buffers may take [bytes], counted again when it is too much

    @functools.cached_property
    def _own_queue(self) -> cl.CommandQueue:
        """A queue for new buffers, which do not wait for the device's other work."""
        return cl.CommandQueue(self.device.context, self.device.queue.device)

    @property
    def used(self) -> int:
        """The size of all live buffers [bytes]."""
        return sum(buffer.size for buffer in self._live)

    @property
    def available(self) -> int:
        """The size of the largest buffer that can be allocated now [bytes]."""
        return max(0, min(self.limit - self.used, self.device.info.max_alloc))

    def allocate(self, name: str, nbytes: int, advice: str = MEMORY_ADVICE) -> cl.Buffer:
        """Return a buffer whose content is undefined.

        name, advice: for the message of a MemoryBudgetError, raised if the buffer does not fit.
        """
        return self._create(name, max(nbytes, _SMALLEST), advice, None)

    def upload(
        self,
        name: str,
        array: ArrayLike,
        dtype: DTypeLike | None = None,
        advice: str = MEMORY_ADVICE,
    ) -> cl.Buffer:
        """Return a buffer with a C-contiguous copy of an array; an empty array gives zeros.

        Raises MemoryBudgetError if the buffer does not fit.
        """
        host = np.ascontiguousarray(array, dtype)
        if host.nbytes < _SMALLEST:
            padded = np.zeros(_SMALLEST, np.uint8)
            padded[: host.nbytes] = np.frombuffer(host.tobytes(), np.uint8)
            host = padded
        return self._create(name, host.nbytes, advice, host)

    def download(self, buffer: cl.Buffer, shape: Sequence[int], dtype: DTypeLike) -> NDArray:
        """Return a buffer's content as an array; wait for the device's queue.

        Raises DeviceError if the driver refuses it.
        """
        host = np.empty(tuple(shape), dtype)
        if host.nbytes:
            try:
                cl.enqueue_copy(self.device.queue, host, buffer, is_blocking=True)
            except cl.Error as error:
                raise refused("a copy to the host", error, host.nbytes) from error
        return host

    def all_or_nothing(self) -> AllOrNothing:
        """Return a context that frees all buffers allocated inside if an error ends it."""
        return AllOrNothing(self)

    def live(self) -> set[CountedBuffer]:
        """All live buffers."""
        return set(self._live)

    def release(self, *buffers: cl.Buffer) -> None:
        """Free buffers at once."""
        for buffer in buffers:
            self._live.discard(buffer)
            buffer.release()

    def _create(self, name: str, nbytes: int, advice: str, host: NDArray | None) -> cl.Buffer:
        if nbytes > min(self.limit - self._most, self.device.info.max_alloc):
            self._most = self.used
            if nbytes > self.available:
                raise MemoryBudgetError(name, nbytes, self.available, advice)
        large = large_pages.pay(self.device.info.is_cpu, nbytes)
        copied = None if large else host
        access = cl.mem_flags.READ_WRITE
        if copied is not None:
            access |= cl.mem_flags.COPY_HOST_PTR
        try:
            buffer = CountedBuffer(
                self.device.context,
                access,
                size=0 if copied is not None else nbytes,
                hostbuf=copied,
            )
            if large:
                large_pages.ask(self._own_queue, buffer, host)
        except cl.Error as error:
            raise refused(name, error, nbytes, self.available, advice) from error
        self._live.add(buffer)
        self._most += buffer.size
        return buffer


class Flag:
    """A word that the host sets and clears, also while kernels run.

    argument: for kernels, a `global const volatile uint *`; None, a null pointer, on devices
    without fine-grained shared memory. Any thread may call the methods, and a signal handler too:
    they do not wait.
    """

    def __init__(self, device: Device):
        self.argument: Any = None
        if not device.info.shares_words:
            return
        try:
            self._words = cl.fsvm_empty(device.context, 1, np.uint32)
        except cl.Error:  # another device of the caller's context cannot share it
            return
        self._words[0] = 0
        self.argument = cl.SVM(self._words)

    def raise_(self) -> None:
        """Set the word to 1."""
        if self.argument is not None:
            self._words[0] = 1

    def lower(self) -> None:
        """Set the word to 0."""
        if self.argument is not None:
            self._words[0] = 0
