"""Tensor files: named arrays in a binary file, as Dupuy and Jakob publish their measurements.

"tensor_file\\0", two bytes of version (1, 0), the number of fields (u32); of each field its name
(u16 length, then the letters), the number of axes (u16), the type (u8), where its values begin
(u64) and its shape (u64 an axis). Numbers are little-endian. The reader checks all of them.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from clpt.errors import SceneError
from clpt.files import input_files, output_files

MAGIC, VERSION = b"tensor_file\0", (1, 0)
TYPES = (
    "u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8",
)  # fmt: skip
MOST_FIELDS, MOST_AXES = 256, 16
ALIGNED = 8  # [bytes] values begin at multiples


def read(path: str | Path) -> dict[str, np.ndarray]:
    """Return the arrays of a file by their names. Raises SceneError."""
    path = Path(path)
    try:
        return _fields(input_files.read_bytes(path))
    except SceneError as error:
        raise SceneError(error.message, file=path) from None
    except struct.error:
        raise SceneError("is damaged: it ends within its list of fields", file=path) from None


def write(path: str | Path, fields: Mapping[str, np.ndarray]) -> None:
    """Write arrays by their names. Raises OSError."""
    head, at = [MAGIC, struct.pack("<BBI", *VERSION, len(fields))], len(MAGIC) + 6
    arrays = {name.encode(): np.ascontiguousarray(values) for name, values in fields.items()}
    at += sum(13 + len(name) + 8 * values.ndim for name, values in arrays.items())
    body = []
    for name, values in arrays.items():
        at += (pad := -at % ALIGNED)
        shape = struct.pack(f"<{values.ndim}Q", *values.shape)
        kind = TYPES.index(values.dtype.newbyteorder("<").str.replace("|", "")) + 1
        head.append(struct.pack("<H", len(name)) + name)
        head.append(struct.pack("<HBQ", values.ndim, kind, at) + shape)
        body += [bytes(pad), values.astype(TYPES[kind - 1], copy=False).tobytes()]
        at += values.nbytes
    output_files.write(path, b"".join(head + body))


def _fields(data: bytes) -> dict[str, np.ndarray]:
    if not data.startswith(MAGIC):
        raise SceneError("is no tensor file: it does not begin with tensor_file")
    at = len(MAGIC)
    *version, count = struct.unpack_from("<BBI", data, at)
    if tuple(version) != VERSION:
        shown = ".".join(map(str, version))
        raise SceneError(f"is a tensor file of version {shown}; 1.0 is read")
    if count > MOST_FIELDS:
        raise SceneError(f"is damaged: it cannot have {count:,} fields")
    at += 6
    fields: dict[str, np.ndarray] = {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", data, at)
        name = data[at + 2 : at + 2 + length].decode("utf8", "replace")
        at += 2 + length
        axes, kind, offset = struct.unpack_from("<HBQ", data, at)
        if axes > MOST_AXES:
            raise SceneError(f"is damaged: the field {name!r} cannot have {axes} axes")
        shape = struct.unpack_from(f"<{axes}Q", data, at + 11)
        at += 11 + 8 * axes
        if not 1 <= kind <= len(TYPES):
            raise SceneError(f"is damaged: the field {name!r} is of an unknown type ({kind})")
        dtype, size = np.dtype(TYPES[kind - 1]), math.prod(shape)
        # also an empty field must have a shape that NumPy can hold
        if max(offset + size * dtype.itemsize, *shape, 0) > len(data):
            raise SceneError(f"is damaged: the field {name!r} goes beyond its end")
        fields[name] = np.frombuffer(data, dtype, size, offset).reshape(shape)
    return fields
