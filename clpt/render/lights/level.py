"""Estimate of a scene's brightness: it tells the film which numbers to expect."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.render.lights.bounds import concatenated
from clpt.render.lights.encode import LightRows
from clpt.render.lights.power import brightness
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.look import Look


def light_level(
    index: SceneIndex, lights: LightRows, sphere: tuple[NDArray[np.float64], float]
) -> float:
    """Estimate the largest radiance of what the camera may see [W m^-2 sr^-1 nm^-1].

    It is that of shapes and media that emit, or what all lights send evenly to the scene, the
    larger one. sphere: centre and radius of one around the scene [m]. 0 where nothing emits, or
    nothing whose values the host knows.
    """
    centre, radius = sphere
    arrives = 0.0
    if lights.bounds:
        bounds = concatenated(list(lights.bounds))
        away = np.square((bounds.low + bounds.high) / 2.0 - centre).sum(axis=1)
        square = np.where(bounds.placed, np.maximum(away, radius**2), radius**2)
        arrives = float((lights.power / (4.0 * np.pi * square)).sum())
    look = Look.of(index.film)
    glow = [brightness(one.light, look) * radius for one in index.emitting if one.light is not None]
    ambient = index.integrator.ambient
    around = 0.0 if ambient is None else brightness(ambient, look)
    return max(lights.radiance, arrives, around, *glow)
