"""Models of many lobes with the parameters of artists: Burley's, glTF's and OpenPBR."""

from __future__ import annotations

from dataclasses import InitVar, dataclass
from typing import TYPE_CHECKING

from clpt.scene import insides, roles
from clpt.scene.materials.material import ANISOTROPY, TRANSMISSION, Material, alpha_of, share
from clpt.scene.params import Shorthand, coefficient, flag, index, real, reflectance
from clpt.scene.roles import Param
from clpt.scene.values import IndexLike, SpectrumLike, Textured, TexturedNumber
from clpt.spectra import Constant

TRANSMISSION_COLOR = Shorthand(
    {
        "transmission_color": Param(
            roles.REFLECTANCE, "colour of transmitted light, at the surface or at the depth",
            low=0.0, high=1.0, textured=True,
        ),
        "transmission_depth": Param(roles.REAL, "depth of that colour; 0: the surface", "m", 0.0),
    },
    ("transmission_tint", "absorption"),
    insides.spelled,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class Principled(Material):
    """The principled model of Burley 2012 and 2015, as Mitsuba 3 defines it; front side.

    It has both sides where `spec_trans` is above 0. The alpha of its microfacets is the square of
    `roughness`.
    """

    shorthands = (ANISOTROPY, TRANSMISSION)
    if TYPE_CHECKING:  # arguments only: they stand for others
        anisotropy: InitVar[TexturedNumber | None] = None
        transmission: InitVar[TexturedNumber | None] = None

    uses_lobe_sample = True
    refracts = True
    chromatic = True
    tints = (("spec_tint",), ("sheen", "sheen_tint"))

    base_color: Textured = reflectance(0.5, "colour of base and metal; its root is of transmission")
    roughness: TexturedNumber = share(0.5, "of reflection and refraction")
    anisotropic: TexturedNumber = share(
        0.0, "how much it is stretched along the tangent", lobe=True
    )
    metallic: TexturedNumber = share(0.0, "share of the metal", lobe=True)
    spec_trans: TexturedNumber = share(
        0.0, "share of transmission, of the part that is no metal", lobe=True
    )
    eta: IndexLike = index(1.5, "inside index over the outside's")
    spec_tint: TexturedNumber = share(
        0.0, "how much of the base's colour the dielectric reflection has", lobe=True
    )
    sheen: TexturedNumber = share(0.0, "strength of a sheen at grazing angles", lobe=True)
    sheen_tint: TexturedNumber = share(0.0, "how much of the base's colour the sheen has")
    flatness: TexturedNumber = share(
        0.0, "share of the base that looks as if light came from below", lobe=True
    )
    clearcoat: TexturedNumber = share(0.0, "strength of a second, colourless reflection", lobe=True)
    clearcoat_gloss: TexturedNumber = share(0.0, "how smooth that is")

    @property
    def inside_index(self) -> IndexLike:
        return self.eta

    @property
    def transmits(self) -> bool:
        return self.spec_trans != 0.0

    @property
    def uses_tangents(self) -> bool:
        return self.anisotropic != 0.0

    @property
    def least_alpha(self) -> float:
        return alpha_of(self.roughness, self.metallic, self.spec_trans)


@dataclass(frozen=True, kw_only=True, eq=False)
class PrincipledThin(Material):
    """The principled model of a thin sheet (Burley 2015), as Mitsuba 3 defines it; both sides."""

    shorthands = (ANISOTROPY, TRANSMISSION)
    if TYPE_CHECKING:  # arguments only: they stand for others
        anisotropy: InitVar[TexturedNumber | None] = None
        transmission: InitVar[TexturedNumber | None] = None

    uses_lobe_sample = True
    tints = (("spec_tint",), ("sheen", "sheen_tint"))

    base_color: Textured = reflectance(0.5, "colour of all but reflection and sheen")
    roughness: TexturedNumber = share(0.5, "of reflection; transmission's grows with the index")
    anisotropic: TexturedNumber = share(
        0.0, "how much it is stretched along the tangent", lobe=True
    )
    spec_trans: TexturedNumber = share(
        0.0, "share of the slab: of reflection and clear transmission", lobe=True
    )
    eta: IndexLike = index(1.5, "inside index over the outside's")
    spec_tint: TexturedNumber = share(
        0.0, "how much of the base's colour the reflection has", lobe=True
    )
    sheen: TexturedNumber = share(0.0, "strength of a sheen at grazing angles", lobe=True)
    sheen_tint: TexturedNumber = share(0.0, "how much of the base's colour the sheen has")
    flatness: TexturedNumber = share(
        0.0, "share of the base that looks as if light came from below", lobe=True
    )
    diff_trans: TexturedNumber = real(
        0.0,
        "share of diffuse light that goes through; 2: all light",
        low=0.0,
        high=2.0,
        textured=True,
        lobe=True,
    )

    @property
    def transmits(self) -> bool:
        return True

    @property
    def uses_tangents(self) -> bool:
        return self.anisotropic != 0.0

    @property
    def least_alpha(self) -> float:
        return alpha_of(self.roughness, self.spec_trans)


@dataclass(frozen=True, kw_only=True, eq=False)
class GltfSurface(Material):
    """glTF 2.0's material with its extensions, see docs/gltf.md; front side.

    It has both sides where light goes through. `thin` makes it a sheet with two equal sides. The
    alpha of its microfacets is the square of a `roughness`, at least 0.001.
    """

    uses_lobe_sample = True
    refracts = True
    chromatic = True
    needs_wavelengths = True

    base_color: Textured = reflectance(1.0, "colour of base and metal, and of transmitted light")
    metallic: TexturedNumber = share(0.0, "share of the metal", lobe=True)
    roughness: TexturedNumber = share(1.0, "of reflection and of transmission")
    multiple_scattering: float = real(
        0.0,
        "share of the light between facets that is kept, as at rough metals",
        low=0.0,
        high=1.0,
        lobe=True,
    )
    ior: IndexLike = index(
        1.5, "index of the dielectric; 0: it reflects all but for `specular_color`", zero=True
    )
    specular: TexturedNumber = share(1.0, "strength of the dielectric's reflection")
    specular_color: Textured = reflectance(1.0, "factor on it at normal incidence")
    anisotropy: TexturedNumber = share(
        0.0, "how much rougher the tangent's direction is", lobe=True
    )
    anisotropy_rotation: TexturedNumber = real(
        0.0,
        "from u to that direction, on the side of v; an image's own u and v",
        "degrees",
        -360.0,
        360.0,
        textured=True,
    )
    clearcoat: TexturedNumber = share(0.0, "strength of a coat of index 1.5 over all", lobe=True)
    clearcoat_roughness: TexturedNumber = share(0.0, "its roughness")
    clearcoat_apart: float = real(
        0.0,
        "1: the coat has its own normals, and ignores a normal map around the material",
        low=0.0,
        high=1.0,
        lobe=True,
    )
    clearcoat_normal_x: TexturedNumber = share(
        0.5, "normal of such a coat by the surface's, along u, an image's own: x / 2 + 1/2"
    )
    clearcoat_normal_y: TexturedNumber = share(0.5, "along v, likewise")
    clearcoat_normal_z: TexturedNumber = share(1.0, "along the surface's normal, likewise")
    clearcoat_normal_scale: float = real(1.0, "factor on its x and y", low=-100.0, high=100.0)
    sheen_color: Textured = reflectance(0.0, "colour of fibres under the coat", lobe=True)
    sheen_roughness: TexturedNumber = share(0.5, "how much fibres lean; at least 0.25")
    transmission: TexturedNumber = share(
        0.0, "share of the light in the base that is transmitted", lobe=True
    )
    thin: bool = flag(False, "whether light goes straight through, as there is no volume")
    absorption: SpectrumLike = coefficient(0.0, "of the inside: exp(-absorption distance) passes")
    diffuse_transmission: TexturedNumber = share(
        0.0, "share of scattered light that goes through", lobe=True
    )
    diffuse_transmission_color: Textured = reflectance(1.0, "its colour")
    iridescence: TexturedNumber = share(0.0, "strength of a thin film on the facets", lobe=True)
    iridescence_ior: float = real(1.3, "index of that film", low=1.0, high=5.0)
    iridescence_thickness: TexturedNumber = real(
        400.0, "its thickness", "nm", 0.0, 1e5, textured=True
    )

    @property
    def inside_index(self) -> IndexLike:
        return Constant(1.0) if self.thin else self.ior

    @property
    def transmits(self) -> bool:
        return self.transmission != 0.0 or self.diffuse_transmission != 0.0

    @property
    def directing(self) -> tuple[object, ...]:
        return self.clearcoat_normal_x, self.anisotropy_rotation

    @property
    def uses_tangents(self) -> bool:
        return self.anisotropy != 0.0 or self.clearcoat_apart != 0.0

    @property
    def least_alpha(self) -> float:
        return alpha_of(self.roughness, self.metallic, self.transmission)

    @property
    def is_sheet(self) -> bool:
        return self.thin


@dataclass(frozen=True, kw_only=True, eq=False)
class Openpbr(Material):
    """OpenPBR Surface 1.1, see docs/materials.md; front side.

    It has both sides where light goes through. `thin_walled` makes it a sheet with two equal sides.
    The parameters are those of the specification. `specular_ior` counts as at least the coat's.
    """

    shorthands = (TRANSMISSION_COLOR,)
    if TYPE_CHECKING:  # arguments only: they stand for others
        transmission_color: InitVar[Textured | None] = None
        transmission_depth: InitVar[float | None] = None

    uses_lobe_sample = True
    refracts = True
    chromatic = True
    needs_wavelengths = True
    turning_lobe = "anisotropy_rotation"

    base_weight: TexturedNumber = share(1.0, "factor on the base's colour")
    base_color: Textured = reflectance(0.8, "colour of the base, and of metal head-on")
    base_metalness: TexturedNumber = share(0.0, "share of the metal", lobe=True)
    base_diffuse_roughness: TexturedNumber = share(0.0, "of diffuse reflection")
    specular_weight: TexturedNumber = real(
        1.0, "factor on the dielectric's reflection head-on, by its index; on metal at most 1",
        low=0.0, high=25.0, textured=True,
    )  # fmt: skip
    specular_color: Textured = reflectance(
        1.0, "factor on the dielectric's reflection; on metal at 82 degrees"
    )
    specular_roughness: TexturedNumber = share(0.3, "of facets; its square is their alpha")
    specular_roughness_anisotropy: TexturedNumber = share(
        0.0, "how much rougher the tangent's direction is", lobe=True
    )
    anisotropy_rotation: TexturedNumber = real(
        0.0,
        "from u to the tangent, on the side of v; an image's own u and v",
        "degrees",
        -360.0,
        360.0,
        textured=True,
        lobe=True,
    )
    specular_ior: IndexLike = index(1.5, "index of the dielectric")
    transmission_weight: TexturedNumber = share(
        0.0, "share of the light in the dielectric that is transmitted", lobe=True
    )
    transmission_tint: Textured = reflectance(1.0, "factor on transmitted light, at the surface")
    absorption: SpectrumLike = coefficient(0.0, "of the inside: exp(-absorption distance) passes")
    subsurface_weight: TexturedNumber = share(
        0.0, "share of the remaining light that is scattered below the surface", lobe=True
    )
    subsurface_color: Textured = reflectance(0.8, "albedo of the scattering there")
    subsurface_scatter_anisotropy: TexturedNumber = real(
        0.0, "thin-walled: 1: all light goes through; -1: none", "", -1.0, 1.0, textured=True
    )
    subsurface_inside: bool = flag(
        False, "True: light goes into a body, and the shape's `interior` scatters it"
    )
    coat_weight: TexturedNumber = share(0.0, "share of the surface that has a coat", lobe=True)
    coat_color: Textured = reflectance(
        1.0, "share of the light that passes the coat twice, head-on"
    )
    coat_roughness: TexturedNumber = share(
        0.0, "of the coat's facets; it also makes the layers below rougher"
    )
    coat_roughness_anisotropy: TexturedNumber = share(0.0, "how much rougher along the tangent")
    coat_ior: TexturedNumber = real(1.6, "index of the coat", low=1.0, high=3.0, textured=True)
    coat_darkening: TexturedNumber = share(
        1.0, "how much of the darkening by reflections within the coat is kept"
    )
    fuzz_weight: TexturedNumber = share(0.0, "share of the surface that has fibres", lobe=True)
    fuzz_color: Textured = reflectance(1.0, "factor on the fibres' light")
    fuzz_roughness: TexturedNumber = share(0.5, "how much fibres lean; at least 0.1")
    thin_film_weight: TexturedNumber = share(0.0, "share of the facets that has a film", lobe=True)
    thin_film_thickness: TexturedNumber = real(
        0.5, "thickness of the film", "um", 0.0, 100.0, textured=True
    )
    thin_film_ior: float = real(1.4, "index of the film", low=1.0, high=5.0)
    thin_walled: bool = flag(False, "whether light goes straight through, as there is no volume")

    @property
    def inside_index(self) -> IndexLike:
        return Constant(1.0) if self.thin_walled else self.specular_ior

    @property
    def transmits(self) -> bool:
        below = self.thin_walled or self.subsurface_inside
        return self.transmission_weight != 0.0 or (below and self.subsurface_weight != 0.0)

    @property
    def directing(self) -> tuple[object, ...]:
        return None, self.anisotropy_rotation

    @property
    def uses_tangents(self) -> bool:
        stretched = self.coat_weight != 0.0 and self.coat_roughness_anisotropy != 0.0
        return self.specular_roughness_anisotropy != 0.0 or stretched

    @property
    def least_alpha(self) -> float:
        return alpha_of(self.specular_roughness, self.base_metalness, self.transmission_weight)

    @property
    def is_sheet(self) -> bool:
        return self.thin_walled
