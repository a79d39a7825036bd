"""The spectrum that three numbers stand for, by the role of their parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from clpt.scene.roles import REFLECTANCE, Spectral


def colour(role: Spectral, rgb: Sequence[float]) -> Any:
    """Return linear Rec.709 as the spectrum of a role; its kind checks the limits."""
    if role is REFLECTANCE or role.colour is None:
        return tuple(rgb)
    return role.colour(*rgb)
