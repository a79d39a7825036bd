"""Graphs of MaterialX over places in space as textures that fill it: noise, mixed and scaled."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt.formats.materialx.graph import (
    PLACES,
    Graph,
    LeftOut,
    Node,
    category,
    numbers,
    probing,
    said,
)
from clpt.scene.textures import MOST_OCTAVES, Mix, Noise, Product, Texture

PASSED = ("convert", "dot", "clamp")  # a reflectance is limited in any case
AMPLITUDE = 0.982  # of Perlin's noise in the library, where ours has 1


def texture(graph: Graph, node: Node, output: str, wide: bool) -> Any:
    """Return an output as a number, three of them, or a texture. Raises LeftOut.

    wide: whether a color is wanted.
    """
    probe = probing()
    value = graph.output(node, output, probe)
    if not probe.varies:
        return said(value.reshape(-1), wide)
    kind = category(node.kind)
    if kind in PASSED:
        return _input(graph, node, "in", 0.0, wide)
    if kind == "mix":
        ends = [_input(graph, node, name, 0.0, wide) for name in ("bg", "fg")]
        return Mix(first=ends[0], second=ends[1], amount=_input(graph, node, "mix", 0.0, False))
    if kind in ("fractal3d", "noise3d"):
        return _noise(graph, node, wide)
    if kind in ("multiply", "add", "subtract", "invert"):
        return _combined(graph, node, kind, wide)
    inner = graph.library(node, output)
    if inner is None:
        raise LeftOut(f"{node.kind} of places in space is not read")
    return texture(graph, *inner, wide)


def _input(graph: Graph, node: Node, name: str, default: float, wide: bool) -> Any:
    source = node.source(name)
    if source is not None:
        return texture(graph, *source, wide)
    return said(graph.evaluated(node, name, default, probing()).reshape(-1), wide)


def _combined(graph: Graph, node: Node, kind: str, wide: bool) -> Any:
    """Return a product, a sum or a difference; a sum is twice the mean."""
    if kind == "invert":
        a, b = (_input(graph, node, name, x, wide) for name, x in (("amount", 1.0), ("in", 0.0)))
    else:
        usual = 1.0 if kind == "multiply" else 0.0
        a, b = (_input(graph, node, name, x, wide) for name, x in (("in1", 0.0), ("in2", usual)))
    if kind == "multiply":
        return Product(first=a, second=b, rgb=wide)
    if kind != "add":
        b = Product(first=b, second=-1.0) if isinstance(b, Texture) else _negative(b)
    return Product(first=Mix(first=a, second=b, amount=0.5), second=2.0)


def _negative(value: float | tuple[float, ...]) -> Any:
    return tuple(-v for v in value) if isinstance(value, tuple) else -value


def _noise(graph: Graph, node: Node, wide: bool) -> Texture:
    """Return Perlin's noise, whose lattice lies where its places are a matrix of those in space."""
    probe = probing()
    at = PLACES
    if node.source("position") is not None:
        at = np.broadcast_to(graph.evaluated(node, "position", None, probe), PLACES.shape)
    ends = np.concatenate([PLACES.reshape(-1, 3), np.ones((PLACES[..., 0].size, 1))], axis=1)
    matrix, *_ = np.linalg.lstsq(ends, at.reshape(-1, 3), rcond=None)
    if not np.allclose(ends @ matrix, at.reshape(-1, 3), atol=1e-6):
        raise LeftOut(f"{node.kind} over places that a graph bends is not read")
    octaves = 1
    if category(node.kind) == "fractal3d":
        octaves = min(max(int(numbers(node.value("octaves", 3))[0]), 1), MOST_OCTAVES)
    rough = float(graph.constant(node, "diminish", 0.5)[0])
    to_texture = np.vstack([matrix.T, [0.0, 0.0, 0.0, 1.0]]).round(9)
    value = Noise(octaves=octaves, roughness=rough, to_texture=to_texture)
    low = float(graph.constant(node, "pivot", 0.0)[0])
    high = low + AMPLITUDE * float(graph.constant(node, "amplitude", 1.0)[0])
    black, white = (said(np.array([end]), wide) for end in (low, high))
    return Mix(first=black, second=white, amount=value)
