"""NanoVDB files (.nvdb) of version 32: fog volumes of real numbers, without OpenVDB.

A file is a row of segments: a header, the metadata of each grid, the grids, each perhaps packed. A
grid is a tree in a buffer: a root with tiles, upper nodes of 32^3 lower nodes, lower nodes of
16^3 leaves, leaves of 8^3 values. Offsets are in bytes from the node that holds them. All of them
are checked: a file may lie.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats.volumes import sparse
from clpt.scene.volumes import Volume

SEGMENTS = (b"NanoVDB0", b"NanoVDB2")
BARE = b"NanoVDB1"  # a grid without segments
MAJOR = 32
CODECS = ("none", "ZIP", "BLOSC")
METADATA, GRID, TREE, TILE = 176, 672, 64, 32
DEFLATE = 1032  # most bytes that a compressed byte of deflate stands for
UPPER, LOWER = 270_400, 33_856
UPPER_TABLE, LOWER_TABLE = 8_256, 1_088  # where a node's children are told
MINIMUM, FLAGS, CODES = 80, 15, 96  # of a leaf whose numbers are packed
LEVEL_SET = 1
TYPES = (
    "unknown", "float", "double", "int16", "int32", "int64", "vec3f", "vec3d", "mask", "half",
    "uint32", "bool", "rgba8", "fp4", "fp8", "fp16", "fpn", "vec4f", "vec4d",
)  # fmt: skip


class _Layout(NamedTuple):
    """Where the numbers of a type lie. bits: of a packed number; 0: not packed, -1: it differs."""

    form: str
    background: int
    root: int
    tile: int
    leaf: int
    values: int
    bits: int = 0


ROOT = 64
LAYOUTS = {
    "float": _Layout("<f4", 28, ROOT, 20, 2_144, 96),
    "double": _Layout("<f8", 32, 96, 24, 4_224, 128),
    "half": _Layout("<f2", 28, ROOT, 20, 1_120, 96),
    "fp4": _Layout("<f4", 28, ROOT, 20, 352, CODES, 4),
    "fp8": _Layout("<f4", 28, ROOT, 20, 608, CODES, 8),
    "fp16": _Layout("<f4", 28, ROOT, 20, 1_120, CODES, 16),
    "fpn": _Layout("<f4", 28, ROOT, 20, CODES, CODES, -1),
}


@dataclass(frozen=True)
class _Entry:
    """A grid of a file: its name, its codec, and where its bytes are."""

    name: str
    codec: int
    begin: int
    end: int
    size: int  # unpacked


def read(path: Path, grid: str = "") -> Volume:
    """Return the values (nx, ny, nz) float32 of a grid with a layer around them, and its box.

    grid: its name, "" is "density", else the first. Raises SceneError, OSError.
    """
    data = input_files.read_bytes(path)
    try:
        entries = list(_entries(data))
        chosen = sparse.chosen([entry.name for entry in entries], grid)
        return _volume(_unpacked(data, entries[chosen]))
    except SceneError:  # which is a ValueError too
        raise
    except (struct.error, IndexError, ValueError):  # whatever leads beyond the bytes
        raise SceneError("is damaged: it ends too soon, or points beyond its end") from None


def names(path: Path) -> tuple[str, ...]:
    """Return the names of the grids of a file. Raises SceneError, OSError."""
    try:
        return tuple(entry.name for entry in _entries(input_files.read_bytes(path)))
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
            if not GRID + TREE + ROOT <= size <= DEFLATE * max(packed, 1):
                raise SceneError(f"the grid {name!r} cannot have {size:,} bytes")
            yield _Entry(name, codec, at, at + packed, size)
            at += packed


def _unpacked(data: bytes, entry: _Entry) -> bytes:
    """The bytes of a grid."""
    if entry.codec >= len(CODECS):
        raise SceneError(f"the grid {entry.name!r} is packed in an unknown way ({entry.codec})")
    if CODECS[entry.codec] == "none":
        grid = data[entry.begin : entry.end]
    else:
        budget.check(2 * entry.size, f"the grid {entry.name!r}")
        zipped = CODECS[entry.codec] == "ZIP"
        if not zipped:
            sparse.check_blosc()
        unpack = sparse.inflated if zipped else sparse.blosc_unpacked
        chunks: list[bytes] = []
        at = entry.begin
        while at < entry.end and len(chunks) < 64:
            (packed,) = struct.unpack_from("<Q", data, at)
            if at + 8 + packed > entry.end:
                raise SceneError(f"is damaged: the grid {entry.name!r} goes beyond its end")
            part = data[at + 8 : at + 8 + packed]
            left = entry.size - sum(len(chunk) for chunk in chunks)
            chunks.append(unpack(part, left))
            at += 8 + packed
        grid = b"".join(chunks)
    if len(grid) != entry.size:
        message = f"is damaged: the grid {entry.name!r} has not {entry.size:,} bytes as it says"
        raise SceneError(message)
    return grid


def _volume(grid: bytes) -> Volume:
    """Return the box of a grid's active values, with a layer of its outside values around it."""
    sort, kind = struct.unpack_from("<2I", grid, 632)
    name = TYPES[kind] if kind < len(TYPES) else str(kind)
    if name not in LAYOUTS:
        raise SceneError(f"is a grid of {name}; read are those of {', '.join(LAYOUTS)}: convert it")
    if sort == LEVEL_SET:
        raise SceneError("is a level set, which has distances; convert it to a fog volume")
    layout = LAYOUTS[name]
    root = GRID + _offset(grid, GRID + 24)
    low, high = np.frombuffer(grid, "<i4", 6, root).reshape(2, 3).astype(np.int64)
    (tiles,) = struct.unpack_from("<I", grid, root + 24)
    sparse.check_box(low, high)
    if root + layout.root + TILE * tiles > len(grid):
        raise SceneError("is damaged: its root goes beyond its end")
    (background,) = np.frombuffer(grid, layout.form, 1, root + layout.background)
    nodes_found = _Found(grid, layout, low, high)
    keys = set()
    for i in range(tiles):
        tile = root + layout.root + TILE * i
        key, child, active = struct.unpack_from("<Qqi", grid, tile)
        (value,) = np.frombuffer(grid, layout.form, 1, tile + layout.tile)
        if key in keys:
            raise SceneError("is damaged: two of its tiles have one place")
        keys.add(key)
        at = np.array([_signed(key >> 42), _signed(key >> 21), _signed(key)])
        if child:
            nodes_found.add_upper(np.array([root + child]), at[None])
        elif active:
            nodes_found.tiles.append(sparse.Tile(at, 4096, float(value)))
    origins, nodes = nodes_found.leaves()
    leaves = _values(np.frombuffer(grid, np.uint8), layout, nodes)
    outside = float(background)
    return sparse.volume(low, high, outside, nodes_found.tiles, origins, leaves, _to_world(grid))


class _Found:
    """The leaves and tiles of a tree that lie in a box."""

    def __init__(self, grid: bytes, layout: _Layout, low: NDArray[Any], high: NDArray[Any]):
        self._grid, self._layout, self._low, self._high = grid, layout, low, high
        self.tiles: list[sparse.Tile] = []
        self._origins: list[NDArray[np.int64]] = [np.zeros((0, 3), np.int64)]
        self._nodes: list[NDArray[np.int64]] = [np.zeros(0, np.int64)]

    def add_upper(self, nodes: NDArray[np.int64], origins: NDArray[np.int64]) -> None:
        """Add what is in upper nodes, at bytes (n,), with their lowest indices (n, 3)."""
        for node, origin in zip(nodes, origins, strict=True):
            _within(self._grid, int(node), UPPER)
            self._add_lower(*self._children(int(node), origin, 32, 128, UPPER_TABLE))

    def leaves(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the lowest indices (n, 3) of leaves, and where they begin (n,)."""
        return np.concatenate(self._origins), np.concatenate(self._nodes)

    def _add_lower(self, nodes: NDArray[np.int64], origins: NDArray[np.int64]) -> None:
        for node, origin in zip(nodes, origins, strict=True):
            _within(self._grid, int(node), LOWER)
            children, at = self._children(int(node), origin, 16, 8, LOWER_TABLE)
            self._nodes.append(children)
            self._origins.append(at)

    def _children(
        self, node: int, origin: NDArray[np.int64], count: int, side: int, table: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return where a node's children begin (n,), and their lowest indices (n, 3).

        count: of children along a side; side: of a child. What else is active becomes tiles.
        """
        masks = np.frombuffer(self._grid, np.uint8, count**3 // 4, node + 32).reshape(2, -1)
        active, child = np.unpackbits(masks, axis=1, bitorder="little").view(bool)
        used = np.flatnonzero(active | child)
        at = origin + side * np.stack(np.unravel_index(used, (count,) * 3), axis=1)
        within = ((at <= self._high) & (at + side > self._low)).all(axis=1)
        used, at = used[within], at[within]
        offsets = np.frombuffer(self._grid, "<i8", count**3, node + table)
        of_table = np.frombuffer(self._grid, self._layout.form, 8 // self._number * count**3,
                                 node + table)  # fmt: skip
        for j, low in zip(used, at, strict=True):
            if not child[j]:
                budget.take_parts(1, "its tiles")
                value = float(of_table[8 // self._number * j])
                self.tiles.append(sparse.Tile(low, side, value))
        inner = child[used]
        return node + offsets[used[inner]], at[inner]

    @property
    def _number(self) -> int:
        return np.dtype(self._layout.form).itemsize


def _values(grid: NDArray[np.uint8], layout: _Layout, nodes: NDArray[np.int64]) -> NDArray[Any]:
    """The values (n, 512) float32 of leaves that begin at the bytes `nodes`."""
    if not layout.bits:
        values = _gather(grid, nodes, layout.values, layout.leaf - layout.values)
        return values.view(layout.form).astype(np.float32, copy=False)
    first, scale = _gather(grid, nodes, MINIMUM, 8).view("<f4").T
    if layout.bits > 0:
        widths = np.full(len(nodes), layout.bits)
    else:
        widths = 1 << (_gather(grid, nodes, FLAGS, 1)[:, 0] >> 5).astype(int)
    values = np.empty((len(nodes), 512), np.float32)
    for bits in np.unique(widths):
        if bits > 16:
            raise SceneError(f"is damaged: a leaf has numbers of {bits} bits")
        same_width = widths == bits
        codes: NDArray[Any] = _gather(grid, nodes[same_width], CODES, 64 * int(bits))
        if bits == 16:
            codes = codes.view("<u2")
        else:
            shifts = np.arange(0, 8, bits).astype(np.uint8)
            codes = (codes[:, :, None] >> shifts) & np.uint8((1 << int(bits)) - 1)
        codes = codes.reshape(-1, 512).astype(np.float32)
        values[same_width] = codes * scale[same_width, None] + first[same_width, None]
    return values


def _gather(
    grid: NDArray[np.uint8], nodes: NDArray[np.int64], begin: int, size: int
) -> NDArray[np.uint8]:
    """The `size` bytes that begin so many bytes behind each of `nodes`: (n, size)."""
    at = nodes + begin
    if len(at) and not (nodes.min() >= GRID and at.max() <= len(grid) - size):
        raise SceneError("is damaged: a node is beyond its end")
    if not len(at):
        return np.zeros((0, size), np.uint8)
    return np.lib.stride_tricks.sliding_window_view(grid, size)[at]


def _to_world(grid: bytes) -> NDArray[np.float64]:
    """The matrix (4, 4) from an index to the world."""
    numbers = np.frombuffer(grid, "<f8", 22, 296 + 88)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = numbers[:9].reshape(3, 3), numbers[18:21]
    return matrix


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
