# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders scene files for Blender: python worker.py PORT, with the connection's key at stdin."""

from __future__ import annotations

import dataclasses
import json
import sys
import time
from multiprocessing.connection import Client, Connection
from typing import Any

import numpy as np

import clpt

SHOWN_EVERY = 0.5  # [s] of pictures on the way
WIDTHS = {"uv": 3}  # channels of layers that have more in Blender


def main() -> None:
    """Answer messages until Blender closes the connection."""
    key = sys.stdin.buffer.read()
    with Client(("127.0.0.1", int(sys.argv[1])), authkey=key) as connection:
        while True:
            try:
                message = json.loads(connection.recv_bytes())
            except (EOFError, OSError):
                return
            try:
                _render(connection, message)
            except (EOFError, OSError):
                return
            except Exception as error:  # whatever happens, Blender is told
                _send(connection, {"error": f"{type(error).__name__}: {error}"})


def _send(connection: Connection, message: dict[str, Any], *pictures: np.ndarray) -> None:
    connection.send_bytes(json.dumps({**message, "pictures": len(pictures)}).encode())
    for picture in pictures:
        connection.send_bytes(picture.tobytes())


def _render(connection: Connection, message: dict[str, Any]) -> None:
    """Render a file until its samples are there, its noise is low, or Blender says stop."""
    scene = clpt.load(message["file"])
    size = {"width": message["width"], "height": message["height"]}
    scene.film = dataclasses.replace(
        scene.film, mode=message["mode"], layers=tuple(message["layers"]), **size
    )
    total, shown = int(message["samples"]), time.monotonic()
    denoise = "oidn" if message.get("denoise") else None
    with clpt.Renderer(scene, denoise=denoise) as renderer:
        _send(connection, {"samples": 0, "warnings": scene.warnings})
        while renderer.samples < total:
            renderer.run(1 if renderer.samples == 0 else min(4, total - renderer.samples))
            if connection.poll() and json.loads(connection.recv_bytes()).get("stop"):
                break
            if time.monotonic() - shown > SHOWN_EVERY:
                _send(connection, {"samples": renderer.samples}, _pixels(renderer.image()))
                shown = time.monotonic()
        image = renderer.denoised() if denoise else renderer.image()
        layers = renderer.layers() if message["layers"] else {}
        _send(
            connection,
            {"samples": renderer.samples, "done": True},
            _pixels(image),
            *(_upward(layers[name], WIDTHS.get(name, 0)) for name in message["layers"]),
        )


def _pixels(picture: Any) -> np.ndarray:
    """Return a picture as Blender has it: (h, w, 4) float32, the bottom row first."""
    return _upward(picture, 4, 1.0)


def _upward(picture: Any, width: int = 0, filled: float = 0.0) -> np.ndarray:
    """Return an array (h, w, width) float32, the bottom row first; more channels are `filled`."""
    image = np.asarray(picture, np.float32)
    image = image.reshape(*image.shape[:2], -1)
    padded = np.full((*image.shape[:2], width or image.shape[2]), filled, np.float32)
    padded[..., : image.shape[2]] = image
    return np.ascontiguousarray(padded[::-1])


if __name__ == "__main__":
    main()
