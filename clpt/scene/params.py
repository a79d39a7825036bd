"""Declarations of the parameters of a kind.

A kind is a frozen dataclass that derives from `Kind`. The functions below declare each field
and give it a role (`clpt.scene.roles`). The role decides which values it accepts, its type
in the kernels, and its entry in the documentation and the JSON schema:

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
choice         a name of a list                       int, the name's position    no
orders         numbers of orders -n to n              real[17], of -8 to 8        no
layers         Layers, from the outside in            Layers                      their profile
host forms     what the lowering needs, see HostForm  -                           -
=============  =====================================  ==========================  ===============
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from operator import attrgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Literal, cast

import numpy as np

from clpt.arrays import check_unmasked, in_memory
from clpt.errors import SceneError, UnusedParameterError
from clpt.files import budget
from clpt.scene import roles
from clpt.scene.roles import HostForm, Param
from clpt.spectra import Constant, Spectrum

if TYPE_CHECKING:
    from typing_extensions import Self

PLAIN = {bool, int, float, str, type(None)}  # types of most values
MOST_PARTS, MOST_NESTED = 1000, 64  # of a material, texture, light or medium


def _field(default: object, param: Param) -> Any:
    if isinstance(default, (list, dict, np.ndarray)):
        return field(default_factory=lambda: default, metadata={"param": param})
    return field(default=default, metadata={"param": param})


def reflectance(
    default: object,
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
        Param(roles.REFLECTANCE, doc, "", low, high, textured=textured, lobe=lobe, linear=linear),
    )


def emission(default: object, doc: str, unit: str, *, textured: bool = False) -> Any:
    """Declare an emitted spectrum; a number or an rgb triple means that multiple of D65."""
    return _field(default, Param(roles.EMISSION, doc, unit, low=0.0, textured=textured))


def index(default: object, doc: str, *, zero: bool = False, textured: bool = False) -> Any:
    """Declare a refractive index or extinction coefficient; may be a name or dispersive.

    zero: it may be 0, as a metal's eta and k may.
    """
    return _field(default, Param(roles.INDEX, doc, low=0.0, textured=textured, positive=not zero))


def factor(default: object, doc: str) -> Any:
    """Declare a factor: a spectrum without limits; may be a texture."""
    return _field(default, Param(roles.FACTOR, doc, textured=True))


def coefficient(default: object, doc: str, unit: str = "1/m") -> Any:
    """Declare a property of the inside of a body; it is no member of its kind's struct.

    It acts between surfaces: kernels/media/medium.cl reads it after the kind's row.
    """
    return _field(default, Param(roles.COEFFICIENT, doc, unit, low=0.0))


def quantity(default: object, doc: str, low: float = -math.inf, high: float = math.inf) -> Any:
    """Declare a number that may depend on the wavelength and is no colour, with its limits."""
    return _field(default, Param(roles.QUANTITY, doc, low=low, high=high))


def angular(doc: str) -> Any:
    """Declare a table over the cosine of an angle; see `clpt.scene.phases.Tabulated`."""
    return _field((1.0, 1.0), Param(roles.ANGULAR, doc))


def reradiation(default: object, doc: str) -> Any:
    """Declare a re-radiation matrix; None for no fluorescence."""
    return _field(default, Param(roles.RERADIATION, doc))


def measurement(doc: str) -> Any:
    """Declare what was measured of a material; None for a matt grey."""
    return _field(None, Param(roles.MEASUREMENT, doc))


def merl(doc: str) -> Any:
    """Declare a table of MERL; None for a matt grey."""
    return _field(None, Param(roles.MERL, doc))


def real(
    default: object,
    doc: str,
    unit: str = "",
    low: float = -math.inf,
    high: float = math.inf,
    *,
    textured: bool = False,
    lobe: bool = False,
) -> Any:
    """Declare a number with its limits; may be a texture where `textured`. `lobe`: see `Param`."""
    return _field(default, Param(roles.REAL, doc, unit, low, high, textured=textured, lobe=lobe))


def member(default: object, doc: str, unit: str = "", low: float = -math.inf) -> Any:
    """Declare a number of a camera that kernels read: a member of its record."""
    return _field(default, Param(roles.REAL, doc, unit, low, member=True))


def flag(default: bool, doc: str) -> Any:
    """Declare true or false."""
    return _field(default, Param(roles.FLAG, doc))


def choice(default: str | None, doc: str, choices: Sequence[str]) -> Any:
    """Declare a choice between names; with the default None, also None."""
    optional = default is None
    return _field(default, Param(roles.CHOICE, doc, choices=tuple(choices), optional=optional))


def per_order(default: Sequence[float], doc: str) -> Any:
    """Declare a number for each order of diffraction from -n to n, n at most 8."""
    return _field(tuple(default), Param(roles.ORDERS_OF_LIGHT, doc, low=0.0))


def layers(doc: str) -> Any:
    """Declare the thin films on a boundary; none by default."""
    return _field((), Param(roles.LAYERS, doc))


def host(
    default: object,
    doc: str,
    unit: str = "",
    *,
    form: HostForm | None = None,
    positive: bool = False,
) -> Any:
    """Declare what only the host needs: geometry, matrices, nested kinds.

    form: of its values; None: implied by the type of the default. positive: of a number.
    """
    role, low = roles.host(form or _form_of(default)), 0.0 if positive else -math.inf
    return _field(default, Param(role, doc, unit, low, positive=positive))


def _form_of(default: object) -> HostForm | Literal["host"]:
    """Return the HostForm that a default's type implies, "host" where it implies none."""
    if isinstance(default, np.ndarray) and default.shape in ((3, 3), (4, 4)):
        return "matrix3" if len(default) == 3 else "matrix4"
    if isinstance(default, tuple) and default:
        if isinstance(default[0], str):
            return "names"
        return "vector" if len(default) == 3 else "numbers"
    return _FORMS.get(type(default), "host")


_FORMS: dict[type, HostForm] = {bool: "boolean", int: "integer", float: "number", str: "text"}


@dataclass(frozen=True)
class Shorthand:
    """Arguments of a kind that stand for some of its parameters.

    arguments: the declaration of each, by its name. stands_for: the parameters. spell: takes the
    arguments that a caller passes, and returns values of the parameters by name.
    """

    arguments: Mapping[str, Param]
    stands_for: tuple[str, ...]
    spell: Callable[..., dict[str, Any]]


class KindType(type):
    """The type of kinds: it checks the arguments of a call.

    An unknown name raises UnusedParameterError with the nearest names. Shorthands become the
    parameters that they stand for. Errors contain the object's name.
    """

    def __call__(cls, /, *values: object, **arguments: object) -> Any:
        kind = cast("type[Kind]", cls)
        budget.check_time()
        if values:
            example = next(iter((*device_params(kind), *_field_names(kind))), "")
            message = f"{cls.__name__} takes its parameters by name: {cls.__name__}({example}=...)"
            raise TypeError(message)
        try:
            plain = _spelled_out(kind, arguments)
            held = {n: v if type(v) in PLAIN else in_memory(v) for n, v in plain.items()}
            return super().__call__(**held)
        except SceneError as error:
            name, where = arguments.get("name"), error.where or kind.kind
            if name and isinstance(name, str) and where.startswith(kind.kind):
                error.place_at(f"{kind.kind} {name!r}{where.removeprefix(kind.kind)}")
            raise


OF_FILES = {  # keys of objects in a scene file, and what Python has instead
    "file": "clpt.load reads a scene.json that has it, a mesh also by itself",
    "type": "in Python the class says it",
}


def _spelled_out(kind: type[Kind], arguments: dict[str, object]) -> dict[str, object]:
    """Return arguments of a kind without shorthands. Raises SceneError, UnusedParameterError."""
    known, short = _field_names(kind), shorthands(kind)
    for name in arguments:
        if name in OF_FILES:
            raise SceneError(f"{name!r} is for scene files: {OF_FILES[name]}", where=kind.kind)
        if name not in known and name not in short:
            raise UnusedParameterError(kind.kind, name, (*known, *short))
    plain = {name: value for name, value in arguments.items() if name not in short}
    for shorthand in kind.shorthands:
        spelled = {
            name: arguments[name] for name in shorthand.arguments if arguments.get(name) is not None
        }
        for name, value in spelled.items():
            check_unmasked(value, f"{kind.kind}.{name}")
        for name in shorthand.stands_for if spelled else ():
            if name in plain:
                first = next(iter(spelled))
                message = f"{first!r} stands for {name!r} too; give either"
                raise SceneError(message, where=f"{kind.kind}.{first}")
        try:
            plain |= shorthand.spell(**spelled) if spelled else {}
        except SceneError as error:
            error.place_at(f"{kind.kind}.{error.where or next(iter(spelled))}")
            raise
    return plain


def _snake(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


@dataclass(frozen=True, kw_only=True, eq=False)
class Kind(metaclass=KindType):
    """Base of all kinds; the class name gives the name in files and kernels.

    kind: that name, RoughConductor -> rough_conductor.
    """

    kind: ClassVar[str] = "kind"
    shorthands: ClassVar[tuple[Shorthand, ...]] = ()
    needs_wavelengths: ClassVar[bool] = False  # its struct in the kernels has `lambdas`
    # Groups of parameters. Where all parameters of a group are above 0, its struct has the
    # `luminance` of `base_color`, and its kernel file includes core/luminance.cl.
    tints: ClassVar[tuple[tuple[str, ...], ...]] = ()
    is_texture: ClassVar[bool] = False  # its values vary over a surface or in space
    is_tree: ClassVar[bool] = True  # its parts become a single kernel text, each at every use
    _size: ClassVar[tuple[int, int]] = (1, 1)  # of an object: its parts, and how deep they lie
    has_textures: ClassVar[bool] = False  # of an object: a parameter that kernels read is a texture

    def __init_subclass__(cls) -> None:
        if "kind" not in vars(cls):  # a class may take the kernels of another kind
            cls.kind = _snake(cls.__name__)
        cls.__repr__ = Kind.__repr__  # type: ignore[method-assign]  # `dataclass` leaves it then

    def __post_init__(self) -> None:
        parts, depth, textured = 1, 0, False
        valid, read = _valid_defaults(type(self)), _fields(type(self))[1]
        declared = params(type(self))
        for name, value in zip(_fields(type(self))[0], read(self), strict=False):
            if name not in declared:
                continue
            param = declared[name]
            if valid.get(name, valid) is not value:
                value = _checked(value, param, f"{self.kind}.{name}")
                object.__setattr__(self, name, value)
            if type(value) in PLAIN:
                continue
            for inner in value if isinstance(value, tuple) else (value,):
                if isinstance(inner, Kind):
                    seen = param.role.place != "host"  # by kernels
                    textured |= seen and (inner.is_texture or inner.has_textures)
                    parts, depth = parts + inner._size[0], max(depth, inner._size[1])
        object.__setattr__(self, "_size", (parts, depth + 1))
        object.__setattr__(self, "has_textures", textured)
        if self.is_tree and (parts > MOST_PARTS or depth >= MOST_NESTED):
            message = f"has more than {MOST_PARTS} parts, shared ones counted at each use"
            if parts <= MOST_PARTS:
                message = f"is nested deeper than {MOST_NESTED} parts"
            raise SceneError(message, where=self.kind)
        self.check()

    def check(self) -> None:
        """Raise SceneError where the parameters contradict each other."""

    def altered(self, **values: object) -> Self:
        """Return a copy with other values, which are valid: nothing is checked again."""
        other = object.__new__(type(self))
        vars(other).update(vars(self), **values)
        return other

    def __repr__(self) -> str:
        """Return the class, and the parameters that differ from their defaults."""
        usual = {name: shown(value) for name, value in _usual(type(self)).items()}
        texts = {name: shown(value) for name, value in fields_of(self).items()}
        changed = (f"{n}={text}" for n, text in texts.items() if text != usual.get(n, "None"))
        return f"{type(self).__name__}({', '.join(changed)})"


@cache  # thousands of objects ask
def _declared(cls: type[Kind]) -> Mapping[str, Param]:
    fields = dataclasses.fields(cls)
    return MappingProxyType({f.name: f.metadata["param"] for f in fields if "param" in f.metadata})


@cache
def _declared_of(cls: type[Kind], place: str) -> Mapping[str, Param]:
    declared = {name: p for name, p in _declared(cls).items() if p.role.place == place}
    return MappingProxyType(declared)


def params(cls: type[Kind]) -> Mapping[str, Param]:
    """Return the declared parameters of a kind, by name, in their order."""
    return _declared(cls)


@cache
def shorthands(cls: type[Kind]) -> Mapping[str, Param]:
    """Return the arguments of a kind that stand for parameters, by name; see `Shorthand`."""
    merged = {
        name: param for shorthand in cls.shorthands for name, param in shorthand.arguments.items()
    }
    return MappingProxyType(merged)


def defaults(cls: type[Kind]) -> dict[str, Any]:
    """Return the defaults of a kind's declared parameters, by name."""
    fields = {f.name: f for f in dataclasses.fields(cls) if "param" in f.metadata}
    return {
        name: f.default if f.default_factory is dataclasses.MISSING else f.default_factory()
        for name, f in fields.items()
    }


@cache
def _usual(cls: type[Kind]) -> Mapping[str, Any]:
    """Return the checked defaults of a kind, without its required parameters."""
    declared = {name: v for name, v in defaults(cls).items() if v is not dataclasses.MISSING}
    return {name: _checked(v, _declared(cls)[name], cls.kind) for name, v in declared.items()}


@cache
def _valid_defaults(cls: type[Kind]) -> Mapping[str, Any]:
    """Return the defaults of a kind that its checks return as they are."""
    declared, checked = defaults(cls), _usual(cls)
    return {name: value for name, value in checked.items() if declared[name] is value}


def fields_of(kind: Kind) -> dict[str, Any]:
    """Return the values of an object's fields by name. Raises as `budget.check_time` does."""
    budget.check_time()
    names, read = _fields(type(kind))
    return dict(zip(names, read(kind), strict=False))


@cache
def _fields(cls: type[Kind]) -> tuple[tuple[str, ...], Callable[[Any], tuple[Any, ...]]]:
    """Return the names of a class's fields, and a function that reads all of them."""
    names = tuple(field.name for field in dataclasses.fields(cls))
    return names, attrgetter(*names, "__class__", "__class__")  # of two or more: a tuple


def _field_names(cls: type[Kind]) -> tuple[str, ...]:
    return _fields(cls)[0]


def place_of(kind: Kind, name: str) -> str:
    """Return the name of a parameter for messages, with the name of its material."""
    named = fields_of(kind).get("name")
    return f"{kind.kind}.{name}" + (f" of {named!r}" if named else "")


def device_params(cls: type[Kind]) -> Mapping[str, Param]:
    """Return the parameters that the kernels read."""
    return _declared_of(cls, "row")


def interior_params(cls: type[Kind]) -> Mapping[str, Param]:
    """Return the parameters of the inside of a body; they follow the others in its row."""
    return _declared_of(cls, "inside")


def _checked(value: object, param: Param, where: str) -> Any:
    if type(value) in PLAIN:
        return param.role.check(value, param, where)
    if isinstance(value, Kind) and value.is_texture and param.role.place != "host":
        if not param.textured:
            raise SceneError("cannot be a texture", where=where)
        return value
    for held in value.values() if isinstance(value, Mapping) else (value,):
        check_unmasked(held, where)
    return param.role.check(value, param, where)


MATRIX = 16  # most numbers that an array shows; a larger array shows its shape
LONGEST = 60  # characters of a spectrum


def shown(value: Any) -> str:
    """Return a value in short: an even spectrum as its number, a large array as its shape."""
    if isinstance(value, np.ndarray):
        few = value.size <= MATRIX
        return str((value.round(5) + 0).tolist()) if few else f"<{value.dtype} {value.shape}>"
    if isinstance(value, Constant):
        return f"{value.value:g}"
    text = repr(value)
    if isinstance(value, Spectrum) and len(text) > LONGEST:
        return f"<{type(value).__name__}>"
    return text
