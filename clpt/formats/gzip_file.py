"""Files that may be packed by gzip, read whole; what is packed draws from the load's budget."""

from __future__ import annotations

import gzip
import os
import zlib
from pathlib import Path

from clpt.errors import SceneError
from clpt.files import budget, input_files

CHUNK = 1 << 22
WHAT = "unpacking it"


def read_bytes(path: Path) -> bytes:
    """Read a file, unpacked if it is gzip's.

    Raises SceneError for what is broken, or takes too much memory.
    """
    with input_files.opened(path) as file:
        if file.read(2) != b"\x1f\x8b":
            return input_files.content(file, path)
        try:
            file.seek(-4, os.SEEK_END)
            budget.check(2 * int.from_bytes(file.read(4), "little"), WHAT, path)  # as it says
            file.seek(0)
            with gzip.open(file) as stream:
                parts, size = [], 0
                while part := stream.read(CHUNK):
                    parts.append(part)
                    size += len(part)
                    budget.check(2 * size, WHAT, path)
            return b"".join(parts)
        except SceneError:
            raise
        except (OSError, EOFError, ValueError, zlib.error) as error:
            reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
            raise SceneError(f"cannot be read: {reason}", file=path) from None
