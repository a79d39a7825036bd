"""How much memory the reading of an image may take; asked before any of it is taken.

A file of a few kilobytes can announce gigabytes of pixels, so what its header says is enough to
refuse it.
"""

from __future__ import annotations

from pathlib import Path

from clpt.errors import SceneError

PIXELS = 1 << 29  # of one image
BYTES = 4 << 30  # that reading one image takes at its peak


def check_size(file: Path | None, width: int, height: int) -> None:
    """Raise SceneError for an image of more pixels than are read."""
    if width * height > PIXELS:
        message = f"has {width}x{height} pixels, more than the {PIXELS} that are read"
        raise SceneError(message, file=file)


def take(size: int, what: str, file: Path | None = None) -> None:
    """Ask for memory [bytes]; what: a noun phrase, the subject of the message.

    Raises SceneError where it is more than an image gets.
    """
    if size > BYTES:
        raise SceneError(
            f"{what} would take {size / 2**30:.1f} GiB of memory to read, more than the "
            f"{BYTES / 2**30:g} GiB that an image gets: save it smaller",
            file=file,
        )
