"""Mitsuba 0.6's `coating` and `roughcoating`.

A coating is a boundary that sends no light back to its base. With F12 and F21 Fresnel's
reflectances of both directions and w' the refracted directions (src/bsdfs/coating.cpp): f(wi, wo) =
F delta + (1 - F12) (1 - F21) exp(-tau (1 / cos wi' + 1 / cos wo')) f_base(wi', wo')
(eta_out / eta_in)^2.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from clpt.formats.mitsuba.principled import at_yellow
from clpt.formats.mitsuba.properties import Context
from clpt.formats.mitsuba.xml import Element
from clpt.formats.pbrt import scattering
from clpt.formats.pbrt.lobes import summed
from clpt.formats.pbrt.textures import map_values
from clpt.scene import materials
from clpt.scene.materials import Material
from clpt.scene.params import fields_of
from clpt.scene.textures import Product
from clpt.scene.values import Textured, TexturedNumber
from clpt.spectra import RGB, Constant, RGBUnbounded, Spectrum

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
        if base.kind in SUMS:
            diffuse, specular, facets = SUMS[base.kind](base)
            metal = partial(materials.RoughConductor, **facets)
            glossy = partial(self._over_facets, metal)
            return summed([(diffuse, self._over_diffuse), (specular, glossy)], self._warn)
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

    def _over_facets(self, metal: Callable[..., Material], factor: Textured) -> Material:
        return self._over_metal(metal(specular_reflectance=factor))

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


Lobes = tuple[Textured, Textured, dict[str, Any]]  # diffuse, specular, and facets of the latter


def _facets(
    alpha_u: TexturedNumber, alpha_v: TexturedNumber, distribution: str = "beckmann"
) -> dict[str, Any]:
    """Return parameters of facets that reflect all light."""
    alphas = {"alpha_u": alpha_u, "alpha_v": alpha_v}
    return {"distribution": distribution, "eta": 0.0, "k": 1.0, **alphas}


def _phong(base: Material) -> Lobes:
    """Return facets as wide as the lobe (Walter et al. 2007)."""
    fields = fields_of(base)
    alpha = map_values(fields["exponent"], lambda n: np.sqrt(2.0 / (n + 2.0)))
    return fields["diffuse"], fields["specular"], _facets(alpha, alpha)


def _ward(base: Material) -> Lobes:
    fields = fields_of(base)
    return fields["diffuse"], fields["specular"], _facets(fields["alpha_u"], fields["alpha_v"])


def _plastic(base: Material) -> Lobes:
    """Return its base and its boundary as the coat sees them, which is nearly along the normal."""
    fields = fields_of(base)
    ratio = at_yellow(fields["int_ior"]) / at_yellow(fields["ext_ior"])
    inside = float(scattering.EVEN @ scattering.internal_fresnel(ratio))
    mirror = ((ratio - 1.0) / (ratio + 1.0)) ** 2
    saturates = fields["nonlinear"]
    diffuse = map_values(
        fields["diffuse_reflectance"],
        lambda r: ((1.0 - mirror) / ratio) ** 2 * r / (1.0 - inside * (r if saturates else 1.0)),
    )
    specular = map_values(fields["specular_reflectance"], lambda r: mirror * r)
    rough = {"alpha": SMOOTHEST, "distribution": "beckmann", **fields}
    return diffuse, specular, _facets(rough["alpha"], rough["alpha"], rough["distribution"])


SUMS: dict[str, Callable[[Material], Lobes]] = {  # a diffuse and a glossy reflection
    "phong": _phong,
    "ward": _ward,
    "plastic": _plastic,
    "rough_plastic": _plastic,
}
