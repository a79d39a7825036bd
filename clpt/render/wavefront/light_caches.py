"""Photons, sorted by cells, and the guide of directions: light paths leave them on the device."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import device
from clpt.device.buffers import Buffers
from clpt.records import PHOTON, PHOTON_NUMBERS
from clpt.render.transport import light_caches
from clpt.render.wavefront.bounce_loop import Kernels, Step
from clpt.render.wavefront.path_buffers import PathBuffers

NONE, RUN = (PHOTON_NUMBERS[name] for name in ("none", "run"))
GROUP = 8  # work-items of a group
ADVICE = "lower photon_memory"
PHOTON_SORT, PHOTON_ROOT = "photons", "transport/photons/sort.cl"
GUIDE_SUM, GUIDE_ROOT = "guide", "transport/guiding/sum.cl"


class Photons:
    """The photons of a pass, which the next pass replaces.

    settings: of the scene, with `photon_places` and so on; arguments: of kernels, by name.

    Raises MemoryBudgetError.
    """

    def __init__(self, stream: device.Stream, buffers: Buffers, settings: NDArray[np.void]):
        self.stream = stream
        paths = int(settings["photon_pixels"]) * int(settings["light_paths"])
        self.places = paths * int(settings["photon_places"])
        self.cells = int(settings["photon_cells"])
        self._runs = -(-self.cells // RUN)

        def words(number: int) -> Any:
            return buffers.allocate("photons", 4 * number, ADVICE)

        self._cells = words(self.cells + 1)
        self._numbers = words(self.places)
        self._sums = words(self._runs)
        self.arguments = {
            "photons": words(self.places * PHOTON.words),
            "photon_numbers": self._numbers,
            "photon_order": words(self.places),
            "photon_cells": self._cells,
        }
        self._sorting: list[Step] = []
        stream.fill(self._cells, 0, 0, 4 * (self.cells + 1))

    @property
    def bytes(self) -> int:
        """The size of all buffers."""
        return sum(buffer.size for buffer in self.arguments.values()) + self._sums.size

    def clear(self) -> None:
        """Enqueue that no photon is stored."""
        self.stream.fill(self._numbers, NONE, 0, 4 * self.places)

    def prepare(self, kernels: Kernels) -> None:
        """Build the program of `sort`. Raises KernelBuildError."""
        if self._sorting:
            return
        kernels.build({PHOTON_SORT: device.assemble(PHOTON_ROOT)})
        program, order = kernels.programs[PHOTON_SORT], self.arguments["photon_order"]
        place = {"numbers": self._numbers, "count": self.places, "cells": self._cells}
        cell = {"count": self.cells, "cells": self._cells}
        steps: list[tuple[str, int, dict[str, Any]]] = [
            ("photons_count", self.places, place),
            ("photons_sum", self._runs, {**cell, "sums": self._sums}),
            ("photons_scan", 1, {"sums": self._sums, "runs": self._runs}),
            ("photons_begin", self._runs, {**cell, "sums": self._sums}),
            ("photons_place", self.places, {**place, "order": order}),
            ("photons_order", self.cells, {**cell, "order": order}),
        ]
        for name, items, arguments in steps:
            group = GROUP if items > 1 else 1
            bound = program.kernel(name).bind(**arguments)
            self._sorting.append(Step(name, bound, (-(-items // group) * group,), (group,)))

    def sort(self, kernels: Kernels) -> None:
        """Enqueue that the photons of a pass are sorted, for paths from the camera to find."""
        self.prepare(kernels)
        self.stream.fill(self._cells, 0, 0, 4 * (self.cells + 1))
        for step in self._sorting:
            self.stream.run(step.bound, step.size, step.group)


class Guide:
    """The sums of a guide, and whether it is `trained` on the present scene.

    paths: whose directions are guided. arguments: of kernels, by name.
    """

    def __init__(self, stream: device.Stream, paths: PathBuffers):
        self.stream, self._paths, self.trained = stream, paths, False
        settings = paths.settings
        self._learns_from = int(settings["guide_paths"])
        self._rows = int(settings["photon_cells"])
        self._bytes = 4 * self._rows * (light_caches.GUIDE_BINS + 1)
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
        kernels.build({GUIDE_SUM: device.assemble(GUIDE_ROOT)})

    def sum(self, kernels: Kernels) -> None:
        """Enqueue the sums over the records of light paths; the guide is then trained."""
        self.prepare(kernels)
        bound = kernels.programs[GUIDE_SUM].kernel("guide_sum").bind(**self.arguments)
        self.stream.run(bound, (self._rows,), (GROUP,))
        self.trained = True
