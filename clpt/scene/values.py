"""Values of parameters: their types, the base of textures, and functions of constants and textures.

The dataclasses convert their arguments: a colour becomes a `clpt.spectra.Spectrum`. So the value of
a parameter has such a type too.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Literal, Protocol, TypeAlias, TypeGuard, cast

import numpy as np
from numpy.typing import NDArray

from clpt import spectra
from clpt.arrays import Floats
from clpt.images.spectral_exr import SpectralImage
from clpt.scene.params import Kind, fields_of, params
from clpt.scene.roles import FACTOR, REAL, REFLECTANCE, Role
from clpt.spectra import Constant, Spectrum, Tabulated, cie
from clpt.spectra.spectrum import d65, primaries


class OnDevice(Protocol):
    """An array or a buffer of PyOpenCL, in a device's memory."""

    @property
    def context(self) -> Any: ...


class Look(Protocol):
    """The weights of emissions for a film, see `clpt.render.spectra.find.Look`."""

    def brightness(self, light: Spectrum) -> float:
        """Return the weight of a spectrum."""

    def levels(self, image: Any) -> Floats:
        """Return the weights of the texels of a bitmap (h, w), top row first."""

    @property
    def white(self) -> float:
        """The weight of a white light whose channels are 1."""


Attributes = Mapping[str, Any]  # values (m, c) of mesh attributes at faces, by name
Use = Literal["own", "factor", "real"]  # an operand's role: the texture's, a reflectance, a number
Operation = tuple[str, tuple[tuple[Any, Use], ...]]  # its name, and its operands with their uses


@dataclass(frozen=True, kw_only=True, eq=False)
class Texture(Kind):
    """Base of all textures.

    factor_name: the parameter that stays a factor in an emission, "" without such a parameter;
    attributes: the names of the mesh attributes that the texture itself reads; fills: "uv" or
    "space", where its pattern lies, or ""; alpha: whether it has a fourth channel.
    """

    is_texture = True
    attributes: ClassVar[tuple[str, ...]] = ()
    fills: ClassVar[str] = ""
    alpha: ClassVar[bool] = False

    def record_members(self) -> dict[str, Any]:
        """Return members of its record beside its place and its colours, by name."""
        return {}

    @property
    def factor_name(self) -> str:
        return ""

    @property
    def identity(self) -> Any:
        """A key that is equal for textures with the same values; by default the object's id."""
        return id(self)

    @property
    def combines(self) -> bool:
        """Whether it combines other values: its row is then a program of operations."""
        return False

    def operation(self, use: Use, role: Role) -> Operation | None:
        """Return the last operation of its program, "multiply" or "mix"; None: it has none.

        use: of its value as an operand; role: of the whole program. A constant operand is a
        spectrum; in the use "real" it is a number.
        """
        return None

    def folded(self, role: Role) -> Any:
        """Return the texture with its constants combined in a role, where that is exact.

        The result is a constant or a texture. In the role REAL constants become numbers.
        """
        return self

    def separated(self, role: Role) -> Any:
        """Return the texture with RGB products of colours as sums of products of numbers."""
        return self

    def channel_factors(self, channel: int) -> list[Any]:
        """Return numbers, and textures of numbers, whose product is a channel 0 to 2 of it."""
        return [self.with_channel("rgb"[channel])]

    def with_channel(self, channel: str) -> Texture:
        """Return it as numbers of a channel of "rgba"; a pattern of numbers is its own."""
        return self

    def mean(self, look: Look) -> float:
        """Return its mean brightness as an emission; a guess costs noise and no truth."""
        return 0.5

    def brightness_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        """Return its brightness as an emission at uv (m, k, 2), by default its mean, (m, k).

        area (m,): of a lookup, in uv; attributes: values (m, c) of mesh attributes, by name.
        """
        return np.full(uv.shape[:2], self.mean(look))

    def number_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        """Return its number at uv (m, k), see `brightness_at`."""
        return self.brightness_at(look, uv, area, attributes)

    def clamped_at_poles(self) -> Texture:
        """Return it as an image around a point, whose last rows do not wrap to the first."""
        parts = {n: v.clamped_at_poles() for n, v in fields_of(self).items() if is_texture(v)}
        return dataclasses.replace(self, **parts) if parts else self

    def normalized(self) -> tuple[float, Texture]:
        """Return a scale, and the texture over that scale with values up to 1 if it has others."""
        return 1.0, self

    def check_use(self, *, emissive: bool) -> None:
        """Raise SceneError for a projective transform, and for an image of the wrong spectra.

        emissive: whether its parameter holds light. Image files are not read.
        """
        for name, param in params(type(self)).items():
            part = fields_of(self)[name]
            if is_texture(part):
                coloured = param.role in (FACTOR, REFLECTANCE)
                part.check_use(emissive=emissive and coloured and name != self.factor_name)


SpectrumLike: TypeAlias = float | Sequence[float] | NDArray[Any] | Spectrum
"""A number for all wavelengths, (r, g, b) linear Rec. 709, or a spectrum."""
Textured: TypeAlias = SpectrumLike | Texture
"""The same, or a texture that varies it over a surface."""
IndexLike: TypeAlias = SpectrumLike | str
"""An index of refraction: also a name, such as "diamond"."""
TexturedNumber: TypeAlias = float | Texture
"""A number, or a texture that varies it over a surface."""
Vector3: TypeAlias = Sequence[float] | NDArray[Any]
"""(3,) float: a point or a direction."""
Matrix4: TypeAlias = NDArray[Any] | Sequence[Sequence[float]]
"""(4, 4) float: a transform; column vectors, so that `a @ b` applies b first."""
ImageLike: TypeAlias = str | os.PathLike[str] | NDArray[Any] | SpectralImage
"""The path of an image file, or its texels (h, w) or (h, w, c)."""


def is_texture(value: object) -> TypeGuard[Texture]:
    """Return whether the value of a parameter is a texture, else it is a constant."""
    return isinstance(value, Texture)


def folded(value: object, role: Role) -> Any:
    """Return a value with its constants combined in a role, see `Texture.folded`."""
    return value.folded(role) if is_texture(value) else value


def separated(value: object, role: Role) -> Any:
    """Return a value with RGB products as sums, see `Texture.separated`."""
    return value.separated(role) if is_texture(value) else value


def channel_factors(value: object, channel: int) -> list[Any]:
    """Return the factors of a channel of a value, see `Texture.channel_factors`."""
    if is_texture(value):
        return value.channel_factors(channel)
    assert isinstance(value, Spectrum)
    return [float(value.to_rgb("unbounded")[channel])]


def constant_number(value: object, role: Role) -> float | None:
    """Return the number of a constant in a role; None for a texture, a colour and a spectrum."""
    if isinstance(value, (int, float)):
        return float(value)
    if isinstance(value, Constant):
        return float(value.value)
    if role is REAL and isinstance(value, Spectrum):
        return float(spectra.luminance(value.to_rgb("unbounded")))
    return None


def mean(value: object, look: Look) -> float:
    """Return the mean brightness of a value as an emission; a number is itself."""
    if is_texture(value):
        return value.mean(look)
    return look.brightness(value) if isinstance(value, Spectrum) else float(cast(float, value))


def brightness_at(
    value: object, look: Look, uv: Floats, area: Floats, attributes: Attributes
) -> Floats:
    """Return the brightness of a value at uv, see `Texture.brightness_at`."""
    if is_texture(value):
        return value.brightness_at(look, uv, area, attributes)
    return np.full(uv.shape[:2], mean(value, look))


@cache
def scaled_primary(number: int, times: float, light: bool) -> Tabulated:
    """Return the spectrum of a primary of Rec. 709, 0 to 2, times a number, and D65 for light."""
    values = times * primaries()[number].sample(cie.GRID)
    return Tabulated(cie.GRID, values * d65().sample(cie.GRID) if light else values, "hold")
