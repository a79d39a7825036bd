"""A lowered scene on a device: its tables and its trees, which several films may share."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyopencl as cl

from clpt import bvh, device
from clpt.arrays import on_host
from clpt.device.buffers import Buffers
from clpt.records import TABLES
from clpt.render.flow.scene_to_tables import Lowered
from clpt.render.media.grids import POINT_WORDS, CloudDensity, Values
from clpt.render.textures.encode import PERMUTATION
from clpt.render.wavefront import trees
from clpt.render.wavefront.strategy import Strategy

_BRICKS = "stage/density.cl#bricks"
_CLOUD = "stage/density.cl#cloud"
UPLOADED = tuple(name for name in TABLES if name != "instances")  # the trees have the instances


class DeviceScene:
    """A lowered scene on a device.

    lowered: the scene as it was lowered, which other device scenes may share: nobody writes to it.
    tables: the buffers of its tables by name; trees: over its triangles, shapes and instances.
    moved_tables: tables that kernels have written, whose words differ from the words in
    `lowered`; tree_refitted: whether the tree over triangles was refitted since it was built.
    quality: of the trees, see clpt.bvh.build; or a scene of the same shapes, whose trees it shares.

    Raises MemoryBudgetError, DeviceError.
    """

    def __init__(
        self,
        stream: device.Stream,
        buffers: Buffers,
        lowered: Lowered,
        strategy: Strategy,
        quality: bvh.Quality | DeviceScene = "high",
    ):
        self.device, self.stream, self.buffers = buffers.device, stream, buffers
        self.lowered, self.strategy = lowered, strategy
        self.tables: dict[str, cl.Buffer] = {
            name: lowered.zero_copy.get(name) or self.upload(name, lowered.table(name))
            for name in UPLOADED
        }
        vertices, layout = self.tables["vertices"], strategy.layout
        self.tree_quality: bvh.Quality
        self.trees: trees.Trees
        if isinstance(quality, DeviceScene):
            self.tree_quality, self.trees = quality.tree_quality, quality.trees
        else:
            self.tree_quality = quality
            self.trees = trees.build(buffers, lowered, vertices, layout, quality)
        self._building = bvh.Building(self.device, stream=stream)
        self.fill_grids()
        self.moved_tables: set[str] = set()
        self.tree_refitted = False

    @property
    def arguments(self) -> dict[str, Any]:
        """The kernels' arguments by name."""
        return {**self.tables, **self.trees.arguments}

    def fill_grids(self) -> None:
        """Enqueue the kernels that make bricks of densities on a device, and of clouds.

        A density of another context is copied through the host, which waits.
        """
        for grid in self.lowered.device_grids:
            source, begin = self._density(grid.values)
            count = int(np.prod(grid.bricks))
            common: dict[str, Any] = {
                "values": source, "begin": begin, "first": grid.first,
                "bricks_x": grid.bricks[0], "bricks_y": grid.bricks[1],
                **dict(zip(("nx", "ny", "nz"), grid.values.shape, strict=True)),
                "images": self.tables["images"],
            }  # fmt: skip
            self._building.run_each(_BRICKS, "brick_bounds", count, **common)
            self._building.run_each(
                _BRICKS, "brick_points", count * POINT_WORDS, bricks=count, **common
            )

    def _density(self, values: Values) -> tuple[cl.Buffer, int]:
        """A buffer with a density, and the index of its first number."""
        if isinstance(values, CloudDensity):
            density = self.buffers.allocate(
                "the density of a cloud", 4 * int(np.prod(values.shape))
            )
            self._building.run_each(
                _CLOUD, "cloud_density", int(np.prod(values.shape)),
                numbers=self.upload("clouds", values.numbers),
                permutation=self.upload("noise", PERMUTATION),
                **dict(zip(("nx", "ny", "nz"), values.shape, strict=True)), values=density,
            )  # fmt: skip
            return density, 0
        if values.context == self.device.context:
            self.stream.after(values.events)
            return values.base_data, values.offset // 4
        return self.upload("densities", on_host(values)), 0

    def upload(self, name: str, table: np.ndarray) -> cl.Buffer:
        """Return a new buffer that holds a table. Raises MemoryBudgetError."""
        return self.buffers.upload(f"the table of {name}", table)
