"""Pictures into files, by their suffix; each says what its numbers mean, or has one meaning."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import output_files
from clpt.arrays import Floats32
from clpt.choices import FOR_SCREENS, WRITABLE, Exposure
from clpt.colour.view import View
from clpt.errors import SceneError
from clpt.images import exr, hdr, npy, pfm, screen_files
from clpt.images.brightness import stops
from clpt.images.png_files import Metadata, png
from clpt.images.transfer import to_codes, to_rec709
from clpt.spectra.spaces import chromaticities

WITH_ALPHA = (".png", ".webp")  # of FOR_SCREENS


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
    """Write a linear (h, w), (h, w, 1), (h, w, 3) or (h, w, 4) image; the suffix says how.

    path: of the file, with the suffix of its format.
    .exr: half, or float where `half` is False or half numbers do not reach the brightest pixel,
    with attributes from `metadata` and further `layers` in float, name -> (h, w) as the channel of
    that name, or (h, w, 3) as its .R, .G, .B; prefix: before R, G and B of the image, such as
    "ViewLayer.Combined.". .png, .jpg, .webp: sRGB transfer, 8 bit, scaled by 2^exposure, with texts
    from `metadata`; NaN is black there, values beyond [0, 1] are clipped. exposure: "auto" is that
    of `clpt.images.auto_exposure`. .hdr, .pfm, .npy: as it is.
    space: of the colours, see clpt.spectra.spaces; an .exr states it by its chromaticities, an .hdr
    by its primaries. Files for screens are converted to sRGB and a .pfm to Rec. 709, white to
    white, which is what they mean; an .npy is not converted.
    tone: of files for screens, see clpt.colour.tones; view: of them, a `clpt.View` of OpenColorIO,
    in the place of tone and sRGB transfer.

    Raises SceneError if the suffix, the space or the tone is unknown, the shape does not fit or the
    file cannot be made.
    """
    path = check_output(path)
    pixels = np.asarray(image, np.float32)
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    if pixels.ndim != 3 or pixels.shape[2] not in (1, 3, 4) or pixels.size == 0:
        advice = "(h, w, 1, 3 or 4) is needed; bands are for clpt.write_spectral"
        message = f"cannot write an image of shape {pixels.shape}; {advice}"
        raise SceneError(message, file=path)
    stated: Metadata = {"chromaticities": chromaticities(space)} if pixels.shape[2] > 1 else {}
    try:
        suffix = path.suffix.lower()
        if suffix == ".exr":
            said = {**stated, **(metadata or {})}
            exr.write(path, pixels, half, said, layers or {}, prefix)
        elif suffix in FOR_SCREENS:
            _write_for_screens(path, to_rec709(pixels, space), exposure, tone, view, metadata)
        elif suffix == ".hdr":
            hdr.write(path, pixels, space)
        elif suffix == ".pfm":
            pfm.write(path, to_rec709(pixels, space))
        else:
            npy.write(path, pixels)
    except SceneError:
        raise
    except (OSError, RuntimeError, ValueError) as error:
        raise SceneError(f"cannot be written: {error}", file=path) from error


def _write_for_screens(
    path: Path,
    pixels: Floats32,
    exposure: Exposure,
    tone: str,
    view: View | None,
    metadata: Metadata | None,
) -> None:
    """Write linear Rec. 709 as codes of a screen. Raises as `write`."""
    suffix = path.suffix.lower()
    if pixels.shape[2] == 4 and suffix not in WITH_ALPHA:
        pixels = pixels[..., :3] * pixels[..., 3:]
    codes = to_codes(pixels, stops(exposure, pixels), tone, view)
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
