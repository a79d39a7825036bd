"""Image files as (h, w, c) float32 arrays, and back; row 0 is the top.

Values are linear Rec. 709 unless raw ones are asked for. 8-bit files are read through Pillow,
EXR through the OpenEXR package; Radiance HDR and PFM are small enough to stand here.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
import OpenEXR
from numpy.typing import ArrayLike, NDArray

from . import output_files
from .colour import tones
from .colour.view import View
from .errors import SceneError
from .spectra.spaces import between, chromaticities

if TYPE_CHECKING:  # else imported where it is used, for many pictures are EXR only
    from PIL import Image

Array = NDArray[np.float32]
Metadata = Mapping[str, str | int | float | tuple[float, ...]]

LARGEST = 1 << 29  # pixels of an image that is read
_HALF_MAX = 65504.0
_HALF_MIN = 2.0**-14  # from which on it has 11 bits
_PILLOW = (".png", ".jpg", ".jpeg", ".tga", ".bmp", ".webp", ".gif", ".tif", ".tiff")


@dataclass(frozen=True)
class Stored:
    """An image as its file has it: (h, w, c) uint8, or float32 where it has not 8 bits.

    encoded: its colours, but not alpha, went through the sRGB transfer.
    """

    values: NDArray[Any]
    encoded: bool

    def decoded(self, linear: bool = True) -> Array:
        """(h, w, c) float32; linear: with the sRGB transfer taken back, if there is one."""
        curved = self.encoded and linear
        if self.values.dtype != np.uint8:
            return _without_transfer(self.values) if curved else self.values
        scale = np.arange(256, dtype=np.float32) / np.float32(255.0)
        if not curved:
            return scale[self.values]
        made = srgb_to_linear(scale)[self.values]
        if self.values.shape[2] == 4:
            made[..., 3] = scale[self.values[..., 3]]
        return made


def _without_transfer(values: Array) -> Array:
    colours = srgb_to_linear(values[..., :3])
    return np.concatenate([colours, values[..., 3:]], axis=2)


def read(path: str | Path, *, linear: bool = True) -> Array:
    """An image file as (h, w, c) float32, c being 1, 3 or 4 (other counts for layered EXR and npy).

    linear: decode the sRGB transfer of 8-bit and 16-bit files; False gives the stored values in
    [0, 1], as for roughness or normals. Files of floats come as they are either way. Alpha is
    never decoded, nor multiplied in.

    Raises SceneError if there is no such file, its suffix is unknown, or it is not an image.
    """
    return read_stored(path).decoded(linear)


def read_stored(path: str | Path) -> Stored:
    """An image file as it is stored; raises as `read` does."""
    path = check_input(path)
    try:
        made: Any = READERS[path.suffix.lower()](path)
    except SceneError:
        raise
    except Exception as error:  # the libraries raise their own, from struct.error to RuntimeError
        message = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise SceneError(f"not a readable image: {message}", file=path) from error
    image = made if isinstance(made, Stored) else Stored(made, encoded=False)
    if image.values.size == 0:
        _fail(path, "the image has no pixels")
    return image


def write(
    path: str | Path,
    image: ArrayLike,
    *,
    half: bool = True,
    metadata: Metadata | None = None,
    exposure: float = 0.0,
    layers: Mapping[str, ArrayLike] | None = None,
    space: str = "rec709",
    tone: str = "none",
    view: View | None = None,
    prefix: str = "",
) -> None:
    """Write a linear (h, w), (h, w, 1), (h, w, 3) or (h, w, 4) image in the format of the suffix.

    .exr: half, or float where `half` is False or half numbers do not reach the brightest pixel,
    with attributes from `metadata` and further `layers` in float, name -> (h, w) as the channel of
    that name, or (h, w, 3) as its .R, .G, .B; prefix: before R, G and B of the image, such as
    "ViewLayer.Combined.". .png: sRGB transfer, 8 bit, scaled by 2^exposure, with texts from
    `metadata`; NaN is black there, values beyond [0, 1] are clipped. .hdr, .pfm, .npy: as it is.
    space: of the colours, see clpt.spectra.spaces; an .exr states it by its chromaticities, a .png
    is converted to sRGB, white to white. tone: of a .png, see clpt.colour.tones; view: of a .png,
    a `clpt.View` of OpenColorIO, in the place of tone and sRGB transfer.

    Raises SceneError if the suffix, the space or the tone is unknown, the shape does not fit or the
    file cannot be made.
    """
    path = check_output(path)
    pixels = np.asarray(image, np.float32)
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    if pixels.ndim != 3 or pixels.shape[2] not in (1, 3, 4) or pixels.size == 0:
        advice = "(h, w, 1, 3 or 4) is needed; bands are for clpt.write_spectral"
        _fail(path, f"cannot write an image of shape {pixels.shape}; {advice}")
    stated: Metadata = {"chromaticities": chromaticities(space)} if pixels.shape[2] > 1 else {}
    try:
        suffix = path.suffix.lower()
        if suffix == ".exr":
            _write_exr(path, pixels, half, {**stated, **(metadata or {})}, layers or {}, prefix)
        elif suffix == ".png":
            codes = to_codes(to_rec709(pixels, space), exposure, tone, view)
            output_files.write(path, png(codes, metadata))
        elif suffix == ".hdr":
            _write_hdr(path, pixels)
        elif suffix == ".pfm":
            _write_pfm(path, pixels)
        else:
            write_npy(path, pixels)
    except SceneError:
        raise
    except (OSError, RuntimeError, ValueError) as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def write_stored(path: Path, values: NDArray[np.uint8]) -> None:
    """Write (h, w) or (h, w, 1, 3 or 4) as the bytes of a .png."""
    output_files.write(path, png(values))


def write_npy(path: Path, array: NDArray[Any]) -> None:
    """Write an array of any shape as .npy."""
    with output_files.replacing(path) as partial, partial.open("wb") as file:
        np.save(file, array)


def exr_name(path: str | Path) -> str:
    """A path as OpenEXR takes it: bytes of UTF-8, whatever the locale. Raises ValueError."""
    return os.fsencode(path).decode("utf-8")


def write_channels(
    path: Path, metadata: Mapping[str, Any], channels: Mapping[str, NDArray[Any]]
) -> None:
    """Write channels (h, w) by name, and attributes, as an .exr."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with output_files.replacing(path) as partial:
        OpenEXR.File({**metadata, **header}, dict(channels)).write(exr_name(partial))


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


def png_text(path: Path) -> dict[str, str]:
    """The texts of a .png by name."""
    from PIL import Image

    with Image.open(path) as image:
        return {name: str(text) for name, text in getattr(image, "text", {}).items()}


def check_output(path: str | Path) -> Path:
    """The path, if `write` knows its suffix and its folder exists. Raises SceneError otherwise."""
    path = Path(path)
    if path.suffix.lower() not in WRITABLE:
        _fail(path, f"unknown image suffix {path.suffix!r}; can write {', '.join(WRITABLE)}")
    try:
        known = path.absolute().parent.is_dir()
    except FileNotFoundError:  # the current folder is gone
        known = False
    if not known:
        _fail(path, "its folder does not exist")
    return path


def check_input(path: str | Path) -> Path:
    """The path, if `read` knows its suffix and there is such a file. Else raises SceneError."""
    path = Path(path)
    if path.suffix.lower() not in READERS:
        _fail(path, f"unknown image suffix {path.suffix!r}; known: {', '.join(READERS)}")
    if not path.is_file():
        _fail(path, "no such image file")
    return path


def read_layers(path: str | Path) -> dict[str, Array]:
    """Every channel of an EXR file by name, each (h, w) float32. Raises SceneError."""
    return {name: np.asarray(c, np.float32) for name, c in read_channels(path).items()}


def read_channels(path: str | Path) -> dict[str, NDArray[Any]]:
    """Every channel of an EXR file by name, (h, w) float16, float32 or uint32, as it is stored.

    Raises SceneError.
    """
    path = Path(path)
    if not path.is_file():
        _fail(path, "no such image file")
    try:
        check_exr(path)
        with OpenEXR.File(exr_name(path), separate_channels=True) as file:
            channels = file.channels()
            return {name: np.asarray(c.pixels) for name, c in channels.items()}
    except SceneError:
        raise
    except (OSError, RuntimeError, ValueError) as error:
        raise SceneError(f"not a readable image: {error}", file=path) from error


def attributes(path: Path) -> dict[str, Any]:
    """The attributes of an EXR file by name."""
    with OpenEXR.File(exr_name(path), header_only=True) as file:
        return dict(file.header())


def part_names(path: Path) -> list[str]:
    """The names of the parts of an EXR file; their numbers where they have none."""
    with OpenEXR.File(exr_name(path), header_only=True) as file:
        return [part.name() or str(i) for i, part in enumerate(file.parts)]


def check_exr(path: Path) -> None:
    """Raise SceneError for an EXR file of more pixels than are read."""
    low, high = attributes(path)["dataWindow"]
    check_size(path, *(int(last) - int(first) + 1 for first, last in zip(low, high, strict=True)))


def from_pillow(image: Image.Image, *, linear: bool = True) -> Array:
    """A Pillow image as (h, w, 1, 3 or 4) float32; `linear` as in `read`."""
    return stored_from_pillow(image).decoded(linear)


def stored_from_pillow(image: Image.Image) -> Stored:
    """A Pillow image as it is stored, (h, w, 1, 3 or 4)."""
    if image.mode == "F":
        return Stored(np.asarray(image, np.float32)[..., None], encoded=False)
    if image.mode in ("I", "I;16", "I;16B", "I;16L"):
        values = np.asarray(image, np.float32)[..., None] / np.float32(65535.0)
        return Stored(values, encoded=True)
    if image.mode not in ("L", "RGB", "RGBA"):
        transparent = "A" in image.mode or "a" in image.mode or "transparency" in image.info
        image = image.convert("RGBA" if transparent else "L" if image.mode == "1" else "RGB")
    values = np.asarray(image)
    return Stored(values[..., None] if values.ndim == 2 else values, encoded=True)


def srgb_to_linear(x: Array) -> Array:
    """The sRGB transfer decoded (IEC 61966-2-1)."""
    return _srgb_decoded(x).astype(np.float32)


def _srgb_decoded(x: NDArray[Any]) -> NDArray[Any]:
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0) + 0.055) / 1.055) ** 2.4)


@cache
def srgb8_steps() -> Array:
    """The least linear value of each 8-bit sRGB code, then infinity: (257,) float32, rising."""
    exact = _srgb_decoded((np.arange(255) + 0.5) / 255.0)
    steps = exact.astype(np.float32)
    steps = np.where(steps < exact, np.nextafter(steps, np.float32(1.0)), steps)
    return np.concatenate([[-np.inf], steps, [np.inf]]).astype(np.float32)


def linear_to_srgb(x: Array) -> Array:
    """The sRGB transfer applied (IEC 61966-2-1)."""
    power = np.maximum(x, 0.0031308) ** (1 / 2.4)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * power - 0.055).astype(np.float32)


def to_srgb8(image: Array, exposure: float = 0.0) -> NDArray[np.uint8]:
    """Linear (h, w, c) as 8-bit sRGB, scaled by 2^exposure; NaN becomes black, infinity white."""
    finite = np.nan_to_num(image, nan=0.0, posinf=np.inf, neginf=0.0)
    colour, alpha = finite[..., :3], finite[..., 3:]
    shown = np.clip(colour * np.float32(2.0**exposure), 0, 1)
    scaled = linear_to_srgb(shown) * 255
    codes = np.round(scaled)
    close = np.abs(scaled - codes) > 0.499  # where float32 may round to the wrong side
    codes[close] = np.searchsorted(srgb8_steps(), shown[close], side="right") - 1
    stored = np.round(np.clip(alpha, 0, 1) * 255)
    return np.concatenate([codes, stored], axis=2).astype(np.uint8)


def to_codes(
    image: Array, exposure: float = 0.0, tone: str = "none", view: View | None = None
) -> NDArray[np.uint8]:
    """Linear Rec. 709 (h, w, c), scaled by 2^exposure, as 8-bit codes of a display.

    tone: see clpt.colour.tones, then sRGB; view: in the place of both. Raises UnknownKindError.
    """
    if view is None and tone == "none":
        return to_srgb8(image, exposure)
    colour = np.repeat(image, 3, axis=2) if image.shape[2] == 1 else image[..., :3]
    brought = colour * np.float32(2.0**exposure)
    if view is None:
        shown = np.concatenate([tones.apply(brought, tone), image[..., 3:]], axis=2)
        return to_srgb8(shown)
    codes = np.concatenate([view.codes(brought), np.clip(image[..., 3:], 0, 1)], axis=2)
    return np.round(codes * 255).astype(np.uint8)


def straight(image: Array) -> Array:
    """Colours (h, w, 4) over nothing as those of what covers: divided by alpha, as a .png has them.

    Images of other shapes are returned as they are; so are colours where nothing covers.
    """
    if image.shape[2] != 4:
        return image
    alpha = image[..., 3:]
    return np.concatenate([image[..., :3] / np.where(alpha > 0, alpha, 1), alpha], axis=2)


def to_rec709(pixels: Array, space: str) -> Array:
    """Colours (h, w, 3 or 4) of a space in linear Rec. 709, white to white; alpha stays."""
    if space == "rec709" or pixels.shape[2] == 1:
        return pixels
    matrix = between(space, "rec709").astype(np.float32)
    return np.concatenate([pixels[..., :3] @ matrix.T, pixels[..., 3:]], axis=2)


def _fail(path: Path, message: str) -> NoReturn:
    raise SceneError(message, file=path)


def check_size(path: Path, width: int, height: int) -> None:
    """Raise SceneError for an image of more pixels than are read."""
    if width * height > LARGEST:
        _fail(path, f"has {width}x{height} pixels, more than the {LARGEST} that are read")


def _read_pillow(path: Path) -> Stored:
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            check_size(path, image.width, image.height)
            return stored_from_pillow(image)
    except UnidentifiedImageError:
        _fail(path, "not an image")
    except Image.DecompressionBombError:
        most = 2 * (Image.MAX_IMAGE_PIXELS or 0)  # Pillow's rule
        _fail(path, f"has more than the {most} pixels that are read of {path.suffix} images")


def _read_exr(path: Path) -> Array:
    channels = read_layers(path)
    if {"RY", "BY"} & channels.keys():
        _fail(path, "luminance and chroma channels (Y, RY, BY) are not supported; save it as RGB")
    return np.stack([channels[name] for name in _colour_channels(channels)], axis=2)


def _colour_channels(names: Collection[str]) -> list[str]:
    """R, G, B and A if there; else Y; else those of Blender's picture, or of a single layer; else
    all, sorted by name."""
    layers = {name.rpartition(".")[0] for name in names}
    prefixes = ["", *(f"{layer}." for layer in sorted(layers) if layer.endswith("Combined"))]
    prefixes += [f"{layer}." for layer in layers if layer and len(layers) == 1]
    for prefix in prefixes:
        for letters in ("RGBA", "RGB", "Y"):
            if all(prefix + letter in names for letter in letters):
                return [prefix + letter for letter in letters]
    return sorted(names)


def _fits_half(pixels: Array) -> bool:
    """Whether half numbers hold the brightest finite value, at their full precision."""
    largest = float(np.max(np.abs(pixels), initial=0.0, where=np.isfinite(pixels)))
    return largest == 0.0 or _HALF_MIN <= largest <= _HALF_MAX


def _write_exr(
    path: Path,
    pixels: Array,
    half: bool,
    metadata: Metadata,
    layers: Mapping[str, ArrayLike],
    prefix: str,
) -> None:
    channels = {}
    letters_of = {1: "Y", 3: "RGB", 4: "RGBA"}[pixels.shape[2]]
    parts = [("", tuple(prefix + letter for letter in letters_of), pixels)]
    for name, given in layers.items():
        layer = np.asarray(given, np.float32)
        layer = layer[..., None] if layer.ndim == 2 else layer
        if layer.shape[:2] != pixels.shape[:2] or layer.shape[2] not in (1, 3, 4):
            _fail(path, f"layer {name!r} has shape {layer.shape}, the image {pixels.shape}")
        letters = (".R", ".G", ".B", ".A")[: layer.shape[2]] if layer.shape[2] > 1 else ("",)
        parts.append((name, letters, layer))
    for name, letters, layer in parts:
        narrow = half and not name and _fits_half(layer)
        stored = np.clip(layer, -_HALF_MAX, _HALF_MAX).astype(np.float16) if narrow else layer
        for index, letter in enumerate(letters):
            channels[name + letter] = np.ascontiguousarray(stored[..., index])
    write_channels(path, metadata, channels)


def _read_npy(path: Path) -> Array:
    array = np.load(path, "r" if path.stat().st_size > 4096 else None, allow_pickle=False)
    if array.ndim > 1:
        check_size(path, *array.shape[1::-1])
    if array.ndim not in (2, 3) or array.dtype.kind not in "fiu":
        _fail(path, f"not an image: an array of {array.dtype}, shape {array.shape}")
    return np.array(array if array.ndim == 3 else array[..., None], np.float32)


def _read_pfm(path: Path) -> Array:
    data = path.read_bytes()
    header = re.match(rb"(P[Ff])\s+(\d+)\s+(\d+)\s+([-+.\deE]+)\s", data)
    if header is None:
        _fail(path, "not a PFM image: its header is not 'PF' or 'Pf', width, height, scale")
    width, height, scale = int(header[2]), int(header[3]), float(header[4])
    check_size(path, width, height)
    channels = 3 if header[1] == b"PF" else 1
    count = width * height * channels
    if len(data) - header.end() < 4 * count:
        _fail(path, f"the file ends early: {width}x{height} pixels are announced")
    values = np.frombuffer(data, "<f4" if scale < 0 else ">f4", count, header.end())
    return values.reshape(height, width, channels)[::-1].astype(np.float32)


def _write_pfm(path: Path, pixels: Array) -> None:
    pixels = pixels[..., :3]
    kind = "PF" if pixels.shape[2] == 3 else "Pf"
    head = f"{kind}\n{pixels.shape[1]} {pixels.shape[0]}\n-1.0\n"
    output_files.write(path, head.encode() + pixels[::-1].astype("<f4").tobytes())


def _read_hdr(path: Path) -> Array:
    """Radiance RGBE, flat or run-length coded, rows from the top (Ward 1991)."""
    data = path.read_bytes()
    size = re.search(rb"\n\n-Y (\d+) \+X (\d+)\n", data)
    if not data.startswith(b"#?") or size is None:
        _fail(path, "not a Radiance HDR image with rows from the top")
    if b"FORMAT=32-bit_rle_xyze" in data[: size.start()]:
        _fail(path, "XYZE colours are not supported; save it as RGBE")
    height, width = int(size[1]), int(size[2])
    check_size(path, width, height)
    rgbe, at = np.empty((height, width, 4), np.uint8), size.end()
    try:
        for y in range(height):
            at = _hdr_row(data, at, rgbe[y])
    except (IndexError, ValueError) as error:
        raise SceneError(f"the file is broken in row {y} of {height}", file=path) from error
    scale = np.ldexp(np.float32(1), rgbe[..., 3:].astype(np.int32) - 136)
    return np.where(rgbe[..., 3:] > 0, rgbe[..., :3] * scale, 0).astype(np.float32)


def _hdr_row(data: bytes, at: int, row: NDArray[np.uint8]) -> int:
    """Decode one row into `row` (w, 4); where the next one begins."""
    width = len(row)
    if data[at : at + 2] != b"\2\2" or not 8 <= width < 32768 or data[at + 2] > 127:
        row[:] = np.frombuffer(data, np.uint8, 4 * width, at).reshape(width, 4)
        if (row[:, :3] == 1).all(axis=1).any():
            raise ValueError("run-length coding of the first kind")
        return at + 4 * width
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


def _write_hdr(path: Path, pixels: Array) -> None:
    """Radiance RGBE, flat rows: a normalised mantissa cannot look like a run-length code."""
    colour = np.nan_to_num(np.broadcast_to(pixels[..., :3], (*pixels.shape[:2], 3)), posinf=1e38)
    colour = np.clip(colour, 0, 1e38)
    mantissa, exponent = np.frexp(colour.max(axis=2))
    scale = np.where(mantissa > 0, np.ldexp(256.0, -exponent), 0)
    rgbe = np.empty((*pixels.shape[:2], 4), np.uint8)
    rgbe[..., :3] = np.clip(np.round(colour * scale[..., None]), 0, 255)
    rgbe[..., 3] = np.where((mantissa > 0) & (exponent > -128), np.clip(exponent + 128, 0, 255), 0)
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {pixels.shape[0]} +X {pixels.shape[1]}\n"
    output_files.write(path, head.encode() + rgbe.tobytes())


READERS = {
    ".exr": _read_exr,
    ".hdr": _read_hdr,
    ".pic": _read_hdr,
    ".pfm": _read_pfm,
    ".npy": _read_npy,
    **dict.fromkeys(_PILLOW, _read_pillow),
}
WRITABLE = (".exr", ".png", ".hdr", ".pfm", ".npy")
