"""How adaptive sampling adds samples to a film: by the film's own wavefront, or with the help of
other devices, whose films are added to it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from clpt.render.wavefront.wavefront import Wavefront
from clpt.render.wavefront.work_list import PixelIndices

OnBatch = Callable[[Any], bool]


class Tracer:
    """Adds samples to a wavefront's film; each method returns whether it was not stopped.

    on_batch: see `Wavefront.render_samples`. Pixels are numbered as in a work list.
    """

    def __init__(self, wavefront: Wavefront):
        self.wavefront = wavefront

    def from_camera(
        self, pixels: PixelIndices, ends: PixelIndices, first: int, end: int, on_batch: OnBatch
    ) -> bool:
        """Add samples first to end - 1 of these pixels, of each before its own of `ends`."""
        self.wavefront.paths.set_work_list(pixels, ends)
        return self.wavefront.render_from_camera(first, end, on_batch)

    def from_lights(self, pixels: PixelIndices, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add the light paths of samples first to end - 1; pixels: all of the picture."""
        self.wavefront.paths.set_work_list(pixels)
        return self.wavefront.render_from_lights(first, end, on_batch)

    def guides(self, pixels: PixelIndices, first: int, end: int, on_batch: OnBatch) -> bool:
        """As `from_lights`, and leave the film's picture as it is."""
        self.wavefront.paths.set_work_list(pixels)
        return self.wavefront.trace_from_lights(first, end, on_batch)

    def gather(self) -> None:
        """Let the film hold all that was added so far."""

    def discard(self) -> None:
        """Forget what was added since `gather`."""

    def use_all_pixels(self, pixels: PixelIndices) -> None:
        """Let later renders sample every pixel; pixels: all of the picture."""
        self.wavefront.paths.set_work_list(pixels)
