"""Pictures as plain numbers: portable float maps (.pfm), NumPy's arrays (.npy), Radiance's (.hdr).

A portable float map is a text header, then floats, rows from the bottom (Debevec's description).
The scale's sign says the order of bytes, its absolute value is a factor. "PF4", of four channels,
is an extension of ImageMagick and others.

Radiance pictures (.hdr, .pic) are RGBE or XYZE, flat or run-length coded. The layout is that of
Radiance's "filefmts" (Ward), section "Picture file format": lines of variables, an empty line, the
order of the pixels, then scanlines. EXPOSURE and COLORCORR lines multiply together; radiance is
what is stored divided by them.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Bytes, Floats32, Matrix
from clpt.errors import SceneError
from clpt.files import budget, numpy_files, output_files
from clpt.images import checks
from clpt.images.stored import Stored
from clpt.spectra import spaces

PFM_HEADER = re.compile(rb"(P[Ff]|PF4)\s+(\d+)\s+(\d+)\s+([-+]?[.\deE+-]+)\s")
PFM_HEADER_BYTES = 256
PFM_CHANNELS = {b"Pf": 1, b"PF": 3, b"PF4": 4}


def read_pfm(path: Path) -> Stored:
    """Read a file. Raises SceneError if it is not a PFM, or ends early."""
    with path.open("rb") as file:
        header = PFM_HEADER.match(file.read(PFM_HEADER_BYTES))
    if header is None:
        message = "not a PFM image: its header is not 'PF' or 'Pf', width, height, scale"
        raise SceneError(message, file=path)
    width, height, channels = int(header[2]), int(header[3]), PFM_CHANNELS[header[1]]
    scale = _pfm_scale(path, header[4])
    checks.check_size(path, width, height)
    count = width * height * channels
    budget.check(8 * count, "its pixels", path)
    begin, size = header.end(), path.stat().st_size
    if size - begin == 4 * count + 1 and header[0].endswith(b"\r"):
        begin += 1  # a header of Windows's lines
    if size - begin < 4 * count:
        message = f"the file ends early: {width}x{height} pixels are announced"
        raise SceneError(message, file=path)
    values = np.fromfile(path, "<f4" if scale < 0.0 else ">f4", count, offset=begin)
    rows = values.reshape(height, width, channels)[::-1].astype(np.float32)
    return Stored(rows if abs(scale) == 1.0 else rows * np.float32(abs(scale)), encoded=False)


def _pfm_scale(path: Path, text: bytes) -> float:
    try:
        scale = float(text)
    except ValueError:
        scale = math.nan
    if not math.isfinite(scale) or scale == 0.0:
        said = text.decode("ascii", "replace")
        raise SceneError(f"its scale must be a number other than 0, not {said!r}", file=path)
    return scale


def write_pfm(path: Path, pixels: Floats32) -> None:
    """Write (h, w, 1, 3 or 4), without alpha."""
    pixels = pixels[..., :3]
    kind = "PF" if pixels.shape[2] == 3 else "Pf"
    head = f"{kind}\n{pixels.shape[1]} {pixels.shape[0]}\n-1.0\n"
    output_files.write(path, head.encode() + pixels[::-1].astype("<f4").tobytes())


def read_npy(path: Path) -> Stored:
    """Read (h, w) or (h, w, c) of any number, bytes as in a .png. Raises SceneError for others."""
    array = numpy_files.array(path)
    if array.ndim > 1:
        checks.check_size(path, *array.shape[1::-1])
    if array.ndim not in (2, 3) or array.dtype.kind not in "fiu":
        message = f"not an image: an array of {array.dtype}, shape {array.shape}"
        raise SceneError(message, file=path)
    budget.check(4 * array.size, "its array", path)
    shaped = array if array.ndim == 3 else array[..., None]
    if array.dtype == np.uint8:
        return Stored(np.array(shaped), encoded=True)
    notes: tuple[str, ...] = ()
    if array.dtype.kind in "iu":
        notes = (f"its numbers of type {array.dtype} are taken as they are: divide them by white",)
    return Stored(np.array(shaped, np.float32), encoded=False, colour_notes=notes)


def write_npy(path: Path, array: NDArray[Any]) -> None:
    """Write an array with axes as .npy. Raises OSError.

    Not by `np.save`, which does not tell that the last bytes were refused, as by a full disk.
    """
    array = np.ascontiguousarray(array)
    with output_files.replacing(path) as partial, partial.open("wb") as file:
        header = np.lib.format.header_data_from_array_1_0(array)
        np.lib.format.write_array_header_1_0(file, header)
        file.write(array.data)


HEADER_BYTES = 1 << 16
RESOLUTION = re.compile(rb"([-+])([XY]) +(\d+) +([-+])([XY]) +(\d+)[ \t]*\r?\n")
XYZE, RGBE = "32-bit_rle_xyze", "32-bit_rle_rgbe"
# What a line may say that pixels do not depend on, or that is honoured.
KNOWN = ("FORMAT", "EXPOSURE", "COLORCORR", "PRIMARIES", "PIXASPECT", "GAMMA")


@dataclass
class _Header:
    """The header of a Radiance picture; end: the offset of its scanlines."""

    format: str = RGBE
    divide: Floats32 = field(default_factory=lambda: np.ones(3, np.float32))
    primaries: tuple[float, ...] | None = None
    aspect: float = 1.0
    gamma: float = 1.0
    order: tuple[str, str, str, str] = ("-", "Y", "+", "X")
    size: tuple[int, int] = (0, 0)  # scanlines, and the pixels of each
    end: int = 0

    @property
    def notes(self) -> tuple[str, ...]:
        notes = []
        if self.aspect != 1.0:
            notes.append(f"its PIXASPECT of {self.aspect:g} is left out: its pixels are square")
        if self.gamma != 1.0:
            notes.append(f"its GAMMA of {self.gamma:g} is left out: its values are linear")
        return tuple(notes)


def read_hdr(path: Path) -> Stored:
    """Read a file. Raises SceneError if it is not a Radiance picture, or is broken."""
    with path.open("rb") as file:
        header = _parsed(path, file.read(HEADER_BYTES))
    rows, columns = header.size
    checks.check_size(path, *(header.size[::-1] if header.order[1] == "Y" else header.size))
    budget.check(24 * rows * columns, "its pixels", path)
    data = path.read_bytes()
    rgbe, at = np.empty((rows, columns, 4), np.uint8), header.end
    try:
        for y in range(rows):
            at = _scanline(data, at, rgbe[y])
    except (IndexError, ValueError) as error:
        raise SceneError(f"the file is broken in row {y} of {rows}", file=path) from error
    scale = np.ldexp(np.float32(1), rgbe[..., 3:].astype(np.int32) - 136)
    values = np.where(rgbe[..., 3:] > 0, rgbe[..., :3] * scale, np.float32(0)).astype(np.float32)
    if (header.divide != 1.0).any():
        values /= header.divide
    return Stored(_upright(values, header.order), False, matrix=_matrix(header), notes=header.notes)


def _parsed(path: Path, data: bytes) -> _Header:
    """Read the lines of a header. Raises SceneError."""
    header, at = _Header(), data.find(b"\n") + 1
    if not data.startswith(b"#?") or not at:
        raise SceneError("not a Radiance picture: it does not begin with #?", file=path)
    while True:
        end = data.find(b"\n", at)
        if end < 0:
            raise SceneError("not a Radiance picture: its header does not end", file=path)
        line, at = data[at:end].rstrip(), end + 1
        if not line:
            break
        name, equals, value = line.decode("latin-1").partition("=")
        if equals and name in KNOWN:
            _note(path, header, name, value.strip())
    order = RESOLUTION.match(data, at)
    if order is None or order[2] == order[5]:
        raise SceneError("not a Radiance picture: no line like '-Y 480 +X 640'", file=path)
    slow, slow_axis, fast, fast_axis = (order[i].decode() for i in (1, 2, 4, 5))
    header.order = slow, slow_axis, fast, fast_axis
    header.size, header.end = (int(order[3]), int(order[6])), order.end()
    return header


def _note(path: Path, header: _Header, name: str, value: str) -> None:
    """Put what a line says into a header. Raises SceneError."""
    if name == "FORMAT":
        if value not in (RGBE, XYZE):
            raise SceneError(f"its FORMAT must be {RGBE} or {XYZE}, not {value!r}", file=path)
        header.format = value
        return
    count = {"COLORCORR": 3, "PRIMARIES": 8}.get(name, 1)
    try:
        numbers = tuple(float(word) for word in value.split())
    except ValueError:
        numbers = ()
    positive = name == "PRIMARIES" or all(number > 0.0 for number in numbers)
    if len(numbers) != count or not all(map(math.isfinite, numbers)) or not positive:
        needed = f"{count} numbers" if count > 1 else "a number above 0"
        raise SceneError(f"its {name} must be {needed}, not {value!r}", file=path)
    if name in ("EXPOSURE", "COLORCORR"):
        header.divide *= np.array(numbers, np.float32)
    elif name == "PRIMARIES":
        header.primaries = numbers if any(numbers) else None  # Photoshop's zeros state none
    elif name == "PIXASPECT":
        header.aspect *= numbers[0]
    else:
        header.gamma = numbers[0]


def _matrix(header: _Header) -> Matrix | None:
    """From a picture's colours to Rec. 709; without PRIMARIES they are taken to be that."""
    if header.format == XYZE:
        return spaces.from_xyz("rec709")
    return None if header.primaries is None else spaces.to_rec709(header.primaries)


def _upright(values: Floats32, order: tuple[str, str, str, str]) -> Floats32:
    """Scanlines as rows from the top, pixels from the left; Y goes up and X to the right."""
    slow, slow_axis, fast, _ = order
    if slow_axis == "X":
        values, slow, fast = values.swapaxes(0, 1), fast, slow
    values = values if slow == "-" else values[::-1]
    return np.ascontiguousarray(values if fast == "+" else values[:, ::-1])


def _scanline(data: bytes, at: int, row: Bytes) -> int:
    """Decode a scanline into `row` (w, 4); return the offset of the next scanline."""
    width = len(row)
    if data[at : at + 2] != b"\2\2" or not 8 <= width < 32768 or data[at + 2] > 127:
        return _old_scanline(data, at, row)
    if int.from_bytes(data[at + 2 : at + 4], "big") != width:
        raise ValueError("another width")
    at += 4
    for channel in range(4):
        values = bytearray()
        while len(values) < width:
            count = data[at]
            if count > 128:
                values += data[at + 1 : at + 2] * (count - 128)
                at += 2
            else:
                values += data[at + 1 : at + 1 + count]
                at += 1 + max(count, 1)
        row[:, channel] = np.frombuffer(values, np.uint8)
    return at


def _old_scanline(data: bytes, at: int, row: Bytes) -> int:
    """Decode flat pixels into `row`; 1 1 1 n repeats the pixel before n times.

    The count of a repeat that follows a repeat is 256 times as much.
    """
    width = len(row)
    flat = np.frombuffer(data, np.uint8, min(4 * width, len(data) - at), at)
    flat = flat[: len(flat) // 4 * 4].reshape(-1, 4)
    repeats = np.flatnonzero((flat[:, :3] == 1).all(axis=1))
    if not len(repeats):
        row[:] = flat  # raises ValueError where it ends early
        return at + 4 * width
    filled = taken = shift = 0
    for index in repeats:
        plain = int(index) - taken
        if filled + plain >= width:
            break
        if plain:
            row[filled : filled + plain] = flat[taken:index]
            filled, shift = filled + plain, 0
        count = int(flat[index, 3]) << shift
        if filled == 0 or filled + count > width:
            raise ValueError("a repeat of nothing, or beyond the end")
        row[filled : filled + count] = row[filled - 1]
        filled, taken, shift = filled + count, int(index) + 1, shift + 8
        if filled == width:
            break
    row[filled:] = flat[taken : taken + width - filled]
    return at + 4 * (taken + width - filled)


def write_hdr(path: Path, pixels: Floats32, space: str = "rec709") -> None:
    """Write (h, w, 1, 3 or 4) as flat rows of RGBE, which state their space unless it is Rec. 709.

    A normalised mantissa cannot look like a run-length code.
    """
    colour = np.nan_to_num(np.broadcast_to(pixels[..., :3], (*pixels.shape[:2], 3)), posinf=1e38)
    colour = np.clip(colour, 0, 1e38)
    mantissa, exponent = np.frexp(colour.max(axis=2))
    scale = np.where(mantissa > 0, np.ldexp(256.0, -exponent), 0)
    rgbe = np.empty((*pixels.shape[:2], 4), np.uint8)
    rgbe[..., :3] = np.clip(np.round(colour * scale[..., None]), 0, 255)
    rgbe[..., 3] = np.where((mantissa > 0) & (exponent > -128), np.clip(exponent + 128, 0, 255), 0)
    space = space if pixels.shape[2] > 1 else "rec709"
    lines = ["#?RADIANCE", f"FORMAT={XYZE if space == 'xyz' else RGBE}"]
    if space not in ("rec709", "xyz"):
        lines.append("PRIMARIES= " + " ".join(f"{v:.7g}" for v in spaces.chromaticities(space)))
    lines += ["", f"-Y {pixels.shape[0]} +X {pixels.shape[1]}", ""]
    output_files.write(path, "\n".join(lines).encode() + rgbe.tobytes())
