"""The air as a medium, by height: for mountains far away and views from above."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.scene.lights import Sky
from clpt.scene.media import Grid, Mixture
from clpt.scene.params import params
from clpt.scene.phases import Draine, HenyeyGreenstein, Phase
from clpt.spectra import Tabulated
from clpt.spectra.air import DEPOLARISED, Atmosphere, densities

WAVELENGTHS = np.arange(360.0, 831.0, 10.0)
# 1 + alpha cos^2: what air scatters after Rayleigh, with its depolarisation (Chandrasekhar 1960)
AIR = Draine(g=0.0, alpha=(1.0 - DEPOLARISED) / (1.0 + 3.0 * DEPOLARISED))


def clear_air(
    width: float,
    height: float = 60e3,
    altitude: float = 0.0,
    layers: int = 240,
    *,
    aerosol: float = 0.1,
    exponent: float = 1.3,
    aerosol_albedo: float = 0.95,
    asymmetry: float = 0.76,
    ozone: float = 300.0,
) -> Grid | Mixture:
    """Return the air over a flat ground: a `Mixture` of air, haze and ozone, each by its height.

    width: of the box along x and z, about the origin [m]; height: of the air above the ground,
    which is y = 0 [m]; altitude: of the ground above the sea [m]; layers: between whose ends
    density is linear; all else: as of `clpt.scene.lights.Sky`. Of what there is none is left out:
    without haze and ozone it is a `Grid`. It still needs a shape around it, a cube of `null` to be
    inside of.

    What is in the air: `clpt.spectra.air`. The earth is flat: right for the sun at some 10 degrees
    and above.

    Raises SceneError for a size that is not above 0, and for what no `Sky` may be.
    """
    content = Atmosphere(aerosol, exponent, aerosol_albedo, asymmetry, ozone)
    _check({"width": width, "height": height, "layers": layers}, content)
    step = height / layers
    shares = densities((altitude + step * np.arange(layers + 1)) / 1e3) / 1e3  # in a metre
    most, depths = shares.max(axis=1), content.depths(WAVELENGTHS)
    albedos = 1.0, aerosol_albedo, 0.0
    phases: tuple[Phase, ...] = AIR, HenyeyGreenstein(g=asymmetry), AIR
    names = "air", "haze", "ozone"
    # The first and the last points lie half a step within the box.
    low = tf.translate([-width / 2, -step / 2, -width / 2])
    box = low @ tf.scale([width, height + step, width])
    parts = [
        Grid(
            density=(shares[i] / most[i]).astype(np.float32).reshape(1, -1, 1),
            to_world=box,
            sigma_t=Tabulated(WAVELENGTHS, depths[i] * most[i], "hold"),
            albedo=albedos[i],
            phase=phases[i],
            name=names[i],
        )
        for i in range(3)
        if depths[i].any()
    ]
    return Mixture(parts=tuple(parts), name="air") if len(parts) > 1 else parts[0]


def _check(sizes: Mapping[str, float], content: Atmosphere) -> None:
    """Raise SceneError for sizes that are not above 0, and for what no `Sky` may be."""
    for name, value in sizes.items():
        if not value > 0:
            raise SceneError(f"must be above 0, not {value!r}", where=f"clear_air.{name}")
    for name, value in vars(content).items():
        limits = params(Sky)[name]
        if not limits.low <= value <= limits.high:
            message = f"must be {limits.low:g} to {limits.high:g}, not {value!r}"
            raise SceneError(message, where=f"clear_air.{name}")
