"""Samples that adaptive sampling adds to a film: which ones, and who adds them.

It is the film's own wavefront, or other devices and machines, whose films are added to it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import pyopencl as cl

from clpt.arrays import Integers
from clpt.render.wavefront.wavefront import Wavefront

OnBatch = Callable[[Any], bool]
# Of all kinds and pixels, see `Wavefront.render_samples`; or of one kind: those of the camera,
# those of lights, and those of lights that leave the picture as it is.
Paths = Literal["all", "camera", "lights", "guides"]


@dataclass(frozen=True, eq=False)
class Selection:
    """Samples that any wavefront of a scene may add to its film, number by number.

    pixels: how many have these samples. ends: (cells,) the sample before which the pixels of each
    cell are left, 0 for a cell that has none; None: all pixels have all of them.
    """

    paths: Paths
    pixels: int
    ends: Integers | None = None

    def prepare(self, wavefront: Wavefront) -> None:
        """Enqueue that the wavefront samples these pixels, until `use_all_pixels`."""
        if self.paths == "all":
            return
        grid = wavefront.paths.cells
        if self.ends is None:
            wavefront.paths.set_work_list(grid.inside)
            return
        ends = self.ends[grid.cell[grid.inside]]
        chosen = ends > 0
        wavefront.paths.set_work_list(grid.inside[chosen], ends[chosen])

    def add(self, wavefront: Wavefront, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add samples first to end - 1, after `prepare`; return whether it was not stopped.

        on_batch: see `Wavefront.render_samples`.
        """
        render = {
            "all": wavefront.render_samples, "camera": wavefront.render_from_camera,
            "lights": wavefront.render_from_lights, "guides": wavefront.trace_from_lights,
        }[self.paths]  # fmt: skip
        return render(first, end, on_batch)


def use_all_pixels(wavefront: Wavefront) -> None:
    """Enqueue that later renders sample every pixel of the picture."""
    wavefront.paths.set_work_list(wavefront.paths.cells.inside)


class Tracer:
    """Adds samples to a wavefront's film."""

    def __init__(self, wavefront: Wavefront):
        self.wavefront = wavefront
        self._prepared: Selection | None = None
        self._copies: dict[str, cl.Buffer] = {}

    def add(self, selection: Selection, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add samples first to end - 1 of a selection; return whether it was not stopped."""
        if selection is not self._prepared:
            selection.prepare(self.wavefront)
        self._prepared = selection
        return selection.add(self.wavefront, first, end, on_batch)

    def gather(self) -> None:
        """Let the film hold all that was added so far."""

    def keep(self) -> None:
        """Keep what the film holds, for `give_back`."""
        wavefront = self.wavefront
        for name, sums in wavefront.film.sums.items():
            if name not in self._copies:
                what = f"a copy of the {name}"
                self._copies[name] = wavefront.buffers.allocate(what, sums.size)
            wavefront.stream.copy(self._copies[name], sums)

    def give_back(self) -> None:
        """Let the film hold what it did at `keep`."""
        for name, sums in self.wavefront.film.sums.items():
            self.wavefront.stream.copy(sums, self._copies[name])
        self.wavefront.refresh()

    def use_all_pixels(self) -> None:
        """Let later renders sample every pixel."""
        self._prepared = None
        use_all_pixels(self.wavefront)
