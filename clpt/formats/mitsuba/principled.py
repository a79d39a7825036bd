"""The principled materials, hair and fluorescent materials of a Mitsuba scene."""

from __future__ import annotations

import math
from typing import Any

from clpt import spectra
from clpt.formats.mitsuba.properties import Properties
from clpt.formats.mitsuba.spectra import factor, index, ior, real, reflectance
from clpt.scene.materials import pigment
from clpt.scene.textures import Product
from clpt.spectra import Constant, RGBUnbounded, Spectrum

LEAST_SPECULAR, LEAST_ETA = 1e-3, 1.001  # Mitsuba's, for surfaces that transmit
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

    transmits: whether light is refracted; an index of 1 would not refract.
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


def fluorescent(props: Properties) -> dict[str, Any]:
    """Take the parameters of materials.Fluorescent and phases.Reradiating."""
    result: dict[str, Any] = {"amount": real(props, "amount", 1.0)}
    inner = reflectance(props, "reflectance", 0.5) if "reflectance" in props.named else None
    if "filename" in props.named:
        child, path = props.named["filename"], props.file()
        with child.locating():
            result["reradiation"] = spectra.read_reradiation(path)
            if inner is None and path.suffix.lower() == ".bfc":
                inner = spectra.read_bispectral(path)[0]
    elif "emission" in props.named:
        result["reradiation"] = dye(props)
    else:
        raise props.element.error("needs 'filename', or 'absorption' and 'emission'")
    return result if inner is None else {**result, "reflectance": inner}


def dye(props: Properties) -> spectra.Fluorophore:
    """Take the spectra of a dye; its `emission` must be given."""
    if "emission" not in props.named:
        raise props.element.error("needs the spectrum 'emission' of its dye")
    absorption, emission = (_spectrum(props, name) for name in ("absorption", "emission"))
    return spectra.Fluorophore(absorption, emission, props.number("quantum_yield", 1.0))


def _spectrum(props: Properties, name: str) -> Spectrum:
    value = reflectance(props, name, 0.5)
    if isinstance(value, (int, float)):
        return Constant(float(value))
    if not isinstance(value, Spectrum):
        raise props.element.error(f"{name!r} cannot be a texture")
    return value
