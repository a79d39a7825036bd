"""Roles of parameters: what a value may be, and what it means.

A role is an object, and tables have an entry for each: `clpt.render.records.materials` says
how a value stands in kernels, `clpt.render.materials.encoder` how it becomes words,
`clpt.render.materials.cases` how kernels load it, `clpt.formats.native.forms` how it is written
in scene.json, and `clpt.testing.settings` draws a value for a test.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeGuard, cast, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import arrays, spectra
from clpt.arrays import LARGEST
from clpt.errors import SceneError
from clpt.images.colour import from_hex
from clpt.measured import Measurement, MerlTable
from clpt.records import GRATING_SIZES
from clpt.spectra import (
    RGB,
    Constant,
    Reradiation,
    RGBIlluminant,
    RGBUnbounded,
    Spectrum,
    Tabulated,
)
from clpt.spectra.spectrum import Role as Meaning
from clpt.spectra.spectrum import check_reach, extremes

ORDERS = GRATING_SIZES["orders"]
ROUNDING = 1e-6  # largest excess of a spectrum over its limits


@dataclass(frozen=True)
class Role:
    """A role of a parameter; the base takes any value.

    name: in kernels and files. place: "row" for a value in a kind's row; "inside" for a value after
    it, of a body's inside; "host" for a value that kernels do not read. advice: for a number that
    is too large.
    """

    name: str
    place: Literal["row", "inside", "host"] = "row"
    advice: str = ""

    def __hash__(self) -> int:
        return hash(self.name)

    def __str__(self) -> str:
        return self.name

    def check(self, value: object, param: Param, where: str | None) -> Any:
        """Return the checked value of a parameter that is no texture. Raises SceneError."""
        return arrays.plain(value)


@dataclass(frozen=True)
class Param:
    """A parameter: role, documentation, unit, limits."""

    role: Role
    doc: str = ""
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    choices: tuple[str, ...] = ()
    optional: bool = False
    textured: bool = False
    lobe: bool = False  # 0 leaves a lobe out: kernels are made without it where all have 0
    positive: bool = False  # it cannot be 0 either, at any wavelength of the film
    linear: bool = False  # f is linear in it and no pdf knows it: a random texel may stand for it
    member: bool = False  # of a camera: a member of its record, which kernels read


class Real(Role):
    """A number within its limits."""

    def check(self, value: object, param: Param, where: str | None) -> float:
        number = arrays.number(value, where)
        if param.positive and number <= 0.0:
            raise SceneError(f"must be above 0, not {value}", where=where)
        if not param.low <= number <= param.high:
            advice = f"; {param.role.advice}" if param.role.advice and number > param.high else ""
            message = f"{value} is outside [{param.low:g}, {param.high:g}]{advice}"
            raise SceneError(message, where=where)
        return number


class Whole(Role):
    """A whole number; the kind that has it knows its limits."""

    def check(self, value: object, param: Param, where: str | None) -> int:
        return arrays.whole(value, where=where)


class Flag(Role):
    """True or false."""

    def check(self, value: object, param: Param, where: str | None) -> bool:
        return arrays.flag(value, where)


def _is_list(value: object) -> TypeGuard[list[Any] | tuple[Any, ...] | NDArray[Any]]:
    """Return whether a value is a list, or an array with an axis."""
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)


class Choice(Role):
    """A name of the parameter's list."""

    def check(self, value: object, param: Param, where: str | None) -> Any:
        known = isinstance(value, str) and value in param.choices
        if not known and not (param.optional and value is None):
            raise SceneError(f"{value!r} is none of {', '.join(param.choices)}", where=where)
        return value


class Orders(Role):
    """A number for each order of diffraction from -n to n."""

    def check(self, value: object, param: Param, where: str | None) -> tuple[float, ...]:
        if not _is_list(value):
            raise SceneError(f"must be a list of numbers, not {value!r}", where=where)
        if len(value) % 2 == 0 or len(value) > 2 * ORDERS + 1:
            raise SceneError(
                f"must be an odd count of numbers, for orders -n to n with n up to {ORDERS}",
                where=where,
            )
        return tuple(REAL.check(v, param, where) for v in value)


@runtime_checkable
class _Part(Protocol):
    """A part of a scene, as far as a list of layers looks at it."""

    kind: str


class Layers(Role):
    """Thin films, from the outside in."""

    def check(self, value: object, param: Param, where: str | None) -> tuple[Any, ...]:
        if not isinstance(value, (list, tuple)):
            message = "must be a list of clpt.scene.materials.Layer(eta=.., thickness=..)"
            raise SceneError(f"{message}, not {value!r}", where=where)
        for i, entry in enumerate(value):
            if not (isinstance(entry, _Part) and entry.kind == "layer"):
                message = "must be a clpt.scene.materials.Layer(eta=.., thickness=..)"
                raise SceneError(f"{message}, not {entry!r}", where=f"{where}[{i}]")
        return tuple(value)


@dataclass(frozen=True)
class Data(Role):
    """An object of a class, or None; words: what messages call it."""

    cls: type[Any] = object
    words: str = ""
    __hash__ = Role.__hash__

    def check(self, value: object, param: Param, where: str | None) -> Any:
        if not isinstance(value, (self.cls, type(None))):
            raise SceneError(f"must be {self.words}, not {value!r}", where=where)
        return value


@dataclass(frozen=True)
class Spectral(Role):
    """A spectrum, or a number, three numbers or a name for a spectrum.

    meaning: the conversion to rgb, see `clpt.spectra.spectrum`. colour: the class of three numbers
    in a file; None: they stay three numbers. codes: "#rrggbb" is a colour too, in sRGB. names:
    returns the spectrum of a name. measured: it is a quantity of matter; its tables hold their end
    values. grey: kernels have a separate load for a value without colour.
    """

    meaning: Meaning = "unbounded"
    colour: type[RGB] | type[RGBUnbounded] | None = RGBUnbounded
    codes: bool = False
    names: Callable[[str], Spectrum] | None = None
    measured: bool = False
    grey: bool = False
    __hash__ = Role.__hash__

    def check(self, value: object, param: Param, where: str | None) -> Any:
        if isinstance(value, str) and self.codes and value.startswith("#"):
            return self._colour(self._decoded(value, where), param, where)
        if isinstance(value, str) and self.names is not None:
            return self._named(value, where)
        if isinstance(value, Spectrum):
            self._check_limits(value, param, where)
            return value
        if arrays.is_number(value):
            return self._constant(REAL.check(value, param, where))
        if _is_list(value) and len(value) == 3:
            return self._colour([REAL.check(v, param, where) for v in value], param, where)
        names = (', "#rrggbb"' if self.codes else "") + (", a name" if self.names else "")
        raise SceneError(
            f"must be a number, three numbers{names} or a spectrum of clpt.spectra, not {value!r}",
            where=where,
        )

    def _decoded(self, code: str, where: str | None) -> list[float]:
        try:
            return list(from_hex(code))
        except SceneError as error:
            raise SceneError(error.message, where=where) from None

    def _named(self, name: str, where: str | None) -> Spectrum | str:
        assert self.names is not None
        try:
            return self.names(name)
        except SceneError as error:
            raise SceneError(error.message, where=where) from None

    def _colour(self, rgb: list[float], param: Param, where: str | None) -> Spectrum:
        return RGB(*rgb) if max(rgb) <= 1.0 else RGBUnbounded(*rgb)

    def _constant(self, number: float) -> Spectrum:
        return Constant(number)

    def _check_limits(self, value: Spectrum, param: Param, where: str | None) -> None:
        """Raise SceneError for a spectrum beyond its limits, or a table that no film can reach."""
        if isinstance(value, Tabulated):
            try:
                check_reach(value.lambdas[0], value.lambdas[-1])
            except SceneError as error:
                raise SceneError(error.message, where=where) from None
        if math.isinf(param.low) and math.isinf(param.high):
            return
        if isinstance(value, RGBUnbounded) and min(value.r, value.g, value.b) < self._least(param):
            shown = ", ".join(f"{part:g}" for part in (value.r, value.g, value.b))
            raise SceneError(f"a colour cannot be negative here: {shown}", where=where)
        for number, at in extremes(spectra.index(value) if self.measured else value):
            if abs(number) > LARGEST:
                message = f"{number:g} at {at:g} nm is beyond {LARGEST:g}, where float32 ends"
                raise SceneError(message, where=where)
            if not param.low - ROUNDING <= number <= param.high + ROUNDING:
                limits = f"[{param.low:g}, {param.high:g}]"
                raise SceneError(f"{number:g} at {at:g} nm is outside {limits}", where=where)

    def _least(self, param: Param) -> float:
        """Return the least number of a colour."""
        return param.low


class Index(Spectral):
    """A refractive index or extinction coefficient; the name of a glass stays a name."""

    def _named(self, name: str, where: str | None) -> str:
        super()._named(name, where)
        return name


class Emission(Spectral):
    """An emitted spectrum; a number and a colour are multiples of D65."""

    def check(self, value: object, param: Param, where: str | None) -> Any:
        spectrum = super().check(value, param, where)
        if type(spectrum) is RGB:
            return RGBIlluminant(spectrum.r, spectrum.g, spectrum.b)
        return spectrum

    def _colour(self, rgb: list[float], param: Param, where: str | None) -> Spectrum:
        return RGBIlluminant(*rgb)

    def _constant(self, number: float) -> Spectrum:
        return RGBIlluminant(*[number] * 3)


class Factor(Spectral):
    """A factor without limits."""

    def _colour(self, rgb: list[float], param: Param, where: str | None) -> Spectrum:
        return RGBUnbounded(*rgb)


class Coefficient(Spectral):
    """A coefficient of the inside of a body; a spectrum of 0 becomes the number 0."""

    def check(self, value: object, param: Param, where: str | None) -> Any:
        spectrum = super().check(value, param, where)
        is_zero = isinstance(spectrum, Spectrum) and all(
            number == 0.0 for number, _ in extremes(spectrum)
        )
        return Constant(0.0) if is_zero else spectrum


class Quantity(Factor):
    """A number that may depend on the wavelength and is no colour."""

    def _colour(self, rgb: list[float], param: Param, where: str | None) -> Spectrum:
        colour = super()._colour(rgb, param, where)
        self._check_limits(colour, param, where)
        return colour

    def _least(self, param: Param) -> float:
        return 0.0


REAL = Real("real")
FLAG = Flag("flag")
CHOICE = Choice("choice")
ORDERS_OF_LIGHT = Orders("orders")
LAYERS = Layers("layers")
ANGULAR = Role("angular")
RERADIATION = Data("reradiation", cls=Reradiation, words="a re-radiation matrix")
MEASUREMENT = Data("measurement", cls=Measurement, words="a Measurement of clpt.measured")
MERL = Data("merl", cls=MerlTable, words="a MerlTable of clpt.measured")
REFLECTANCE = Spectral(
    "reflectance",
    advice="colours are 0 to 1, linear",
    meaning="reflectance",
    colour=RGB,
    codes=True,
)
EMISSION = Emission(
    "emission", meaning="emission", colour=RGBIlluminant, codes=True, names=spectra.illuminant
)
INDEX = Index("index", names=spectra.index, measured=True, grey=True)
FACTOR = Factor("factor", codes=True)
COEFFICIENT = Coefficient("coefficient", "inside", measured=True)
QUANTITY = Quantity("quantity", measured=True, grey=True)
SPECTRA = (REFLECTANCE, EMISSION, INDEX, FACTOR, COEFFICIENT, QUANTITY)
DEVICE = (
    *SPECTRA, RERADIATION, REAL, FLAG, CHOICE, ORDERS_OF_LIGHT, LAYERS, ANGULAR, MEASUREMENT, MERL,
)  # fmt: skip
NAMED = {role.name: role for role in DEVICE}


@dataclass(frozen=True)
class OptionalReal(Real):
    """A number within its limits, or None."""

    def check(self, value: object, param: Param, where: str | None) -> Any:
        return None if value is None else super().check(value, param, where)


@dataclass(frozen=True)
class Vector(Role):
    """Three numbers; a direction is not (0, 0, 0)."""

    def check(self, value: object, param: Param, where: str | None) -> Any:
        try:
            numbers = np.asarray(cast("ArrayLike", value), np.float64)
        except (TypeError, ValueError):
            numbers = np.empty(0)
        if numbers.shape != (3,) or not np.isfinite(numbers).all():
            raise SceneError(f"must be three finite numbers, not {value!r}", where=where)
        if np.abs(numbers).max() > LARGEST:
            raise SceneError(f"is beyond {LARGEST:g}, where float32 ends", where=where)
        if self.name == "direction" and not numbers.any():
            raise SceneError("has no length", where=where)
        return value


@dataclass(frozen=True)
class Matrix(Role):
    """A square matrix; a matrix on a device is not checked."""

    def check(self, value: object, param: Param, where: str | None) -> Any:
        wanted = (3, 3) if self.name == "matrix3" else (4, 4)
        if hasattr(value, "context"):
            return value
        try:
            shape = np.asarray(cast("ArrayLike", value), np.float64).shape
        except (TypeError, ValueError) as error:
            raise SceneError(f"is not a matrix: {error}", where=where) from None
        if shape != wanted:
            raise SceneError(f"must be {wanted}, found {shape}", where=where)
        return value


_HOSTS: dict[str, type[Role]] = {
    "boolean": Flag, "integer": Whole, "number": Real, "optional_number": OptionalReal,
    "vector": Vector, "direction": Vector, "matrix3": Matrix, "matrix4": Matrix,
}  # fmt: skip
# The form of a host parameter. clpt/formats/native/forms.py reads, writes and describes each form.
HostForm = Literal[
    "boolean", "integer", "number", "text", "names", "numbers",
    "vector", "direction", "matrix3", "matrix4",
    "material", "medium", "media", "phase", "texture", "filter", "area_light", "group",
    "textures", "nodes",
    "rows2", "rows3", "rows4", "grid", "normals", "triangles", "attributes",
    "number_or_list", "lengths",
    "image", "volume", "colour_volume", "cube_images", "crop", "sensor", "white_balance",
    "number_or_auto", "lens", "keys", "deformation", "shutter", "optional_number", "metal", "size",
]  # fmt: skip


def host(form: HostForm | Literal["host"]) -> Role:
    """Return the role of a parameter of the host; "host": scene files cannot hold it."""
    return _HOSTS.get(form, Role)(form, "host")
