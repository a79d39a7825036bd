"""The acceleration structures of a lowered scene, and the table that leads rays into instances."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import bvh
from clpt.device.buffers import Buffers
from clpt.render.flow.scene_to_tables import Lowered


@dataclass(frozen=True)
class Trees:
    """The trees of a scene on a device.

    triangles: the trees over the triangles of the world and of every group, in shared buffers;
    offsets: where each of them begins, (n, 2) uint32, see clpt.bvh.build_parts; boxes: the trees
    over analytic shapes, "shape", and over instances, "instance"; order: (k,) uint32, the instance
    in each leaf; rows: (k,) of INSTANCE.dtype, the rows of the instances in that order, as they
    were last written by the host; instances: their buffer; seconds: of the builds.
    """

    triangles: bvh.Bvh
    offsets: NDArray[np.uint32]
    boxes: dict[str, bvh.Bvh]
    order: NDArray[np.uint32]
    rows: NDArray[Any]
    instances: cl.Buffer
    seconds: float

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
        triangles, offsets = bvh.build_parts(
            buffers.device, points, lowered.faces, lowered.tags, runs, layout, quality
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
