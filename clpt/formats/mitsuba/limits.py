"""Values beyond what a kind accepts, which Mitsuba takes as they are: bent, with a warning."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from clpt.formats.mitsuba.properties import Properties
from clpt.scene.params import params
from clpt.scene.roles import INDEX, ROUNDING, Param
from clpt.spectra import RGB, Constant, RGBIlluminant, RGBUnbounded, Tabulated

COLOURS = (RGB, RGBUnbounded, RGBIlluminant)


def within(cls: type, values: dict[str, Any], props: Properties) -> dict[str, Any]:
    """Return the parameters of a kind within its limits; warn of each that was beyond them.

    A negative eta or k of a conductor counts without its sign, as Fresnel's equations hold only
    its square; an index that must be above 0 is left to its kind; all else is clamped.
    """
    made = dict(values)
    for name, param in params(cls).items():
        limited = np.isfinite([param.low, param.high]).any() and not param.positive
        if name in values and limited:
            made[name] = _bent(values[name], param)
            if made[name] is not values[name]:
                limits = f"{param.low:g} to {param.high:g}"
                meant = "its size counts" if param.role is INDEX else "it is clamped"
                props.context.warn(props.element, f"{name} is outside {limits}; {meant}")
    return made


def _bent(value: object, param: Param) -> Any:
    """The value itself where it lies within the limits, or is of a form that is not looked into."""
    if isinstance(value, (int, float)):
        made = _numbers([value], param)
        return value if made is None else made[0]
    if isinstance(value, tuple):
        made = _numbers(value, param)
        return value if made is None else tuple(made)
    if isinstance(value, Constant):
        made = _numbers([value.value], param)
        return value if made is None else Constant(made[0])
    if isinstance(value, COLOURS):
        made = _numbers([value.r, value.g, value.b], param)
        return value if made is None else type(value)(*made)
    if isinstance(value, Tabulated):
        made = _numbers(value.values, param)
        return value if made is None else replace(value, values=tuple(made))
    return value


def _numbers(values: object, param: Param) -> list[float] | None:
    """The numbers within the limits; None where all of them are."""
    given = np.asarray(values, np.float64)
    if ((given >= param.low - ROUNDING) & (given <= param.high + ROUNDING)).all():
        return None
    made = np.abs(given) if param.role is INDEX else np.clip(given, param.low, param.high)
    return [float(value) for value in made]
