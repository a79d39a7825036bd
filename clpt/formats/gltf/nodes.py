"""The scene graph: which nodes are shown, and their transforms."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Matrix
from clpt.formats.gltf.document import Document, Element

# The defaults of a node, ten numbers in all.
TRS: dict[str, tuple[float, ...]] = {
    "translation": (0.0, 0.0, 0.0),
    "rotation": (0.0, 0.0, 0.0, 1.0),
    "scale": (1.0, 1.0, 1.0),
}
Pose = dict[tuple[int, str], NDArray[np.float64]]


@dataclass
class Graph:
    """The transforms of all nodes to the world (n, 4, 4), and the nodes of the scene, in order."""

    document: Document
    to_world: Matrix
    shown: list[int]
    pose: Pose = field(default_factory=dict)

    def node(self, index: int) -> Element:
        """Return a node."""
        return self.document.entry("nodes", index)


def graph(document: Document, chosen: str | None, pose: Pose) -> Graph:
    """Return the nodes of the chosen or default scene; `pose` overrides transforms.

    Without any scene all nodes are shown. Raises SceneError for a node that has two parents or is
    its own ancestor, and for an invalid transform.
    """
    nodes = document.root.children("nodes")
    children = [node.indices("children", "nodes") for node in nodes]
    parents = _parents(document, children)
    roots = [i for i, parent in enumerate(parents) if parent < 0]
    order = _descendants(roots, children)
    if len(order) < len(nodes):
        looping = sorted(set(range(len(nodes))) - set(order))[0]
        raise nodes[looping].error("is its own ancestor", "children")
    to_world = _locals(nodes, pose)
    with np.errstate(over="ignore", invalid="ignore"):
        for i in order:
            if parents[i] >= 0:
                to_world[i] = to_world[parents[i]] @ to_world[i]
    finite = np.isfinite(to_world).all(axis=(1, 2))
    if not finite.all():
        raise nodes[int(np.argmin(finite))].error("its transform is too large")
    scene = _scene(document, chosen)
    starts = roots if scene is None else scene.indices("nodes", "nodes")
    if scene is not None and any(parents[start] >= 0 for start in starts):
        scene.warn("names a node that is another's child: it stays where its parents put it")
    if scene is not None and len(set(starts)) < len(starts):
        raise scene.error("names a node twice", "nodes")
    return Graph(document, to_world, _descendants(starts, children), pose)


def compose(translation: Matrix, rotation: Matrix, scale: Matrix) -> Matrix:
    """Return matrices (..., 4, 4) T R S of (..., 3), unit quaternions xyzw (..., 4), (..., 3)."""
    x, y, z, w = np.moveaxis(rotation, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrices = np.zeros((*x.shape, 4, 4))
    matrices[..., :3, :3] = np.stack([np.stack(row, -1) for row in rows], -2) * scale[..., None, :]
    matrices[..., :3, 3] = translation
    matrices[..., 3, 3] = 1.0
    return matrices


def _scene(document: Document, chosen: str | None) -> Element | None:
    scenes = document.root.children("scenes")
    if chosen is not None:
        for number, scene in enumerate(scenes):
            if chosen in (str(number), scene.text("name", None)):
                return scene
        names = ", ".join(s.text("name", str(i)) for i, s in enumerate(scenes)) or "none"
        raise document.root.error(f"has no scene {chosen!r}; it has: {names}")
    if len(scenes) > 1:
        document.warn(f"one of its {len(scenes)} scenes is shown; -D scene=N chooses another")
    return document.root.entry("scene", "scenes") or (scenes[0] if scenes else None)


def _parents(document: Document, children: list[list[int]]) -> list[int]:
    parents = [-1] * len(children)
    for parent, node_children in enumerate(children):
        for child in node_children:
            if parents[child] >= 0:
                message = f"nodes[{child}] is already a child of nodes[{parents[child]}]"
                raise document.entry("nodes", parent).error(message, "children")
            parents[child] = parent
    return parents


def _descendants(roots: list[int], children: list[list[int]]) -> list[int]:
    """Return roots and all below them, parents first; without recursion: graphs can be deep."""
    order, open_ = [], list(reversed(roots))
    seen = set()
    while open_:
        node = open_.pop()
        if node not in seen:
            seen.add(node)
            order.append(node)
            open_ += reversed(children[node])
    return order


def _locals(nodes: list[Element], pose: Pose) -> Matrix:
    """Return the nodes' own transforms (n, 4, 4), with the values of `pose` where it has any."""
    values = np.zeros((len(nodes), 10))
    for i, node in enumerate(nodes):
        values[i] = [
            value for path in TRS for value in node.numbers(path, len(TRS[path]), TRS[path])
        ]
    for (i, path), value in pose.items():
        if path in TRS:
            first = list(TRS).index(path)
            values[i, (0, 3, 7)[first] : (3, 7, 10)[first]] = value
    length = np.linalg.norm(values[:, 3:7], axis=1, keepdims=True)
    if (length < 1e-6).any():
        raise nodes[int(np.argmin(length))].error(
            "a quaternion of length 0 is no rotation", "rotation"
        )
    matrices = compose(values[:, :3], values[:, 3:7] / length, values[:, 7:])
    for i, node in enumerate(nodes):
        if "matrix" in node:
            matrices[i] = np.array(node.numbers("matrix", 16)).reshape(4, 4).T
            if not np.allclose(matrices[i, 3], [0.0, 0.0, 0.0, 1.0]):
                raise node.error("its last row must be 0 0 0 1", "matrix")
    return matrices
