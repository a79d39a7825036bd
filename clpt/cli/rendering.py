"""Rendering in passes: the picture is complete after the first, and can be taken at any time."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Sequence

from ..cluster.cluster_renderer import ClusterRenderer
from ..render.film_renderer import MOST_SAMPLES
from ..render.progress import Progress
from ..render.wavefront.wavefront import Counts
from .scene_options import AnyRenderer

PASS_SECONDS = 3.0  # at the end of a pass few paths are left; only at its end is there a checkpoint
GROWTH = 3  # times what has been rendered so far


def render_samples(
    renderer: AnyRenderer | ClusterRenderer,
    end: int | None,
    limit: float | None,
    show: Callable[[Progress], None],
    noise: float | None = None,
    stopped: Sequence[int] = (),
    after_pass: Callable[[], None] = lambda: None,
    *,
    pass_seconds: float = PASS_SECONDS,
) -> None:
    """Render until the next sample is number `end` or `limit` [s] is over; None means no limit.

    With `noise` the rendering also ends when no pixel has more noise. after_pass: is called when a
    pass has come to its end; pass_seconds: of a pass, infinite for a single one.

    It ends soon after the limit, perhaps before every pixel has a sample, and within a second when
    `stopped` gets an entry, see clpt.cli.stopping.
    """
    began = time.perf_counter()
    first, last = renderer.first_sample, end or MOST_SAMPLES
    total = 0 if end is None else end - first
    others = renderer.counts if renderer.samples > first else Counts()  # who rendered before

    def tell(progress: Progress) -> bool:
        seconds = time.perf_counter() - began
        paths, rays = progress.paths - others.samples, progress.rays - others.rays
        show(dataclasses.replace(progress, total=total, seconds=seconds, paths=paths, rays=rays))
        over = limit is not None and seconds >= limit
        return not (stopped or over)

    if renderer.samples >= last:
        return
    size, now = 1 if math.isfinite(pass_seconds) else last - renderer.samples, began
    while renderer.run(size, tell, noise=noise):
        after_pass()
        start, now = now, time.perf_counter()
        seconds_left = math.inf if limit is None else began + limit - now
        samples_left = last - renderer.samples
        if stopped or samples_left <= 0 or seconds_left <= 0 or renderer.active == 0.0:
            break
        rate = size / max(now - start, 1e-9)
        done = renderer.samples - first
        size = pass_size(done, rate, samples_left, seconds_left, pass_seconds)


def pass_size(
    samples: int,
    rate: float,
    samples_left: float,
    seconds_left: float,
    seconds: float = PASS_SECONDS,
) -> int:
    """Return the samples of the next pass, after `samples`, at `rate` [1/s]; seconds: that it takes
    at the most.
    """
    in_time = int(rate * min(seconds, seconds_left))
    return int(max(1, min(GROWTH * samples, in_time, samples_left)))
