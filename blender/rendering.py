# SPDX-License-Identifier: GPL-3.0-or-later
"""Final pictures by clpt, in the process beside Blender; `live.py` has those of viewports."""

from __future__ import annotations

import dataclasses
import importlib.util
import time
from pathlib import Path
from typing import Any

import bake
import live
import numpy as np
from worker import Link

import clpt
from clpt.formats.native import read
from clpt.scene import Scene

SHOWN_EVERY = 0.5  # [s] of pictures on the way
WIDTHS = {"uv": 3}  # channels of layers that have more in Blender
GREY = "grey"  # in place of images that cannot be read


def answer(link: Link, message: dict[str, Any]) -> None:
    """Do what a message asks for."""
    if "live" in message:
        live.Live(link, message["live"]).go()
    elif "file" in message:
        _render(link, message)


def _render(link: Link, message: dict[str, Any]) -> None:
    """Render a file until its samples are there, its noise is low, or Blender says stop."""
    scene = _scene(message)
    total, noise = int(message["samples"]), message.get("noise") or None
    denoise = denoiser() if message.get("denoise") else None
    sent = time.monotonic()
    with clpt.Renderer(scene, denoise=denoise, cancel_seconds=0.1) as renderer:
        link.send({"samples": 0, "warnings": [*scene.warnings, *renderer.warnings]})

        def goes_on(_: object) -> bool:
            return link.inbox.empty()

        while renderer.samples < total and renderer.active > 0.0:
            step = min(max(renderer.samples, 1), total - renderer.samples)
            if not renderer.run(step, goes_on, noise=noise):
                break
            if time.monotonic() - sent > SHOWN_EVERY:
                link.send({"samples": renderer.samples}, pixels(renderer.picture()))
                sent = time.monotonic()
        while not link.inbox.empty():
            link.inbox.get()  # the order to stop
        shown = clpt.DenoisedPicture(renderer) if denoise and renderer.samples else renderer
        picture = shown.picture()
        layers = renderer.layers() if message["layers"] else {}
        if "bands" in message:
            layers["bands"] = shown.image()
        dark = np.zeros((*picture.shape[:2], 3), np.float32)  # a group without lights
        link.send(
            {"samples": renderer.samples, "done": True},
            pixels(picture),
            *(_upward(layers.get(name, dark), WIDTHS.get(name, 0)) for name in message["layers"]),
        )


def denoiser() -> str:
    """Return Open Image Denoise where it is installed, else clpt's own denoiser."""
    return "statistical" if importlib.util.find_spec("pyoidn") is None else "oidn"


def _scene(message: dict[str, Any]) -> Scene:
    bake.scene(Path(message["file"]))
    scene = read.load(Path(message["file"]), missing=GREY)
    changes = {name: message[name] for name in ("width", "height", "mode")}
    layers = ("light_groups" if name.startswith("light_") else name for name in message["layers"])
    changes["layers"] = tuple(name for name in dict.fromkeys(layers) if name != "bands")
    if "bands" in message:
        changes["bands"] = message["bands"]
        changes["lambda_min"], changes["lambda_max"] = message["lambdas"]
    if message.get("crop"):
        changes["crop"] = tuple(message["crop"])
    if message.get("noise"):
        changes["filtering"] = "importance"  # which the limit of noise needs
    scene.film = dataclasses.replace(scene.film, **changes)
    return scene


def pixels(picture: Any) -> np.ndarray:
    """Return a picture as Blender has it: (h, w, 4) float32, the bottom row first."""
    return _upward(picture, 4, 1.0)


def _upward(picture: Any, width: int = 0, filled: float = 0.0) -> np.ndarray:
    """Return an array (h, w, width) float32, the bottom row first; more channels are `filled`."""
    image = np.asarray(picture, np.float32)
    image = image.reshape(*image.shape[:2], -1)
    padded = np.full((*image.shape[:2], width or image.shape[2]), filled, np.float32)
    padded[..., : image.shape[2]] = image
    return np.ascontiguousarray(padded[::-1])
