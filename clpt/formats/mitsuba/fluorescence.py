"""Light of other wavelengths in plugins of clpt's own: Mitsuba has no fluorescence."""

from __future__ import annotations

from typing import Any

from clpt import spectra
from clpt.formats.mitsuba.properties import Properties
from clpt.formats.mitsuba.spectra import real, reflectance
from clpt.spectra import Constant, Spectrum


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
