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
    result = dict(values)
    for name, param in params(cls).items():
        limited = np.isfinite([param.low, param.high]).any() and not param.positive
        if name in values and limited:
            result[name] = _bent(values[name], param)
            if result[name] is not values[name]:
                limits = f"{param.low:g} to {param.high:g}"
                meant = "its size counts" if param.role is INDEX else "it is clamped"
                props.context.warn(props.element, f"{name} is outside {limits}; {meant}")
    return result


def _bent(value: object, param: Param) -> Any:
    """The value itself where it lies within the limits, or is of a form that is not looked into."""
    if isinstance(value, (int, float)):
        result = _numbers([value], param)
        return value if result is None else result[0]
    if isinstance(value, tuple):
        result = _numbers(value, param)
        return value if result is None else tuple(result)
    if isinstance(value, Constant):
        result = _numbers([value.value], param)
        return value if result is None else Constant(result[0])
    if isinstance(value, COLOURS):
        result = _numbers([value.r, value.g, value.b], param)
        return value if result is None else type(value)(*result)
    if isinstance(value, Tabulated):
        result = _numbers(value.values, param)
        return value if result is None else replace(value, values=tuple(result))
    return value


def _numbers(values: object, param: Param) -> list[float] | None:
    """The numbers within the limits; None where all of them are."""
    entries = np.asarray(values, np.float64)
    if ((entries >= param.low - ROUNDING) & (entries <= param.high + ROUNDING)).all():
        return None
    result = np.abs(entries) if param.role is INDEX else np.clip(entries, param.low, param.high)
    return [float(value) for value in result]
