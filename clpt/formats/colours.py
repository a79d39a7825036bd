"""Colours of files: spectra of three numbers, and grey for missing images."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from clpt.scene.roles import REFLECTANCE, Spectral

GREY = np.full((1, 1, 3), 0.5, np.float32)
EVEN = np.array([[[0.5, 0.5, 1.0]]], np.float32)  # a normal map that bends nothing
GREY.flags.writeable = EVEN.flags.writeable = False


def grey_for(name: object) -> str:
    """Return the warning of an image that GREY or EVEN replaces."""
    return f"there is no file {str(name)!r}; grey stands for it"


def colour(role: Spectral, rgb: Sequence[float]) -> Any:
    """Return linear Rec.709 as the spectrum of a role; its kind checks the limits."""
    if role is REFLECTANCE or role.colour is None:
        return tuple(rgb)
    return role.colour(*rgb)
