"""Layers as people can see them."""

from __future__ import annotations

import numpy as np

from clpt.arrays import Image


def viewable(name: str, layer: Image) -> Image:
    """Return values (h, w, 1 to 4) as colours in [0, 1], (h, w, 3) float32."""
    if name.endswith("albedo"):
        return layer
    if name.endswith("_normal"):
        return layer * np.float32(0.5) + np.float32(0.5)
    if name in ("depth", "z"):  # the nearest point is white, one twice as far half as bright
        near = np.min(layer, where=layer > 0, initial=np.inf)
        return np.repeat(np.divide(near, layer, where=layer > 0, out=np.zeros_like(layer)), 3, 2)
    if name.endswith(
        "_id"
    ):  # neighbours in number differ in hue; where nothing is seen it is black
        hue = layer * np.float32(0.618034) + np.arange(3, dtype=np.float32) / np.float32(3.0)
        shown = 0.5 + 0.5 * np.cos(2 * np.pi * hue)
        return np.where(layer < 0, 0.0, shown).astype(np.float32)
    if name == "motion":  # the hue is whereto, the brightness how far, of the farthest
        moved = layer[..., 2:] - layer[..., :2]
        turn = np.arctan2(moved[..., 1:], moved[..., :1])
        far = np.linalg.norm(moved, axis=2, keepdims=True)
        wheel = 0.5 + 0.5 * np.cos(turn - 2 * np.pi / 3 * np.arange(3))
        return (wheel * (far / max(float(far.max()), 1e-6))).astype(np.float32)
    cells = np.mod(layer, np.float32(1.0))  # positions and uv: the colours repeat in every unit
    return np.pad(cells, ((0, 0), (0, 0), (0, 3 - cells.shape[2])))
