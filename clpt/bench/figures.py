"""Figures: quantities measured in rounds, with their spread and plausibility."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterable, Sequence
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
