"""What three numbers mean: it depends on the role of the parameter that they stand for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from clpt.errors import SceneError
from clpt.spectra import RGB, RGBIlluminant, RGBUnbounded

COLOURS: dict[str, type[Any]] = {
    "reflectance": RGB,
    "index": RGBUnbounded,
    "factor": RGBUnbounded,
    "coefficient": RGBUnbounded,
    "emission": RGBIlluminant,
}


def colour(role: str, rgb: Sequence[float]) -> Any:
    """Return linear Rec.709 as the spectrum of a role; a reflectance is left for its kind to check.

    Raises SceneError for a negative component.
    """
    if role == "reflectance":
        return tuple(rgb)
    if min(rgb) < 0.0:
        raise SceneError(f"a colour cannot be negative: {', '.join(f'{v:g}' for v in rgb)}")
    return COLOURS[role](*rgb)
