"""The principled materials of a Mitsuba scene."""

from __future__ import annotations

import math
from typing import Any

from clpt.formats.mitsuba.properties import Properties
from clpt.formats.mitsuba.spectra import index, real, reflectance

LEAST_SPECULAR, LEAST_ETA = 1e-3, 1.001  # Mitsuba's, of what transmits light
MOST_SPECULAR = 12.5  # where the index that it stands for is infinite
SHARED = (
    "anisotropic", "spec_trans", "spec_tint", "sheen", "sheen_tint", "flatness",
)  # fmt: skip
SAMPLING = "sampling_rate"  # such parameters change how lobes are chosen, but no picture


def principled(props: Properties) -> dict[str, Any]:
    """Take the parameters of `principled`."""
    values = _shared(props)
    for name in ("metallic", "clearcoat", "clearcoat_gloss"):
        values[name] = real(props, name, 0.0)
    return {**values, "eta": _eta(props, transmits=values["spec_trans"] != 0.0)}


def principled_thin(props: Properties) -> dict[str, Any]:
    """Take the parameters of `principledthin`."""
    values = _shared(props)
    return {**values, "diff_trans": real(props, "diff_trans", 0.0), "eta": index(props, "eta", 1.5)}


def _shared(props: Properties) -> dict[str, Any]:
    props.ignore(*[name for name in props.named if name.endswith(SAMPLING)])
    return {
        "base_color": reflectance(props, "base_color", 0.5),
        "roughness": real(props, "roughness", 0.5),
        **{name: real(props, name, 0.0) for name in SHARED},
    }


def _eta(props: Properties, *, transmits: bool) -> Any:
    """Take the index of refraction, by itself or as Mitsuba's `specular`.

    transmits: whether light is refracted; an index of one would refract nothing.
    """
    if "eta" in props.named and "specular" in props.named:
        raise props.element.error("give either 'eta' or 'specular', not both")
    if "eta" in props.named:
        eta = index(props, "eta", 1.5)
        return LEAST_ETA if transmits and eta == 1.0 else eta
    specular = props.number("specular", 0.5)
    if not 0.0 <= specular < MOST_SPECULAR:
        message = f"specular must be at least 0 and below {MOST_SPECULAR:g}, not {specular:g}"
        raise props.element.error(message)
    if transmits:
        specular = specular or LEAST_SPECULAR
    return 2.0 / (1.0 - math.sqrt(0.08 * specular)) - 1.0
