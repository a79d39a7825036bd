"""Files of codes for screens: PNG with its statements on colours, JPEG, WebP."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Matrix
from clpt.errors import SceneError
from clpt.spectra import spaces

Metadata = Mapping[str, str | int | float | tuple[float, ...]]

SIGNATURE = b"\x89PNG\r\n\x1a\n"
COLOURS = (b"cICP", b"iCCP", b"sRGB", b"gAMA", b"cHRM")
SRGB_GAMMA = 0.45455  # which writers of sRGB state beside it
SRGB_CICP = b"\x01\x0d\x00\x01"
QUALITY = 95  # of JPEG and WebP, of 100
DESCRIPTION, SOFTWARE = 0x010E, 0x0131  # tags of Exif
FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP"}


@dataclass(frozen=True)
class Profile:
    """Colours of a PNG file as its chunks describe them, with the names of `clpt.images.Stored`."""

    gamma: float | None = None
    matrix: Matrix | None = None
    notes: tuple[str, ...] = ()


def profile(file: BinaryIO) -> Profile:
    """Read the colours that the chunks before the pixels describe; Pillow reads iCCP.

    The PNG Specification (third edition), sections 4.3 and 11.3.2: of cICP, iCCP, sRGB, and gAMA
    with cHRM the first counts. Without any of them the colours are sRGB.
    """
    chunks = dict(_chunks(file))
    if b"cICP" in chunks and chunks[b"cICP"] != SRGB_CICP:
        return Profile(notes=("its cICP chunk is left out: its colours are taken as sRGB",))
    if any(name in chunks for name in (b"cICP", b"iCCP", b"sRGB")):
        return Profile()
    return _stated(chunks)


def _stated(chunks: Mapping[bytes, bytes]) -> Profile:
    """Read the gamma of gAMA and the primaries of cHRM."""
    gamma, matrix, notes = None, None, []
    if len(chunks.get(b"gAMA", b"")) == 4:
        exponent = struct.unpack(">I", chunks[b"gAMA"])[0] / 100000.0
        if exponent == 0.0:
            notes.append("its gAMA of 0 is left out: its colours are taken as sRGB")
        elif abs(exponent - SRGB_GAMMA) > 0.01 * SRGB_GAMMA:
            gamma = exponent
    if len(chunks.get(b"cHRM", b"")) == 32:
        white_x, white_y, *others = np.divide(struct.unpack(">8I", chunks[b"cHRM"]), 100000.0)
        try:
            matrix = spaces.to_rec709((*others, white_x, white_y))
        except SceneError as error:
            notes.append(f"{error.message}: its cHRM is left out")
    return Profile(gamma, matrix, tuple(notes))


def _chunks(file: BinaryIO) -> Iterator[tuple[bytes, bytes]]:
    """The chunks of colours before the first of pixels, by name; the first chunk of each name."""
    file.seek(0)
    seen = set()
    if file.read(8) != SIGNATURE:
        return
    while len(head := file.read(8)) == 8:
        size, name = struct.unpack(">I4s", head)
        if name in (b"IDAT", b"IEND"):
            return
        if name in COLOURS and name not in seen and size < 1 << 24:
            seen.add(name)
            yield name, file.read(size)
            file.seek(4, 1)
        else:
            file.seek(size + 4, 1)


def png(values: NDArray[np.uint8], metadata: Metadata | None = None) -> bytes:
    """A .png file of (h, w) or (h, w, 1, 3 or 4), stored as they are; metadata: its texts."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    file, texts = BytesIO(), PngInfo()
    for name, value in (metadata or {}).items():
        texts.add_itxt(name, str(value))
    grey = values.ndim == 3 and values.shape[2] == 1
    Image.fromarray(values[..., 0] if grey else values).save(file, "png", pnginfo=texts)
    return file.getvalue()


def encode(suffix: str, codes: NDArray[np.uint8], metadata: Metadata | None = None) -> bytes:
    """Return a file of codes (h, w, 1, 3 or 4), by its suffix.

    A JPEG has no alpha. metadata: texts of a .png; of the others the
    description in Exif. Raises what Pillow raises, such as for a side that the format cannot have.
    """
    if FORMATS[suffix] == "PNG":
        return png(codes, metadata)
    from PIL import Image

    image = Image.fromarray(codes[..., 0] if codes.shape[2] == 1 else codes)
    exif = Image.Exif()
    if metadata:
        exif[DESCRIPTION] = "\n".join(f"{name}: {value}" for name, value in metadata.items())
        exif[SOFTWARE] = str(metadata.get("software", ""))
    file = BytesIO()
    subsampling = {"subsampling": 0} if FORMATS[suffix] == "JPEG" else {}
    image.save(file, FORMATS[suffix], quality=QUALITY, exif=exif.tobytes(), **subsampling)
    return file.getvalue()
