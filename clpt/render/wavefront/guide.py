"""A guide on the device: it learns where light comes from (transport/guiding/guide.cl)."""

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
        """The light paths for each pixel from which it learns."""
        return -(-self._learns_from // self._paths.pixels)

    def clear(self) -> None:
        """Enqueue that it knows nothing."""
        self.stream.fill(self.arguments["guide"], 0, 0, self._bytes)

    def prepare(self, kernels: Kernels) -> None:
        """Build what `sum` runs. Raises KernelBuildError."""
        kernels.build({PROGRAM: device.assemble(ROOT)})

    def sum(self, kernels: Kernels) -> None:
        """Enqueue that it stands for what light paths have left."""
        self.prepare(kernels)
        bound = kernels.programs[PROGRAM].kernel(KERNEL).bind(**self.arguments)
        self.stream.run(bound, (self._rows,), (GROUP,))
        self.trained = True
