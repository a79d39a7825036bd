"""What a render tells of its progress."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """How far a render is.

    samples, total: per pixel, in the mean; paths: samples of all pixels; rays: traced so far;
    seconds: since the first; active: the share of the pixels that are not finished.
    """

    samples: float
    total: int
    paths: int
    rays: int
    seconds: float
    active: float = 1.0
