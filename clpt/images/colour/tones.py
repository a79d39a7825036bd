"""Tone curves: linear Rec. 709 of any brightness to what a screen shows, linear, white is 1.

The device has the same curves, in kernels/film/tone.cl, by the places of their names in TONES.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from clpt.arrays import Floats32
from clpt.errors import UnknownKindError

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
    """Return the scales of AgX's sigmoid below and above grey with which it ends at 0 and at 1."""
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


def apply(colours: Floats32, tone: str) -> Floats32:
    """Return colours (..., 3) float32 of linear Rec. 709 under a curve, linear, white is 1.

    Without a curve they stay as they are; else what is negative or no number is black. Raises
    UnknownKindError.
    """
    check_tone(tone)
    if tone == "none":
        return colours
    c = np.clip(np.nan_to_num(colours, nan=0.0, posinf=np.inf), 0, LARGEST)
    return TONES[tone](c).astype(np.float32)
