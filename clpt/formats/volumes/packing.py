"""Unpacking of parts of .vdb and .nvdb files: by zlib, and by Blosc of the package `blosc`."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable

from clpt.errors import SceneError

BLOSC_HEADER = 16


def inflated(packed: bytes | memoryview, most: int) -> bytes:
    """Return what zlib has packed, one byte more than `most` where it is more."""
    try:
        return zlib.decompressobj().decompress(packed, most + 1)
    except zlib.error as error:
        raise SceneError(f"is damaged: {error}") from None


def blosc_unpacker() -> Callable[[bytes | memoryview, int], bytes]:
    """Return what unpacks Blosc's bytes into at most so many. Raises SceneError without it."""
    try:
        import blosc
    except ImportError:
        message = "is packed by Blosc: pip install 'clpt[volumes]', or convert it with ZIP"
        raise SceneError(message) from None

    def unpacked(packed: bytes | memoryview, most: int) -> bytes:
        if len(packed) < BLOSC_HEADER:
            raise SceneError("is damaged: a packed part has no head")
        size, _, held = struct.unpack_from("<3I", packed, 4)
        if size > most or held > len(packed):
            raise SceneError("is damaged: a packed part is larger than the grid")
        try:
            made: bytes = blosc.decompress(bytes(packed))
        except Exception as error:  # the package has a class of its own
            raise SceneError(f"is damaged: {error}") from None
        return made

    return unpacked
