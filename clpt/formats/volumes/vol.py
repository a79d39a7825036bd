"""Mitsuba's .vol of version 3: 48 bytes of header, then float32 with x fastest."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from clpt import transforms
from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.scene.volumes import Volume

HEADER = struct.Struct("<3sB5i6f")
FLOAT32 = 1  # the only encoding that Mitsuba 3 reads


def read(path: Path) -> Volume:
    """Return the values (nx, ny, nz) of a single channel, and their box. Raises SceneError."""
    values, box = read_channels(path)
    if values.shape[3] != 1:
        raise SceneError(f"has {values.shape[3]} channels; a density has one")
    return Volume(values[..., 0], box)


def read_channels(path: Path) -> tuple[np.ndarray, transforms.Matrix]:
    """Return values (nx, ny, nz, channels) float32, and what takes the unit cube to their box.

    Raises SceneError, OSError.
    """
    data = input_files.read_bytes(path)
    budget.take(len(data), "its values", path)
    if len(data) < HEADER.size or data[:3] != b"VOL":
        raise SceneError("is no .vol file: it does not begin with VOL")
    _, version, encoding, nx, ny, nz, channels, *box = HEADER.unpack_from(data)
    if version != 3 or encoding != FLOAT32:
        message = f"is a .vol of version {version}, encoding {encoding}; read are 3 and float32 (1)"
        raise SceneError(message)
    if min(nx, ny, nz, channels) < 1 or channels > 6:
        raise SceneError(f"cannot be {nx} x {ny} x {nz} of {channels} channels")
    count = nx * ny * nz * channels
    if len(data) != HEADER.size + 4 * count:
        message = f"must have {HEADER.size + 4 * count:,} bytes by its header, found {len(data):,}"
        raise SceneError(message)
    values = np.frombuffer(data, "<f4", count, HEADER.size).reshape(nz, ny, nx, channels)
    low, high = np.array(box[:3]), np.array(box[3:])
    if not (np.isfinite(box).all() and (low < high).all()):
        raise SceneError("its box is empty")
    matrix = transforms.translate(low) @ transforms.scale(high - low)
    return np.ascontiguousarray(values.transpose(2, 1, 0, 3), np.float32), matrix
