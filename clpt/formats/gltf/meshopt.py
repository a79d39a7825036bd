"""EXT_meshopt_compression and KHR_meshopt_compression: a buffer view that is stored smaller.

After appendix A of KHR_meshopt_compression, whose version 0 is the older extension's format. The
only package that decodes it is an alpha release without binaries, hence this decoder: where groups
of bytes begin is found one by one, all else goes by arrays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Array, Bytes
from clpt.files import budget
from clpt.formats.gltf import meshopt_filters, meshopt_indices
from clpt.formats.gltf.document import Element

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
    chosen = element.text("filter", "NONE", meshopt_filters.FILTERS)
    stream = np.frombuffer(data, np.uint8)
    try:
        if mode == "ATTRIBUTES":
            values = _attributes(stream, count, stride)
            return meshopt_filters.apply(values, chosen).tobytes()
        if stride not in (2, 4) or chosen != "NONE":
            raise ValueError("indices have 2 or 4 bytes and no filter")
        read = meshopt_indices.triangles if mode == "TRIANGLES" else meshopt_indices.sequence
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
    made = np.empty((count, stride), np.uint8)
    for channel, mode in enumerate(modes.tolist()):
        part = slice(4 * channel, 4 * channel + 4)
        made[:, part] = _undone(deltas[part], last[part], mode)
    return made


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
    """Count the deltas before each byte, `bits` wide, whose bits are all one."""
    values = np.arange(256)
    per_byte = sum(
        (values >> shift & (1 << bits) - 1) == (1 << bits) - 1 for shift in range(0, 8, bits)
    )
    return [0, *np.cumsum(np.asarray(per_byte)[stream]).tolist()]


def _unpacked(stream: Bytes, where: NDArray[np.int64], bits: NDArray[np.int8]) -> Bytes:
    """The deltas of all groups, (groups, 16)."""
    begins, widths = where.reshape(-1), bits.reshape(-1)
    made = np.zeros((len(begins), GROUP), np.uint8)
    literal = widths == 8
    made[literal] = stream[begins[literal, None] + np.arange(GROUP)]
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
        made[chosen] = deltas
    return made


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
    one = steps.dtype.type(1)
    steps = steps >> one ^ (0 - (steps & one)).astype(steps.dtype)
    steps[0] += base if kind == 0 else base.copy().view("<u2")
    return np.cumsum(steps, axis=0, dtype=steps.dtype).view(np.uint8)
