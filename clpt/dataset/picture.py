"""A picture of a dataset."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.arrays import Floats32
from clpt.dataset.truth import Truth
from clpt.scene import Scene


@dataclass(frozen=True)
class Picture:
    """A picture of a dataset.

    index: its number; image: (h, w, 3) linear; scene; truth: see `Truth`, or None; seconds: that it
    took, without its files.
    """

    index: int
    image: Floats32
    scene: Scene
    truth: Truth | None
    seconds: float
