"""Files that may be packed by gzip, read whole; what is packed has a limit."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

from clpt.errors import SceneError

LARGEST = 1 << 30  # bytes of a file, unpacked
CHUNK = 1 << 22


def read_bytes(path: Path, largest: int = LARGEST) -> bytes:
    """Read a file, unpacked if it is gzip's: a small file may become at most `largest` bytes then.

    Raises SceneError.
    """
    try:
        with path.open("rb") as file:
            if file.read(2) != b"\x1f\x8b":
                file.seek(0)
                return file.read()
        with gzip.open(path, "rb") as stream:
            parts, size = [], 0
            while part := stream.read(CHUNK):
                parts.append(part)
                size += len(part)
                if size > largest:
                    message = f"is larger than {largest >> 20} MiB when unpacked; unpack it first"
                    raise SceneError(message, file=path)
        return b"".join(parts)
    except SceneError:
        raise
    except (OSError, EOFError, ValueError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise SceneError(f"cannot be read: {reason}", file=path) from None
