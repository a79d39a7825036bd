"""Selections of samples, and tracers, which add them to a film for adaptive sampling.

The tracer is the film's own wavefront, or other devices and machines, whose films are summed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import pyopencl as cl

from clpt.arrays import Integers
from clpt.render.wavefront.bounce_loop import OnBatch
from clpt.render.wavefront.wavefront import Wavefront

# Paths of all kinds and pixels, paths from the camera, light paths, or light paths that leave the
# picture unchanged.
Paths = Literal["all", "camera", "lights", "guides"]


@dataclass(frozen=True, eq=False)
class Selection:
    """Samples that any wavefront of a scene may add to its film, number by number.

    pixels: number of pixels with these samples. ends: (cells,) the end of the samples of each cell,
    0 for a cell without samples; None: all pixels have all samples.
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
        """Complete the film, if other devices have taken samples."""

    def keep(self) -> None:
        """Keep a copy of the film, for `give_back`."""
        wavefront = self.wavefront
        for name, sums in wavefront.film.sums.items():
            if name not in self._copies:
                label = f"a copy of the {name}"
                self._copies[name] = wavefront.buffers.allocate(label, sums.size)
            wavefront.stream.copy(self._copies[name], sums)

    def give_back(self) -> None:
        """Restore the film of `keep`."""
        for name, sums in self.wavefront.film.sums.items():
            self.wavefront.stream.copy(sums, self._copies[name])
        self.wavefront.refresh()

    def use_all_pixels(self) -> None:
        """Let later renders sample every pixel."""
        self._prepared = None
        use_all_pixels(self.wavefront)
