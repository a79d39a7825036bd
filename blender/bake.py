# SPDX-License-Identifier: GPL-3.0-or-later
"""Surroundings that nodes compute, as images; in the process beside Blender, which has clpt."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images
from clpt.formats.native import read
from clpt.scene.textures import Graph

SIZE = 1024, 512  # of an image


@dataclass(frozen=True)
class Directions:
    """The sources of a graph for directions (h, w, 3), and its images."""

    graph: Graph
    place: np.ndarray

    def source(self, name: str) -> np.ndarray:
        return self.place if name == "position" else np.zeros((*self.place.shape[:-1], 2))

    def texture(self, number: int, uv: np.ndarray | None, channels: int) -> np.ndarray:
        """Return an image at uv, blended between four texels."""
        image: Any = self.graph.textures[number].image
        if isinstance(image, (str, Path)):
            image = np.load(image) if str(image).endswith(".npy") else images.read(image)
        pixels = np.asarray(image, np.float64)
        pixels = pixels.reshape(*pixels.shape[:2], -1)[..., :channels]
        at = self.source("texcoord") if uv is None else uv
        height, width = pixels.shape[:2]
        x, y = at[..., 0] * width - 0.5, (1.0 - at[..., 1]) * height - 0.5
        left, top = np.floor(x).astype(int), np.floor(y).astype(int)
        s, t = (x - left)[..., None], (y - top)[..., None]

        def texel(i: int, j: int) -> np.ndarray:
            return pixels[np.clip(top + j, 0, height - 1), (left + i) % width]

        upper = texel(0, 0) * (1.0 - s) + texel(1, 0) * s
        return upper * (1.0 - t) + (texel(0, 1) * (1.0 - s) + texel(1, 1) * s) * t


def lights(described: list[dict[str, Any]], folder: Path) -> list[dict[str, Any]]:
    """Return lights with images in place of graphs."""
    return [
        {**light, "image": _file(light["image"], folder)}
        if isinstance(light.get("image"), dict)
        else light
        for light in described
    ]


def scene(file: Path) -> None:
    """Write a scene file again, with images in place of graphs around it."""
    described = json.loads(file.read_text("utf-8"))
    if any(isinstance(light.get("image"), dict) for light in described["lights"]):
        described["lights"] = lights(described["lights"], file.parent)
        file.write_text(json.dumps(described), "utf-8")


def _file(radiance: dict[str, Any], folder: Path) -> str:
    """Return the image of a radiance; the same one for the same."""
    name = hashlib.sha256(json.dumps(radiance).encode()).hexdigest()[:16]
    file = folder / f"world_{name}.npy"
    if not file.is_file():
        width, height = SIZE
        polar = np.pi * np.arange(height)[:, None] / (height - 1)
        turn = 2.0 * np.pi * (0.5 - (np.arange(width)[None, :] + 0.5) / width)
        parts = np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)
        place = np.stack(np.broadcast_arrays(*parts), axis=-1)
        pixels = np.broadcast_to(_value(radiance, place, folder), place.shape)
        np.save(file, np.maximum(np.nan_to_num(pixels), 0.0).astype(np.float32))
    return str(file)


def _value(radiance: Any, place: np.ndarray, folder: Path) -> np.ndarray:
    """Return a radiance by direction: numbers, a mixture or a graph."""
    if not isinstance(radiance, dict):
        return np.atleast_1d(np.asarray(radiance, np.float64))
    if radiance["type"] == "mix":
        keys = ("first", "second", "amount")
        first, second, share = (_value(radiance[key], place, folder) for key in keys)
        return first + (second - first) * share
    if radiance["type"] != "graph":
        look = {"type": "texture", "texture": 0}
        radiance = {"type": "graph", "nodes": {"look": look}, "textures": [radiance]}
    carrier = {"type": "sphere", "material": {"type": "diffuse", "reflectance": radiance}}
    described = {"version": 2, "camera": {"type": "perspective"}, "shapes": [carrier]}
    material: Any = read.from_json(described, folder, "grey").shapes[0].material
    return material.reflectance.evaluated(Directions(material.reflectance, place))
