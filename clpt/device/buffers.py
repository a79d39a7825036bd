"""Device memory, counted, so that an error comes before a driver fails in its own way."""

from __future__ import annotations

import weakref
from collections.abc import Sequence

import numpy as np
import pyopencl as cl
from numpy.typing import ArrayLike, DTypeLike, NDArray

from ..errors import MemoryBudgetError
from .context import Device
from .refusals import MEMORY_ADVICE, refused

_SMALLEST = 64  # [bytes] OpenCL has no empty buffer, and kernels want something to point at


class CountedBuffer(cl.Buffer):
    """A buffer that takes weak references, as PyOpenCL's own does not."""


def host_buffer(context: cl.Context, flags: int, array: NDArray) -> cl.Buffer:
    """Return a buffer of an array of the host, which is C-contiguous and not empty.

    flags: of `pyopencl.mem_flags`; they tell whether it is a copy. Raises MemoryBudgetError,
    DeviceError.
    """
    try:
        return cl.Buffer(context, flags, hostbuf=array)
    except cl.Error as error:
        raise refused("a buffer", error, array.nbytes) from error


class AllOrNothing:
    """See `Buffers.all_or_nothing`.

    It is no generator: one that an interrupt leaves in the middle would go on when it is freed.
    """

    def __init__(self, buffers: Buffers):
        self._buffers, self._before = buffers, buffers.live()

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self._buffers.release(*(self._buffers.live() - self._before))


class Buffers:
    """Buffers on one device within a budget.

    limit: bytes that all of them together may take; by default what the device has free now.
    A buffer lives, and counts, as long as it is referred to; `release` frees it at once.
    """

    def __init__(self, device: Device, limit: int | None = None):
        self.device = device
        self.limit = device.free_memory() if limit is None else limit
        self._live: weakref.WeakSet[CountedBuffer] = weakref.WeakSet()

    @property
    def used(self) -> int:
        """The size of all buffers that live [bytes]."""
        return sum(buffer.size for buffer in self._live)

    @property
    def available(self) -> int:
        """The size of the largest buffer that can be allocated now [bytes]."""
        return max(0, min(self.limit - self.used, self.device.info.max_alloc))

    def allocate(self, what: str, nbytes: int, advice: str = MEMORY_ADVICE) -> cl.Buffer:
        """Return a buffer whose content is undefined.

        what, advice: for the message of the MemoryBudgetError that is raised if it does not fit.
        """
        return self._create(what, max(nbytes, _SMALLEST), advice, None)

    def upload(
        self,
        what: str,
        array: ArrayLike,
        dtype: DTypeLike | None = None,
        advice: str = MEMORY_ADVICE,
    ) -> cl.Buffer:
        """Return a copy of an array, C-contiguous; of an empty one a small buffer of zeros.

        Raises MemoryBudgetError if it does not fit.
        """
        host = np.ascontiguousarray(array, dtype)
        if host.nbytes < _SMALLEST:
            padded = np.zeros(_SMALLEST, np.uint8)
            padded[: host.nbytes] = np.frombuffer(host.tobytes(), np.uint8)
            host = padded
        return self._create(what, host.nbytes, advice, host)

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
        """For a `with`: free what is allocated inside, if an error ends it."""
        return AllOrNothing(self)

    def live(self) -> set[CountedBuffer]:
        """All buffers that live."""
        return set(self._live)

    def release(self, *buffers: cl.Buffer) -> None:
        """Free buffers."""
        for buffer in buffers:
            self._live.discard(buffer)
            buffer.release()

    def _create(self, what: str, nbytes: int, advice: str, host: NDArray | None) -> cl.Buffer:
        if nbytes > self.available:
            raise MemoryBudgetError(what, nbytes, self.available, advice)
        access = cl.mem_flags.READ_WRITE
        if host is not None:
            access |= cl.mem_flags.COPY_HOST_PTR
        try:
            buffer = CountedBuffer(
                self.device.context, access, size=0 if host is not None else nbytes, hostbuf=host
            )
        except cl.Error as error:
            raise refused(what, error, nbytes, self.available, advice) from error
        self._live.add(buffer)
        return buffer
