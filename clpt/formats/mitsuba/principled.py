"""The principled materials of a Mitsuba scene."""

from __future__ import annotations

import math
from typing import Any

from clpt.formats.mitsuba.properties import Properties
from clpt.formats.mitsuba.spectra import index, real, reflectance

LEAST_SPECULAR, LEAST_ETA = 1e-3, 1.001  # Mitsuba's, of what lets light through
SHARED = (
    "anisotropic", "spec_trans", "spec_tint", "sheen", "sheen_tint", "flatness",
)  # fmt: skip
SAMPLING = "sampling_rate"  # such parameters change how lobes are chosen, but no picture


def principled(props: Properties) -> dict[str, Any]:
    """Take the parameters of `principled`."""
    given = _shared(props)
    for name in ("metallic", "clearcoat", "clearcoat_gloss"):
        given[name] = real(props, name, 0.0)
    return {**given, "eta": _eta(props, passes=given["spec_trans"] != 0.0)}


def principled_thin(props: Properties) -> dict[str, Any]:
    """Take the parameters of `principledthin`."""
    given = _shared(props)
    return {**given, "diff_trans": real(props, "diff_trans", 0.0), "eta": index(props, "eta", 1.5)}


def _shared(props: Properties) -> dict[str, Any]:
    props.ignore(*[name for name in props.named if name.endswith(SAMPLING)])
    return {
        "base_color": reflectance(props, "base_color", 0.5),
        "roughness": real(props, "roughness", 0.5),
        **{name: real(props, name, 0.0) for name in SHARED},
    }


def _eta(props: Properties, *, passes: bool) -> Any:
    """Take the index, which Mitsuba's `specular` is another name for.

    passes: whether light is let through; then an index of one would refract nothing.
    """
    if "eta" in props.named and "specular" in props.named:
        raise props.element.error("give either 'eta' or 'specular', not both")
    if "eta" in props.named:
        eta = index(props, "eta", 1.5)
        return LEAST_ETA if passes and eta == 1.0 else eta
    specular = props.number("specular", 0.5)
    if not 0.0 <= specular <= 1.0:
        raise props.element.error(f"specular must be from 0 to 1, not {specular:g}")
    if passes:
        specular = specular or LEAST_SPECULAR
    return 2.0 / (1.0 - math.sqrt(0.08 * specular)) - 1.0
