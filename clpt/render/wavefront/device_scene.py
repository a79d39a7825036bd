"""A lowered scene on a device: its tables and its trees, which several films may share.

A table leads rays into instances.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import bvh, device
from clpt.arrays import on_host
from clpt.device.buffers import Buffers
from clpt.records import TABLES
from clpt.render.flow.scene_to_tables import Lowered
from clpt.render.media.grids import POINT_WORDS, CloudDensity, Values
from clpt.render.textures.encode import PERMUTATION
from clpt.render.wavefront.strategy import Strategy


@dataclass(frozen=True)
class Trees:
    """The trees of a scene on a device.

    triangles: the trees over the triangles of the world and of every group, in shared buffers;
    offsets: where each of them begins, (n, 2) uint32, see clpt.bvh.build_parts; boxes: the trees
    over analytic shapes, "shape", and over instances, "instance"; order: (k,) uint32, the instance
    in each leaf; rows: (k,) of INSTANCE.dtype, the rows of the instances in that order, as they
    were last written by the host; instances: their buffer; seconds: of the builds; shared: whether
    they are another scene's, which releases the buffer.
    """

    triangles: bvh.Bvh
    offsets: NDArray[np.uint32]
    boxes: dict[str, bvh.Bvh]
    order: NDArray[np.uint32]
    rows: NDArray[Any]
    instances: cl.Buffer
    seconds: float
    shared: bool = False

    @property
    def arguments(self) -> dict[str, Any]:
        """The kernels' arguments by name."""
        return {
            **self.triangles.buffers,
            "triangles": max(self.triangles.count, 0),
            "instances": self.instances,
            **{
                f"{name}_{part}": buffer
                for name, tree in self.boxes.items()
                for part, buffer in tree.buffers.items()
            },
        }

    @property
    def bytes(self) -> dict[str, int]:
        """The size of each tree by name."""
        return {name: t.bytes for name, t in {"triangles": self.triangles, **self.boxes}.items()}


def build(
    buffers: Buffers,
    lowered: Lowered,
    vertices: cl.Buffer,
    layout: str,
    quality: bvh.Quality = "high",
    former: Trees | None = None,
) -> Trees:
    """Build the trees of a scene.

    vertices: the scene's table of vertices; former: trees whose triangles are taken over. Raises
    MemoryBudgetError, and SceneError as clpt.bvh.build does.
    """
    start = time.perf_counter()
    instances = lowered.instances
    if former is None:
        counts = [len(lowered.faces) - sum(instances.triangles), *instances.triangles]
        runs = bvh.Runs(counts, (1, *instances.keys), lowered.vertices)
        points = vertices if len(lowered.faces) else lowered.vertices
        building = bvh.Building(buffers.device, limit=buffers.available)
        triangles, offsets = bvh.build_parts(
            building, points, lowered.faces, lowered.tags, runs, layout, quality
        )
    else:
        triangles, offsets = former.triangles, former.offsets
    boxes = {}
    if lowered.features.geometry.analytic and layout != "brute":
        boxes["shape"] = bvh.build_boxes(buffers.device, lowered.boxes, bvh.shapes_layout(layout))
    order, rows = np.zeros(0, np.uint32), instances.rows
    if lowered.features.geometry.instances:
        boxes["instance"] = bvh.build_boxes(buffers.device, instances.boxes, layout)
        indices = boxes["instance"].buffers["indices"]
        order = buffers.download(indices, (len(instances.rows),), np.uint32)
        rows = instances.rows[order]  # neighbours in the tree are neighbours in memory
        rows["nodes"], rows["leaves"] = offsets[1 + instances.prototypes[order]].T
    table = rows.view(np.uint32) if len(rows) else lowered.table("instances")
    buffer = buffers.upload("the table of instances", table)
    seconds = time.perf_counter() - start
    return Trees(triangles, offsets, boxes, order, rows, buffer, seconds)


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
        self.trees: Trees
        if isinstance(quality, DeviceScene):
            self.tree_quality, self.trees = quality.tree_quality, quality.trees
        else:
            self.tree_quality = quality
            self.trees = build(buffers, lowered, vertices, layout, quality)
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
