"""Colours of screens: transfer curves, tone curves, false colours, views of OpenColorIO.

A tone curve takes linear Rec. 709 of any brightness to linear values of a screen, where white is 1.
The device has the same curves, in kernels/film/tone.cl, in the order of their names in TONES.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Bytes, Floats32
from clpt.choices import OCIO_CONFIG
from clpt.errors import SceneError, UnknownKindError
from clpt.files import input_files
from clpt.spectra.spaces import between

LARGEST = np.float32(1e18)  # its square is finite
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of Rec. 709

# AgX (Sobotka 2022, "AgX"): a log of base 2 about middle grey from 10 stops below to 6.5 above, of
# colours drawn towards white, then a sigmoid with slope 2 at grey, powers 3 below and 3.25 above,
# whose result is encoded by a power of 2.2.
AGX_STOPS = (-10.0, 6.5)
AGX_GREY = 0.18
AGX_KEPT = 0.8  # of a colour; the rest becomes grey by these weights
AGX_WEIGHTS = np.array([0.0424010709504685, 0.0784365015618028, 0.0791624274877287])
AGX_SLOPE, AGX_POWERS = 2.0, (3.0, 3.25)  # below and above grey
AGX_GAMMA = 2.2

# PBR Neutral (Khronos 2024): colours up to START stay, less what a smooth surface reflects.
NEUTRAL_F90, NEUTRAL_START, NEUTRAL_DESATURATION = 0.04, 0.8 - 0.04, 0.15
# From few to many: of matplotlib's "inferno", which is as even in grey.
SCALE: Final = (
    "#000004", "#1b0c41", "#4a0c6b", "#781c6d", "#a52c60", "#cf4446", "#ed6925", "#fb9b06",
    "#f7d13d", "#fcffa4",
)  # fmt: skip
REC709 = "Linear Rec.709 (sRGB)"  # of OpenColorIO's own config

# A table's axes: more points about black than among highlights. What is outside is clamped.
TABLE_SIZE = 97
LOWEST, HIGHEST, NEAR = -0.5, 128.0, 0.012


def none(c: Floats32) -> Floats32:
    """The light as it is."""
    return c


def reinhard(c: Floats32) -> Floats32:
    """Reinhard et al. 2002, "Photographic Tone Reproduction", eq. 3, of the luminance."""
    return c / (1 + c @ LUMINANCE)[..., None]


def aces(c: Floats32) -> Floats32:
    """The rational fit to the curve of ACES by Narkowicz 2015."""
    return np.clip(c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14), 0, 1)


def agx(c: Floats32) -> Floats32:
    """AgX (Sobotka 2022) with its first, base look; saturated light turns white as film does."""
    low, high = AGX_STOPS
    inset = AGX_KEPT * c + (c @ AGX_WEIGHTS)[..., None]
    stops = np.log2(np.maximum(inset, 1e-10) / AGX_GREY)
    x = np.clip((stops - low) / (high - low), 0, 1)
    pivot = -low / (high - low)
    below, above = agx_scales()
    away = np.abs(x - pivot)
    bend = np.where(x < pivot, (1 + below * away**AGX_POWERS[0]) ** (-1 / AGX_POWERS[0]),
                    (1 + above * away**AGX_POWERS[1]) ** (-1 / AGX_POWERS[1]))  # fmt: skip
    curved = 0.5 + AGX_SLOPE * (x - pivot) * bend
    outset = (curved - (curved @ AGX_WEIGHTS)[..., None]) / AGX_KEPT
    return np.clip(outset, 0, 1) ** AGX_GAMMA


def agx_scales() -> tuple[float, float]:
    """Return the scales of AgX's sigmoid below and above grey, such that it ends at 0 and at 1."""
    low, high = AGX_STOPS
    pivot = -low / (high - low)
    ends = ((pivot, AGX_POWERS[0]), (1 - pivot, AGX_POWERS[1]))
    below, above = (((AGX_SLOPE * d / 0.5) ** p - 1) / d**p for d, p in ends)
    return below, above


def neutral(c: Floats32) -> Floats32:
    """Khronos PBR Neutral (2024): base colours under white light are shown as they are."""
    least = c.min(axis=-1, keepdims=True)
    f90 = NEUTRAL_F90
    c = c - np.where(least < 2 * f90, least - least**2 / (4 * f90), f90)
    peak = c.max(axis=-1, keepdims=True)
    d = 1 - NEUTRAL_START
    new = 1 - d * d / (np.maximum(peak, NEUTRAL_START) + d - NEUTRAL_START)
    white = 1 - 1 / (NEUTRAL_DESATURATION * (peak - new) + 1)
    pressed = c * (new / np.maximum(peak, NEUTRAL_START))
    return np.where(peak < NEUTRAL_START, c, pressed + (new - pressed) * white)


TONES: dict[str, Callable[[Floats32], Floats32]] = {
    "none": none, "reinhard": reinhard, "aces": aces, "agx": agx, "neutral": neutral,
}  # fmt: skip


def check_tone(tone: str) -> None:
    """Raise UnknownKindError for a name that no curve has."""
    if tone not in TONES:
        raise UnknownKindError("tone curve", tone, TONES)


def apply_tone(colours: Floats32, tone: str) -> Floats32:
    """Return colours (..., 3) float32 of linear Rec. 709 under a curve, linear, white is 1.

    Without a curve they stay as they are; else what is negative or no number is black. Raises
    UnknownKindError.
    """
    check_tone(tone)
    if tone == "none":
        return colours
    c = np.clip(np.nan_to_num(colours, nan=0.0, posinf=np.inf), 0, LARGEST)
    return TONES[tone](c).astype(np.float32)


def false_colours(share: NDArray[Any]) -> Bytes:
    """Return numbers (h, w) from 0 to 1 as colours of the scale, (h, w, 3) uint8."""
    table = np.array([[int(code[i : i + 2], 16) for i in (1, 3, 5)] for code in SCALE], float)
    at = np.linspace(0.0, 1.0, len(table))
    fine = np.linspace(0.0, 1.0, 256)
    steps = np.stack([np.interp(fine, at, column) for column in table.T], axis=1)
    index = np.clip(np.rint(255.0 * share), 0, 255).astype(np.uint8)
    return np.rint(steps).astype(np.uint8)[index]


@dataclass(frozen=True, eq=False)
class Table:
    """Codes of colours over a cube, for kernels/film/tone.cl.

    values: (n, n, n, 4) float32, by blue, green and red, the last is 0; bounds: asinh(v / NEAR) at
    the ends of an axis, NEAR, and 0.
    """

    values: Floats32
    bounds: tuple[float, float, float, float]


class View:
    """A view of OpenColorIO: the transform from light to the values of a display.

    name: of the view; display, look: by default the config's first display and no look; config: a
    file, or a name such as ocio://default, or "$OCIO" for the file that the environment names.

    OpenColorIO (`pip install 'clpt[colour]'`) makes the pictures of files. A device gets a table of
    its result, see `table`.

    Raises SceneError where OpenColorIO is not installed or refuses the config, UnknownKindError for
    names that the config does not have.
    """

    def __init__(
        self,
        name: str | None = None,
        *,
        display: str | None = None,
        look: str | None = None,
        config: str = OCIO_CONFIG,
    ):
        ocio = _opencolorio()
        self.config = os.environ.get("OCIO", "") if config == "$OCIO" else config
        if not self.config:
            raise SceneError("the environment has no OCIO that names a config", where="config")
        loaded = _loaded(ocio, self.config)
        self.display = display or loaded.getDefaultDisplay()
        if self.display not in [*loaded.getDisplays()]:
            raise UnknownKindError("display", self.display, loaded.getDisplays())
        self.name = name or loaded.getDefaultView(self.display)
        views = [*loaded.getViews(self.display)]
        if self.name not in views:
            raise UnknownKindError(f"view of {self.display!r}", self.name, views)
        self.look = look
        if look is not None and look not in [*loaded.getLookNames()]:
            raise UnknownKindError("look", look, loaded.getLookNames())
        self._processors = _processors(ocio, loaded, self)

    def __repr__(self) -> str:
        look = "" if self.look is None else f", look={self.look!r}"
        return f"View({self.name!r}, display={self.display!r}{look}, config={self.config!r})"

    def codes(self, colours: Floats32) -> Floats32:
        """Return the codes (..., 3) float32 that a display gets for linear Rec. 709 (..., 3).

        What is no number is black. 0 and 1 are the least and the largest code.
        """
        known = np.nan_to_num(colours, nan=0.0, posinf=HIGHEST, neginf=0.0)
        return np.clip(self._unclipped(known.astype(np.float32)), 0.0, 1.0)

    def _unclipped(self, colours: Floats32) -> Floats32:
        codes = colours.copy()
        for processor in self._processors:
            processor.applyRGB(codes.reshape(-1))
        return codes

    def table(self, size: int = TABLE_SIZE) -> Table:
        """Return the codes as a table, fitted to interpolation over tetrahedra."""
        low, high = np.arcsinh(LOWEST / NEAR), np.arcsinh(HIGHEST / NEAR)
        axis = (NEAR * np.sinh(np.linspace(low, high, size))).astype(np.float32)
        values = np.zeros((size, size, size, 4), np.float32)
        blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
        values[..., :3] = self._unclipped(np.stack([red, green, blue], axis=-1))
        return Table(values, (float(low), float(high), NEAR, 0.0))


def views(config: str = OCIO_CONFIG) -> dict[str, tuple[str, ...]]:
    """Return the views of a config by display. Raises SceneError."""
    loaded = _loaded(_opencolorio(), config)
    return {display: tuple(loaded.getViews(display)) for display in loaded.getDisplays()}


def _opencolorio() -> Any:
    """The package. Raises SceneError where it is not installed."""
    try:
        import PyOpenColorIO
    except ImportError as error:
        advice = "a view needs OpenColorIO: pip install 'clpt[colour]'; tone curves do not"
        raise SceneError(advice, where="view") from error
    return PyOpenColorIO


def _loaded(ocio: Any, config: str) -> Any:
    """A config. Raises SceneError."""
    if os.path.exists(config):  # else it is a name of the library's own
        input_files.regular(Path(config))
    try:
        return ocio.Config.CreateFromFile(config)
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        first = str(error).strip().splitlines()[0]
        raise SceneError(f"OpenColorIO cannot read it: {first}", file=config) from error


def _processors(ocio: Any, config: Any, view: View) -> list[Any]:
    """From linear Rec. 709 to the config's light, and from that to codes. Raises SceneError."""
    light = config.getRoleColorSpace(ocio.ROLE_SCENE_LINEAR)
    shown = ocio.DisplayViewTransform(src=light, display=view.display, view=view.name)
    both = ocio.GroupTransform()
    if view.look is not None:
        both.appendTransform(ocio.LookTransform(src=light, dst=light, looks=view.look))
    both.appendTransform(shown)
    try:
        processors = [
            ocio.Config.GetProcessorFromBuiltinColorSpace(REC709, config, light),
            config.getProcessor(both),
        ]
        return [
            processor.getDefaultCPUProcessor() for processor in processors if not processor.isNoOp()
        ]
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        first = str(error).strip().splitlines()[0]
        raise SceneError(f"OpenColorIO refuses the view: {first}", file=view.config) from error


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
