"""Between linear values and the codes of displays: sRGB, tone curves, views; white to white."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats32
from clpt.errors import SceneError
from clpt.images.colour import View, apply_tone
from clpt.spectra.spaces import between

HEX = r"#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})"


def srgb_to_linear(x: Floats32) -> Floats32:
    """The sRGB transfer decoded (IEC 61966-2-1)."""
    return decoded(x).astype(np.float32)


def decoded(x: NDArray[Any], gamma: float | None = None) -> NDArray[Any]:
    """Return light of values that are light to the power of `gamma`; None: of the sRGB transfer."""
    if gamma is not None:
        return np.maximum(x, x.dtype.type(0.0)) ** x.dtype.type(1.0 / gamma)
    return np.where(x <= 0.04045, x / 12.92, ((np.maximum(x, 0) + 0.055) / 1.055) ** 2.4)


@cache
def srgb8_steps() -> Floats32:
    """The least linear value of each 8-bit sRGB code, then infinity: (257,) float32, rising."""
    exact = decoded((np.arange(255) + 0.5) / 255.0)
    steps = exact.astype(np.float32)
    steps = np.where(steps < exact, np.nextafter(steps, np.float32(1.0)), steps)
    return np.concatenate([[-np.inf], steps, [np.inf]]).astype(np.float32)


def from_hex(text: str) -> tuple[float, float, float]:
    """Return #rrggbb, sRGB as colour pickers have it, as linear Rec. 709. Raises SceneError."""
    match = re.fullmatch(HEX, text)
    if match is None:
        raise SceneError(f'{text!r} is no colour such as "#aa2020"')
    codes = np.array([int(code, 16) for code in match.groups()], np.float32)
    red, green, blue = srgb_to_linear(codes / np.float32(255.0)).tolist()
    return red, green, blue


def linear_to_srgb(x: Floats32) -> Floats32:
    """The sRGB transfer applied (IEC 61966-2-1)."""
    power = np.maximum(x, 0.0031308) ** (1 / 2.4)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * power - 0.055).astype(np.float32)


def to_srgb8(image: Floats32, exposure: float = 0.0) -> NDArray[np.uint8]:
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
    image: Floats32, exposure: float = 0.0, tone: str = "none", view: View | None = None
) -> NDArray[np.uint8]:
    """Linear Rec. 709 (h, w, c), scaled by 2^exposure, as 8-bit codes of a display.

    tone: see clpt.images.colour, then sRGB; view: in the place of both. Raises
    UnknownKindError.
    """
    if view is None and tone == "none":
        return to_srgb8(image, exposure)
    colour = np.repeat(image, 3, axis=2) if image.shape[2] == 1 else image[..., :3]
    brought = colour * np.float32(2.0**exposure)
    if view is None:
        shown = np.concatenate([apply_tone(brought, tone), image[..., 3:]], axis=2)
        return to_srgb8(shown)
    codes = np.concatenate([view.codes(brought), np.clip(image[..., 3:], 0, 1)], axis=2)
    return np.round(codes * 255).astype(np.uint8)


def straight(image: Floats32) -> Floats32:
    """Return premultiplied colours (h, w, 4) divided by alpha, as a .png has them.

    Images of other shapes are returned as they are; so are colours where alpha is 0.
    """
    if image.shape[2] != 4:
        return image
    alpha = image[..., 3:]
    return np.concatenate([image[..., :3] / np.where(alpha > 0, alpha, 1), alpha], axis=2)


def multiplied(image: Floats32) -> Floats32:
    """Return colours (h, w, 4) multiplied by alpha: the inverse of `straight`."""
    if image.shape[2] != 4:
        return image
    return np.concatenate([image[..., :3] * image[..., 3:], image[..., 3:]], axis=2)


def to_rec709(pixels: Floats32, space: str) -> Floats32:
    """Colours (h, w, 3 or 4) of a space in linear Rec. 709, white to white; alpha stays."""
    if space == "rec709" or pixels.shape[2] == 1:
        return pixels
    matrix = between(space, "rec709").astype(np.float32)
    return np.concatenate([pixels[..., :3] @ matrix.T, pixels[..., 3:]], axis=2)
