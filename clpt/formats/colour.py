"""The spectrum that three numbers stand for, by the role of their parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from clpt.spectra import RGB, RGBIlluminant, RGBUnbounded

COLOURS: dict[str, type[Any]] = {
    "reflectance": RGB,
    "index": RGBUnbounded,
    "factor": RGBUnbounded,
    "coefficient": RGBUnbounded,
    "quantity": RGBUnbounded,
    "emission": RGBIlluminant,
}


def colour(role: str, rgb: Sequence[float]) -> Any:
    """Return linear Rec.709 as the spectrum of a role; its kind checks the limits."""
    return tuple(rgb) if role == "reflectance" else COLOURS[role](*rgb)
