"""Bases of materials, and the declarations of parameters that several kinds share."""

from __future__ import annotations

from dataclasses import InitVar, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, cast

from clpt.scene import roles
from clpt.scene.params import Kind, Shorthand, fields_of, host, index, real, reflectance
from clpt.scene.roles import Param
from clpt.scene.scatterer import Scatterer
from clpt.scene.values import IndexLike, SpectrumLike, TexturedNumber
from clpt.spectra import Constant, Spectrum
from clpt.spectra import metal as named_metal

DISTRIBUTIONS = ("ggx", "beckmann")
CLEAR = Constant(0.0)  # absorption of a clear body
LEAST_ALPHA = 1e-4
FILMS = "thin films on the surface, from the outside in"


def _metal(metal: str | tuple[Spectrum, Spectrum]) -> dict[str, Any]:
    eta, k = named_metal(metal) if isinstance(metal, str) else metal
    return {"eta": eta, "k": k}


def _roughness(names: tuple[str, ...]) -> tuple[Shorthand, ...]:
    """Return the shorthands for the parameters of roughness; a single name needs no `alpha`."""
    alpha = Param(
        roles.REAL, "roughness along both directions", low=LEAST_ALPHA, high=1.0, textured=True
    )
    square = Param(roles.REAL, "its root, as `principled` and glTF have it", low=0.0, high=1.0)

    def squared(roughness: float) -> dict[str, Any]:
        return dict.fromkeys(
            names, max(roles.REAL.check(roughness, square, None) ** 2, LEAST_ALPHA)
        )

    rough = Shorthand({"roughness": square}, names, squared)
    even = Shorthand({"alpha": alpha}, names, lambda alpha: dict.fromkeys(names, alpha))
    return (rough,) if len(names) == 1 else (even, rough)


def _renamed(argument: str, name: str, doc: str) -> Shorthand:
    """Return the shorthand of another word for a parameter."""
    param = Param(roles.REAL, doc, low=0.0, high=1.0, textured=True)
    return Shorthand({argument: param}, (name,), lambda **arguments: {name: arguments[argument]})


METAL = Shorthand(
    {"metal": Param(roles.host("metal"), "such as gold or Au, or its (eta, k)")},
    ("eta", "k"),
    _metal,
)


ROUGH, ROUGH_EVENLY = _roughness(("alpha_u", "alpha_v")), _roughness(("alpha",))
ANISOTROPY = _renamed("anisotropy", "anisotropic", "another word for `anisotropic`, as in glTF")
TRANSMISSION = _renamed("transmission", "spec_trans", "another word for `spec_trans`, as in glTF")


def share(default: float, doc: str, *, lobe: bool = False) -> Any:
    return real(default, doc, low=0.0, high=1.0, textured=True, lobe=lobe)


def light_factor(of: str, *, linear: bool = False) -> Any:
    """Declare a factor on light that a material sends out, which is 1 in physics."""
    return reflectance(1.0, f"factor on {of}; 1 is physical", linear=linear)


def least_number(*alphas: object) -> float:
    """Return the least number among alphas, 1 without numbers."""
    return min((a for a in alphas if isinstance(a, (int, float))), default=1.0)


def alpha_of(roughness: object, *shares: object) -> float:
    """Return the alpha of a roughness; 1 for a texture, and where all specular shares are 0."""
    if not isinstance(roughness, (int, float)) or all(share == 0.0 for share in shares):
        return 1.0
    return roughness**2


@dataclass(frozen=True, kw_only=True, eq=False)
class Layer(Kind):
    """A film, thin enough for the light reflected at its two faces to interfere.

    It may be up to 100 um thick. From about 10 um on its fringes are too fine for the eye.
    """

    shorthands = (METAL,)
    if TYPE_CHECKING:  # arguments only: they stand for others
        metal: InitVar[str | tuple[Spectrum, Spectrum] | None] = None

    eta: IndexLike = index("water", "index of refraction")
    k: IndexLike = index(0.0, "extinction coefficient; above 0 it absorbs", zero=True)
    thickness: float = real(400.0, "where it is thickest", "nm", low=0.0, high=1e5)
    profile: TexturedNumber = real(
        1.0, "share of that thickness that is there", "", 0.0, 1.0, textured=True
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Material(Scatterer):
    """Base of all materials.

    A kind from outside of clpt is a leaf with a `source`: its OpenCL text, or the path of its file,
    from the folder of the module that defines the class.
    """

    bounds_body: ClassVar[bool] = False  # its shapes enclose bodies, which may have a priority
    is_composite: ClassVar[bool] = False  # it consists of other materials, and has no kernel file

    name: str = host("", "for messages and for references in scene files")

    # of a kind without such parameters
    absorption = cast(SpectrumLike, CLEAR)

    @property
    def is_sheet(self) -> bool:
        """Whether its surface has no inside."""
        return False

    @property
    def absorbs_inside(self) -> bool:
        return self.absorption != CLEAR

    @property
    def least_alpha(self) -> float:
        """The least roughness alpha of its specular lobes; 1 without such lobes, or by a texture.

        A coat over a diffuse base does not count.
        """
        return 1.0

    @property
    def shared_parts(self) -> dict[str, Material]:
        """The materials that it consists of, by their parameters."""
        if not self.is_composite:
            return {}
        return {name: v for name, v in fields_of(self).items() if isinstance(v, Material)}

    @property
    def inside_index(self) -> IndexLike:
        """The index of refraction behind the boundary."""
        return Constant(1.0)

    layers = cast("tuple[Layer, ...]", ())
