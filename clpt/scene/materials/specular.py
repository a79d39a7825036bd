"""Dielectrics and metals, smooth and rough: boundaries, plastics, gratings and hair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import InitVar, dataclass
from typing import TYPE_CHECKING

from clpt.errors import SceneError
from clpt.scene.materials.material import (
    DISTRIBUTIONS,
    FILMS,
    METAL,
    ROUGH,
    ROUGH_EVENLY,
    Layer,
    Material,
    least_number,
    light_factor,
    share,
)
from clpt.scene.params import (
    choice,
    coefficient,
    factor,
    flag,
    index,
    layers,
    per_order,
    real,
    reflectance,
)
from clpt.scene.roles import ORDERS
from clpt.scene.values import IndexLike, SpectrumLike, Texture, Textured, TexturedNumber
from clpt.spectra import Spectrum


def pigment(eumelanin: float, pheomelanin: float) -> tuple[float, ...]:
    """Return the absorption of hair with concentrations of its two pigments, as linear rgb.

    Per radius of the fibre (d'Eon et al. 2011, as in Chiang et al. 2016).
    """
    dark, red = (0.419, 0.697, 1.37), (0.187, 0.4, 1.05)
    return tuple(eumelanin * a + pheomelanin * b for a, b in zip(dark, red, strict=True))


@dataclass(frozen=True, kw_only=True, eq=False)
class Dielectric(Material):
    """A smooth boundary of two dielectrics; both sides."""

    delta = True
    uses_lobe_sample = True
    refracts = True
    bounds_body = True

    int_ior: IndexLike = index(1.5046, "inside index, number, glass name or spectrum")
    ext_ior: IndexLike = index(1.000277, "outside index")
    specular_reflectance: Textured = light_factor("reflection", linear=True)
    specular_transmittance: Textured = light_factor("transmission", linear=True)
    absorption: SpectrumLike = coefficient(0.0, "of the inside: exp(-absorption distance) passes")
    layers: tuple[Layer, ...] = layers(FILMS)

    @property
    def inside_index(self) -> IndexLike:
        return self.int_ior

    @property
    def transmits(self) -> bool:
        return True


@dataclass(frozen=True, kw_only=True, eq=False)
class ThinDielectric(Material):
    """A thin slab of a dielectric: reflections inside are summed, light passes undeviated."""

    delta = True
    uses_lobe_sample = True
    is_pane = True

    int_ior: IndexLike = index(1.5046, "index of the slab")
    ext_ior: IndexLike = index(1.000277, "index around it")
    specular_reflectance: Textured = light_factor("reflection", linear=True)
    specular_transmittance: Textured = light_factor("transmission", linear=True)

    @property
    def transmits(self) -> bool:
        return True


@dataclass(frozen=True, kw_only=True, eq=False)
class RoughDielectric(Material):
    """A rough boundary of two dielectrics (Walter et al. 2007); both sides."""

    shorthands = ROUGH
    if TYPE_CHECKING:  # arguments only: they stand for others
        alpha: InitVar[TexturedNumber | None] = None
        roughness: InitVar[float | None] = None

    uses_lobe_sample = True
    refracts = True
    bounds_body = True
    chromatic = True
    lobes_apart = True

    int_ior: IndexLike = index(1.5046, "inside index")
    ext_ior: IndexLike = index(1.000277, "outside index")
    distribution: str = choice("ggx", "of the microfacet normals", DISTRIBUTIONS)
    alpha_u: TexturedNumber = real(
        0.1, "roughness along the tangent", low=1e-4, high=1.0, textured=True
    )
    alpha_v: TexturedNumber = real(0.1, "roughness across it", low=1e-4, high=1.0, textured=True)
    specular_reflectance: Textured = light_factor("reflection", linear=True)
    specular_transmittance: Textured = light_factor("transmission", linear=True)
    absorption: SpectrumLike = coefficient(0.0, "of the inside: exp(-absorption distance) passes")
    layers: tuple[Layer, ...] = layers(FILMS)

    @property
    def inside_index(self) -> IndexLike:
        return self.int_ior

    @property
    def transmits(self) -> bool:
        return True

    @property
    def least_alpha(self) -> float:
        return least_number(self.alpha_u, self.alpha_v)


@dataclass(frozen=True, kw_only=True, eq=False)
class Conductor(Material):
    """A smooth metal; front side. The default is a perfect mirror."""

    shorthands = (METAL,)
    if TYPE_CHECKING:  # arguments only: they stand for others
        metal: InitVar[str | tuple[Spectrum, Spectrum] | None] = None

    delta = True

    eta: IndexLike | Texture = index(0.0, "index of refraction", zero=True, textured=True)
    k: IndexLike | Texture = index(1.0, "extinction coefficient", zero=True, textured=True)
    specular_reflectance: Textured = light_factor("reflection", linear=True)
    layers: tuple[Layer, ...] = layers(FILMS)


@dataclass(frozen=True, kw_only=True, eq=False)
class RoughConductor(Material):
    """A rough metal of microfacets (Cook and Torrance; Heitz 2018 visible normals); front side."""

    shorthands = (METAL, *ROUGH)
    if TYPE_CHECKING:  # arguments only: they stand for others
        metal: InitVar[str | tuple[Spectrum, Spectrum] | None] = None
        alpha: InitVar[TexturedNumber | None] = None
        roughness: InitVar[float | None] = None

    eta: IndexLike | Texture = index(0.0, "index of refraction", zero=True, textured=True)
    k: IndexLike | Texture = index(1.0, "extinction coefficient", zero=True, textured=True)
    distribution: str = choice("ggx", "of the microfacet normals", DISTRIBUTIONS)
    alpha_u: TexturedNumber = real(
        0.1, "roughness along the tangent", low=1e-4, high=1.0, textured=True
    )
    alpha_v: TexturedNumber = real(0.1, "roughness across it", low=1e-4, high=1.0, textured=True)
    specular_reflectance: Textured = light_factor("reflection", linear=True)
    layers: tuple[Layer, ...] = layers(FILMS)

    @property
    def least_alpha(self) -> float:
        return least_number(self.alpha_u, self.alpha_v)


@dataclass(frozen=True, kw_only=True, eq=False)
class Plastic(Material):
    """A diffuse base under a smooth dielectric coat, with all internal reflections; front side."""

    uses_lobe_sample = True
    has_diffuse_lobe = True

    diffuse_reflectance: Textured = reflectance(0.5, "albedo of the base")
    int_ior: IndexLike = index(1.49, "index of the coat")
    ext_ior: IndexLike = index(1.000277, "index outside")
    specular_reflectance: Textured = light_factor("the coat's reflection")
    nonlinear: bool = flag(False, "whether internal reflection saturates the colour")


@dataclass(frozen=True, kw_only=True, eq=False)
class RoughPlastic(Material):
    """A diffuse base under a rough dielectric coat; front side."""

    shorthands = ROUGH_EVENLY
    if TYPE_CHECKING:  # arguments only: they stand for others
        roughness: InitVar[float | None] = None

    uses_lobe_sample = True
    has_diffuse_lobe = True

    diffuse_reflectance: Textured = reflectance(0.5, "albedo of the base")
    int_ior: IndexLike = index(1.49, "index of the coat")
    ext_ior: IndexLike = index(1.000277, "index outside")
    specular_reflectance: Textured = light_factor("the coat's reflection")
    distribution: str = choice("ggx", "of the microfacet normals", DISTRIBUTIONS)
    alpha: TexturedNumber = real(0.1, "roughness", low=1e-4, high=1.0, textured=True)
    nonlinear: bool = flag(False, "whether internal reflection saturates the colour")


@dataclass(frozen=True, kw_only=True, eq=False)
class CoatedConductor(Material):
    """A rough metal under a rough, clear dielectric coat; front side.

    It is a closed form. docs/materials.md has its difference from a random walk between metal and
    coat.
    """

    shorthands = (METAL, *ROUGH)
    if TYPE_CHECKING:  # arguments only: they stand for others
        metal: InitVar[str | tuple[Spectrum, Spectrum] | None] = None
        alpha: InitVar[TexturedNumber | None] = None
        roughness: InitVar[float | None] = None

    uses_lobe_sample = True

    coat_ior: IndexLike = index(1.5046, "index of the coat")
    ext_ior: IndexLike = index(1.000277, "index outside")
    coat_alpha: TexturedNumber = real(
        0.01, "roughness of the coat", low=1e-4, high=1.0, textured=True
    )
    eta: IndexLike | Texture = index(
        0.0,
        "index of refraction of the metal; the default is a perfect mirror",
        zero=True,
        textured=True,
    )
    k: IndexLike | Texture = index(
        1.0, "extinction coefficient of the metal", zero=True, textured=True
    )
    distribution: str = choice("ggx", "of both their microfacet normals", DISTRIBUTIONS)
    alpha_u: TexturedNumber = real(
        0.1, "the metal's roughness along tangents", "", 1e-4, 1.0, textured=True
    )
    alpha_v: TexturedNumber = real(
        0.1, "the metal's roughness across it", "", 1e-4, 1.0, textured=True
    )
    specular_reflectance: Textured = light_factor("the metal's reflection")

    @property
    def least_alpha(self) -> float:
        return least_number(self.alpha_u, self.alpha_v)


@dataclass(frozen=True, kw_only=True, eq=False)
class Grating(Material):
    """A diffraction grating: every order leaves in its own direction, by wavelength.

    Its grooves repeat along the tangent, which `angle` turns. The tangent is that of u. On a disk
    it is the radius. A mesh needs uvs. A reflective grating is the front of a metal. A transmissive
    grating is a thin plate with both sides.
    """

    shorthands = (METAL,)
    if TYPE_CHECKING:  # arguments only: they stand for others
        metal: InitVar[str | tuple[Spectrum, Spectrum] | None] = None

    delta = True
    uses_lobe_sample = True
    disperses = True
    needs_wavelengths = True
    reversible = False

    mode: str = choice("reflective", "whether light is turned back", ("reflective", "transmissive"))
    profile: str = choice(
        "sinusoidal",
        "of the grooves, or explicit `efficiencies`",
        ("sinusoidal", "lamellar", "blazed", "explicit"),
    )
    period: TexturedNumber = real(1600.0, "from groove to groove", "nm", 100.0, 1e5, textured=True)
    angle: TexturedNumber = real(
        0.0, "tangent to next groove", "degrees", -360.0, 360.0, textured=True
    )
    depth: TexturedNumber = real(150.0, "of a groove", "nm", 0.0, 1000.0, textured=True)
    fill: float = real(0.5, "share of the period that lamellar crests take", low=0.0, high=1.0)
    orders: float = real(float(ORDERS), "highest order that is followed", low=0.0, high=ORDERS)
    efficiencies: Sequence[float] = per_order(
        (1.0, 1.0, 1.0), "how strong orders -n to n are, explicitly"
    )
    ior: IndexLike = index(1.5, "index of a transmissive plate")
    eta: IndexLike | Texture = index(
        0.0,
        "index of refraction of the metal; the default is a perfect mirror",
        zero=True,
        textured=True,
    )
    k: IndexLike | Texture = index(
        1.0, "extinction coefficient of the metal", zero=True, textured=True
    )
    reflectance: Textured = light_factor("the light of all orders", linear=True)

    @property
    def transmits(self) -> bool:
        return self.mode == "transmissive"

    @property
    def uses_tangents(self) -> bool:
        return True

    def check(self) -> None:
        """Raise SceneError unless an efficiency is above zero."""
        if self.profile == "explicit" and not any(self.efficiencies):
            raise SceneError("one must be above zero", where="grating.efficiencies")


@dataclass(frozen=True, kw_only=True, eq=False)
class Hair(Material):
    """A fibre that light goes through (Chiang et al. 2016), as Mitsuba 3 and pbrt 4 have it.

    It is for `curves`, whose v runs along the fibre. Scattering happens where light enters the
    fibre. The far side of the fibre has no effect. `sigma_a` is the absorption per radius of the
    fibre, so the thickness does not matter. Transmission is not reciprocal.
    """

    uses_lobe_sample = True
    no_back = True
    reversible = False

    sigma_a: Textured = factor(pigment(1.3, 0.2), "absorption, per radius of the fibre")
    longitudinal_roughness: TexturedNumber = share(0.3, "of the angle along the fibre")
    azimuthal_roughness: TexturedNumber = share(0.3, "of the angle around it")
    scale_tilt: float = real(2.0, "of the scales against the fibre", "degrees", -45.0, 45.0)
    eta: float = real(1.55, "index of the fibre over that outside", "", 1.001, 5.0)

    @property
    def transmits(self) -> bool:
        return True

    @property
    def uses_tangents(self) -> bool:
        return True
