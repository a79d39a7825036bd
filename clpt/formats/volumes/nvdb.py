"""NanoVDB files (.nvdb) of version 32: fog volumes of float32, without OpenVDB.

A file is a row of segments: a header, the metadata of each grid, the grids, each perhaps packed. A
grid is a tree in one buffer: a root with tiles, upper nodes of 32^3 lower ones, lower nodes of 16^3
leaves, leaves of 8^3 values. Offsets are in bytes from the node that holds them. All of them are
checked: a file may lie.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.scene.volumes import Volume

SEGMENTS = (b"NanoVDB0", b"NanoVDB2")
BARE = b"NanoVDB1"  # a grid without segments
MAJOR = 32
CODECS = ("none", "ZIP", "BLOSC")
METADATA, GRID, TREE, ROOT, TILE = 176, 672, 64, 64, 32
UPPER, LOWER, LEAF = 270_400, 33_856, 2_144
MOST_BYTES = 1 << 31  # of a grid, unpacked
MOST_VALUES = 1 << 28  # of the box of a grid
TYPES = (
    "unknown", "float", "double", "int16", "int32", "int64", "vec3f", "vec3d", "mask", "half",
    "uint32", "bool", "rgba8", "fp4", "fp8", "fp16", "fpn", "vec4f", "vec4d",
)  # fmt: skip


@dataclass(frozen=True)
class _Entry:
    """A grid of a file: its name, its codec, and where its bytes are."""

    name: str
    codec: int
    begin: int
    end: int
    size: int  # unpacked


def read(path: Path, grid: str = "") -> Volume:
    """Return the values (nx, ny, nz) float32 of a grid, and its box; one layer is put around.

    grid: its name, "" is "density", else the first. Raises SceneError, OSError.
    """
    data = path.read_bytes()
    try:
        entries = list(_entries(data))
        names = [entry.name for entry in entries]
        wanted = grid or ("density" if "density" in names else names[0])
        if wanted not in names:
            raise SceneError(f"has no grid {wanted!r}; it has {', '.join(map(repr, names))}")
        return _volume(_unpacked(data, entries[names.index(wanted)]))
    except SceneError:  # which is a ValueError too
        raise
    except (struct.error, IndexError, ValueError):  # whatever leads beyond the bytes
        raise SceneError("is damaged: it ends too soon, or points beyond its end") from None


def names(path: Path) -> tuple[str, ...]:
    """Return the names of the grids of a file. Raises SceneError, OSError."""
    try:
        return tuple(entry.name for entry in _entries(path.read_bytes()))
    except SceneError:
        raise
    except (struct.error, IndexError, ValueError):
        raise SceneError("is damaged: it ends too soon") from None


def _entries(data: bytes) -> Iterator[_Entry]:
    if data[:8] == BARE:
        yield _Entry(data[40:296].split(b"\0")[0].decode("latin1"), 0, 0, len(data), len(data))
        return
    if data[:8] not in SEGMENTS:
        raise SceneError("is no .nvdb file: it does not begin with NanoVDB")
    at = 0
    while at < len(data):
        magic, version, count, codec = struct.unpack_from("<8sIHH", data, at)
        if magic not in SEGMENTS or count == 0:
            raise SceneError(f"is damaged: no segment begins at byte {at:,}")
        if version >> 21 != MAJOR:
            raise SceneError(f"is of NanoVDB {version >> 21}, not {MAJOR}; convert it again")
        at += 16
        heads = []
        for _ in range(count):
            size, packed = struct.unpack_from("<QQ", data, at)
            (length,) = struct.unpack_from("<I", data, at + 136)
            (codec,) = struct.unpack_from("<H", data, at + 168)
            at += METADATA
            heads.append(
                (data[at : at + length].split(b"\0")[0].decode("latin1"), size, packed, codec)
            )
            at += length
        for name, size, packed, codec in heads:
            if at + packed > len(data):
                raise SceneError(f"is damaged: the grid {name!r} goes beyond its end")
            if not GRID + TREE + ROOT <= size <= MOST_BYTES:
                raise SceneError(f"the grid {name!r} cannot have {size:,} bytes")
            yield _Entry(name, codec, at, at + packed, size)
            at += packed


def _unpacked(data: bytes, entry: _Entry) -> bytes:
    """The bytes of a grid."""
    if entry.codec >= len(CODECS):
        raise SceneError(f"the grid {entry.name!r} is packed in an unknown way ({entry.codec})")
    if CODECS[entry.codec] == "none":
        made = data[entry.begin : entry.end]
    else:
        chunks: list[bytes] = []
        at = entry.begin
        while at < entry.end and len(chunks) < 64:
            (packed,) = struct.unpack_from("<Q", data, at)
            if at + 8 + packed > entry.end:
                raise SceneError(f"is damaged: the grid {entry.name!r} goes beyond its end")
            part = data[at + 8 : at + 8 + packed]
            left = entry.size - sum(len(chunk) for chunk in chunks)
            zipped = CODECS[entry.codec] == "ZIP"
            chunks.append(_inflated(part, left) if zipped else _of_blosc(part, left))
            at += 8 + packed
        made = b"".join(chunks)
    if len(made) != entry.size:
        message = f"is damaged: the grid {entry.name!r} has not {entry.size:,} bytes as it says"
        raise SceneError(message)
    return made


def _inflated(packed: bytes, most: int) -> bytes:
    """What zlib has packed, one byte more than `most` where it is more."""
    try:
        return zlib.decompressobj().decompress(packed, most + 1)
    except zlib.error as error:
        raise SceneError(f"is damaged: {error}") from None


def _of_blosc(packed: bytes, most: int) -> bytes:
    """What Blosc has packed."""
    try:
        import blosc  # type: ignore[import-not-found]
    except ImportError:
        message = (
            "is packed by Blosc: `pip install blosc`, or convert it with the codec ZIP or none"
        )
        raise SceneError(message) from None
    if len(packed) < 16 or struct.unpack_from("<I", packed, 4)[0] > most:
        raise SceneError("is damaged: a packed part is larger than the grid")
    try:
        made: bytes = blosc.decompress(packed)
    except Exception as error:  # the package has a class of its own
        raise SceneError(f"is damaged: {error}") from None
    return made


def _volume(grid: bytes) -> Volume:
    """The box of the active values of a grid, with a layer of what is outside around it."""
    (kind,) = struct.unpack_from("<I", grid, 636)
    if kind != TYPES.index("float"):
        name = TYPES[kind] if kind < len(TYPES) else str(kind)
        raise SceneError(f"is a grid of {name}; read are those of float: convert it")
    root = GRID + _offset(grid, GRID + 24)
    box = np.frombuffer(grid, "<i4", 6, root).reshape(2, 3).astype(np.int64)
    tiles, background = struct.unpack_from("<If", grid, root + 24)
    low, size = box[0], box[1] - box[0] + 1
    if not (size > 0).all():
        raise SceneError("has no active values")
    if np.prod(size.astype(float)) > MOST_VALUES:
        shape = " x ".join(map(str, size))
        raise SceneError(f"its box is {shape}; at most {MOST_VALUES:,} values are read")
    if root + ROOT + TILE * tiles > len(grid):
        raise SceneError("is damaged: its root goes beyond its end")
    values = np.full(size, background, np.float32)
    for i in range(tiles):
        tile = root + ROOT + TILE * i
        key, child, active, value = struct.unpack_from("<QqIf", grid, tile)
        at = np.array([_signed(key >> 42), _signed(key >> 21), _signed(key)]) - low
        if child:
            _upper(grid, _within(grid, root + child, UPPER), at, values)
        elif active:
            _put(values, at, 4096, value)
    around = np.pad(values, 1, constant_values=background)
    return Volume(around, _box(grid, low - 1.5, size + 2))


def _upper(grid: bytes, node: int, at: NDArray[Any], values: np.ndarray) -> None:
    """Write the values of an upper node whose lowest index is `at`, from the box's lowest."""
    for place, child, value in _children(grid, node, 32, 4096, 8256):
        low = at + 128 * place
        if child is None:
            _put(values, low, 128, value)
        else:
            _lower(grid, _within(grid, child, LOWER), low, values)


def _lower(grid: bytes, node: int, at: NDArray[Any], values: np.ndarray) -> None:
    """The same of a lower node."""
    for place, child, value in _children(grid, node, 16, 512, 1088):
        low = at + 8 * place
        if child is None:
            _put(values, low, 8, value)
        else:
            leaf = _within(grid, child, LEAF)
            _put(values, low, 8, np.frombuffer(grid, "<f4", 512, leaf + 96).reshape(8, 8, 8))


def _children(
    grid: bytes, node: int, side: int, mask_bytes: int, table: int
) -> Iterator[tuple[NDArray[Any], int | None, float]]:
    """What is in a node: its place, and where its child is, or None and its value."""
    masks = np.frombuffer(grid, np.uint8, 2 * mask_bytes, node + 32).reshape(2, -1)
    active, child = np.unpackbits(masks, axis=1, bitorder="little").astype(bool)
    offsets = np.frombuffer(grid, "<i8", side**3, node + table)
    numbers = np.frombuffer(grid, "<f4", 2 * side**3, node + table)[::2]
    for j in np.flatnonzero(active | child):
        place = np.array([j // side**2, j // side % side, j % side])
        yield place, node + int(offsets[j]) if child[j] else None, float(numbers[j])


def _put(values: np.ndarray, low: NDArray[Any], side: int, part: Any) -> None:
    """Write a number or (side, side, side) values from `low` on, where that is in the box."""
    first, last = np.maximum(low, 0), np.minimum(low + side, values.shape)
    if (first < last).all():
        there = tuple(map(slice, first, last))
        whole = isinstance(part, np.ndarray)
        values[there] = part[tuple(map(slice, first - low, last - low))] if whole else part


def _box(grid: bytes, low: NDArray[Any], size: NDArray[Any]) -> NDArray[np.float64]:
    """The matrix that takes the unit cube to the box from the index `low` on, of so many cells."""
    numbers = np.frombuffer(grid, "<f8", 22, 296 + 88)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = numbers[:9].reshape(3, 3), numbers[18:21]
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix)) == 0.0:
        raise SceneError("is damaged: its transform has no inverse")
    unit = np.diag([*size.astype(float), 1.0])
    unit[:3, 3] = low
    return matrix @ unit


def _offset(grid: bytes, at: int) -> int:
    """The offset from the tree that stands somewhere."""
    (offset,) = struct.unpack_from("<q", grid, at)
    if not TREE <= offset <= len(grid) - GRID - ROOT:
        raise SceneError("is damaged: its root is beyond its end")
    return int(offset)


def _within(grid: bytes, node: int, size: int) -> int:
    if not GRID <= node <= len(grid) - size:
        raise SceneError("is damaged: a node is beyond its end")
    return node


def _signed(key: int) -> int:
    """A root tile's index along an axis: 21 bits of its key are those above the lowest 12."""
    bits = key & 0x1FFFFF
    return ((bits << 12) + (1 << 31)) % (1 << 32) - (1 << 31)
