"""Figures: quantities measured in rounds, with their spread and plausibility.

The bandwidth of a copying kernel is the yardstick of other kernels.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from clpt import device
from clpt.device.stream import Timings

SECONDS = "s"


@dataclass(frozen=True)
class Figure:
    """A measured quantity.

    part: a name in clpt.bench.PARTS; name: unique in the part; scene: its name, or ""; rounds: the
    value of each round; more: further JSON values; refused: why it cannot be true, or "".
    """

    part: str
    name: str
    unit: str
    rounds: tuple[float, ...]
    scene: str = ""
    more: dict[str, Any] = field(default_factory=dict)
    refused: str = ""

    @property
    def value(self) -> float:
        """The median of the rounds."""
        return float(np.median(self.rounds)) if self.rounds else float("nan")

    @property
    def spread(self) -> float:
        """Half the distance between the rounds' quartiles, as a share of the median."""
        if len(self.rounds) < 2 or not self.value:
            return 0.0
        low, high = np.percentile(self.rounds, (25, 75))
        return float((high - low) / 2 / self.value)

    @property
    def less_is_better(self) -> bool:
        """Whether the figure is a time."""
        return self.unit == SECONDS

    def refuse(self, *complaints: str) -> Figure:
        """Return a copy of this figure, refused if any complaint is not empty."""
        all_complaints = [self.refused, *complaints]
        return dataclasses.replace(
            self, refused="; ".join(dict.fromkeys(filter(None, all_complaints)))
        )

    def record(self) -> dict[str, Any]:
        """Return this figure as JSON values; a refused figure has no value."""
        optional: dict[str, Any] = {"scene": self.scene} if self.scene else {}
        if self.refused:
            optional["refused"] = self.refused
        return {
            "bench": self.part,
            **optional,
            "figure": self.name,
            "unit": self.unit,
            "value": self.value if self.rounds and not self.refused else None,
            "spread": self.spread,
            "rounds": [] if self.refused else list(self.rounds),
            **self.more,
        }


def rates(items: float | Sequence[float], seconds: Iterable[float]) -> tuple[float, ...]:
    """Return millions a second of each round."""
    taken = np.asarray(list(seconds))
    return tuple((np.asarray(items) * 1e-6 / taken).tolist())


@dataclass(frozen=True)
class Taken:
    """Seconds by the device's clock, and by the host's clock until the device had ended."""

    device: float
    host: float


def timed(on: device.Device, enqueue: Callable[[], Iterable[Any]]) -> Taken:
    """Time the commands whose events `enqueue` returns, on a queue with profiling."""
    timings, stream = Timings(on.queue), device.Stream(on.queue)
    device.wait(stream.mark())
    start = time.perf_counter()
    for event in enqueue():
        timings.add("", event)
    device.wait(stream.mark())
    host = time.perf_counter() - start
    return Taken(timings.collect()[""].seconds, host)


def clock_complaint(taken: Iterable[Taken]) -> str:
    """Return why the device's clock is wrong, or "": it stands still, or outruns the host's."""
    for seconds in taken:
        if not seconds.device > 0.0:
            return "the device's clock tells that it took no time"
        if seconds.device > 1.1 * seconds.host + 1e-3:
            return (
                f"the device's clock tells {seconds.device:.3g} s "
                f"of what took {seconds.host:.3g} s by the host's"
            )
    return ""


COPY = """
/* Each work-item copies 64 bytes. */
kernel void copy(global const uint16 *restrict from, global uint16 *restrict to)
{
    to[get_global_id(0)] = from[get_global_id(0)];
}
"""
LARGEST = 1 << 27  # [bytes] beyond the caches of most devices
WORD = 0x9E3779B9
SLACK = 1.25  # over a copy's bandwidth: caches and registers may hold a part


class Copying:
    """Copies between two buffers.

    Raises MemoryBudgetError if the device lacks memory.
    """

    def __init__(self, on: device.Device):
        self.device = on
        self._program = device.build(on, device.assemble("copy", {"copy": COPY}))
        self._rates: dict[int, float] = {}

    def rounds(self, nbytes: int, rounds: int) -> tuple[list[Taken], str]:
        """Time copies of about `nbytes` bytes; return the times, and a complaint or ""."""
        items = max(nbytes // 64, 64)
        give = device.Buffers(self.device)
        source = (np.arange(items * 16, dtype=np.uint32) * WORD).view(np.uint32)
        first = give.upload("the copy's source", source)
        second = give.allocate("the copy's target", source.nbytes)
        stream = device.Stream(self.device.queue)
        bound = self._program.kernel("copy").bind(**{"from": first, "to": second})
        repeats = max(1, min(64, (1 << 25) // nbytes))

        def enqueue() -> list:
            return [
                stream.run(bound, (items,), (64 if items % 64 == 0 else 1,)) for _ in range(repeats)
            ]

        timed(self.device, enqueue)
        stream.fill(second, 0, 0, source.nbytes)
        taken = [timed(self.device, enqueue) for _ in range(rounds)]
        wrong = (give.download(second, source.shape, np.uint32) != source).sum()
        complaint = f"{wrong:,} of {source.size:,} words were not copied" if wrong else ""
        each = [Taken(t.device / repeats, t.host / repeats) for t in taken]
        return each, complaint or clock_complaint(taken)

    def rate(self, nbytes: int) -> float:
        """Return bytes read and written a second by copies of `nbytes`; measured once."""
        half = max(nbytes // 2 // 4096, 1) * 4096
        if half not in self._rates:
            taken, _ = self.rounds(half, 5)
            self._rates[half] = 2 * half / min(t.device for t in taken)
        return self._rates[half]

    def complaint(self, nbytes: float, seconds: float, within: int) -> str:
        """Return why bytes cannot have been moved in the time, or "".

        within: size of the memory that holds them [bytes], which may fit a cache.
        """
        limit = SLACK * max(self.rate(within), self.rate(2 * LARGEST))
        if nbytes <= limit * seconds:
            return ""
        return (
            f"{nbytes / seconds * 1e-9:.3g} GB/s cannot be: a copy of as much memory "
            f"moves {limit / SLACK * 1e-9:.3g} GB/s"
        )


def measure(
    on: device.Device, rounds: int, sizes: Sequence[int] = (1 << 21, LARGEST)
) -> Iterator[Figure]:
    """Yield figures of copies: GB/s read and written, for a small and a large buffer."""
    copying = Copying(on)
    for size in sizes:
        size = min(size, on.info.max_alloc // 64 * 64)
        taken, complaint = copying.rounds(size, rounds)
        speeds = tuple(2e-9 * size / t.device for t in taken)
        name = f"copy {size / 2**20:g} MiB"
        yield Figure("bandwidth", name, "GB/s", speeds, more={"bytes": 2 * size}).refuse(complaint)
