"""The principled materials of a Mitsuba scene, and Mitsuba 0.6's `coating` and `roughcoating`.

A coating is a boundary that sends no light back to its base. With F12 and F21 Fresnel's
reflectances of both directions and w' the refracted directions (src/bsdfs/coating.cpp): f(wi, wo) =
F delta + (1 - F12) (1 - F21) exp(-tau (1 / cos wi' + 1 / cos wo')) f_base(wi', wo')
(eta_out / eta_in)^2.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

from clpt import spectra
from clpt.formats.mitsuba.properties import Context, Properties
from clpt.formats.mitsuba.spectra import factor, index, ior, real, reflectance
from clpt.formats.mitsuba.xml import Element
from clpt.formats.pbrt import scattering
from clpt.formats.pbrt.textures import map_values
from clpt.scene import materials
from clpt.scene.materials import Material, pigment
from clpt.scene.params import fields_of
from clpt.scene.textures import Product
from clpt.scene.values import Textured, TexturedNumber
from clpt.spectra import RGB, Constant, RGBUnbounded, Spectrum

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


KINDS = ("coating", "roughcoating")
METALS = {
    "conductor": ("eta", "k", "specular_reflectance"),
    "rough_conductor": (
        "eta", "k", "specular_reflectance", "distribution", "alpha_u", "alpha_v",
    ),
}  # fmt: skip
COLOURS = (RGB, RGBUnbounded)
SMOOTHEST = 1e-4  # Mitsuba's own floor of a roughness


@dataclass(frozen=True)
class Coat:
    """The boundary of a coated material.

    indices: `int_ior` and `ext_ior`; alpha: its roughness; depth: absorption of a pass along the
    normal, a number or a spectrum; kept: parameters of the material that are the coat's.
    """

    element: Element
    context: Context
    indices: dict[str, Any]
    specular: Textured
    alpha: TexturedNumber
    rough: bool
    depth: Spectrum | float
    kept: dict[str, Any]

    def over(self, base: Material) -> Material:
        """Return a base with the coat; bases without a counterpart stay bare, with a warning.

        A coat of a sum is the sum of coats, as f is linear in f_base.
        """
        if isinstance(base, materials.Blend):
            first, second = self.over(base.first), self.over(base.second)
            return dataclasses.replace(base, first=first, second=second)
        if isinstance(base, materials.TwoSided):
            back = None if base.back is None else self.over(base.back)
            return dataclasses.replace(base, front=self.over(base.front), back=back)
        if isinstance(base, materials.NormalMapped):
            self._warn("its normal map bends the coat too")
            return dataclasses.replace(base, material=self.over(base.material))
        if base.kind in METALS:
            return self._over_metal(base)
        if base.kind == "oren_nayar":
            self._warn("its rough diffuse base is taken as smooth")
        elif base.kind != "diffuse":
            self._warn(f"a coat over {base.kind} is left out: it would darken it")
            return base
        return self._over_diffuse(fields_of(base)["reflectance"])

    def _warn(self, message: str) -> None:
        self.context.warn(self.element, message)

    @property
    def _ratio(self) -> float:
        return at_yellow(self.indices["int_ior"]) / at_yellow(self.indices["ext_ior"])

    def _over_metal(self, base: Material) -> Material:
        fields = fields_of(base)
        metal = {name: fields[name] for name in METALS[base.kind]}
        metal["specular_reflectance"] = self._absorbed(metal["specular_reflectance"])
        smooth = {} if "alpha_u" in metal else {"alpha_u": SMOOTHEST, "alpha_v": SMOOTHEST}
        coat = {"coat_ior": self.indices["int_ior"], "ext_ior": self.indices["ext_ior"]}
        values = {**self.kept, **coat, "coat_alpha": self.alpha, **metal, **smooth}
        return materials.CoatedConductor(**values)

    def _over_diffuse(self, albedo: Textured) -> Material:
        """Return Plastic whose base is darker by the light that Plastic sends back to it."""
        inside = float(scattering.EVEN @ scattering.internal_fresnel(self._ratio))
        base = map_values(self._absorbed(albedo), lambda r: r / (1.0 + inside * r))
        values = {**self.kept, **self.indices, "diffuse_reflectance": base}
        values |= {"specular_reflectance": self.specular, "nonlinear": True}
        if self.rough:
            return materials.RoughPlastic(**values, alpha=self.alpha)
        return materials.Plastic(**values)

    def _absorbed(self, albedo: Textured) -> Any:
        """Return a reflectance times the mean transmittance of the coat, in and out."""
        if self.depth in (0.0, Constant(0.0)):
            return albedo
        self._warn("'sigma_a' absorbs alike in all directions: the mean of even light")
        share = map_values(
            self.depth, lambda depth: scattering.transmitted(self._ratio, depth) ** 2
        )
        share = share.value if isinstance(share, Constant) else share
        if isinstance(share, float):
            return map_values(albedo, lambda r: r * share)
        if isinstance(share, COLOURS) and isinstance(albedo, (RGB, Constant)):
            numbers = albedo.to_rgb() * share.to_rgb()
            return tuple(numbers.tolist())
        return Product(first=albedo, second=share, rgb=True)
