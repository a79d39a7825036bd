# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of surroundings that nodes compute, and of lamps; in the process that has clpt."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images
from clpt.formats import ies
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
    """Return lights with images in place of graphs and of tables of directions."""
    return [_baked(light, folder) for light in described]


def scene(file: Path) -> None:
    """Write a scene file again, with images in place of graphs and tables of its lights."""
    described = json.loads(file.read_text("utf-8"))
    baked = lights(described["lights"], file.parent)
    if baked != described["lights"]:
        file.write_text(json.dumps({**described, "lights": baked}), "utf-8")


def _baked(light: dict[str, Any], folder: Path) -> dict[str, Any]:
    image = light.get("image")
    if "table" in light:
        kept = {name: value for name, value in light.items() if name not in ("table", "cone")}
        file = _directions(light["table"], light.get("cone"), folder)
        return {**kept, "image": {"type": "bitmap", "image": file, "raw": True, "wrap": "repeat"}}
    is_graph = isinstance(image, dict) and light["type"] == "envmap"
    return {**light, "image": _file(image, folder)} if is_graph else light


def _directions(table: str, cone: list[float] | None, folder: Path) -> str:
    """Return the image of a lamp's file of intensities [cd], where a spot has a cone within it.

    cone: the cosines at its edge, and where it is as bright as within.
    """
    file = folder / f"lamp_{_name([table, cone])}.npy"
    if not file.is_file():
        image = np.asarray(ies.parameters(Path(table))["image"].image)
        if cone is not None:
            down = -np.cos(np.pi * (np.arange(len(image)) + 0.5) / len(image))
            t = np.clip((down - cone[0]) / max(cone[1] - cone[0], 1e-6), 0.0, 1.0)
            image = image * (t * t * (3.0 - 2.0 * t))[:, None, None]
        np.save(file, image.astype(np.float32))
    return str(file)


def _name(described: Any) -> str:
    """Return a name, the same one for the same description."""
    return hashlib.sha256(json.dumps(described).encode()).hexdigest()[:16]


def _file(radiance: dict[str, Any], folder: Path) -> str:
    """Return the image of a radiance; the same one for the same."""
    file = folder / f"world_{_name(radiance)}.npy"
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
