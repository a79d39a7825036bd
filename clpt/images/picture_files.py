"""Files of pictures by their suffix: the way in and the way out."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats32
from clpt.choices import FOR_SCREENS, WRITABLE, Exposure
from clpt.errors import SceneError
from clpt.files import budget, output_files
from clpt.images import exr, float_files, pillow, screen_files
from clpt.images.checks import check_there, reading
from clpt.images.colour import View, multiplied, straight, to_codes, to_rec709
from clpt.images.measures import stops
from clpt.images.screen_files import Metadata, png
from clpt.images.stored import Stored, from_array
from clpt.spectra.spaces import chromaticities

log = logging.getLogger("clpt.images")
READERS: dict[str, Callable[[Path], Stored]] = {
    ".exr": exr.read,
    ".hdr": float_files.read_hdr,
    ".pic": float_files.read_hdr,
    ".pfm": float_files.read_pfm,
    ".npy": float_files.read_npy,
    **dict.fromkeys(pillow.SUFFIXES, pillow.read),
}
STRAIGHT = pillow.SUFFIXES  # of files whose colours are not multiplied by alpha
WITH_ALPHA = (".png", ".webp")  # of FOR_SCREENS


def read(path: str | Path, *, linear: bool = True) -> Floats32:
    """Return an image file as (h, w, c) float32, row 0 at the top; c is 1, 3 or 4.

    Other counts are possible for EXR files without colours, and .npy.

    path: of the file. linear: colours, as linear Rec. 709. False: data, such as roughness or
    normals: the numbers as they are stored, those of 8 and 16 bits in [0, 1]. Alpha is never
    decoded; colours of .exr are multiplied by it, those of other files are not, and they stay so.
    What the file says and is left out is a warning in the log. docs/images.md has the table.

    Raises SceneError if there is no such file, its suffix is unknown, it is not an image, or too
    large.
    """
    image = read_stored(path)
    log_notes(path, image, raw=not linear)
    return image.decoded(linear)


def log_notes(path: str | Path, image: Stored, *, raw: bool) -> None:
    """Warn in the log of statements of an image's file that are left out."""
    for note in image.notes_of(raw):
        log.warning("%s: %s", path, note)


def read_stored(path: str | Path) -> Stored:
    """Return an image file as it is stored; whoever asks tells its notes. Raises as `read`."""
    path = check_input(path)
    with reading(path):
        image = READERS[path.suffix.lower()](path)
    if image.values.size == 0:
        raise SceneError("the image has no pixels", file=path)
    budget.take_image(image.values.nbytes, "its pixels", path)
    return image


def check_input(path: str | Path) -> Path:
    """Return the path, if `read` knows its suffix and there is such a file. Else SceneError."""
    path = Path(path)
    if path.suffix.lower() not in READERS:
        message = f"unknown image suffix {path.suffix!r}; known: {', '.join(READERS)}"
        raise SceneError(message, file=path)
    check_there(path)
    return path


def write(
    path: str | Path,
    image: ArrayLike,
    *,
    half: bool = True,
    metadata: Metadata | None = None,
    exposure: Exposure = 0.0,
    layers: Mapping[str, ArrayLike] | None = None,
    space: str = "rec709",
    tone: str = "none",
    view: View | None = None,
    prefix: str = "",
) -> None:
    """Write an image (h, w), (h, w, 1), (h, w, 3) or (h, w, 4); the suffix says how.

    path: of the file, with the suffix of its format. image: linear floats, colours multiplied by
    alpha, as `Renderer.image` has them; or bytes as of `Renderer.resolve` or a .png: sRGB, not
    multiplied. In a .png and a .webp colours are divided by alpha; a .jpg, an .hdr and a .pfm have
    no alpha, and are black there.
    .exr: half, or float where `half` is False or half numbers do not reach the brightest pixel,
    with attributes from `metadata` and further `layers` in float, name -> (h, w) as the channel of
    that name, or (h, w, 3) as its .R, .G, .B; prefix: before R, G and B of the image, such as
    "ViewLayer.Combined.". .png, .jpg, .webp: sRGB transfer, 8 bit, scaled by 2^exposure, with texts
    from `metadata`; NaN is black there, values beyond [0, 1] are clipped. exposure: "auto" is that
    of `clpt.images.auto_exposure`. .hdr, .pfm, .npy: as it is.
    space: of the colours, see clpt.spectra.spaces; an .exr states it by its chromaticities, an .hdr
    by its primaries. Files for screens are converted to sRGB and a .pfm to Rec. 709, white to
    white, which is what they mean; an .npy is not converted.
    tone: of files for screens, see clpt.images.colour; view: of them, a `clpt.View` of
    OpenColorIO, in the place of tone and sRGB transfer.

    Raises SceneError if the suffix, the space or the tone is unknown, the shape does not fit or the
    file cannot be made.
    """
    path = check_output(path)
    pixels = _pixels(path, image)
    stated: Metadata = {"chromaticities": chromaticities(space)} if pixels.shape[2] > 1 else {}
    try:
        suffix = path.suffix.lower()
        if suffix == ".exr":
            said = {**stated, **(metadata or {})}
            exr.write(path, pixels, half, said, layers or {}, prefix)
        elif suffix in FOR_SCREENS:
            _write_for_screens(path, to_rec709(pixels, space), exposure, tone, view, metadata)
        elif suffix == ".hdr":
            float_files.write_hdr(path, pixels, space)
        elif suffix == ".pfm":
            float_files.write_pfm(path, to_rec709(pixels, space))
        else:
            float_files.write_npy(path, pixels)
    except SceneError:
        raise
    except (OSError, RuntimeError, ValueError) as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def _pixels(path: Path, image: ArrayLike) -> Floats32:
    """Return an image as linear floats (h, w, 1, 3 or 4), colours multiplied by alpha."""
    try:
        stored = from_array(image)
    except SceneError as error:
        bands = "; bands are for clpt.write_spectral" if np.ndim(image) == 3 else ""
        raise SceneError(f"image: {error.message}{bands}", file=path) from None
    return multiplied(stored.decoded()) if stored.encoded else stored.decoded()


def _write_for_screens(
    path: Path,
    pixels: Floats32,
    exposure: Exposure,
    tone: str,
    view: View | None,
    metadata: Metadata | None,
) -> None:
    """Write linear Rec. 709, multiplied by alpha, as codes of a screen. Raises as `write`."""
    suffix = path.suffix.lower()
    covering = straight(pixels)
    shown = covering if suffix in WITH_ALPHA else pixels[..., :3]
    codes = to_codes(shown, stops(exposure, covering), tone, view)
    output_files.write(path, screen_files.encode(suffix, codes, metadata))


def write_stored(path: Path, values: NDArray[np.uint8]) -> None:
    """Write (h, w) or (h, w, 1, 3 or 4) as the bytes of a .png."""
    output_files.write(path, png(values))


def check_output(path: str | Path) -> Path:
    """The path, if `write` knows its suffix and its folder exists. Raises SceneError otherwise."""
    path = Path(path)
    if path.suffix.lower() not in WRITABLE:
        message = f"unknown image suffix {path.suffix!r}; can write {', '.join(WRITABLE)}"
        raise SceneError(message, file=path)
    try:
        known = path.absolute().parent.is_dir()
    except FileNotFoundError:  # the current folder is gone
        known = False
    if not known:
        raise SceneError("its folder does not exist", file=path)
    return path
