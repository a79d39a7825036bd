"""OpenVDB's files (.vdb): grids of float or double in trees of 5-4-3, without OpenVDB.

A file is a head, a row of descriptors of grids, and the grids. A grid is its metadata, its
transform, the topology of its tree from the root down, and the values of its leaves in the same
order. Numbers are little-endian. Nothing that a file claims is believed: it may lie.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.formats.volumes import sparse
from clpt.scene.volumes import Volume

MAGIC = b" BDV\0\0\0\0"
OLDEST = 222  # the version since which nodes leave out what is inactive
ZIP, ACTIVE_MASK, BLOSC = 1, 2, 4  # of the word that says how a grid is packed
HALF = "_HalfFloat"
TYPES = {"Tree_float_5_4_3": "f", "Tree_double_5_4_3": "d"}  # of numbers
UPPER, LOWER, LEAF = 32, 16, 8  # children, or values, along a side
MASK = LEAF**3 // 8  # bytes
PER_LEAF = 6 * LEAF**3  # bytes of a leaf's values and of its mask
# A node's flag for its inactive values, before its active values.
ONE_INACTIVE, TWO_INACTIVE, MASKED, ALL_VALUES = (2, 4, 5), 5, (3, 4, 5), 6


@dataclass(frozen=True)
class _Entry:
    """A grid of a file: its name, its type, and where its head and its leaves' values begin."""

    name: str
    kind: str
    parent: str  # the grid whose tree it shares
    head: int
    blocks: int


class _Bytes:
    """Reads a file's bytes in order."""

    def __init__(self, data: bytes, at: int = 0):
        self.data, self.at = data, at

    def take(self, form: str) -> tuple[Any, ...]:
        values = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return values

    def part(self, size: int) -> memoryview:
        if not 0 <= size <= len(self.data) - self.at:
            raise SceneError("is damaged: it ends too soon")
        self.at += size
        return memoryview(self.data)[self.at - size : self.at]

    def text(self) -> str:
        return bytes(self.part(*self.take("I"))).decode("latin1")

    def array(self, form: str, count: int) -> NDArray[Any]:
        return np.frombuffer(self.part(count * np.dtype(form).itemsize), form)

    def metadata(self) -> dict[str, bytes]:
        (count,) = self.take("I")
        entries = {}
        for _ in range(count):
            name, _ = self.text(), self.text()
            entries[name] = bytes(self.part(*self.take("I")))
        return entries


def read(path: Path, grid: str = "") -> Volume:
    """Return the values (nx, ny, nz) float32 of a grid with a layer around them, and its box.

    grid: its name, "" is "density", else the first. Raises SceneError, OSError.
    """
    data = input_files.read_bytes(path)
    try:
        entries = list(_entries(data))
        chosen = sparse.chosen([entry.name for entry in entries], grid)
        return _volume(data, entries, entries[chosen])
    except SceneError:  # which is a ValueError too
        raise
    except (struct.error, IndexError, ValueError, OverflowError):
        raise SceneError("is damaged: it ends too soon, or points beyond its end") from None


def _entries(data: bytes) -> Iterator[_Entry]:
    if data[: len(MAGIC)] != MAGIC:
        raise SceneError("is no .vdb file: it does not begin with OpenVDB's number")
    stream = _Bytes(data, len(MAGIC))
    version, _, _, has_offsets = stream.take("IIIB")
    if version < OLDEST:
        raise SceneError(f"is of OpenVDB's version {version}; read are {OLDEST} and later")
    if not has_offsets:
        raise SceneError("was written as a stream: write it as a file")
    stream.part(36)  # a name of its own
    stream.metadata()
    (count,) = stream.take("I")
    for _ in range(count):
        name, kind, parent = stream.text(), stream.text(), stream.text()
        head, blocks, end = stream.take("3q")
        if not (stream.at <= head <= end <= len(data) and 0 <= blocks <= end):
            raise SceneError(f"is damaged: the grid {name!r} goes beyond its end")
        yield _Entry(name.split("\x1e")[0], kind, parent.split("\x1e")[0], head, blocks)
        stream.at = end


def _volume(data: bytes, entries: list[_Entry], entry: _Entry) -> Volume:
    """Return the box of a grid's active values, with a layer of its outside values around it."""
    kind = entry.kind.removesuffix(HALF)
    if kind not in TYPES:
        known = ", ".join(TYPES)
        raise SceneError(f"the grid {entry.name!r} is a {kind}; read are {known}: convert it")
    stream = _Bytes(data, entry.head)
    (packed,) = stream.take("I")
    if stream.metadata().get("class") == b"level set":
        raise SceneError(
            f"the grid {entry.name!r} is a level set, which has distances; convert it to a fog "
            "volume (`vdb_tool -sdf2fog`, or `sdfToFogVolume`)"
        )
    to_world = _transform(stream)
    if entry.parent:
        shared = [
            candidate
            for candidate in entries
            if candidate.name == entry.parent and not candidate.parent
        ]
        if not shared:
            raise SceneError(f"is damaged: it has no grid {entry.parent!r}, whose tree is shared")
        entry = shared[0]
        stream = _Bytes(data, entry.head)
        (packed,) = stream.take("I")
        stream.metadata()
        _transform(stream)
    tree = _Tree(stream, packed, TYPES[kind], entry.kind.endswith(HALF))
    stream.at = entry.blocks
    low, high = tree.box()
    sparse.check_box(low, high)
    leaves = tree.leaf_values()
    return sparse.volume(low, high, tree.background, tree.tiles, tree.origins, leaves, to_world)


def _transform(stream: _Bytes) -> NDArray[np.float64]:
    """The matrix (4, 4) from an index to the world."""
    kind = stream.text()
    matrix = np.eye(4)
    if kind in ("UniformScaleMap", "ScaleMap"):
        matrix[:3, :3] = np.diag(stream.array("<f8", 15)[:3])
    elif kind in ("UniformScaleTranslateMap", "ScaleTranslateMap"):
        numbers = stream.array("<f8", 18)
        matrix[:3, :3], matrix[:3, 3] = np.diag(numbers[3:6]), numbers[:3]
    elif kind == "TranslationMap":
        matrix[:3, 3] = stream.array("<f8", 3)
    elif kind in ("AffineMap", "UnitaryMap"):
        matrix = stream.array("<f8", 16).reshape(4, 4).T  # of rows there
        if not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
            raise SceneError("is damaged: its transform is not affine")
    else:
        raise SceneError(f"lies in space by a {kind}; read are those of matrices")
    return matrix


class _Tree:
    """The tree of a grid: its background, its tiles, and where its leaves are.

    Reads the topology; `leaf_values` then reads the values, from where the stream stands.
    """

    def __init__(self, stream: _Bytes, packed: int, form: str, half: bool):
        self._stream, self._packed, self._form = stream, packed, form
        self._held = np.dtype("<f2" if half else f"<{form}")
        if packed & BLOSC:
            sparse.check_blosc()
        self._unpack = sparse.blosc_unpacked if packed & BLOSC else sparse.inflated
        self.tiles: list[sparse.Tile] = []
        self._active: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []  # boxes of tiles
        origins: list[NDArray[np.int64]] = []
        masks: list[NDArray[np.uint8]] = []
        self.leaves = 0
        (buffers,) = stream.take("I")
        if buffers != 1:
            raise SceneError("is damaged: its tree has several buffers")
        (self.background,) = self._number()
        tiles, children = stream.take("II")
        places: set[tuple[int, ...]] = set()
        for _ in range(tiles):
            low = self._place(places)
            (value,) = self._number()
            self._tile(low, UPPER * LOWER * LEAF, value, bool(*stream.take("B")))
        for _ in range(children):
            upper = self._place(places)
            for lower in upper + LOWER * LEAF * self._children(upper, UPPER, LOWER * LEAF):
                leaf_origins = lower + LEAF * self._children(lower, LOWER, LEAF)
                self.leaves += len(leaf_origins)
                budget.check(PER_LEAF * self.leaves, f"its {self.leaves:,} leaves")
                origins.append(leaf_origins)
                masks.append(stream.array("u1", MASK * len(leaf_origins)))
        none = [np.zeros((0, 3), np.int64)]
        self.origins = np.concatenate(origins or none)
        self.masks = np.concatenate([*masks, np.zeros(0, np.uint8)]).reshape(-1, MASK)

    def _place(self, places: set[tuple[int, ...]]) -> NDArray[np.int64]:
        """Read the lowest index (3,) of a tile or node of the root; they do not overlap."""
        low = self._stream.take("3i")
        if low in places or any(n % (UPPER * LOWER * LEAF) for n in low):
            raise SceneError("is damaged: two of its nodes have one place")
        places.add(low)
        return np.array(low, np.int64)

    def box(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the lowest and the highest index (3,) of active values."""
        lows, highs = [part[0] for part in self._active], [part[1] for part in self._active]
        step = 1 << 14
        for first in range(0, self.leaves, step):
            part = slice(first, first + step)
            bits: Any = _bits(self.masks[part]).reshape(-1, LEAF, LEAF, LEAF)
            used = bits.any(axis=(1, 2, 3))
            ends = []
            for axis in range(3):
                others = tuple(i + 1 for i in range(3) if i != axis)
                along = bits[used].any(axis=others)
                ends.append((along.argmax(axis=1), LEAF - 1 - along[:, ::-1].argmax(axis=1)))
            low, high = np.array(ends).transpose(1, 2, 0).reshape(2, -1, 3)
            if used.any():
                lows.append((self.origins[part][used] + low).min(axis=0))
                highs.append((self.origins[part][used] + high).max(axis=0))
        if not lows:
            raise SceneError("has no active values")
        return np.min(lows, axis=0), np.max(highs, axis=0)

    def leaf_values(self) -> NDArray[np.float32]:
        """Return the values (n, 512) of the leaves."""
        stream, counts = self._stream, _bits(self.masks).sum(axis=1).tolist()
        values = np.full((self.leaves, LEAF**3), self.background, np.float32)
        stored = _bits(self.masks)
        parts = []
        for i in range(self.leaves):
            stream.at += MASK  # once more
            tells, inactive, other_inactive, mask = self._inactive(MASK)
            if not self._packed & ACTIVE_MASK or tells == ALL_VALUES:
                stored[i] = True
                parts.append(self._numbers(LEAF**3))
                continue
            if tells != 0:
                values[i] = (
                    inactive if mask is None else np.where(_bits(mask), other_inactive, inactive)
                )
            parts.append(self._numbers(counts[i]))
        if parts:
            values[stored] = np.frombuffer(b"".join(parts), self._held)
        return values

    def _number(self) -> tuple[Any, ...]:
        return self._stream.take(self._form)

    def _tile(self, low: NDArray[np.int64], side: int, value: float, active: bool) -> None:
        if active:
            self._active.append((low, low + side - 1))
        if active or value != self.background:
            budget.take_parts(1, "its tiles")
            self.tiles.append(sparse.Tile(low, side, value))

    def _children(self, low: NDArray[np.int64], count: int, side: int) -> NDArray[np.int64]:
        """Read a node with `count` children along a side; return the places of its children.

        low: its lowest index; side: of a child. Its other values become tiles.
        """
        size = count**3 // 8
        children, active = self._stream.array("u1", size), self._stream.array("u1", size)
        tells, inactive, other, mask = self._inactive(size)
        on = _bits(active)
        values = np.full(count**3, inactive, np.float64)
        if mask is not None:
            values[_bits(mask)] = other
        if not self._packed & ACTIVE_MASK or tells == ALL_VALUES:
            on[:] = True
        values[on] = np.frombuffer(self._numbers(int(on.sum())), self._held)
        on = _bits(active)
        is_child = _bits(children)
        for i in np.flatnonzero(~is_child & (on | (values != self.background))):
            place = np.array(np.unravel_index(i, (count,) * 3))
            self._tile(low + side * place, side, float(values[i]), bool(on[i]))
        return np.stack(np.unravel_index(np.flatnonzero(is_child), (count,) * 3), axis=1)

    def _inactive(self, mask_bytes: int) -> tuple[int, float, float, NDArray[np.uint8] | None]:
        """Read a node's inactive values: their encoding, two values, and the mask of the second."""
        (tells,) = self._stream.take("B")
        if tells > ALL_VALUES:
            raise SceneError("is damaged: a node's values are told in an unknown way")
        first, second = -self.background if tells else self.background, self.background
        if tells in ONE_INACTIVE:
            (first,) = self._number()
        if tells == TWO_INACTIVE:
            (second,) = self._number()
        mask = self._stream.array("u1", mask_bytes) if tells in MASKED else None
        return tells, first, second, mask

    def _numbers(self, count: int) -> bytes | memoryview:
        """The bytes of so many numbers."""
        size = count * self._held.itemsize
        if not self._packed & (ZIP | BLOSC):
            return self._stream.part(size)
        if not count and self._held.itemsize == 2:
            return b""
        (length,) = self._stream.take("q")
        if length <= 0:
            packed: bytes | memoryview = self._stream.part(-length)
        else:
            packed = self._unpack(self._stream.part(length), size)
        if len(packed) != size:
            raise SceneError("is damaged: a node has not as many values as it says")
        return packed


def _bits(mask: NDArray[np.uint8]) -> NDArray[np.bool_]:
    bits: NDArray[np.bool_] = np.unpackbits(mask, axis=-1, bitorder="little").view(np.bool_)
    return bits
