"""The progress of a render, as a caller's `progress` is told it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """The progress of a render at some time.

    samples, total: per pixel, in the mean; paths: samples of all pixels; rays: traced so far;
    seconds: since the first; active: the share of the pixels that are not finished; noise: of the
    picture so far, relative, None where it is not measured.
    """

    samples: float
    total: int
    paths: int
    rays: int
    seconds: float
    active: float = 1.0
    noise: float | None = None
