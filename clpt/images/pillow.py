"""Files that Pillow decodes: PNG, JPEG, TGA, BMP, WebP, GIF and TIFF, and no others.

Pillow would open dozens of formats by their first bytes, PostScript among them, which starts
another program; the formats are always named here.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.images import checks, screen_files
from clpt.images.stored import Stored

if TYPE_CHECKING:  # else imported where it is used, for many pictures are EXR only
    from PIL.Image import Image
    from PIL.ImageFile import ImageFile

FORMATS = ("PNG", "JPEG", "TGA", "BMP", "WEBP", "GIF", "TIFF")
PLUGINS = ("Png", "Jpeg", "Tga", "Bmp", "WebP", "Gif", "Tiff")  # Pillow's modules of these
SUFFIXES = (".png", ".jpg", ".jpeg", ".tga", ".bmp", ".webp", ".gif", ".tif", ".tiff")
NAMES = {"WEBP": "WebP"}  # of formats, where people write them in another way
ORIENTATION = 0x0112  # the tag of Exif
PHOTOMETRIC, WHITE_IS_ZERO = 262, 0  # a tag of TIFF, and its value
START_OF_SCAN = b"\xff\xda"  # a marker of JPEG
SCANS, SCANNED_PIXELS = 20, 1 << 31  # limits for a JPEG
LEFT_OUT = "is left out: its pixels are taken as they are stored"

Source = Path | bytes
Admit = Callable[[int, int], object]


def read(path: Path) -> Stored:
    """Read a file, with its statements on colours. Raises SceneError."""
    return decoded(path, FORMATS)


def decoded(
    source: Source, formats: Sequence[str], admit: Admit | None = None, *, profiled: bool = True
) -> Stored:
    """Decode a file, or its bytes, in any of the given FORMATS.

    admit: called with width and height before there are pixels, and may raise; by default it limits
    the number of pixels. profiled: heed the file's statements on colours and orientation, which are
    else passed over in silence.

    Raises SceneError if it is not such an image or takes too much memory, else Pillow's errors.
    """
    with _opened(source, formats) as image:
        (admit or partial(checks.check_size, _file(source)))(image.width, image.height)
        _check_scans(source, image)
        with budget.lending(_bytes(image), "its pixels", _file(source)):
            pixels = _pixels(source, formats, image)
        # Only now: Pillow decodes an image to find its Exif.
        kind, notes, colour_notes = image.format, _notes(image), _colour_notes(image)
    if not profiled:
        return pixels
    if kind != "PNG":
        return replace(pixels, notes=notes, colour_notes=colour_notes)
    with BytesIO(source) if isinstance(source, bytes) else source.open("rb") as file:
        said = screen_files.profile(file)
    return replace(
        pixels,
        gamma=said.gamma,
        matrix=said.matrix,
        notes=notes,
        colour_notes=(*said.notes, *colour_notes),
    )


def _check_scans(source: Source, image: ImageFile) -> None:
    """Raise SceneError for a JPEG whose scans, each of all its pixels, would take long."""
    if not image.info.get("progressive"):
        return
    data = source if isinstance(source, bytes) else input_files.read_bytes(source)
    scans = data.count(START_OF_SCAN)
    if scans > SCANS and scans * image.width * image.height > SCANNED_PIXELS:
        message = f"has {scans} scans of {image.width}x{image.height} pixels; at most {SCANS} are "
        raise SceneError(message + "read of so many: save it anew", file=_file(source))


def _pixels(source: Source, formats: Sequence[str], image: ImageFile) -> Stored:
    wide, key = _sixteen_bits(source, formats, image), image.info.get("transparency")
    if wide is None:
        return from_pillow(image)
    return Stored(_floats(wide, key if isinstance(key, tuple) else None), encoded=True)


def texts(path: Path) -> dict[str, str]:
    """The texts of a .png by name. Raises as `decoded` does."""
    with _opened(path, ("PNG",)) as image:
        return {name: str(text) for name, text in getattr(image, "text", {}).items()}


@contextmanager
def _opened(source: Source, formats: Sequence[str]) -> Iterator[ImageFile]:
    """The only place that has Pillow open an image."""
    from PIL import Image, UnidentifiedImageError

    _know_formats()
    file, data = (source, None) if isinstance(source, Path) else (None, BytesIO(source))
    try:
        with Image.open(file or data, formats=formats) as image:  # type: ignore[arg-type]
            yield image
    except UnidentifiedImageError:
        *first, last = (NAMES.get(name, name) for name in formats)
        listed = f"{', '.join(first)} or {last}" if first else last
        raise SceneError(f"is no {listed} image of a kind that is read", file=file) from None
    except Image.DecompressionBombError:
        most = 2 * (Image.MAX_IMAGE_PIXELS or 0)  # Pillow's rule
        subject = f"{file.suffix} images" if file else "images"
        message = f"has more than the {most} pixels that are read of {subject}"
        raise SceneError(message, file=file) from None


@cache
def _know_formats() -> None:
    """Import Pillow's modules of FORMATS; without them it imports all its modules."""
    for name in PLUGINS:
        importlib.import_module(f"PIL.{name}ImagePlugin")


def _bytes(image: ImageFile) -> int:
    """Return the memory that decoding takes [bytes], Pillow's own and ours."""
    bands = max(len(image.getbands()), 1)
    deep = image.mode[0] in "IF" or _raw_mode(image).find(";16") >= 0
    stored = 1 if bands == 1 else 4  # Pillow's, of a pixel
    each = 12 * bands if deep else stored + 2 * bands + (4 if image.mode in ("P", "1") else 0)
    return image.width * image.height * each


def _file(source: Source) -> Path | None:
    return source if isinstance(source, Path) else None


def from_pillow(image: Image) -> Stored:
    """A Pillow image as it is stored, (h, w, 1, 3 or 4). Raises SceneError."""
    key = image.info.get("transparency")
    if image.mode == "F":
        return Stored(np.asarray(image, np.float32)[..., None], encoded=False)
    if image.mode == "I" and getattr(image, "format", None) not in ("PNG", None):
        subject = "its whole numbers of 32 bits, or with a sign, have no meaning as colours"
        raise SceneError(f"{subject}; save floats, or 16 bits")
    if image.mode == "I" or image.mode.startswith("I;16"):
        wide = np.asarray(image).astype(np.uint16)[..., None]
        if getattr(image, "tag_v2", {}).get(PHOTOMETRIC) == WHITE_IS_ZERO:
            wide = np.uint16(65535) - wide  # which Pillow does for fewer bits alone
        return Stored(_floats(wide, (key,) if isinstance(key, int) else None), encoded=True)
    transparent = "A" in image.mode or "a" in image.mode or key is not None
    if image.mode not in ("L", "RGB", "RGBA") or (transparent and image.mode != "RGBA"):
        image = image.convert("RGBA" if transparent else "L" if image.mode == "1" else "RGB")
    values = np.asarray(image)
    return Stored(values[..., None] if values.ndim == 2 else values, encoded=True)


def _floats(values: NDArray[np.uint16], key: Sequence[int] | None) -> NDArray[np.float32]:
    """Numbers of 16 bits from 0 to 1; key: the transparent colour, None for none."""
    floats = values.astype(np.float32)
    floats /= np.float32(65535.0)
    if key is None:
        return floats
    alpha = (values != np.array(key, np.uint16)).any(axis=2, keepdims=True)
    colours = np.repeat(floats, 3, axis=2) if floats.shape[2] == 1 else floats
    return np.concatenate([colours, alpha.astype(np.float32)], axis=2)


def _raw_mode(image: ImageFile) -> str:
    """Return Pillow's name of the file's form of pixels, such as "RGB;16B"."""
    if len(image.tile) != 1:
        return ""
    mode: Any = image.tile[0][3]
    raw = mode[0] if isinstance(mode, tuple) and mode else mode
    return raw if isinstance(raw, str) else ""


def _sixteen_bits(
    source: Source, formats: Sequence[str], image: ImageFile
) -> NDArray[np.uint16] | None:
    """Return colours of 16 bits (h, w, 3 or 4); None for an image without.

    Pillow keeps the upper 8 bits. The lower bits come from decoding it again as if the bytes had
    the other order.
    """
    raw = _raw_mode(image)
    if raw == "LA;16B":
        upper_lower = _bytes_as(image, "RGBA").astype(np.uint16)
        grey_alpha = upper_lower[..., ::2] << np.uint16(8) | upper_lower[..., 1::2]
        return grey_alpha[..., [0, 0, 0, 1]]
    mode, _, order = raw.partition(";16")
    if mode not in ("RGB", "RGBA") or mode != image.mode or order not in ("B", "L", "N"):
        return None
    little = order == "L" or (order == "N" and sys.byteorder == "little")
    upper, lower = ("L", "B") if little else ("B", "L")
    high = _bytes_as(image, f"{mode};16{upper}")
    with _opened(source, formats) as again:
        low = _bytes_as(again, f"{mode};16{lower}")
    return high.astype(np.uint16) << np.uint16(8) | low


def _bytes_as(image: ImageFile, raw: str) -> NDArray[np.uint8]:
    """The pixels of an image that is not decoded yet, as if it stored them in another way."""
    tile: Any = image.tile[0]
    mode = tile[3]
    changed: Any = (*tile[:3], (raw, *mode[1:]) if isinstance(mode, tuple) else raw)
    image.tile = [type(tile)(*changed) if hasattr(tile, "_replace") else changed]
    return np.asarray(image)


def _notes(image: ImageFile) -> tuple[str, ...]:
    """Return notes on pictures and orientations of a file that are left out."""
    notes = []
    if image.format != "MPO" and getattr(image, "is_animated", False):  # n_frames reads them all
        notes.append("its first picture of several is taken")
    turned = image.getexif().get(ORIENTATION, 1) if image.format != "TIFF" else 1
    if turned not in (0, 1):
        notes.append(f"its Exif orientation {turned} {LEFT_OUT}")
    return tuple(notes)


def _colour_notes(image: ImageFile) -> tuple[str, ...]:
    """Return notes on a file's description of its colours that are left out."""
    notes = []
    icc = image.info.get("icc_profile") or b""
    if icc and b"sRGB" not in icc and "sRGB".encode("utf-16-be") not in icc:
        notes.append("its colour profile is left out: its colours are taken as sRGB")
    if image.mode == "CMYK":
        notes.append("its colours are CMYK, made RGB without a profile")
    return tuple(notes)
