"""Files that may be packed by gzip, read whole and not beyond a limit."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

from clpt.errors import SceneError

LARGEST = 1 << 30  # bytes of a file, unpacked
CHUNK = 1 << 22


def read_bytes(path: Path) -> bytes:
    """Read a file, unpacked if it is gzip's; at most LARGEST bytes. Raises SceneError."""
    try:
        with path.open("rb") as file:
            packed = file.read(2) == b"\x1f\x8b"
        with gzip.open(path, "rb") if packed else path.open("rb") as stream:
            parts, size = [], 0
            while part := stream.read(CHUNK):
                parts.append(part)
                size += len(part)
                if size > LARGEST:
                    message = f"is larger than {LARGEST >> 20} MiB"
                    raise SceneError(message + (" when unpacked" if packed else ""), file=path)
        return b"".join(parts)
    except SceneError:
        raise
    except (OSError, EOFError, ValueError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise SceneError(f"cannot be read: {reason}", file=path) from None
