"""EXT_meshopt_compression and KHR_meshopt_compression: a buffer view that is stored smaller.

After appendices A (modes) and B (filters) of KHR_meshopt_compression, whose version 0 is the older
extension's format. The only package that decodes it is an alpha release without binaries, hence
this decoder: it finds the beginnings of groups of bytes serially and decodes the rest by arrays.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Array, Bytes
from clpt.files import budget
from clpt.formats.gltf.document import Element

TABLE = 16  # bytes at a triangle stream's end


def decode_triangles(stream: Bytes, count: int) -> NDArray[np.uint32]:
    """Decode mode 1 into (count,) indices. Raises ValueError or IndexError for a broken stream."""
    if count % 3 or len(stream) < 1 + count // 3 + TABLE or stream[0] != 0xE1:
        raise ValueError("it is no stream of triangles")
    codes, data = stream[1 : 1 + count // 3].tolist(), stream[1 + count // 3 :].tolist()
    return np.array(_Triangles(data).decoded(codes), np.uint32)


def decode_sequence(stream: Bytes, count: int) -> NDArray[np.uint32]:
    """Decode mode 2 into (count,) indices. Raises ValueError for a broken stream."""
    if len(stream) < 1 + count + 4 or stream[0] != 0xD1:
        raise ValueError("it is no stream of indices")
    body = stream[1:-4]
    ends = np.flatnonzero(body < 128)[:count]
    if len(ends) < count:
        raise ValueError("it is cut short")
    begins = np.concatenate([[0], ends[:-1] + 1])
    if (ends - begins).max() > 4:
        raise ValueError("a number has more than five bytes")
    values = np.zeros(count, np.uint64)
    for i in range(5):
        inside = begins + i <= ends
        part = body[np.minimum(begins + i, ends)].astype(np.uint64) & np.uint64(127)
        values += np.where(inside, part << np.uint64(7 * i), 0).astype(np.uint64)
    words = values.astype(np.uint32)
    delta = words >> np.uint32(2) ^ (0 - (words >> np.uint32(1) & np.uint32(1))).astype(np.uint32)
    indices = np.empty(count, np.uint32)
    for baseline in (0, 1):
        uses_baseline = (words & np.uint32(1)) == baseline
        indices[uses_baseline] = np.cumsum(delta[uses_baseline], dtype=np.uint32)
    return indices


class _Triangles:
    """A decoder of triangles, with the edges and vertices that the next triangle may refer to."""

    def __init__(self, data: list[int]):
        self.data, self.table = data, data[-TABLE:]
        self.end = len(data) - TABLE
        self.at = self.last = self.next = 0
        self.edges: list[tuple[int, int]] = []  # the newest last
        self.vertices: list[int] = []

    def decoded(self, codes: list[int]) -> list[int]:
        """Return the indices of all triangles."""
        corners: list[int] = []
        edges, vertices = self.edges, self.vertices
        for code in codes:
            if code < 0xF0:
                a, b = edges[~(code >> 4)]
                low = code & 15
                if low == 0:
                    c = self.fresh()
                elif low < 0xD:
                    c = vertices[~low]
                else:
                    if low == 0xF:
                        c = self.explicit()
                    else:
                        c = self.last = (self.last + (1 if low == 0xE else -1)) & 0xFFFFFFFF
                    vertices.append(c)
                edges += ((c, b), (a, c))
            else:
                a, b, c = self.three(code)
                edges += ((b, a), (c, b), (a, c))
            corners += (a, b, c)
            if len(edges) > 1024:
                del edges[:-16]
                del vertices[:-16]
        if self.at > self.end:
            raise ValueError("it is cut short")
        return corners

    def three(self, code: int) -> tuple[int, int, int]:
        """Return a triangle that shares no edge with earlier triangles."""
        known = len(self.vertices)  # those that this triangle adds cannot be meant
        if code < 0xFE:
            pair = self.table[code & 15]
            a = self.fresh()
        else:
            pair = self.byte()
            if pair == 0:
                self.next = 0
            a = self.fresh() if code == 0xFE else self.explicit(push=True)
        b = self.corner(pair >> 4, known)
        c = self.corner(pair & 15, known)
        return a, b, c

    def corner(self, number: int, known: int) -> int:
        """Return a vertex: a new vertex, an explicit vertex, or a vertex of the `known` first."""
        if number == 0:
            return self.fresh()
        if number == 15:
            return self.explicit(push=True)
        if number > known:
            raise ValueError("it names a vertex that did not occur")
        return self.vertices[known - number]

    def fresh(self) -> int:
        """Return the next index that did not occur."""
        value = self.next
        self.next = (value + 1) & 0xFFFFFFFF
        self.vertices.append(value)
        return value

    def explicit(self, push: bool = False) -> int:
        """Return an index that is stored as its difference from the last explicit index."""
        value = shift = 0
        for _ in range(5):
            byte = self.byte()
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                break
        else:
            raise ValueError("a number has more than five bytes")
        value &= 0xFFFFFFFF
        self.last = (self.last + (~(value >> 1) if value & 1 else value >> 1)) & 0xFFFFFFFF
        if push:
            self.vertices.append(self.last)
        return self.last

    def byte(self) -> int:
        """Return the next byte of the data."""
        if self.at >= self.end:
            raise ValueError("it is cut short")
        self.at += 1
        return self.data[self.at - 1]


FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR")


def apply_filter(values: Bytes, name: str) -> Bytes:
    """Undo a filter on elements (count, stride). Raises ValueError for a stride it cannot have."""
    stride = values.shape[1]
    strides = {"OCTAHEDRAL": (4, 8), "QUATERNION": (8,), "COLOR": (4, 8)}
    if stride not in strides.get(name, (stride,)):
        raise ValueError(f"{name} is not for {stride} bytes")
    if name == "NONE":
        return values
    if name == "EXPONENTIAL":
        words = values.view("<i4")
        filtered = np.ldexp((words << 8 >> 8).astype(np.float32), words >> 24).astype("<f4")
        return filtered.view(np.uint8)
    filtered = {"OCTAHEDRAL": _octahedral, "QUATERNION": _quaternion, "COLOR": _colour}[name](
        values.view(f"<i{stride // 4}")
    )
    return np.ascontiguousarray(filtered).view(np.uint8)


def _octahedral(values: NDArray[Any]) -> NDArray[Any]:
    largest = np.iinfo(values.dtype).max
    scale = np.maximum(values[:, 2].astype(np.float64), 1.0)
    x, y = values[:, 0] / scale, values[:, 1] / scale
    z = 1.0 - np.abs(x) - np.abs(y)
    t = np.minimum(z, 0.0)
    unit = np.stack([x - np.copysign(t, x), y - np.copysign(t, y), z], axis=1)
    unit *= largest / np.maximum(np.linalg.norm(unit, axis=1, keepdims=True), 1e-30)
    return np.concatenate([_rounded(unit, values.dtype), values[:, 3:]], axis=1)


def _quaternion(values: NDArray[Any]) -> NDArray[Any]:
    unit = np.maximum((values[:, 3:] | 3).astype(np.float64), 1.0)
    components = values[:, :3] / unit / math.sqrt(2.0)
    w = np.sqrt(np.maximum(1.0 - (components**2).sum(axis=1), 0.0))
    # The largest component, which is left out, stands before the others in turn.
    order = ((values[:, 3:] & 3) + np.arange(4)) % 4
    quaternion = np.empty((len(values), 4))
    np.put_along_axis(quaternion, order.astype(np.int64), np.column_stack([w, components]), axis=1)
    return _rounded(quaternion * 32767.0, values.dtype)


def _colour(values: NDArray[Any]) -> NDArray[Any]:
    unsigned = np.dtype(f"<u{values.dtype.itemsize}")
    alpha = values[:, 3].astype(np.int64) & int(np.iinfo(unsigned).max)
    y = values[:, 0].astype(np.int64) & int(np.iinfo(unsigned).max)
    co, cg = values[:, 1].astype(np.int64), values[:, 2].astype(np.int64)
    bits = np.floor(np.log2(np.maximum(alpha, 1))).astype(np.int64)
    scale = (1 << bits + 1) - 1
    a = alpha & scale >> 1
    rgba = np.stack([y + co - cg, y + cg, y - co - cg, a << 1 | a & 1], axis=1)
    return _rounded(rgba * (np.iinfo(unsigned).max / scale[:, None]), unsigned)


def _rounded(values: NDArray[np.float64], dtype: np.dtype[Any]) -> NDArray[Any]:
    """To the nearest whole number, halves away from zero."""
    limits = np.iinfo(dtype)
    whole = np.copysign(np.floor(np.abs(values) + 0.5), values)
    return np.clip(whole, limits.min, limits.max).astype(dtype)


EXTENSIONS = ("KHR_meshopt_compression", "EXT_meshopt_compression")
PER_BYTE = 8  # bytes of memory for each that is unpacked, while it is
GROUP = 16  # elements
TAIL = {0: 32, 1: 24}  # bytes at least, by version
# By control mode (version 1), or for version 0: the bits of a delta by the group's header bits.
BITS_V0, BITS_V1 = (0, 2, 4, 8), ((0, 1, 2, 4), (1, 2, 4, 8))
ZERO, LITERAL = 2, 3  # control modes without header bits


def extension(view: Element) -> Element | None:
    """Return the element that says how a buffer view is compressed, or None."""
    return next((e for e in map(view.extension, EXTENSIONS) if e is not None), None)


def decode(element: Element, data: memoryview, length: int) -> bytes:
    """Return the `length` bytes of a compressed buffer view.

    Raises SceneError for a stream that is cut short or that the extension does not allow.
    """
    count, stride = element.integer("count", low=1), element.integer("byteStride", low=1, high=256)
    if count * stride != length:
        raise element.error(f"{count} elements of {stride} bytes are not the view's {length}")
    budget.check(PER_BYTE * length, element.json_path(), element.document.file)
    budget.take(length, element.json_path(), element.document.file)
    mode = element.text("mode", choices=("ATTRIBUTES", "TRIANGLES", "INDICES"))
    chosen = element.text("filter", "NONE", FILTERS)
    stream = np.frombuffer(data, np.uint8)
    try:
        if mode == "ATTRIBUTES":
            values = _attributes(stream, count, stride)
            return apply_filter(values, chosen).tobytes()
        if stride not in (2, 4) or chosen != "NONE":
            raise ValueError("indices have 2 or 4 bytes and no filter")
        read = decode_triangles if mode == "TRIANGLES" else decode_sequence
        return read(stream, count).astype(f"<u{stride}").tobytes()
    except (ValueError, IndexError) as error:
        raise element.error(f"cannot be decompressed: {error}") from None


def _attributes(stream: Bytes, count: int, stride: int) -> Bytes:
    """Decode mode 0 into (count, stride)."""
    version = int(stream[0]) - 0xA0
    if version not in TAIL or stride % 4:
        raise ValueError("it is no stream of attributes")
    tail = stride + (stride // 4 if version else 0)
    end = len(stream) - max(tail, TAIL[version])
    block = min(8192 // stride & ~15, 256)  # elements in it
    blocks = -(-count // block)
    if end < 1 or blocks * stride // (4 if version else 1) > end:
        raise ValueError("it is cut short")
    where, bits = _groups(stream, end, count, stride, block, version)
    deltas = _unpacked(stream, where, bits).reshape(stride, -1)[:, :count]
    last = stream[len(stream) - tail :]
    modes = last[stride:] if version else np.zeros(stride // 4, np.uint8)
    vertices = np.empty((count, stride), np.uint8)
    for channel, mode in enumerate(modes.tolist()):
        part = slice(4 * channel, 4 * channel + 4)
        vertices[:, part] = _undone(deltas[part], last[part], mode)
    return vertices


def _groups(
    stream: Bytes, end: int, count: int, stride: int, block: int, version: int
) -> tuple[NDArray[np.int64], NDArray[np.int8]]:
    """Where each group's bytes begin, and the bits of its deltas: (stride, groups) each."""
    groups = -(-count // GROUP)
    where, bits = np.zeros((stride, groups), np.int64), np.zeros((stride, groups), np.int8)
    values = stream.tolist()
    sentinels, at = {n: _sentinels(stream, n) for n in (1, 2, 4)}, 1
    for first in range(0, groups, block // GROUP):
        here = min(block // GROUP, groups - first)
        control = values[at : at + stride // 4] if version else ()
        at += len(control)
        for k in range(stride):
            mode = control[k // 4] >> 2 * (k % 4) & 3 if version else 0
            if mode == ZERO:
                continue
            if mode == LITERAL:
                where[k, first : first + here] = at + GROUP * np.arange(here)
                bits[k, first : first + here] = 8
                at += min(block, count - GROUP * first)  # the last group is not filled up
                continue
            head = values[at : at + (here + 3) // 4]
            at += len(head)
            table = BITS_V1[mode] if version else BITS_V0
            widths = [table[head[g >> 2] >> 2 * (g & 3) & 3] for g in range(here)]
            begins = []
            for width in widths:
                begins.append(at)
                if width == 8:
                    at += GROUP
                elif width:
                    packed = at + 2 * width
                    if packed > end:
                        raise ValueError("it is cut short")
                    counts = sentinels[width]
                    at = packed + counts[packed] - counts[at]
            where[k, first : first + here], bits[k, first : first + here] = begins, widths
        if at > end:
            raise ValueError("it is cut short")
    return where, bits


def _sentinels(stream: Bytes, bits: int) -> list[int]:
    """Count the deltas before each byte, `bits` wide, whose bits are all 1."""
    values = np.arange(256)
    per_byte = sum(
        (values >> shift & (1 << bits) - 1) == (1 << bits) - 1 for shift in range(0, 8, bits)
    )
    return [0, *np.cumsum(np.asarray(per_byte)[stream]).tolist()]


def _unpacked(stream: Bytes, where: NDArray[np.int64], bits: NDArray[np.int8]) -> Bytes:
    """The deltas of all groups, (groups, 16)."""
    begins, widths = where.reshape(-1), bits.reshape(-1)
    groups = np.zeros((len(begins), GROUP), np.uint8)
    literal = widths == 8
    groups[literal] = stream[begins[literal, None] + np.arange(GROUP)]
    for width in (1, 2, 4):
        chosen = np.flatnonzero(widths == width)
        packed = stream[begins[chosen, None] + np.arange(2 * width)]
        shifts = np.arange(0, 8, width)
        shifts = shifts if width == 1 else shifts[::-1]
        deltas = (packed[:, :, None] >> shifts & (1 << width) - 1).reshape(-1, GROUP)
        full = deltas == (1 << width) - 1
        group, element = np.nonzero(full)
        order = np.cumsum(full, axis=1)[full] - 1
        deltas[group, element] = stream[begins[chosen[group]] + 2 * width + order]
        groups[chosen] = deltas
    return groups


def _undone(deltas: Bytes, base: Bytes, mode: int) -> Bytes:
    """Four bytes of all elements (count, 4), from their deltas (4, count)."""
    kind, turn = mode & 15, mode >> 4
    raw = np.ascontiguousarray(deltas.T)
    if kind == 2:
        words = raw.view("<u4")[:, 0]
        if turn:
            words = words << np.uint32(turn) | words >> np.uint32(32 - turn)
        words[0] ^= base.copy().view("<u4")[0]
        return np.bitwise_xor.accumulate(words).astype("<u4")[:, None].view(np.uint8)
    if kind > 2 or turn:
        raise ValueError(f"there is no channel mode {mode}")
    steps: Array = raw if kind == 0 else raw.view("<u2")
    bit = steps.dtype.type(1)
    steps = steps >> bit ^ (0 - (steps & bit)).astype(steps.dtype)
    steps[0] += base if kind == 0 else base.copy().view("<u2")
    return np.cumsum(steps, axis=0, dtype=steps.dtype).view(np.uint8)
