"""Trees over triangles whose vertices move: nodes and leaves stand there once for each key.

The tree is that of the places in the middle, refitted to every key. What a traversal needs of two
keys are neighbours, see kernels/bvh/keyed.cl.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..choices import Quality
from ..records import TREE_BITS
from .building import Building
from .layouts import LAYOUTS, Mesh, Packed, Part, refit_nodes

WORDS = {"binary": (8, 16), "wide8": (64, 88), "compact": (20, 12)}  # of a node, and of a leaf
_FARTHEST = 1e38  # of boxes of what is not there: finite, so that no product with 0 is NaN
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
    """Build a tree over triangles of which each vertex has a row for each of `keys` keys.

    vertices: (n, 3) float32, the rows of a vertex side by side; faces: (m, 3) uint32, which name
    the first of these. It cannot be refitted. Raises MemoryBudgetError.
    """
    first = int(faces.min())
    own = vertices[first : int(faces.max()) + keys]
    count = len(own) - keys + 1
    lower, upper = (keys - 1) // 2, keys // 2
    middle = own.copy()
    middle[:count] = 0.5 * (own[lower : lower + count] + own[upper : upper + count])
    local = np.ascontiguousarray(faces - np.uint32(first))
    mesh = Mesh(
        len(local),
        building.upload(middle, np.float32),
        building.upload(local, np.uint32),
        building.upload(tags, np.uint32),
        quality,
    )
    packed = LAYOUTS[layout](building, mesh)
    copies = _refitted(building, packed, own, local, keys)
    node_words, leaf_words = WORDS[layout]
    made = _side_by_side([one[0] for one in copies], node_words)
    if layout == "wide8":
        _finish_wide(made, keys)
    buffers = {"nodes": _whole_steps(made)}
    buffers["leaves"] = _whole_steps(_side_by_side([one[1] for one in copies], leaf_words))
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


def _side_by_side(copies: list[NDArray[np.uint32]], words: int) -> NDArray[np.uint32]:
    """Records of `words` words of several copies, (n, copies, words)."""
    count = len(copies[0]) // words
    return np.stack([one[: count * words].reshape(count, words) for one in copies], axis=1)


def _finish_wide(nodes: NDArray[np.uint32], keys: int) -> None:
    """Let the words of wide nodes count nodes and blocks of all keys, and boxes be finite."""
    links, there = nodes[..., 48:56], nodes[..., 56:64] != 0
    leaf = links & _LEAF
    links[...] = np.where(there, leaf | (links ^ leaf) * np.uint32(keys), links)
    boxes = nodes[..., :48].view(np.float32)
    boxes[...] = np.clip(boxes, -_FARTHEST, _FARTHEST)


def _whole_steps(words: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Words in whole steps of 32 bytes, in which trees that share a buffer begin."""
    flat = words.reshape(-1)
    return np.concatenate([flat, np.zeros(-len(flat) % 8, np.uint32)])
