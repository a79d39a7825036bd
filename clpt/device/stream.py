"""Commands on a queue, one after the other, whatever order the queue itself keeps."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl

from . import forking
from .buffers import host_buffer
from .program import BoundKernel
from .refusals import failed_before, refused, wait

Events = Iterable[cl.Event] | None  # as `wait_for` takes them
TILE = (64, 2)  # work-items of a group of pixels


def tiles(width: int, height: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the global and the local size of a kernel whose work-items are pixels.

    Groups are the same for pictures of every size, for PoCL compiles a kernel once for each size
    of a group. There are work-items beyond the picture, which the kernel leaves alone.
    """
    across, down = TILE
    return (-(-width // across) * across, -(-height // down) * down), TILE


@dataclass(frozen=True)
class Rows:
    """Parts of a buffer: where the first begins, their size, and their distance [bytes]."""

    first: int
    size: int
    pitch: int
    count: int

    @property
    def region(self) -> tuple[int, int, int]:
        """The rows as OpenCL's commands take a rectangle."""
        return self.size, self.count, 1


class Stream:
    """Commands of one owner on a queue: each begins when the one before it has ended.

    On an in-order queue that costs nothing; on an out-of-order one each command waits for the event
    of the last. The host waits in `read` and `wait` only. Nothing calls clFinish, so that commands
    of others on the queue are left alone. What the driver refuses is raised as DeviceError, or as
    MemoryBudgetError where memory has run out; so is a fork that the driver does not survive.

    queue: the caller's; last: the event of the last command, None before the first.
    """

    def __init__(self, queue: cl.CommandQueue):
        self.queue = queue
        out_of_order = cl.command_queue_properties.OUT_OF_ORDER_EXEC_MODE_ENABLE
        self.ordered = not queue.properties & out_of_order
        self.last: cl.Event | None = None
        self._before: list[cl.Event] = []
        self._copies: deque[cl.Event] = deque()  # to the host, that may not have ended

    def after(self, events: Events) -> None:
        """Let the next command wait for events of others too.

        Raises DeviceError for one that has failed: on some drivers the command would never begin.
        """
        given = list(events or ())
        for event in given:
            if event.command_execution_status < 0:
                raise failed_before(event)
        self._before += given

    def run(
        self,
        bound: BoundKernel,
        global_size: Sequence[int],
        local_size: Sequence[int] | None = None,
        offset: Sequence[int] | None = None,
    ) -> cl.Event:
        """Enqueue a kernel; offset: of its first work-item. Raises DeviceError if it is refused."""
        self.last = bound.enqueue(self.queue, global_size, local_size, self._waits(), offset)
        return self.last

    def fill(self, buffer: cl.Buffer, word: int, offset: int, nbytes: int) -> cl.Event:
        """Enqueue that a range of a buffer becomes one repeated word."""
        command = cl.enqueue_fill_buffer
        return self._enqueue("a fill", nbytes, command, buffer, np.uint32(word), offset, nbytes)

    def fill_rows(self, buffer: cl.Buffer, word: int, rows: Rows) -> cl.Event:
        """Enqueue that rows of a buffer become one repeated word."""
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
        host = np.full(rows.count * rows.size // 4, word, np.uint32)
        staged = host_buffer(self.queue.context, flags, host)
        return self._enqueue(
            "a fill", host.nbytes, cl.enqueue_copy, buffer, staged,
            src_origin=(0, 0, 0), src_pitches=(rows.size,),
            dst_origin=(rows.first, 0, 0), dst_pitches=(rows.pitch,), region=rows.region,
        )  # fmt: skip

    def copy(self, target: cl.Buffer, source: cl.Buffer, **offsets: int) -> cl.Event:
        """Enqueue a copy on the device; offsets: as of `pyopencl.enqueue_copy`."""
        size = offsets.get("byte_count", source.size)
        return self._enqueue("a copy", size, cl.enqueue_copy, target, source, **offsets)

    def write(self, target: cl.Buffer, source: np.ndarray, offset: int = 0) -> cl.Event:
        """Enqueue that an array goes to a buffer, from a copy of it: it may change at once."""
        # The copy is a buffer, which the driver keeps until it is read: PyOpenCL's event of a copy
        # from the host waits when nobody refers to it, and no other thread of Python runs then.
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
        staged = host_buffer(self.queue.context, flags, np.ascontiguousarray(source))
        return self.copy(target, staged, dst_offset=offset, byte_count=staged.size)

    def mark(self) -> cl.Event:
        """Return an event that ends when all commands so far, and the events of `after`, have."""
        return self._enqueue("a marker", None, cl.enqueue_marker)

    def read(self, source: cl.Buffer, into: np.ndarray, offset: int = 0) -> np.ndarray:
        """Return a buffer's content in an array; wait for it."""
        if into.nbytes:
            wait(self.read_later(source, into, offset), "a copy to the host")
        return into

    def read_rows(self, source: cl.Buffer, into: np.ndarray, rows: Rows) -> np.ndarray:
        """Return rows of a buffer in an array, one behind the other; wait for them."""
        event = self._enqueue(
            "a copy to the host", into.nbytes, cl.enqueue_copy, into, source,
            buffer_origin=(rows.first, 0, 0), buffer_pitches=(rows.pitch,),
            host_origin=(0, 0, 0), host_pitches=(rows.size,), region=rows.region,
            is_blocking=False,
        )  # fmt: skip
        wait(self._keep(event), "a copy to the host")
        return into

    def read_later(self, source: cl.Buffer, into: np.ndarray, offset: int = 0) -> cl.Event:
        """Enqueue that an array is filled from a buffer; it is valid when the event has ended."""
        options = {"src_offset": offset, "is_blocking": False}
        event = self._enqueue(
            "a copy to the host", into.nbytes, cl.enqueue_copy, into, source, **options
        )
        return self._keep(event)

    def rejoin(self) -> None:
        """Let the next command wait for all so far, also for one whose event was lost."""
        if not self.ordered:
            self._before.append(cl.enqueue_marker(self.queue))

    def wait(self) -> None:
        """Wait until the last command has ended."""
        forking.check(self.queue)
        if self.last is not None:
            wait(self.last)

    def flush(self) -> None:
        """Let the device begin what was enqueued."""
        try:
            self.queue.flush()
        except cl.Error as error:
            raise refused("a flush of the queue", error) from error

    def _waits(self) -> list[cl.Event] | None:
        forking.check(self.queue)
        waits, self._before = self._before, []
        if not self.ordered and self.last is not None:
            waits = [*waits, self.last]
        return waits or None

    def _enqueue(
        self, what: str, nbytes: int | None, command: Callable[..., Any], *args: Any, **named: Any
    ) -> cl.Event:
        """Enqueue one of OpenCL's commands; what, nbytes: see `refused`."""
        waits = self._waits()
        try:
            self.last = command(self.queue, *args, wait_for=waits, **named)
        except cl.Error as error:
            raise refused(what, error, nbytes) from error
        return self.last

    def _keep(self, event: cl.Event) -> cl.Event:
        """Refer to an event of a copy to the host until it has ended."""
        done = cl.command_execution_status.COMPLETE
        while self._copies and self._copies[0].command_execution_status <= done:
            self._copies.popleft()
        self._copies.append(event)
        return event
