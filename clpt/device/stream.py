"""Ordered commands on a queue, in order or out of order, and times of kernels."""

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
from .runtimes import failed_before, refused, wait

Events = Iterable[cl.Event] | None  # for `wait_for`
TILE = (64, 2)  # pixels of a work-group


def tiles(width: int, height: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the global and the local size of a kernel with a work-item for each pixel.

    Groups are equal for all sizes of pictures, since PoCL compiles a kernel for each group size.
    Work-items beyond the picture do nothing.
    """
    across, down = TILE
    return (-(-width // across) * across, -(-height // down) * down), TILE


@dataclass(frozen=True)
class Rows:
    """Rows of a buffer: offset of the first, size and distance [bytes]; their number."""

    first: int
    size: int
    pitch: int
    count: int

    @property
    def region(self) -> tuple[int, int, int]:
        """The region of OpenCL's rectangle commands."""
        return self.size, self.count, 1


class Stream:
    """An owner's commands on a queue: each starts when the former has ended.

    On an in-order queue this costs nothing; on an out-of-order queue each command waits for the
    former's event. The host waits in `read` and `wait` only. Nothing calls clFinish, so other
    owners' commands on the queue are not awaited. Methods raise DeviceError if the driver refuses
    a command or does not survive a fork, MemoryBudgetError if memory has run out.

    queue: of the caller; last: the event of the last command, None before the first.
    """

    def __init__(self, queue: cl.CommandQueue):
        self.queue = queue
        out_of_order = cl.command_queue_properties.OUT_OF_ORDER_EXEC_MODE_ENABLE
        self.ordered = not queue.properties & out_of_order
        self.last: cl.Event | None = None
        self._before: list[cl.Event] = []
        self._copies: deque[cl.Event] = deque()  # unfinished copies to the host

    def after(self, events: Events) -> None:
        """Let the next command wait for the caller's events too.

        Raises DeviceError for a failed event: with some drivers the command would never start.
        """
        awaited = list(events or ())
        for event in awaited:
            if event.command_execution_status < 0:
                raise failed_before(event)
        self._before += awaited

    def run(
        self,
        bound: BoundKernel,
        global_size: Sequence[int],
        local_size: Sequence[int] | None = None,
        offset: Sequence[int] | None = None,
    ) -> cl.Event:
        """Enqueue a kernel; offset: of its first work-item. Raises DeviceError."""
        self.last = bound.enqueue(self.queue, global_size, local_size, self._waits(), offset)
        return self.last

    def fill(self, buffer: cl.Buffer, word: int, offset: int, nbytes: int) -> cl.Event:
        """Enqueue a fill of a buffer's range with a word."""
        command = cl.enqueue_fill_buffer
        return self._enqueue("a fill", nbytes, command, buffer, np.uint32(word), offset, nbytes)

    def fill_rows(self, buffer: cl.Buffer, word: int, rows: Rows) -> cl.Event:
        """Enqueue a fill of a buffer's rows with a word."""
        return self.write_rows(buffer, np.full(rows.count * rows.size // 4, word, np.uint32), rows)

    def write_rows(self, buffer: cl.Buffer, source: np.ndarray, rows: Rows) -> cl.Event:
        """Enqueue a copy of an array without gaps to a buffer's rows; it may change at once."""
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
        staged = host_buffer(self.queue.context, flags, source)
        return self._enqueue(
            "a copy to rows", source.nbytes, cl.enqueue_copy, buffer, staged,
            src_origin=(0, 0, 0), src_pitches=(rows.size,),
            dst_origin=(rows.first, 0, 0), dst_pitches=(rows.pitch,), region=rows.region,
        )  # fmt: skip

    def copy(self, target: cl.Buffer, source: cl.Buffer, **offsets: int) -> cl.Event:
        """Enqueue a copy on the device; offsets: see `pyopencl.enqueue_copy`."""
        size = offsets.get("byte_count", source.size)
        return self._enqueue("a copy", size, cl.enqueue_copy, target, source, **offsets)

    def write(self, target: cl.Buffer, source: np.ndarray, offset: int = 0) -> cl.Event:
        """Enqueue a copy of an array to a buffer; the array may change at once."""
        # The array is copied to a buffer, which the driver keeps until it is read: PyOpenCL's event
        # of a copy from the host waits when it is freed, and blocks Python's other threads.
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
        staged = host_buffer(self.queue.context, flags, np.ascontiguousarray(source))
        return self.copy(target, staged, dst_offset=offset, byte_count=staged.size)

    def mark(self) -> cl.Event:
        """Return an event that ends after all former commands and the events of `after`."""
        return self._enqueue("a marker", None, cl.enqueue_marker)

    def read(self, source: cl.Buffer, into: np.ndarray, offset: int = 0) -> np.ndarray:
        """Wait and return a buffer's content in an array."""
        if into.nbytes:
            wait(self.read_later(source, into, offset), "a copy to the host")
        return into

    def read_rows(self, source: cl.Buffer, into: np.ndarray, rows: Rows) -> np.ndarray:
        """Wait and return rows of a buffer in an array, without gaps."""
        event = self._enqueue(
            "a copy to the host", into.nbytes, cl.enqueue_copy, into, source,
            buffer_origin=(rows.first, 0, 0), buffer_pitches=(rows.pitch,),
            host_origin=(0, 0, 0), host_pitches=(rows.size,), region=rows.region,
            is_blocking=False,
        )  # fmt: skip
        wait(self._keep(event), "a copy to the host")
        return into

    def read_later(self, source: cl.Buffer, into: np.ndarray, offset: int = 0) -> cl.Event:
        """Enqueue a copy of a buffer to an array, which is valid when the event has ended."""
        options = {"src_offset": offset, "is_blocking": False}
        event = self._enqueue(
            "a copy to the host", into.nbytes, cl.enqueue_copy, into, source, **options
        )
        return self._keep(event)

    def rejoin(self) -> None:
        """Let the next command wait for all former commands, even if an event was lost."""
        if not self.ordered:
            self._before.append(cl.enqueue_marker(self.queue))

    def wait(self) -> None:
        """Wait until the last command has ended."""
        forking.check(self.queue)
        if self.last is not None:
            wait(self.last)

    def flush(self) -> None:
        """Let the device start the enqueued commands."""
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
        self,
        subject: str,
        nbytes: int | None,
        command: Callable[..., Any],
        *args: Any,
        **named: Any,
    ) -> cl.Event:
        """Enqueue an OpenCL command; subject, nbytes: see `refused`."""
        waits = self._waits()
        try:
            self.last = command(self.queue, *args, wait_for=waits, **named)
        except cl.Error as error:
            raise refused(subject, error, nbytes) from error
        return self.last

    def _keep(self, event: cl.Event) -> cl.Event:
        """Hold an event of a copy to the host until it has ended."""
        done = cl.command_execution_status.COMPLETE
        while self._copies and self._copies[0].command_execution_status <= done:
            self._copies.popleft()
        self._copies.append(event)
        return event


@dataclass
class Timing:
    """A kernel's number of calls, and its total time [s] by the device's clock."""

    calls: int = 0
    seconds: float = 0.0


class Timings:
    """Sums of kernels' times by name. A queue without profiling has none, at no cost."""

    def __init__(self, queue: cl.CommandQueue):
        self.enabled = bool(queue.properties & cl.command_queue_properties.PROFILING_ENABLE)
        self._pending: list[tuple[str, cl.Event]] = []
        self._sums: dict[str, Timing] = {}

    def add(self, name: str, event: cl.Event) -> cl.Event:
        """Note an event, which may be unfinished; return it."""
        if self.enabled:
            self._pending.append((name, event))
            if len(self._pending) >= 4096:  # held events take driver memory
                self.collect()
        return event

    def collect(self) -> dict[str, Timing]:
        """Wait for all events so far; return the Timing of each name, the longest first."""
        for name, event in self._pending:
            event.wait()
            timing = self._sums.setdefault(name, Timing())
            timing.calls += 1
            timing.seconds += (event.profile.end - event.profile.start) * 1e-9
        self._pending.clear()
        return dict(sorted(self._sums.items(), key=lambda item: -item[1].seconds))
