"""The hair material of a Mitsuba scene."""

from __future__ import annotations

from typing import Any

from clpt.formats.mitsuba.properties import Properties
from clpt.formats.mitsuba.spectra import factor, ior, real
from clpt.scene.materials import pigment
from clpt.scene.textures import Product
from clpt.spectra import Constant, RGBUnbounded, Spectrum

PIGMENTS = {"eumelanin": 1.3, "pheomelanin": 0.2}


def hair(props: Properties) -> dict[str, Any]:
    """Take the parameters of `hair`. An index that disperses is taken at 589.3 nm."""
    inside, outside = ior(props, "int_ior", "amber"), ior(props, "ext_ior", "air")
    return {
        "sigma_a": _absorption(props),
        "longitudinal_roughness": real(props, "longitudinal_roughness", 0.3),
        "azimuthal_roughness": real(props, "azimuthal_roughness", 0.3),
        "scale_tilt": props.number("scale_tilt", 2.0),
        "eta": at_yellow(inside) / at_yellow(outside),
    }


def at_yellow(index: Any) -> float:
    return float(index.sample(589.3)) if isinstance(index, Spectrum) else float(index)


def _absorption(props: Properties) -> Any:
    """Take the coefficient and its scale, or the pigments' concentrations."""
    scale = props.number("scale", 1.0)
    if "sigma_a" not in props.named:
        return pigment(*(props.number(name, value) for name, value in PIGMENTS.items()))
    if any(name in props.named for name in PIGMENTS):
        raise props.element.error("give either 'sigma_a' or pigments, not both")
    value = factor(props, "sigma_a", 0.0)
    if isinstance(value, (int, float)):
        return scale * value
    if isinstance(value, Constant):
        return scale * value.value
    if isinstance(value, RGBUnbounded):
        return RGBUnbounded(*(scale * c for c in (value.r, value.g, value.b)))
    return value if scale == 1.0 else Product(first=value, second=scale)
