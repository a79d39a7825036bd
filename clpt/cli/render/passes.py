"""Rendering in passes: the picture is complete after the first, and can be taken at any time."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...choices import MOST_SAMPLES
from ...render.progress import Progress
from ...render.resumable import ResumableRenderer
from ...render.wavefront.wavefront import Counts
from ..opening import DEVICE_SECONDS

GROWTH = 3  # times what has been rendered so far


@dataclass(frozen=True)
class End:
    """When a render ends: the first of these that comes; None means no limit.

    samples: the number of the next sample; seconds: of the render; noise: that no pixel has more
    of; stopped: gets an entry at a signal, see clpt.cli.process.ending.
    """

    samples: int | None = None
    seconds: float | None = None
    noise: float | None = None
    stopped: Sequence[int] = ()


def render_samples(
    renderer: ResumableRenderer,
    end: End,
    show: Callable[[Progress], None],
    after_pass: Callable[[], None] = lambda: None,
    *,
    pass_seconds: float = DEVICE_SECONDS,
) -> None:
    """Render until the end.

    show: called with the progress; after_pass: called at the end of a pass; pass_seconds: of a
    pass, infinite for a single pass.

    It ends soon after the limit, perhaps before every pixel has a sample, and within a second of a
    signal.
    """
    first, last, limit = renderer.first_sample, end.samples or MOST_SAMPLES, end.seconds
    if renderer.samples >= last:
        return
    began = time.perf_counter()
    total = 0 if end.samples is None else end.samples - first
    former = renderer.counts if renderer.samples > first else Counts()

    def tell(progress: Progress) -> bool:
        seconds = time.perf_counter() - began
        paths, rays = progress.paths - former.samples, progress.rays - former.rays
        show(dataclasses.replace(progress, total=total, seconds=seconds, paths=paths, rays=rays))
        return not (end.stopped or (limit is not None and seconds >= limit))

    size, now = 1 if math.isfinite(pass_seconds) else last - renderer.samples, began
    while renderer.run(size, tell, noise=end.noise):
        after_pass()
        start, now = now, time.perf_counter()
        seconds_left = math.inf if limit is None else began + limit - now
        samples_left = last - renderer.samples
        if end.stopped or samples_left <= 0 or seconds_left <= 0 or renderer.active == 0.0:
            break
        rate = size / max(now - start, 1e-9)
        size = pass_size(renderer.samples - first, rate, samples_left, seconds_left, pass_seconds)


def pass_size(
    samples: int,
    rate: float,
    samples_left: float,
    seconds_left: float,
    seconds: float = DEVICE_SECONDS,
) -> int:
    """Return the samples of the next pass, after `samples`, at `rate` [1/s]; seconds: that it takes
    at the most.
    """
    in_time = int(rate * min(seconds, seconds_left))
    return int(max(1, min(GROWTH * samples, in_time, samples_left)))
