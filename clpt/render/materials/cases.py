"""Kernel text of the parameters of kinds: structs, and the loaders that fill them.

A parameter's values in a scene come from sources: "none" (0, which leaves a lobe out), "constant",
"grey" (an index that is the same at all wavelengths), "table" (a tabulated spectrum), "texture",
"layers"; the source of a flag or a choice is its number. A loader reads the sources that occur. It
holds a flag or a choice that is the same in the whole scene.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from clpt.records.layout import row_words
from clpt.render.records import Features
from clpt.render.records.dispatch import Case, choose, function, indented
from clpt.render.records.materials import (
    NORMAL_MAP_WORDS,
    SPECTRUM_WORDS,
    array_size,
    lane_type,
    words,
)
from clpt.scene import roles
from clpt.scene.params import Kind, device_params
from clpt.scene.roles import Param, Role

CONSTANT = frozenset({"constant"})  # for a scene that is not known
_LOADED = "(Scene scene, integer at, TexturePoint point, Wavelengths lambdas)"


def struct_text(cls: type[Kind], sources: Mapping[str, frozenset[str]] | None = None) -> str:
    """Return `typedef struct {...} Kind;` with a member for each device parameter.

    For a lobe that a parameter of 0 leaves out, `USES_KIND_PARAMETER` before it says whether the
    scene has the lobe. sources: of each parameter; without them every lobe is used.
    """
    rows, uses = [], []
    for name, param in device_params(cls).items():
        size = f"[{array_size(param)}]" if array_size(param) > 1 else ""
        rows.append(f"    {lane_type(param)} {name}{size}; /* {param.doc} */")
    if cls.tints:
        rows.append("    real luminance; /* of base_color, where a tint is above 0 */")
    if cls.needs_wavelengths:
        rows.append("    Spectrum lambdas; /* the path's wavelengths [nm] */")
    for name in (name for name, param in device_params(cls).items() if param.lobe):
        used = not sources or sources.get(name) != frozenset({"none"})
        uses.append(f"#define USES_{cls.kind.upper()}_{name.upper()} {int(used)}")
    rows = rows or ["    integer unused; /* no parameters */"]
    return "\n".join([*uses, "typedef struct {", *rows, f"}} {cls.__name__};", ""])


def word_before(cls: type[Kind], name: str) -> int:
    """Return the first word of the parameter `name` in a kind's row."""
    declared = device_params(cls)
    names = [*declared]
    return sum(words(declared[before]) for before in names[: names.index(name)])


def load_text(
    cls: type[Kind],
    sources: Mapping[str, frozenset[str]],
    table: str,
    stochastic: bool = False,
) -> str:
    """Return `kind_load(scene, row, point, lambdas)`, which reads a row at the path's wavelengths.

    sources: of each parameter, by default "constant"; stochastic: a random texel stands for a
    filtered texture in linear parameters.
    """
    declared = device_params(cls)
    read, loaded = row_words(f"scene.{table}", "row", sum(map(words, declared.values())))
    rows = [f"{cls.__name__} r;", *read]
    for name, param in declared.items():
        first = word_before(cls, name)
        of_param = loaded[first : first + words(param)]
        if array_size(param) > 1:
            rows += [f"r.{name}[{i}] = {word};" for i, word in enumerate(of_param)]
        else:
            present, texel = sources.get(name) or CONSTANT, stochastic and param.linear
            rows += _member(f"r.{name}", _Read(param, of_param, f"row + {first}", present, texel))
    before = ""
    if cls.tints:
        before = value_text(
            f"{cls.kind}_colour", declared["base_color"], sources.get("base_color"), table
        )
        rows += _luminance(cls)
    if cls.needs_wavelengths:
        rows.append("r.lambdas = lambdas;")
    if len(rows) == 1:
        rows.append("r.unused = 0;")
    head = (
        f"{cls.__name__} {cls.kind}_load"
        "(Scene scene, integer row, TexturePoint point, Wavelengths lambdas)"
    )
    return before + function(head, *rows, "return r;")


def _luminance(cls: type[Kind]) -> list[str]:
    """Return the lines that set `luminance`, of base_color, where a lane has a tint."""
    each = (" & ".join(f"(r.{name} > 0.0f)" for name in names) for names in cls.tints)
    tests = " | ".join(f"({test})" for test in each)
    row = f"row + {word_before(cls, 'base_color')}"
    colour = f"{cls.kind}_colour(scene, {row}, point, luminance_lambdas())"
    return [
        "r.luminance = 1.0f;",
        f"if (any({tests}))",
        *indented(f"r.luminance = luminance_of({colour});"),
    ]


@dataclass(frozen=True)
class _Read:
    """A member to be read: its parameter, and its words in the row.

    at: the first word; sources: those that occur; texel: read a random texel of an image.
    """

    param: Param
    words: Sequence[str]
    at: str
    sources: frozenset[str]
    texel: bool = False


def _number(read: _Read) -> str:
    numbers = [source for source in read.sources if source.isdigit()]
    held = len(numbers) == len(read.sources) == 1
    return f"(integer)({numbers[0]})" if held else f"as_integer({read.words[0]})"


def _layers(read: _Read) -> str:
    layered = "layers" in read.sources
    return f"layers_load(scene, {read.at}, point, lambdas)" if layered else "layers_none()"


def _table(read: _Read) -> str:
    return f"{TABLES[read.param.role].load}(scene, {read.at}, lambdas)"


@dataclass(frozen=True)
class Table:
    """A table that a member refers to: the function that finds it, and the files that read it.

    counted: texts hold the counts at the tables' heads if all tables of a scene have the same.
    """

    load: str
    file: str
    load_file: str
    counted: bool = True


TABLES: dict[Role, Table] = {
    roles.ANGULAR: Table(
        "angular_load",
        "materials/angular_table.cl",
        "materials/angular_table.cl#load",
        counted=False,
    ),
    roles.MEASUREMENT: Table(
        "measurement_load", "materials/measurement.cl", "materials/measurement.cl#load"
    ),
    roles.MERL: Table("merl_load_table", "materials/merl_table.cl", "materials/merl_table.cl#load"),
}
# the loads of members that are neither spectra nor numbers
LOADS: dict[Role, Callable[[_Read], str]] = {
    roles.FLAG: _number,
    roles.CHOICE: _number,
    roles.LAYERS: _layers,
    **dict.fromkeys(TABLES, _table),
}


def _member(target: str, read: _Read) -> list[str]:
    """Return the lines that set a member from the sources that occur."""
    if read.param.role in LOADS:
        return [f"{target} = {LOADS[read.param.role](read)};"]
    return _value(target, read)


def _value(target: str, read: _Read) -> list[str]:
    """Return the lines that set a spectrum or a number.

    The word after the value says the source of a lane.
    """
    form, present = lane_type(read.param), read.sources
    if present == {"none"}:
        return [f"{target} = {'spectrum_of(0.0f)' if form == 'Spectrum' else '(real)(0.0f)'};"]
    *values, source = read.words
    whole = f"v4({', '.join(values)})" if form == "Spectrum" else values[0]
    if present == {"grey"}:
        return [f"{target} = spectrum_grey({whole});"]
    if present & {"none", "grey"}:
        present |= {"constant"}
    constant, table = f"spectrum_constant({whole}, lambdas)", f"spectrum_table(scene, {whole}"
    looked_up = "texel" if read.texel else read.param.role.name
    texture = f"{form.lower()}_texture_{looked_up}(scene, as_integer({source}), point, lambdas)"
    loads = {
        "constant": ("", constant if form == "Spectrum" else whole),
        "table": ("< 0", f"{table}, as_integer({source}), lambdas)"),
        "texture": ("> 0", texture),
    }
    (_, first), *others = [load for name, load in loads.items() if name in present]
    cases = [Case(f"as_integer({source}) {test}", value) for test, value in others]
    return [f"{target} = {first};", *choose(target, form, *cases)]


def value_text(
    name: str, param: Param, sources: frozenset[str] | None, table: str = "materials"
) -> str:
    """Return `name(scene, at, point, lambdas)`, which loads a single parameter from `table`."""
    form = lane_type(param)
    read, loaded = row_words(f"scene.{table}", "at", words(param))
    member = _Read(param, loaded, "at", sources or CONSTANT)
    rows = [*read, f"{form} value;", *_member("value", member)]
    return function(f"{form} {name}{_LOADED}", *rows, "return value;")


def emission_text(sources: frozenset[str]) -> str:
    """Return `emission_load(scene, at, point, lambdas)`: five words of `light_params`."""
    emission = Param(roles.EMISSION, textured=True)
    return value_text("emission_load", emission, sources, "light_params")


def factor_text(sources: frozenset[str]) -> str:
    """Return `factor_load(scene, at, point, lambdas)`: five words of `light_params`."""
    return value_text(
        "factor_load", Param(roles.REFLECTANCE, textured=True), sources, "light_params"
    )


def medium_text(sources: Mapping[str, frozenset[str]]) -> str:
    """Return `medium_absorption(scene, at, point, lambdas)`: five words of `materials`.

    sources: of "absorption". With "scattering", `medium_scattering` reads the words
    MEDIUM_SCATTERING behind it. With "light", `medium_light` reads those MEDIUM_LIGHT before it.
    """
    coefficient = Param(roles.COEFFICIENT)
    head = f"#define MEDIUM_SCATTERING {SPECTRUM_WORDS}\n" if "scattering" in sources else ""
    head += f"#define MEDIUM_LIGHT {1 + SPECTRUM_WORDS}\n" if "light" in sources else ""
    return head + "".join(
        value_text(f"medium_{name}", coefficient, of_name) for name, of_name in sources.items()
    )


def _medium_sources(features: Features) -> dict[str, frozenset[str]]:
    names = ("absorption", "scattering") if features.media.present else ("absorption",)
    loaded = features.materials.sources
    sources = {
        name: frozenset(source for _, param, source in loaded if param == name) for name in names
    }
    if features.media.emissive:
        sources["light"] = features.materials.sources_of("medium")["light"]
    return sources


def virtual_files(features: Features) -> dict[str, str]:
    """Return the loaders of values that belong to no kind: of media, mixtures and normal maps."""
    weights = features.materials.sources_of("mixture").get("weight")
    bodies = features.materials.sources_of("body").get("index")
    maps = features.materials.sources_of("perturbation").get("value")
    real = Param(roles.REAL, textured=True)
    return {
        "generated/medium_coefficients.cl": medium_text(_medium_sources(features)),
        "generated/body_index.cl": value_text("body_index", Param(roles.INDEX), bodies),
        "generated/mixture.cl": value_text("mixture_weight", real, weights, "mixtures"),
        "generated/normal_map.cl": f"#define NORMAL_MAP_WORDS {NORMAL_MAP_WORDS}\n"
        + value_text("normal_map_real", real, maps),
    }
