"""OpenEXR files through the library: the only module that opens them."""

from __future__ import annotations

import errno
import os
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, input_files, output_files
from clpt.images import checks

Channels = Mapping[str, NDArray[Any]]
Header = Mapping[str, Any]
Window = tuple[int, int, int, int]  # first x and y, and those behind the last

DEEP = ("deepscanline", "deeptile")


def exr_name(path: str | Path) -> str:
    """A path as OpenEXR takes it: bytes of UTF-8, whatever the locale. Raises ValueError."""
    return os.fsencode(path).decode("utf-8")


@contextmanager
def opened(path: Path, header_only: bool = False) -> Iterator[Sequence[Any]]:
    """The parts of a file, whose `header` and `channels` are those of the library.

    Raises SceneError unless there is a regular file, else the library's errors, from RuntimeError
    to MemoryError.
    """
    input_files.regular(path)
    with OpenEXR.File(exr_name(path), separate_channels=True, header_only=header_only) as file:
        yield file.parts


def headers(path: Path) -> list[dict[str, Any]]:
    """The attributes of each part by name. Raises as `opened` does."""
    with opened(path, header_only=True) as parts:
        return [dict(part.header) for part in parts]  # copies: closing the file empties them


def attributes(path: Path) -> dict[str, Any]:
    """The attributes of the first part by name. Raises as `opened` does."""
    return headers(path)[0]


def part_names(path: Path) -> list[str]:
    """The names of the parts; their numbers where they have none. Raises as `opened` does."""
    with opened(path, header_only=True) as parts:
        return [part.name() or str(i) for i, part in enumerate(parts)]


def channel_names(header: Header) -> list[str]:
    """The names of a part's channels, in the order of the file."""
    return [channel.name for channel in header["channels"]]


def flat_channels(header: Header) -> list[str]:
    """The names of a part's channels, none if its pixels are deep."""
    return [] if _is_deep(header) else channel_names(header)


def _is_deep(header: Header) -> bool:
    return getattr(header.get("type"), "name", "") in DEEP


def window(header: Header, name: str) -> Window:
    """The "dataWindow" or the "displayWindow" of a part."""
    (x0, y0), (x1, y1) = header[name]
    return int(x0), int(y0), int(x1) + 1, int(y1) + 1


def windows(
    shape: tuple[int, ...], place: tuple[int, int, int, int] | None
) -> dict[str, tuple[float, ...]]:
    """The attributes that say where a part (h, w, ..) of a whole picture lies: first and last x, y.

    place: the column and the row where it begins, and the size of the whole, (x, y, width, height);
    None: it is the whole, which needs no attributes.
    """
    if place is None:
        return {}
    x, y, width, height = place
    data = (x, y, x + shape[1] - 1, y + shape[0] - 1)
    return {"dataWindow": data, "displayWindow": (0, 0, width - 1, height - 1)}


def check(path: Path, header: Header) -> None:
    """Raise SceneError for a part of too many pixels, or of deep pixels."""
    if _is_deep(header):
        raise SceneError(f"has deep pixels ({header['type'].name}); flatten it", file=path)
    for name in ("dataWindow", "displayWindow"):
        x0, y0, x1, y1 = window(header, name)
        checks.check_size(path, x1 - x0, y1 - y0)


def read_channels(path: Path, chosen: Sequence[str] | None = None, part: int = 0) -> Channels:
    """Channels of a part by name, as they are stored: float16, float32 or uint32.

    (h, w) of the data window, less where they are subsampled. chosen: which; all if None. Raises
    SceneError where they take too much memory, else as `opened` does.
    """
    parts_headers = headers(path)
    check(path, parts_headers[part])
    names = channel_names(parts_headers[part]) if chosen is None else chosen
    if not names:
        return {}
    if len(parts_headers) == 1 and set(names) < set(channel_names(parts_headers[0])):
        return _some(path, parts_headers[0], names)
    # The library reads all channels of all parts.
    budget.check(sum(_size(header, channel_names(header)) for header in parts_headers), _WHAT, path)
    with opened(path) as parts:
        channels = parts[part].channels
        return {name: np.asarray(channels[name].pixels) for name in names}


_WHAT = "what its channels hold"


def _size(header: Header, names: Sequence[str]) -> int:
    """Return the most memory [bytes] that channels of a part take: as stored and as float32."""
    areas = []
    for name in ("dataWindow", "displayWindow"):
        x0, y0, x1, y1 = window(header, name)
        areas.append((x1 - x0) * (y1 - y0))
    return 8 * max(areas) * len(names)


def _some(path: Path, header: Header, names: Sequence[str]) -> Channels:
    """Read some channels of a file of a single part.

    By the library's older interface, for the newer interface always reads all channels.
    """
    budget.check(_size(header, names), _WHAT, path)
    x0, y0, x1, y1 = window(header, "dataWindow")
    input_files.regular(path)
    file = OpenEXR.InputFile(exr_name(path))
    try:
        about = file.header()["channels"]
        kinds = {0: np.uint32, 1: np.float16, 2: np.float32}  # by the number of a pixel type
        read = file.channels(list(names))
    finally:
        file.close()
    channels = {}
    for name, data in zip(names, read, strict=True):
        channel = about[name]
        shape = (y1 - y0) // channel.ySampling, (x1 - x0) // channel.xSampling
        channels[name] = np.frombuffer(data, kinds[channel.type.v]).reshape(shape)
    return channels


def write_parts(path: Path, parts: Sequence[Any]) -> None:
    """Write parts of the library's own class. Raises RuntimeError or OSError where it cannot."""
    OpenEXR.File(list(parts)).write(exr_name(path))
    _check_whole(path)


def _check_whole(path: Path) -> None:
    """Raise OSError for a file that ends before its last chunk does.

    The library does not tell that the last bytes were refused, as by a full disk. Behind the
    headers stand the offsets of all chunks, then these: number of the part in a file of several,
    row, size (each i32) and data.
    """
    with path.open("rb") as file:
        _, version = _unpacked("<2I", file)
        several = bool(version & SEVERAL_PARTS)
        while _skip_header(file) and several:
            pass
        (first,) = _unpacked("<Q", file)
        file.seek(-8, os.SEEK_CUR)
        offsets = _unpacked(f"<{max(first - file.tell(), 8) // 8}Q", file)
        last = max(offsets)
        file.seek(last)
        *_, size = _unpacked("<3i" if several else "<2i", file)
        whole = file.tell() + size
        if not min(offsets) or file.seek(0, os.SEEK_END) != whole:
            raise OSError(errno.ENOSPC, NOT_WHOLE)


SEVERAL_PARTS = 0x1000  # of the version
NOT_WHOLE = "it could not be written to its end; is the disk full?"


def _skip_header(file: BinaryIO) -> bool:
    """Read over the attributes of a part; return whether there was a part."""
    some = False
    while _word(file):
        _word(file)  # its type
        (size,) = _unpacked("<i", file)
        file.seek(size, os.SEEK_CUR)
        some = True
    return some


def _word(file: BinaryIO) -> bytes:
    """The bytes before the next zero. Raises OSError at the end of the file."""
    letters = bytearray()
    while (letter := _unpacked("<c", file)[0]) != b"\0":
        letters += letter
    return bytes(letters)


def _unpacked(form: str, file: BinaryIO) -> tuple[Any, ...]:
    """The next numbers of a file. Raises OSError at its end."""
    try:
        return struct.unpack(form, file.read(struct.calcsize(form)))
    except struct.error:
        raise OSError(errno.ENOSPC, NOT_WHOLE) from None


def write_channels(path: Path, metadata: Mapping[str, Any], channels: Channels) -> None:
    """Write channels (h, w) by name, and attributes, as an .exr; windows are as of `windows`."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    for name in ("dataWindow", "displayWindow"):
        if name in metadata:
            first, last = np.array(metadata[name], np.int32).reshape(2, 2)
            header[name] = first, last
    with output_files.replacing(path) as partial:
        OpenEXR.File({**metadata, **header}, dict(channels)).write(exr_name(partial))
        _check_whole(partial)
