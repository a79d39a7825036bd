"""Cameras: the first one of the scene, or a chosen one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clpt import transforms
from clpt.arrays import Matrix
from clpt.formats.gltf.document import Element
from clpt.formats.gltf.nodes import Graph
from clpt.scene.cameras import Camera, Orthographic, Perspective
from clpt.scene.integrators import Film

Size = tuple[int, int]
FROM_GLTF = np.diag([-1.0, 1.0, -1.0, 1.0])  # glTF looks along -z with +x to the right
HEIGHT = Film().height
FAR = 1e30  # [m] without a far plane
LARGEST_ASPECT = 16.0  # of a film, and of its inverse


def cameras_of(graph: Graph) -> list[tuple[int, Element]]:
    """Return (node, camera) of every camera in the scene, in order."""
    pairs = [(i, graph.node(i).entry("camera", "cameras")) for i in graph.shown]
    return [(node, camera) for node, camera in pairs if camera is not None]


def descriptions(graph: Graph) -> list[str]:
    """Return the kind and, where it has one, the name of every camera in the scene."""
    names = [c.text("name", None) or graph.node(i).text("name", None) for i, c in cameras_of(graph)]
    kinds = [camera.text("type") for _, camera in cameras_of(graph)]
    return [f"{kind} {name or ''}".strip() for kind, name in zip(kinds, names, strict=True)]


def chosen(graph: Graph, name: str | None) -> tuple[Camera, Size] | None:
    """Return a camera and the size of its film, or None where the scene has no camera.

    name: its number in the scene, its own name or its node's; None for the first one. Raises
    SceneError where there is none of that name.
    """
    cameras = cameras_of(graph)
    if name is None:
        if not cameras:
            return None
        return camera(cameras[0][1], graph.to_world[cameras[0][0]])
    for number, (node, element) in enumerate(cameras):
        if name in (str(number), element.text("name", None), graph.node(node).text("name", None)):
            return camera(element, graph.to_world[node])
    names = ", ".join(c.text("name", str(i)) for i, (_, c) in enumerate(cameras)) or "none"
    raise graph.document.root.error(f"shows no camera {name!r}; it shows: {names}")


def camera(element: Element, node: Matrix) -> tuple[Camera, Size]:
    """Return a camera and the size of its film; the node's scale does not count."""
    kind = element.text("type", choices=("perspective", "orthographic"))
    lens = element.needed(kind)
    to_world = rigid(lens, node) @ FROM_GLTF
    if kind == "orthographic":
        x, y = (abs(lens.number(key)) for key in ("xmag", "ymag"))
        if not (x > 0.0 and y > 0.0):
            raise lens.error("xmag and ymag must not be 0")
        planes = _planes(lens, needed=True)
        to_world = to_world @ transforms.scale([x, x, 1.0])
        return Orthographic(to_world=to_world, **planes), size(x / y)
    fov = math.degrees(lens.number("yfov", low=1e-5, high=math.pi - 1e-5))
    aspect = lens.number("aspectRatio", Film().width / HEIGHT, low=1e-6)
    planes = _planes(lens, needed=False)
    return Perspective(to_world=to_world, fov=fov, fov_axis="y", **planes), size(aspect)


def size(aspect: float) -> Size:
    """Return the width and height of a film of the default height and that aspect ratio."""
    aspect = min(max(aspect, 1.0 / LARGEST_ASPECT), LARGEST_ASPECT)
    return max(round(HEIGHT * aspect), 1), HEIGHT


def rigid(element: Element, node: Matrix) -> Matrix:
    """Return a node's transform without its scale: the nearest rotation, and the translation."""
    if transforms.is_singular(node):
        raise element.error("its node's transform flattens space")
    return transforms.rigid(node)


def _planes(lens: Element, needed: bool) -> dict[str, Any]:
    near = lens.number("znear", low=0.0)
    far = lens.number("zfar") if needed else lens.number("zfar", FAR)
    if far <= near:
        raise lens.error("must be farther than znear", "zfar")
    return {"near": near, "far": far}
