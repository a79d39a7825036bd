"""Unpacking of parts of .vdb and .nvdb files: by zlib, and by Blosc of the package `blosc`."""

from __future__ import annotations

import importlib.util
import math
import struct
import zlib
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget
from clpt.scene.volumes import Volume

BLOSC_HEADER = 16


def inflated(packed: bytes | memoryview, most: int) -> bytes:
    """Return at most `most` + 1 bytes that zlib has packed."""
    try:
        return zlib.decompressobj().decompress(packed, most + 1)
    except zlib.error as error:
        raise SceneError(f"is damaged: {error}") from None


def check_blosc() -> None:
    """Raise SceneError unless the package `blosc` is installed."""
    if importlib.util.find_spec("blosc") is None:
        message = "is packed by Blosc: pip install 'clpt[volumes]', or convert it with ZIP"
        raise SceneError(message)


def blosc_unpacked(packed: bytes | memoryview, most: int) -> bytes:
    """Return at most `most` bytes that Blosc has packed; the package `blosc` must be there."""
    import blosc

    if len(packed) < BLOSC_HEADER:
        raise SceneError("is damaged: a packed part has no head")
    size, _, held = struct.unpack_from("<3I", packed, 4)
    if size > most or held > len(packed):
        raise SceneError("is damaged: a packed part is larger than the grid")
    try:
        unpacked: bytes = blosc.decompress(bytes(packed))
    except Exception as error:  # the package has a class of its own
        raise SceneError(f"is damaged: {error}") from None
    return unpacked


SIDE = 8  # of a leaf
PER_VALUE = 16  # bytes of memory for each value of the box, while it is read
MOST_AXIS = 1 << 16


class Tile(NamedTuple):
    """A cube of a constant value."""

    low: NDArray[np.int64]
    side: int
    value: float


def chosen(names: list[str], grid: str) -> int:
    """Return the number of the named grid of a file; "" is "density", else the first.

    Raises SceneError if there is no such grid.
    """
    if not names:
        raise SceneError("has no grid")
    wanted = grid or ("density" if "density" in names else names[0])
    if wanted not in names:
        raise SceneError(f"has no grid {wanted!r}; it has {', '.join(map(repr, names))}")
    return names.index(wanted)


def check_box(low: NDArray[np.int64], high: NDArray[np.int64]) -> None:
    """Raise SceneError for a box, from its lowest index to its highest, that cannot be read."""
    size = high - low + 1
    if not (size > 0).all():
        raise SceneError("has no active values")
    shape = " x ".join(map(str, size))
    if (size > MOST_AXIS).any():
        raise SceneError(f"its box is {shape}; at most {MOST_AXIS:,} values along an axis are read")
    budget.check(PER_VALUE * math.prod(map(int, size + 2 * SIDE)), f"its box of {shape}")


def volume(
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    background: float,
    tiles: Iterable[Tile],
    origins: NDArray[np.int64],
    leaves: NDArray[np.float32],
    to_world: NDArray[np.float64],
) -> Volume:
    """Return the values of a box, with a layer of the outside value around it.

    low, high: (3,) the lowest and the highest index of the box; origins: (n, 3) the lowest index of
    each leaf; leaves: (n, 512) their values, z fastest; to_world: 4x4, from an index to the world.
    Raises SceneError for an empty or too large box, and for a matrix without an inverse.
    """
    check_box(low, high)
    budget.take(4 * math.prod(map(int, high - low + 3)), "its values")
    if not np.isfinite(to_world).all() or abs(np.linalg.det(to_world)) == 0.0:
        raise SceneError("is damaged: its transform has no inverse")
    first = (low - 1) // SIDE
    counts = (high + 1) // SIDE - first + 1
    values = np.full(counts * SIDE, background, np.float32)
    for tile in tiles:
        begin = np.maximum(tile.low - first * SIDE, 0)
        end = np.minimum(tile.low - first * SIDE + tile.side, values.shape)
        if (begin < end).all():
            values[tuple(map(slice, begin, end))] = tile.value
    at = origins // SIDE - first
    within = ((at >= 0) & (at < counts)).all(axis=1)
    x, y, z = at[within].T
    blocks = values.reshape([n for count in counts for n in (count, SIDE)])
    blocks[x, :, y, :, z, :] = leaves[within].reshape(-1, SIDE, SIDE, SIDE)
    begin = low - 1 - first * SIDE
    size = high - low + 3
    whole = values[tuple(map(slice, begin, begin + size))]
    return Volume(np.ascontiguousarray(_outside(whole, background)), _box(to_world, low, size))


def _outside(values: NDArray[np.float32], background: float) -> NDArray[np.float32]:
    """Put what is outside into the outermost layer."""
    for axis in range(3):
        np.moveaxis(values, axis, 0)[[0, -1]] = background
    return values


def _box(to_world: NDArray[np.float64], low: NDArray[Any], size: NDArray[Any]) -> Any:
    """The matrix that takes the unit cube to the cells of a box and of the layer around it."""
    unit = np.diag([*size.astype(float), 1.0])
    unit[:3, 3] = low - 1.5
    return to_world @ unit
