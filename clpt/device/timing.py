"""Time of kernels by their names, from the device's own clock."""

from __future__ import annotations

from dataclasses import dataclass

import pyopencl as cl


@dataclass
class Timing:
    """The time of a kernel; calls: how often it ran; seconds: how long in all."""

    calls: int = 0
    seconds: float = 0.0


class Timings:
    """Sums over the events of kernels, by name.

    On a queue without profiling it keeps nothing and costs nothing.
    """

    def __init__(self, queue: cl.CommandQueue):
        self.enabled = bool(queue.properties & cl.command_queue_properties.PROFILING_ENABLE)
        self._pending: list[tuple[str, cl.Event]] = []
        self._sums: dict[str, Timing] = {}

    def add(self, name: str, event: cl.Event) -> cl.Event:
        """Note an event, which may not have ended; return it."""
        if self.enabled:
            self._pending.append((name, event))
            if len(self._pending) >= 4096:  # an event that is held costs the driver memory
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
