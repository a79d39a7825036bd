"""A limit on the size of an image, checked before memory is taken for its pixels.

A file of a few kilobytes can announce gigabytes of pixels, so what its header says is enough to
refuse it. What reading takes is asked of `clpt.files.budget`.
"""

from __future__ import annotations

from pathlib import Path

from clpt.errors import SceneError

PIXELS = 1 << 29  # of one image


def check_size(file: Path | None, width: int, height: int) -> None:
    """Raise SceneError for an image of more pixels than are read."""
    if width * height > PIXELS:
        message = f"has {width}x{height} pixels, more than the {PIXELS} that are read"
        raise SceneError(message, file=file)
