"""Declarations of the parameters of a kind.

A kind is a frozen dataclass that derives from `Kind`. One of the functions below declares each
field and gives it a role. The role decides which values it accepts, its type in the kernels, and
its entry in the documentation and the JSON schema:

=============  =====================================  ==========================  ===============
role           accepted                               in the kernel               texture
=============  =====================================  ==========================  ===============
reflectance    number, (r, g, b), Spectrum, Texture   Spectrum in [0, 1]          yes
emission       number, name, (r, g, b), ...           Spectrum, rgb times D65     area, envmap
index          number, name, Spectrum, Texture        Spectrum, unbounded         conductors
factor         number, (r, g, b), Spectrum, Texture   Spectrum, unbounded         yes
coefficient    number, (r, g, b), Spectrum            of the inside, in [1/m]     no
quantity       number, (r, g, b), Spectrum            Spectrum within its limits  no
angular        rows of numbers                        AngularTable                no
real           number, Texture                        real                        yes
reradiation    Reradiation, None                      Spectrum, its rows' sums    no
measurement    Measurement, None                      Measurement                 no
merl           MerlTable, None                        MerlTable                   no
flag           bool                                   int                         no
choice         one of the names listed                int, the name's position    no
orders         numbers of orders -n to n              real[17], of -8 to 8        no
layers         Layers, from the outside in            Layers                      their profile
host           what the lowering needs, see HostForm  -                           -
=============  =====================================  ==========================  ===============
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from clpt.errors import SceneError, UnusedParameterError
from clpt.measured import Measurement, MerlTable
from clpt.spectra import (
    RGB,
    Constant,
    Reradiation,
    RGBIlluminant,
    RGBUnbounded,
    Spectrum,
    Tabulated,
    illuminant,
)
from clpt.spectra import index as index_of
from clpt.spectra.spectrum import check_reach, extremes

SPECTRUM_ROLES = ("reflectance", "emission", "index", "factor", "coefficient", "quantity")
DEVICE_ROLES = (
    "reflectance", "emission", "index", "factor", "reradiation", "real", "flag", "choice", "orders",
    "layers", "quantity", "angular", "measurement",
    "merl",
)  # fmt: skip
# What a host parameter holds. clpt/formats/native/forms.py reads, writes and describes each form.
HostForm = Literal[
    "boolean", "integer", "number", "text", "names", "numbers",
    "vector", "direction", "matrix3", "matrix4",
    "material", "medium", "media", "phase", "texture", "filter", "area_light", "group",
    "rows2", "rows3", "rows4", "grid", "normals", "triangles", "attributes",
    "number_or_list", "lengths",
    "image", "volume", "colour_volume", "cube_images", "crop", "sensor", "white_balance",
    "number_or_auto", "lens", "keys", "deformation", "shutter", "optional_number", "metal", "size",
]  # fmt: skip
MEASURED = {"measurement": Measurement, "merl": MerlTable}
ORDERS = 8  # highest order of diffraction, see kernels/optics/diffraction.cl
MOST_PARTS, MOST_NESTED = 1000, 64  # of a material, texture, light or medium
ROUNDING = 1e-6  # by which a spectrum may be beyond its limits
LARGEST = float(np.finfo(np.float32).max)  # number of a parameter: kernels have no larger ones


@dataclass(frozen=True)
class Param:
    """One parameter: role (see the table above), documentation, unit, limits, form in files.

    form: of a host parameter, "" where a scene file cannot hold it.
    """

    role: str
    doc: str
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    choices: tuple[str, ...] = ()
    optional: bool = False
    textured: bool = False
    form: str = ""
    lobe: bool = False  # 0 leaves a lobe out: kernels are made without it where all have 0
    positive: bool = False  # it cannot be 0 either, at any wavelength of the film
    linear: bool = False  # f is linear in it and no pdf knows it: a random texel may stand for it


def _field(default: Any, param: Param) -> Any:
    if isinstance(default, (list, dict, np.ndarray)):
        return field(default_factory=lambda: default, metadata={"param": param})
    return field(default=default, metadata={"param": param})


def reflectance(
    default: Any,
    doc: str,
    *,
    lobe: bool = False,
    linear: bool = False,
    limited: bool = True,
    textured: bool = True,
) -> Any:
    """Declare a spectrum in [0, 1]; may be a texture where `textured`. `lobe`, `linear`: see
    `Param`.

    limited: False where it may be a number of any kind, as what textures are made of.
    """
    low, high = (0.0, 1.0) if limited else (-math.inf, math.inf)
    return _field(
        default,
        Param("reflectance", doc, "", low, high, textured=textured, lobe=lobe, linear=linear),
    )


def emission(default: Any, doc: str, unit: str, *, textured: bool = False) -> Any:
    """Declare an emitted spectrum; a number or an rgb triple means that multiple of D65."""
    return _field(default, Param("emission", doc, unit, low=0.0, textured=textured))


def index(default: Any, doc: str, *, zero: bool = False, textured: bool = False) -> Any:
    """Declare a refractive index or extinction coefficient; may be a name or dispersive.

    zero: it may be 0, as a metal's eta and k may.
    """
    return _field(default, Param("index", doc, low=0.0, textured=textured, positive=not zero))


def factor(default: Any, doc: str) -> Any:
    """Declare a factor: a spectrum without limits; may be a texture."""
    return _field(default, Param("factor", doc, textured=True))


def coefficient(default: Any, doc: str, unit: str = "1/m") -> Any:
    """Declare a property of the inside of a body; it is no member of its kind's struct.

    It acts between surfaces: kernels/media/medium.cl reads it after the kind's row.
    """
    return _field(default, Param("coefficient", doc, unit, low=0.0))


def quantity(default: Any, doc: str, low: float = -math.inf, high: float = math.inf) -> Any:
    """Declare a number that may depend on the wavelength and is no colour, with its limits."""
    return _field(default, Param("quantity", doc, low=low, high=high))


def angular(doc: str) -> Any:
    """Declare a table over the cosine of an angle; `clpt.scene.media.Tabulated` says of what."""
    return _field((1.0, 1.0), Param("angular", doc))


def reradiation(default: Any, doc: str) -> Any:
    """Declare a re-radiation matrix; None for no fluorescence."""
    return _field(default, Param("reradiation", doc))


def measurement(doc: str) -> Any:
    """Declare what was measured of a material; None for a matt grey."""
    return _field(None, Param("measurement", doc))


def merl(doc: str) -> Any:
    """Declare a table of MERL; None for a matt grey."""
    return _field(None, Param("merl", doc))


def real(
    default: Any,
    doc: str,
    unit: str = "",
    low: float = -math.inf,
    high: float = math.inf,
    *,
    textured: bool = False,
    lobe: bool = False,
) -> Any:
    """Declare a number with its limits; may be a texture where `textured`. `lobe`: see `Param`."""
    return _field(default, Param("real", doc, unit, low, high, textured=textured, lobe=lobe))


def flag(default: bool, doc: str) -> Any:
    """Declare true or false."""
    return _field(default, Param("flag", doc))


def choice(default: str | None, doc: str, choices: Sequence[str]) -> Any:
    """Declare one of several names; with the default None, also None."""
    optional = default is None
    return _field(default, Param("choice", doc, choices=tuple(choices), optional=optional))


def per_order(default: Sequence[float], doc: str) -> Any:
    """Declare a number for each order of diffraction from -n to n, n at most ORDERS."""
    return _field(tuple(default), Param("orders", doc, low=0.0))


def layers(doc: str) -> Any:
    """Declare the thin films on a boundary; none by default."""
    return _field((), Param("layers", doc))


def host(
    default: Any,
    doc: str,
    unit: str = "",
    *,
    form: HostForm | None = None,
    positive: bool = False,
) -> Any:
    """Declare what only the host needs: geometry, matrices, nested kinds.

    form: what it holds; None for what the type of the default implies. positive: of a number.
    """
    low = 0.0 if positive else -math.inf
    made = Param("host", doc, unit, low, form=form or _form_of(default), positive=positive)
    return _field(default, made)


def _form_of(default: Any) -> str:
    """Return the HostForm that a default's type implies, "" where it implies none."""
    if isinstance(default, np.ndarray) and default.shape in ((3, 3), (4, 4)):
        return f"matrix{len(default)}"
    if isinstance(default, tuple) and default:
        if isinstance(default[0], str):
            return "names"
        return "vector" if len(default) == 3 else "numbers"
    forms: dict[type, str] = {bool: "boolean", int: "integer", float: "number", str: "text"}
    return forms.get(type(default), "")


@dataclass(frozen=True)
class Shorthand:
    """Arguments of a kind that stand for some of its parameters.

    arguments: what each is, by its name. stands_for: the parameters. spell: called with those of
    the arguments that are given, returns values of the parameters by name.
    """

    arguments: Mapping[str, Param]
    stands_for: tuple[str, ...]
    spell: Callable[..., dict[str, Any]]


class classproperty:
    """A read-only property of a class."""

    def __init__(self, function: Callable[[Any], str]):
        self.function = function

    def __get__(self, _: Any, owner: type) -> str:
        return self.function(owner)


class KindType(type):
    """The type of kinds: what all of them do with the arguments that they are called with.

    A name that the kind does not have raises UnusedParameterError with the nearest ones. Shorthands
    become the parameters that they stand for. What is wrong with an object tells its name.
    """

    def __call__(cls, /, *values: object, **given: object) -> Any:
        kind = cast("type[Kind]", cls)
        if values:
            example = next(iter((*device_params(kind), *_field_names(kind))), "")
            message = f"{cls.__name__} takes its parameters by name: {cls.__name__}({example}=...)"
            raise TypeError(message)
        try:
            return super().__call__(**_spelled_out(kind, given))
        except SceneError as error:
            name, where = given.get("name"), error.where or kind.kind
            if name and isinstance(name, str) and where.startswith(kind.kind):
                error.place_at(f"{kind.kind} {name!r}{where.removeprefix(kind.kind)}")
            raise


def _spelled_out(kind: type[Kind], given: dict[str, object]) -> dict[str, object]:
    """Return arguments of a kind without shorthands. Raises SceneError, UnusedParameterError."""
    known, short = _field_names(kind), shorthands(kind)
    for name in given:
        if name not in known and name not in short:
            raise UnusedParameterError(kind.kind, name, (*known, *short))
    plain = {name: value for name, value in given.items() if name not in short}
    for shorthand in kind.shorthands:
        asked = {name: given[name] for name in shorthand.arguments if given.get(name) is not None}
        for name in shorthand.stands_for if asked else ():
            if name in plain:
                first = next(iter(asked))
                message = f"{first!r} stands for {name!r} too; give either"
                raise SceneError(message, where=f"{kind.kind}.{first}")
        try:
            plain |= shorthand.spell(**asked) if asked else {}
        except SceneError as error:
            error.place_at(f"{kind.kind}.{error.where or next(iter(asked))}")
            raise
    return plain


@dataclass(frozen=True, kw_only=True, eq=False)
class Kind(metaclass=KindType):
    """Base of all kinds; the class name gives the name in files and kernels."""

    shorthands: ClassVar[tuple[Shorthand, ...]] = ()
    needs_wavelengths: ClassVar[bool] = False  # its struct in the kernels has `lambdas`
    # Where all numbers of one of these are above 0, its struct has the `luminance` of `base_color`,
    # and its kernel file includes core/luminance.cl.
    tints: ClassVar[tuple[tuple[str, ...], ...]] = ()
    is_tree: ClassVar[bool] = True  # its parts become one text in the kernels, each at every use
    _size: ClassVar[tuple[int, int]] = (1, 1)  # of an object: its parts, and how deep they lie

    @classproperty
    def kind(cls) -> str:
        """The name in scene files and kernels: RoughConductor -> rough_conductor."""
        return _snake(cls.__name__)  # type: ignore[attr-defined]

    def __post_init__(self) -> None:
        parts, depth = 1, 0
        for name, param in params(type(self)).items():
            value = _checked(getattr(self, name), param, f"{self.kind}.{name}")
            object.__setattr__(self, name, value)
            for inner in value if isinstance(value, tuple) else (value,):
                if isinstance(inner, Kind):
                    parts, depth = parts + inner._size[0], max(depth, inner._size[1])
        object.__setattr__(self, "_size", (parts, depth + 1))
        if self.is_tree and (parts > MOST_PARTS or depth >= MOST_NESTED):
            message = f"has more than {MOST_PARTS} parts, shared ones counted at each use"
            if parts <= MOST_PARTS:
                message = f"is nested deeper than {MOST_NESTED} parts"
            raise SceneError(message, where=self.kind)
        self.check()

    def check(self) -> None:
        """Raise SceneError where the parameters contradict each other."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Texture(Kind):
    """Base of all textures."""

    is_texture = True


@cache
def _snake(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


@cache  # thousands of objects ask
def _declared(cls: Any) -> Mapping[str, Param]:
    fields = dataclasses.fields(cls)
    return MappingProxyType({f.name: f.metadata["param"] for f in fields if "param" in f.metadata})


@cache
def _declared_of(cls: Any, *roles: str) -> Mapping[str, Param]:
    return MappingProxyType({name: p for name, p in _declared(cls).items() if p.role in roles})


def params(cls: type) -> Mapping[str, Param]:
    """Return the declared parameters of a kind, by name, in their order."""
    return _declared(cls)


@cache
def shorthands(cls: type[Kind]) -> Mapping[str, Param]:
    """Return the arguments of a kind that stand for parameters, by name; see `Shorthand`."""
    merged = {name: param for one in cls.shorthands for name, param in one.arguments.items()}
    return MappingProxyType(merged)


def defaults(cls: type) -> dict[str, Any]:
    """Return the defaults of a kind's declared parameters, by name."""
    fields = {f.name: f for f in dataclasses.fields(cls) if "param" in f.metadata}
    return {
        name: f.default if f.default_factory is dataclasses.MISSING else f.default_factory()
        for name, f in fields.items()
    }


def fields_of(kind: Kind) -> dict[str, Any]:
    """Return the values of an object's fields by name."""
    cls: Any = type(kind)
    return {name: getattr(kind, name) for name in _field_names(cls)}


@cache
def _field_names(cls: Any) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(cls))


def place_of(kind: Kind, name: str) -> str:
    """Return the name of a parameter for messages, with the name of its material."""
    named = getattr(kind, "name", "")
    return f"{kind.kind}.{name}" + (f" of {named!r}" if named else "")


def device_params(cls: type) -> Mapping[str, Param]:
    """Return the parameters that the kernels read."""
    return _declared_of(cls, *DEVICE_ROLES)


def interior_params(cls: type) -> Mapping[str, Param]:
    """Return the parameters of the inside of a body; they follow the others in its row."""
    return _declared_of(cls, "coefficient")


def _checked(value: Any, param: Param, where: str) -> Any:
    if param.role == "host" and param.form in _CHECKED_FORMS:
        return _CHECKED_FORMS[param.form](value, param, where)
    if param.role in ("host", "angular"):
        return value
    if param.role == "flag":
        if not isinstance(value, (bool, np.bool_)):
            raise SceneError(f"must be true or false, not {value!r}", where=where)
        return bool(value)
    if param.role == "choice":
        if value not in param.choices and not (param.optional and value is None):
            raise SceneError(f"{value!r} is none of {', '.join(param.choices)}", where=where)
        return value
    if param.role == "layers":
        return _layers(value, where)
    if param.role == "reradiation":
        if not isinstance(value, (Reradiation, type(None))):
            raise SceneError(f"must be a re-radiation matrix, not {value!r}", where=where)
        return value
    if param.role in MEASURED:
        if not isinstance(value, (MEASURED[param.role], type(None))):
            name = MEASURED[param.role].__name__
            raise SceneError(f"must be a {name} of clpt.measured, not {value!r}", where=where)
        return value
    if getattr(value, "is_texture", False):
        if not param.textured:
            raise SceneError("cannot be a texture", where=where)
        return value
    if param.role == "real":
        return check_number(value, param, where)
    if param.role == "orders":
        return _orders(value, param, where)
    return _spectrum(value, param, where)


def _layers(value: Any, where: str) -> tuple[Kind, ...]:
    if not isinstance(value, (list, tuple)):
        raise SceneError(f"must be a list of layers, not {value!r}", where=where)
    for i, entry in enumerate(value):
        if not (isinstance(entry, Kind) and entry.kind == "layer"):
            raise SceneError(f"must be a layer, not {entry!r}", where=f"{where}[{i}]")
    return tuple(value)


def check_number(value: Any, param: Param, where: str | None = None) -> float:
    """Return the value of a number's parameter. Raises SceneError."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise SceneError(f"must be a number, not {value!r}", where=where)
    if not math.isfinite(value):
        raise SceneError(f"must be finite, not {value}", where=where)
    if abs(value) > LARGEST:
        raise SceneError(f"{value:g} is beyond {LARGEST:g}, where float32 ends", where=where)
    if param.positive and value <= 0.0:
        raise SceneError(f"must be above 0, not {value}", where=where)
    if not param.low <= value <= param.high:
        advice = (
            "; colours are 0 to 1, linear" if param.role == "reflectance" and value > 1.0 else ""
        )
        message = f"{value} is outside [{param.low:g}, {param.high:g}]{advice}"
        raise SceneError(message, where=where)
    return float(value)


def _vector(value: object, param: Param, where: str) -> Any:
    """Check three numbers; those of a direction cannot all be 0."""
    try:
        numbers = np.asarray(cast("ArrayLike", value), np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise SceneError(f"must be three finite numbers, not {value!r}", where=where)
    if np.abs(numbers).max() > LARGEST:
        raise SceneError(f"is beyond {LARGEST:g}, where float32 ends", where=where)
    if param.form == "direction" and not numbers.any():
        raise SceneError("has no length", where=where)
    return value


def _matrix(value: object, param: Param, where: str) -> Any:
    """Check the form of a matrix that is not on a device."""
    if isinstance(value, np.ndarray) and value.shape == _MATRICES[param.form]:
        return value
    if hasattr(value, "context"):
        return value
    try:
        shape = np.asarray(cast("ArrayLike", value), np.float64).shape
    except (TypeError, ValueError) as error:
        raise SceneError(f"is not a matrix: {error}", where=where) from None
    if shape != _MATRICES[param.form]:
        raise SceneError(f"must be {_MATRICES[param.form]}, found {shape}", where=where)
    return value


_MATRICES = {"matrix3": (3, 3), "matrix4": (4, 4)}


def _optional_number(value: object, param: Param, where: str) -> float | None:
    return None if value is None else check_number(value, param, where)


_CHECKED_FORMS: dict[str, Callable[[Any, Param, str], Any]] = {
    "number": check_number,
    "optional_number": _optional_number,
    "vector": _vector,
    "direction": _vector,
    "matrix3": _matrix,
    "matrix4": _matrix,
}


def _orders(value: Any, param: Param, where: str) -> tuple[float, ...]:
    if not isinstance(value, (list, tuple, np.ndarray)):
        raise SceneError(f"must be a list of numbers, not {value!r}", where=where)
    if len(value) % 2 == 0 or len(value) > 2 * ORDERS + 1:
        raise SceneError(
            f"must be an odd count of numbers, for orders -n to n with n up to {ORDERS}",
            where=where,
        )
    return tuple(check_number(v, param, where) for v in value)


def _spectrum(value: Any, param: Param, where: str) -> Any:
    if isinstance(value, str) and param.role in ("index", "emission"):
        try:
            known = index_of(value) if param.role == "index" else illuminant(value)
        except SceneError as error:
            raise SceneError(error.message, where=where) from None
        return value if param.role == "index" else known
    if isinstance(value, Spectrum):
        _check_spectrum(value, param, where)
        return value
    if isinstance(value, (list, tuple, np.ndarray)) and len(value) == 3:
        bounded = param.role not in ("factor", "quantity") and max(value) <= 1.0
        made = RGB if bounded or param.role == "emission" else RGBUnbounded
        colour = made(*(check_number(v, param, where) for v in value))
        if param.role == "quantity":
            _check_spectrum(colour, param, where)
        return colour
    if isinstance(value, (int, float, np.number)):
        number = check_number(value, param, where)
        return RGBIlluminant(*[number] * 3) if param.role == "emission" else Constant(number)
    names = ", a name" if param.role in ("index", "emission") else ""
    raise SceneError(
        f"must be a number, three numbers{names} or a spectrum of clpt.spectra, not {value!r}",
        where=where,
    )


def _check_spectrum(value: Spectrum, param: Param, where: str) -> None:
    """Raise SceneError for a spectrum beyond its limits, or a table that no film can reach."""
    if isinstance(value, Tabulated):
        try:
            check_reach(value.lambdas[0], value.lambdas[-1])
        except SceneError as error:
            raise SceneError(error.message, where=where) from None
    if math.isinf(param.low) and math.isinf(param.high):
        return
    least = 0.0 if param.role == "quantity" else param.low
    if isinstance(value, RGBUnbounded) and min(value.r, value.g, value.b) < least:
        shown = ", ".join(f"{part:g}" for part in (value.r, value.g, value.b))
        raise SceneError(f"a colour cannot be negative here: {shown}", where=where)
    meant = index_of(value) if param.role in ("index", "coefficient", "quantity") else value
    for found, at in extremes(meant):
        if abs(found) > LARGEST:
            message = f"{found:g} at {at:g} nm is beyond {LARGEST:g}, where float32 ends"
            raise SceneError(message, where=where)
        if not param.low - ROUNDING <= found <= param.high + ROUNDING:
            raise SceneError(
                f"{found:g} at {at:g} nm is outside [{param.low:g}, {param.high:g}]", where=where
            )
