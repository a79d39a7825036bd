"""A guide on the device: it learns where light comes from, see kernels/guiding/guide.cl."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import device
from clpt.device.buffers import Buffers
from clpt.render.lowering import guides
from clpt.render.wavefront.bounce_loop import Kernels

PROGRAM, ROOT, KERNEL = "guide", "guiding/sum.cl", "guide_sum"
GROUP = 8  # work-items of a group


class Guide:
    """The sums of a guide, and whether it is `trained` on the present scene.

    settings: of the scene; pixels: how many have samples; arguments: of kernels, by name; samples:
    light paths for each of these pixels from which it learns.

    Raises MemoryBudgetError.
    """

    def __init__(
        self, stream: device.Stream, buffers: Buffers, settings: NDArray[np.void], pixels: int
    ):
        self.stream, self.trained = stream, False
        self._rows = int(settings["photon_cells"])
        self._bytes = 4 * self._rows * (guides.BINS + 1)
        self.arguments: dict[str, Any] = {"guide": buffers.allocate("the guide", self._bytes)}
        self.samples = -(-int(settings["guide_paths"]) // pixels)

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
