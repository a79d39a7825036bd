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
    which is y = 0 [m]; altitude: of the ground above the sea [m]; layers: their number; the density
    is linear within a layer; the other arguments are parameters of `clpt.scene.lights.Sky`. An
    absent constituent has no part in the mixture: without haze and ozone the result is a `Grid`.
    The caller puts it into a shape, such as a cube of `null`.

    `clpt.spectra.air` has the constituents of air. The earth is flat: this holds while the sun is
    10 degrees or more above the horizon.

    Raises SceneError for a size that is not above 0, and for a value that `Sky` refuses.
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
    """Raise SceneError for sizes that are not above 0, and for values that `Sky` refuses."""
    for name, value in sizes.items():
        if not value > 0:
            raise SceneError(f"must be above 0, not {value!r}", where=f"clear_air.{name}")
    for name, value in vars(content).items():
        limits = params(Sky)[name]
        if not limits.low <= value <= limits.high:
            message = f"must be {limits.low:g} to {limits.high:g}, not {value!r}"
            raise SceneError(message, where=f"clear_air.{name}")
