"""Trees over triangles with moving vertices: nodes and leaves have a copy for each key.

The tree is built over the middle positions, and refitted to every key. Copies of a record for
consecutive keys are neighbours, see kernels/bvh/keyed.cl.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..choices import Quality
from ..records import TREE_BITS
from .building import Building
from .layouts import LAYOUTS, Mesh, Packed, Part, refit_nodes

WORDS = {
    "binary": (8, 16),
    "wide8": (64, 88),
    "compact": (20, 12),
}  # words of a node, and of a leaf
_FARTHEST = 1e38  # bounds of empty boxes: finite, so that a product with 0 is not NaN
_LEAF = np.uint32(TREE_BITS["leaf"])


def keyed(
    building: Building,
    vertices: NDArray[np.float32],
    faces: NDArray[np.uint32],
    tags: NDArray[np.uint32],
    keys: int,
    layout: str,
    quality: Quality = "high",
) -> Packed:
    """Build a tree over triangles whose vertices have a row for each key.

    vertices: (n, 3) float32, with consecutive rows for a vertex's keys; faces: (m, 3) uint32 first
    rows of vertices; keys: their number. The tree cannot be refitted. Raises MemoryBudgetError.
    """
    first = int(faces.min())
    used = vertices[first : int(faces.max()) + keys]
    count = len(used) - keys + 1
    lower, upper = (keys - 1) // 2, keys // 2
    middle = used.copy()
    middle[:count] = 0.5 * (used[lower : lower + count] + used[upper : upper + count])
    local = np.ascontiguousarray(faces - np.uint32(first))
    mesh = Mesh(
        len(local),
        building.upload(middle, np.float32),
        building.upload(local, np.uint32),
        building.upload(tags, np.uint32),
        quality,
    )
    packed = LAYOUTS[layout](building, mesh)
    copies = _refitted(building, packed, used, local, keys)
    node_words, leaf_words = WORDS[layout]
    keyed_nodes = _interleaved([nodes for nodes, _ in copies], node_words)
    if layout == "wide8":
        _finish_wide(keyed_nodes, keys)
    keyed_leaves = _interleaved([leaves for _, leaves in copies], leaf_words)
    buffers = {"nodes": _padded(keyed_nodes), "leaves": _padded(keyed_leaves)}
    uploaded = {name: building.upload(words, np.uint32) for name, words in buffers.items()}
    return Packed(uploaded, Part(0), packed.stats)


def _refitted(
    building: Building,
    packed: Packed,
    vertices: NDArray[np.float32],
    faces: NDArray[np.uint32],
    keys: int,
) -> list[tuple[NDArray[np.uint32], NDArray[np.uint32]]]:
    """Return the nodes and leaves of a tree at each key."""
    nodes, leaves = packed.buffers["nodes"], packed.buffers["leaves"]
    places = building.upload(vertices, np.float32)
    copies: list[tuple[NDArray[np.uint32], NDArray[np.uint32]]] = []
    for key in range(keys):
        source = {"vertices": places, "faces": building.upload(faces + np.uint32(key), np.uint32)}
        trees = {"nodes": nodes, "leaves": leaves, "boxes": None, "indices": None}
        refit_nodes(building, packed.part, **trees, **source)
        copies.append(
            (
                building.read(nodes, nodes.size // 4, np.uint32),
                building.read(leaves, leaves.size // 4, np.uint32),
            )
        )
    return copies


def _interleaved(copies: list[NDArray[np.uint32]], words: int) -> NDArray[np.uint32]:
    """Return records of `words` words of several copies, (n, copies, words)."""
    count = len(copies[0]) // words
    return np.stack([c[: count * words].reshape(count, words) for c in copies], axis=1)


def _finish_wide(nodes: NDArray[np.uint32], keys: int) -> None:
    """Multiply the links of wide nodes by the number of keys, and make boxes finite."""
    links, exists = nodes[..., 48:56], nodes[..., 56:64] != 0
    leaf = links & _LEAF
    links[...] = np.where(exists, leaf | (links ^ leaf) * np.uint32(keys), links)
    boxes = nodes[..., :48].view(np.float32)
    boxes[...] = np.clip(boxes, -_FARTHEST, _FARTHEST)


def _padded(words: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return words padded to steps of 32 bytes, the alignment of trees in shared buffers."""
    flat = words.reshape(-1)
    return np.concatenate([flat, np.zeros(-len(flat) % 8, np.uint32)])
