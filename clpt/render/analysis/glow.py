"""Media whose bricks are lights: what a grid emits."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from clpt.render.analysis.bricks import Glow, black_bodies, glow
from clpt.scene.media import Grid, Medium


def glows(emitting: Iterable[Medium], spectral: bool) -> dict[Medium, Glow]:
    """Return the bricks that are lights, of each medium with a density that emits."""
    return {medium: _glow(medium, spectral) for medium in emitting if isinstance(medium, Grid)}


def _glow(medium: Grid, spectral: bool) -> Glow:
    light: Any = medium.light
    absorbs, _ = medium.coefficients(spectral)
    strength, brightness = np.asarray(absorbs.to_rgb("unbounded"), float), None
    if medium.temperature is not None:
        table = black_bodies(medium, light.kelvin)
        brightness = np.stack([table[:, 0], table[:, 1:].mean(axis=1)], axis=1)
    else:
        strength = strength * np.asarray(light.to_rgb("emission"), float)
    return glow(medium, max(float(strength.mean()), 1e-30), brightness).brightest()
