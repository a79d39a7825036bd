"""Clear air as a medium, by height: for mountains far away and views from above."""

from __future__ import annotations

import numpy as np

from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.scene.media import Grid, Rayleigh
from clpt.spectra import Tabulated, air

LAMBDAS = np.arange(360.0, 831.0, 10.0)


def clear_air(width: float, height: float = 60e3, altitude: float = 0.0, layers: int = 120) -> Grid:
    """Return the air over a flat ground, a `Grid` that scatters after Rayleigh.

    width: of the box along x and z, about the origin [m]; height: of the air above the ground,
    which is y = 0 [m]; altitude: of the ground above the sea [m]; layers: of the grid, in between
    which density is linear. It still needs a shape around it, a cube of `null` to be inside of.

    Optical depth: Bodhaine et al. 1999; density: U.S. Standard Atmosphere 1976. There is no haze
    and no ozone, and the earth is flat: right for the sun at some 10 degrees and above.

    Raises SceneError for a size that is not above 0.
    """
    for name, value in (("width", width), ("height", height), ("layers", layers)):
        if not value > 0:
            raise SceneError(f"must be above 0, not {value!r}", where=f"clear_air.{name}")
    heights = (altitude + (np.arange(layers) + 0.5) * height / layers) / 1e3
    density = air.share(heights)
    most = density.max()
    box = tf.translate([-width / 2, 0.0, -width / 2]) @ tf.scale([width, height, width])
    return Grid(
        density=(density / most).astype(np.float32).reshape(1, -1, 1),
        to_world=box,
        sigma_s=Tabulated(LAMBDAS, air.depth(LAMBDAS) * most / 1e3, "hold"),
        phase=Rayleigh(),
        name="air",
    )
