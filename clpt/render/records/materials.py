"""Materials: words of parameters in a row, their features, and kinds from outside of the package.

A scene carries its classes itself: nothing is registered, and two scenes may have different kinds
with the same name.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from textwrap import dedent

from clpt import device
from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.records import INSTANCE, LIGHT, MATERIAL_KINDS, RERADIATION_SIZES, SETTINGS, SHAPE, SLABS
from clpt.render.records import lights as light_records
from clpt.render.records.macros import flag, macro
from clpt.scene import KINDS, roles
from clpt.scene.materials import LEAVES, Material
from clpt.scene.params import Kind, device_params, interior_params
from clpt.scene.roles import INDEX, ORDERS, Param, Role
from clpt.scene.scatterer import Scatterer

NORMAL_MAP_WORDS = 23  # before a material's row, see kernels/materials/shading_frame.cl
MIXTURE = MATERIAL_KINDS["mixture"]
FILM_COSINES = 128  # of the table of a film's colours, from 0 to 1
RERADIATION_STEP = RERADIATION_SIZES["step"]  # [nm] between the nodes of a matrix

# How many words a parameter takes in a row of `materials`, `textures` or `light_params`.
SPECTRUM_WORDS = 5  # x y z w and where the value comes from: 0 here, > 0 texture, < 0 table
REAL_WORDS = 2  # the value, and 0 or 1 + the texture
ORDERS_WORDS = 2 * ORDERS + 1
ANGULAR_WORDS = 5  # of the table: first value, cosines, rows; first wavelength, rows a nm
MEASUREMENT_WORDS = 1 + SPECTRUM_WORDS  # its first number; which colour a wavelength has
MERL_WORDS = 4  # its first number; rows of the spectra of red, green and blue
LAYERS_WORDS = 2  # where the layers lie, see clpt.render.materials.thin_films; how many


@dataclass(frozen=True)
class Member:
    """A parameter in kernels: words in its row, and `count` values of a type in its struct."""

    words: int
    lane_type: str
    count: int = 1


MEMBERS: dict[Role, Member] = {
    **dict.fromkeys((*roles.SPECTRA, roles.RERADIATION), Member(SPECTRUM_WORDS, "Spectrum")),
    roles.REAL: Member(REAL_WORDS, "real"),
    roles.FLAG: Member(1, "integer"),
    roles.CHOICE: Member(1, "integer"),
    roles.ORDERS_OF_LIGHT: Member(ORDERS_WORDS, "real", ORDERS_WORDS),
    roles.LAYERS: Member(LAYERS_WORDS, "Layers"),
    roles.ANGULAR: Member(ANGULAR_WORDS, "AngularTable"),
    roles.MEASUREMENT: Member(MEASUREMENT_WORDS, "Measurement"),
    roles.MERL: Member(MERL_WORDS, "MerlTable"),
}


def words(param: Param) -> int:
    """Return the number of 4-byte words that a parameter takes in its row."""
    return MEMBERS[param.role].words


def lane_type(param: Param) -> str:
    """Return the parameter's type in a kind's struct."""
    return MEMBERS[param.role].lane_type


def array_size(param: Param) -> int:
    """Return how many values of `lane_type` a parameter has in a kind's struct."""
    return MEMBERS[param.role].count


@cache
def row_words(cls: type[Kind]) -> int:
    """Return the length of a kind's row."""
    return sum(map(words, [*device_params(cls).values(), *interior_params(cls).values()]))


Sources = frozenset[tuple[str, str, str]]


@dataclass(frozen=True)
class MaterialFeatures:
    """The materials that a path may meet.

    leaves: classes of leaf materials in their order, then of phase functions: a material word's
    upper bits count in it; transmitting: kinds of leaves that let light through somewhere; shining:
    kinds of leaves on shapes that are lights; sources: (kind, parameter, source) of all that is
    loaded, of lights and media too, see clpt.render.materials.cases.
    """

    leaves: tuple[type[Scatterer], ...] = ()
    transmitting: tuple[str, ...] = ()
    shining: tuple[str, ...] = ()
    mixtures: int = 0  # how deep masks and blends nest
    normal_mapped: bool = False  # some material has a normal or a bump map
    free_panes: bool = flag("FREE_PANES")  # light goes straight through thin glass
    slopes: bool = False  # rows of glass know how the index changes with the wavelength
    sources: Sources = frozenset()

    @property
    @macro("BSDF_COUNT")
    def count(self) -> int:
        """Number of kinds."""
        return len(self.leaves)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the leaf materials, in their order."""
        return tuple(cls.kind for cls in self.leaves)

    @property
    def null_surfaces(self) -> bool:
        """Whether some surface lets light through as if it were not there."""
        return self.free_panes or any(cls.is_null for cls in self.leaves)

    @property
    def disperses(self) -> bool:
        """Whether the direction of light depends on its wavelength at some material."""
        indices = (
            (cls.kind, name, "table")
            for cls in self.leaves
            if cls.refracts
            for name, param in device_params(cls).items()
            if param.role is INDEX
        )
        return any(cls.disperses for cls in self.leaves) or not self.sources.isdisjoint(indices)

    def sources_of(self, kind: str) -> dict[str, frozenset[str]]:
        """Return the sources of each parameter of a kind that has some."""
        by_name: dict[str, frozenset[str]] = {}
        for owner, name, source in self.sources:
            if owner == kind:
                by_name[name] = by_name.get(name, frozenset()) | {source}
        return by_name

    def phase_varies(self, cls: type[Scatterer]) -> bool:
        """Return whether a phase function differs between wavelengths."""
        varies = cls.is_phase and cls.chromatic
        sources = frozenset[str]().union(*self.sources_of(cls.kind).values())
        return varies and not sources <= {"grey", "row"}


MOST = 255  # kinds in a scene: what the upper bits of a material word count, but for mixtures
CONTRACT = ("sample", "eval", "pdf", "albedo")  # what each has, see kernels/materials/bsdf.cl
VERBS = (*CONTRACT, "pdfs", "across", "load", "colour")
# what else tables keep sources under, see clpt.render.records.tables
INNER = ("perturbation", "emission", "factor", "layer", "mixture")


def ordered(kinds: dict[type[Material], str]) -> tuple[type[Material], ...]:
    """Return the leaf kinds of a scene in their order: clpt's as they are listed, then the others.

    kinds: each with where the scene has it. Raises SceneError for a kind without valid kernels.
    """
    outside = sorted(kinds.keys() - set(LEAVES), key=lambda cls: cls.kind)
    for cls in outside:
        check(cls, kinds[cls])
    for cls, other in pairwise(outside):
        if cls.kind == other.kind:
            raise SceneError(
                f"two classes are called {cls.__name__!r}; rename one, or, if its definition was "
                "run twice, make the materials anew",
                where=kinds[other],
            )
    if len(kinds) > MOST:
        raise SceneError(f"a scene can have {MOST} kinds of materials, not {len(kinds)}")
    return (*(cls for cls in LEAVES if cls in kinds), *outside)


def check(cls: type[Material], where: str | None = None) -> None:
    """Raise SceneError for a class without its functions, or with a name that kernels have."""
    if cls.source is None:
        raise SceneError(
            f"the material class {cls.__name__!r} has no `source`: the text or the path of its "
            "OpenCL functions",
            where=where,
        )
    kinds = {*INNER, *(cls.kind for listed in KINDS.values() for cls in listed)}
    names = {cls.__name__, *(f"{cls.kind}_{verb}" for verb in VERBS)}
    if taken := sorted({cls.kind} & kinds | names & _identifiers()):
        raise SceneError(
            f"the material class {cls.__name__!r} cannot have this name: clpt has {taken[0]!r}",
            where=where,
        )
    if cls.__eq__ is not Material.__eq__:
        raise SceneError(
            f"declare {cls.__name__!r} with eq=False: materials are told apart by identity",
            where=where,
        )
    if not cls.__name__.isascii():
        raise SceneError(f"{cls.__name__!r} is no name in OpenCL: use a to z", where=where)
    part, verbs = text(cls), (*CONTRACT, *(("pdfs",) if cls.chromatic else ()))
    missing = {f"{cls.kind}_{verb}" for verb in verbs} - set(re.findall(r"\w+", part.text))
    if missing:
        raise SceneError(f"has no {', '.join(sorted(missing))}", file=part.file, where=where)


def text(cls: type[Scatterer]) -> device.Part:
    """Return a kind's OpenCL text, with its file and line for compilers' messages.

    Raises SceneError for a file that cannot be read.
    """
    owner = next(base for base in cls.__mro__ if "source" in vars(base))
    module = getattr(sys.modules.get(owner.__module__), "__file__", None)
    if isinstance(cls.source, Path):
        path = Path(module).parent / cls.source if module else cls.source
        try:
            return device.Part(path.read_text(encoding="utf-8"), path.as_posix())
        except (OSError, UnicodeDecodeError) as error:
            raise SceneError(f"{cls.__name__}.source cannot be read: {error}", file=path) from error
    source = str(cls.source)
    if "{" not in source:
        raise SceneError(
            f"{cls.__name__}.source is {source!r}, which is no OpenCL; a file is a pathlib.Path"
        )
    file, line = _place(source, Path(module)) if module else (f"{cls.__name__}.source", 1)
    return device.Part(dedent(source), file, line)  # functions begin at the beginnings of lines


def _place(source: str, module: Path) -> tuple[str, int]:
    """The file and line of a text, if the Python file holds it unchanged."""
    try:
        before, match, _ = module.read_text(encoding="utf-8").partition(source)
    except (OSError, UnicodeDecodeError):
        match = ""
    return (module.as_posix(), before.count("\n") + 1) if match else (f"{module.name}:source", 1)


@cache
def _identifiers() -> frozenset[str]:
    """Types and functions of the kernels."""
    files = device.kernels_folder().rglob("*.cl")
    kernels = "\n".join(path.read_text(encoding="utf-8") for path in files)
    records = [SETTINGS, *SLABS, SHAPE, INSTANCE, LIGHT]
    records += [*shapes.VALUES, *light_records.VALUES]
    return frozenset(
        [
            *(record.name for record in records),
            *re.findall(r"\}\s*(\w+);", kernels),
            *re.findall(r"^(?:inline )?\w+ (\w+)\(", kernels, re.MULTILINE),
        ]
    )
