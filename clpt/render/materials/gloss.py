"""Gloss of materials: what the tree over lights knows of them, kernels/lights/receiver.cl.

It only decides how often a light is chosen, so a guess costs noise and no truth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from clpt.scene.params import fields_of
from clpt.scene.scatterer import Scatterer
from clpt.spectra import RGB, RGBUnbounded, Spectrum

STRAIGHT = 0.04  # of light that a dielectric reflects which falls on it straight on
TEXTURED = 0.2  # an albedo or a share that is a texture: a mean of what scenes have
ROUGHLY = 0.5  # a roughness that is one
EXPONENT = 30.0  # and an exponent
SEEN = np.linspace(420.0, 680.0, 14)  # wavelengths over which an albedo is meant [nm]

Values = Mapping[str, object]


def word(material: Scatterer) -> int:
    """Return the gloss of a leaf material, 0 for none.

    The upper 16 bits are the roughness of its microfacets, alpha; the lower ones the share of its
    reflection in what it reflects of light that comes straight on.
    """
    found = _KINDS.get(material.kind)
    if found is None or material.transmits:
        return 0
    alpha, share = found(fields_of(material))
    alpha, share = np.clip((alpha, share), 1e-3, 1.0)
    return int(alpha * 65535) << 16 | int(share * 65535)


def _number(value: object, other: float = TEXTURED) -> float:
    """The mean of a parameter over its colours; `other` if it is not known."""
    if isinstance(value, (int, float)):
        return float(value)
    if isinstance(value, (RGB, RGBUnbounded)):
        return (value.r + value.g + value.b) / 3.0
    return float(value.sample(SEEN).mean()) if isinstance(value, Spectrum) else other


def _metal(values: Values) -> tuple[float, float]:
    u, v = (_number(values[name], ROUGHLY**2) for name in ("alpha_u", "alpha_v"))
    return float(np.sqrt(u * v)), 1.0


def _plastic(values: Values) -> tuple[float, float]:
    share = _share(STRAIGHT, _number(values["diffuse_reflectance"]))
    return _number(values["alpha"], ROUGHLY**2), share


def _principled(values: Values) -> tuple[float, float]:
    metal, albedo = _number(values["metallic"]), _number(values["base_color"])
    straight = metal * albedo + (1.0 - metal) * STRAIGHT
    return _number(values["roughness"], ROUGHLY) ** 2, _share(straight, (1.0 - metal) * albedo)


def _phong(values: Values) -> tuple[float, float]:
    share = _share(_number(values["specular"]), _number(values["diffuse"]))
    return float(np.sqrt(2.0 / (4.0 * _number(values["exponent"], EXPONENT) + 2.0))), share


def _share(glossy: float, diffuse: float) -> float:
    return glossy / max(glossy + diffuse, 1e-6)


_KINDS: dict[str, Callable[[Values], tuple[float, float]]] = {
    "rough_conductor": _metal,
    "coated_conductor": _metal,
    "rough_plastic": _plastic,
    "principled": _principled,
    "gltf_surface": _principled,
    "phong": _phong,
}
