"""Image files byte by byte, as their formats' texts have them, where no writer makes them."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

Channel = tuple[np.ndarray, int, int]  # samples, and every how many columns and rows they are


def exr(
    path: Path,
    channels: Mapping[str, Channel | np.ndarray],
    size: tuple[int, int],
    data: tuple[int, int, int, int] | None = None,
    extra: bytes = b"",
    flags: int = 2,
    levels: Mapping[str, Sequence[np.ndarray]] | None = None,
) -> Path:
    """Write uncompressed scanlines; of `levels`, each in a tile.

    size: of the display window; data: the data window, inclusive.
    extra: further attributes, of `attribute`; flags: the second word of a file.
    """
    width, height = size
    x0, y0, x1, y1 = data or (0, 0, width - 1, height - 1)
    made = {n: c if isinstance(c, tuple) else (c, 1, 1) for n, c in channels.items()}
    kinds = {"<u4": 0, "<f2": 1, "<f4": 2}
    names = sorted(made)
    listed = b"".join(
        name.encode()
        + b"\0"
        + struct.pack("<4i", kinds[made[name][0].dtype.str], 0, made[name][1], made[name][2])
        for name in names
    )
    given = [
        ("channels", "chlist", listed + b"\0"),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", struct.pack("<4i", x0, y0, x1, y1)),
        ("displayWindow", "box2i", struct.pack("<4i", 0, 0, width - 1, height - 1)),
        ("lineOrder", "lineOrder", b"\0"),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    ]
    if b"pixelAspectRatio" not in extra:
        given.append(("pixelAspectRatio", "float", struct.pack("<f", 1)))
    head = b"\x76\x2f\x31\x01" + struct.pack("<I", flags)
    head += b"".join(attribute(*one) for one in given) + extra + b"\0"
    if levels is not None:
        return _with_levels(path, head, [levels[n] for n in names])
    rows = []
    for y in range(y0, y1 + 1):
        row = b"".join(
            made[n][0][(y - y0) // made[n][2]].tobytes() for n in names if y % made[n][2] == 0
        )
        rows.append(struct.pack("<ii", y, len(row)) + row)
    first = len(head) + 8 * len(rows)
    offsets = np.cumsum([first, *(len(row) for row in rows[:-1])])
    path.write_bytes(head + struct.pack(f"<{len(rows)}Q", *offsets) + b"".join(rows))
    return path


def _with_levels(path: Path, head: bytes, levels: Sequence[Sequence[np.ndarray]]) -> Path:
    """Write MIP levels of some channels, a tile each: the whole level."""
    tiles = []
    for number, planes in enumerate(zip(*levels, strict=True)):
        rows = zip(*planes, strict=True)
        data = b"".join(line.tobytes() for row in rows for line in row)
        tiles.append(struct.pack("<5i", 0, 0, number, number, len(data)) + data)
    first = len(head) + 8 * len(tiles)
    offsets = np.cumsum([first, *(len(tile) for tile in tiles[:-1])])
    path.write_bytes(head + struct.pack(f"<{len(tiles)}Q", *offsets) + b"".join(tiles))
    return path


def attribute(name: str, kind: str, value: bytes) -> bytes:
    """Return an attribute of an EXR header."""
    return f"{name}\0{kind}\0".encode() + struct.pack("<i", len(value)) + value


ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2),
         (0, 1, 1, 2))  # fmt: skip


def png(
    path: Path,
    rows: np.ndarray,
    depth: int,
    colour: int,
    chunks: Sequence[tuple[bytes, bytes]] = (),
    filtered: int = 0,
    interlaced: bool = False,
) -> Path:
    """Write rows (h, w) or (h, w, c) of `depth` bits a sample; colour: the type of IHDR.

    filtered: the filter of all rows, 0 none, 1 to the left, 2 up; interlaced: by Adam7.
    """
    height, width = rows.shape[:2]
    passes = ADAM7 if interlaced else ((0, 0, 1, 1),)
    parts = [rows[y::dy, x::dx] for x, y, dx, dy in passes]
    data = b"".join(_filtered(part, depth, filtered) for part in parts if part.size)
    head = struct.pack(">2I5B", width, height, depth, colour, 0, 0, interlaced)
    whole = [(b"IHDR", head), *chunks, (b"IDAT", zlib.compress(data)), (b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*part) for part in whole))
    return path


def _filtered(rows: np.ndarray, depth: int, filtered: int) -> bytes:
    height = len(rows)
    if depth == 16:
        lines = np.ascontiguousarray(rows, ">u2").reshape(height, -1).view(np.uint8)
    elif depth == 8:
        lines = rows.astype(np.uint8).reshape(height, -1)
    else:
        bits = (rows.astype(np.uint8)[..., None] >> np.arange(depth - 1, -1, -1)) & 1
        lines = np.packbits(bits.reshape(height, -1), axis=1)
    step = max(depth * int(np.prod(rows.shape[2:])) // 8, 1)
    before = np.zeros_like(lines)
    if filtered == 1:
        before[:, step:] = lines[:, :-step]
    elif filtered == 2:
        before[1:] = lines[:-1]
    return b"".join(bytes([filtered]) + line.tobytes() for line in lines - before)


def _chunk(name: bytes, data: bytes) -> bytes:
    crc = struct.pack(">I", zlib.crc32(name + data))
    return struct.pack(">I", len(data)) + name + data + crc


def tiff(path: Path, pixels: np.ndarray, photometric: int, order: str = "<") -> Path:
    """Write pixels (h, w, c) of whole numbers in one strip, by TIFF 6.0."""
    height, width, count = pixels.shape
    data = pixels.astype(pixels.dtype.newbyteorder(order)).tobytes()
    kind = 2 if pixels.dtype.kind == "i" else 1
    tags: list[list[Any]] = [
        [256, 3, [width]], [257, 3, [height]], [258, 3, [8 * pixels.dtype.itemsize] * count],
        [259, 3, [1]], [262, 3, [photometric]], [273, 4, [0]], [277, 3, [count]],
        [278, 3, [height]], [279, 4, [len(data)]], [339, 3, [kind] * count],
    ]  # fmt: skip
    beyond, extra = 10 + 12 * len(tags) + 4, b""
    words: dict[int, bytes] = {}
    for tag, form, values in tags:
        word = struct.pack(f"{order}{len(values)}{'H' if form == 3 else 'I'}", *values)
        if len(word) > 4:
            word, extra = struct.pack(f"{order}I", beyond + len(extra)), extra + word
        words[tag] = word
    words[273] = struct.pack(f"{order}I", beyond + len(extra))
    body = b"".join(
        struct.pack(f"{order}HHI", tag, form, len(values)) + words[tag].ljust(4, b"\0")
        for tag, form, values in tags
    )
    head = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}IH", 8, len(tags))
    path.write_bytes(head + body + bytes(4) + extra + data)
    return path
