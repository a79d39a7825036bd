"""A guide on the device: directions of light, learned from light paths (guiding/guide.cl)."""

from __future__ import annotations

from typing import Any

from clpt import device
from clpt.render.transport import guides
from clpt.render.wavefront.bounce_loop import Kernels
from clpt.render.wavefront.path_buffers import PathBuffers

PROGRAM, ROOT, KERNEL = "guide", "transport/guiding/sum.cl", "guide_sum"
GROUP = 8  # work-items of a group


class Guide:
    """The sums of a guide, and whether it is `trained` on the present scene.

    paths: whose directions are guided. arguments: of kernels, by name.
    """

    def __init__(self, stream: device.Stream, paths: PathBuffers):
        self.stream, self._paths, self.trained = stream, paths, False
        settings = paths.settings
        self._learns_from = int(settings["guide_paths"])
        self._rows = int(settings["photon_cells"])
        self._bytes = 4 * self._rows * (guides.BINS + 1)
        guide = paths.buffers.allocate("the guide", self._bytes)
        self.arguments: dict[str, Any] = {"guide": guide}

    @property
    def samples(self) -> int:
        """The light paths for each pixel that train it."""
        return -(-self._learns_from // self._paths.pixels)

    def clear(self) -> None:
        """Enqueue that all sums are zero."""
        self.stream.fill(self.arguments["guide"], 0, 0, self._bytes)

    def prepare(self, kernels: Kernels) -> None:
        """Build the program of `sum`. Raises KernelBuildError."""
        kernels.build({PROGRAM: device.assemble(ROOT)})

    def sum(self, kernels: Kernels) -> None:
        """Enqueue the sums over the records of light paths; the guide is then trained."""
        self.prepare(kernels)
        bound = kernels.programs[PROGRAM].kernel(KERNEL).bind(**self.arguments)
        self.stream.run(bound, (self._rows,), (GROUP,))
        self.trained = True
