"""Parts of the loop of a CPU that several kinds of materials share: vertices of paths, functions.

Most of the code that shades a kind is the vertex of the path: emission, next-event estimation, MIS
weights, roulette. Kinds with the same vertex code share a part of the loop. Each kind has a further
part with its functions, which the vertex calls for LANES paths of the same kind at once. In a
single lane, as on GPUs, each kind has a program with both.

Functions that several kinds call are another part, which no kind's flags reach: `common.cl`. In a
program of its own a kind has them inline. Shading calls `common_<name>` in both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from clpt.device.source import TWIN
from clpt.render.flow import choices, flags, stages
from clpt.render.records import Features
from clpt.render.records.dispatch import function
from clpt.scene.scatterer import Scatterer


@dataclass(frozen=True)
class Common:
    """A function: its type, name and parameters (types and names), and which kinds call it."""

    returns: str
    name: str
    parameters: tuple[tuple[str, str], ...]
    calls: Callable[[Features, type[Scatterer]], object]

    def shared(self, features: Features) -> bool:
        """Whether several kinds of a scene call it."""
        return sum(bool(self.calls(features, cls)) for cls in features.materials.leaves) > 1


def _parameters(text: str) -> tuple[tuple[str, str], ...]:
    """Split declared parameters into types and names."""
    parameters = []
    for declared in text.split(", "):
        name = declared.split(" ")[-1].lstrip("*")
        parameters.append((declared.removesuffix(name), name))
    return tuple(parameters)


# Functions that are short or called often stay inline: a call keeps structs in memory.
FUNCTIONS = (
    Common(
        "Surface",
        "surface_load",
        _parameters("Scene scene, Slab hit, uint at, mask active, vec3 o, vec3 d, mask *front"),
        lambda f, cls: not cls.is_phase,
    ),
    Common(
        "LightSample",
        "light_sample",
        _parameters(
            "Scene scene, vec3 p, Receiver receiver, real pick, vec2 u, Wavelengths lambdas"
        ),
        lambda f, cls: f.lights.kinds and not cls.delta,
    ),
    Common(
        "real",
        "light_begins_pdf",
        _parameters(
            "Scene scene, integer row, vec3 p, Receiver receiver, vec3 wi, real t, vec3 n, "
            "real *found"
        ),
        lambda f, cls: f.transport.balanced and not flags.is_null(f, cls),
    ),
    Common(
        "real",
        "light_tree_pmf",
        _parameters("Scene scene, integer row, vec3 p, Receiver receiver"),
        flags.asks_chance,
    ),
)


def shared(features: Features, lanes: int) -> list[Common]:
    """Return the functions that several kinds of a scene call; none in a single lane."""
    return [function for function in FUNCTIONS if lanes > 1 and function.shared(features)]


def calls_text(elsewhere: Sequence[Common] = ()) -> str:
    """Return the macros of calls: of functions in a part `elsewhere`, or in the same program."""
    rows = []
    for common in FUNCTIONS:
        if common in elsewhere:
            declared = ", ".join(f"{type_}{name}" for type_, name in common.parameters)
            rows.append(f"{common.returns} loop_{common.name}({declared});")
        called = f"loop_{common.name}" if common in elsewhere else common.name
        rows.append(f"#define common_{common.name} {called}")
    return "\n".join([*rows, ""])


def common_part_text(functions: Sequence[Common]) -> str:
    """Return the functions of the part."""
    rows = []
    for common in functions:
        declared = ", ".join(f"{type_}{name}" for type_, name in common.parameters)
        passed = ", ".join(name for _, name in common.parameters)
        rows.append(f"COMMON({common.returns}, {common.name})({declared})")
        rows.append(f"{{\n    return {common.name}({passed});\n}}")
    return "\n".join([*rows, ""])


# kinds of a vertex may differ in these flags
RUN_TIME = ("BSDF_KIND", "BSDF_TRANSMITS", "BSDF_SHINES", "BSDF_ABSORBS", "USES_CHOICE",
            "STOCHASTIC_FILTERING", "BSDF_REUSED")  # fmt: skip


@dataclass(frozen=True)
class Vertex:
    """The program that shades some kinds of a scene's materials, and the numbers of the kinds."""

    program: str
    kinds: tuple[int, ...]

    @property
    def shared(self) -> bool:
        """Whether several kinds have it."""
        return len(self.kinds) > 1


def vertices(features: Features, lanes: int) -> list[Vertex]:
    """Return the vertices of a scene, in the order of their kinds of materials."""
    leaves = features.materials.leaves
    alike: dict[object, list[int]] = {}
    for kind, cls in enumerate(leaves):
        key = _key(features, cls) if lanes > 1 and _may_share(features, cls) else kind
        alike.setdefault(key, []).append(kind)
    vertices_ = []
    for kinds in alike.values():
        others = "_and_others" if len(kinds) > 1 else ""
        vertices_.append(Vertex(f"shade_{leaves[kinds[0]].kind}{others}", tuple(kinds)))
    return vertices_


def _may_share(features: Features, cls: type[Scatterer]) -> bool:
    """Whether a kind may share a vertex: not with photons, guides, escapes, hero wavelengths."""
    special = (
        flags.is_chromatic, flags.fluoresces, flags.is_guided, flags.between_bodies,
        flags.refracts_widely,
    )  # fmt: skip
    merged = features.transport.merged and flags.gathers_photons(features, cls)
    turning = ("clearcoat_apart", cls.turning_lobe)
    turned = any(flags.has_lobe(features, cls, lobe) for lobe in turning)
    sent = features.media.escapes and cls.is_phase
    alone = merged or turned or sent or any(holds(features, cls) for holds in special)
    return features.transport.integrator != "whitted" and not alone


def _key(features: Features, cls: type[Scatterer]) -> object:
    """Return a key that is equal for kinds of a vertex, whether they emit light or not."""
    values = flags.of_material(features, cls)
    files = {
        name: tuple(file.replace(f"met_emission.cl{TWIN}", "met_emission.cl") for file in chosen)
        for name, chosen in choices.material_files(features, cls).items()
    }
    fixed = (flag for flag in values.items() if flag[0] not in RUN_TIME)
    return (*fixed, *files.items())


def leader(features: Features, vertex: Vertex) -> type[Scatterer]:
    """Return the kind whose files serve all kinds of a vertex: a kind that emits, if any does."""
    classes = [features.materials.leaves[kind] for kind in vertex.kinds]
    return max(classes, key=lambda cls: cls.kind in features.materials.shining)


def defines(features: Features, vertex: Vertex) -> flags.Defines:
    """Return the flags of a vertex; flags that differ between its kinds depend on `scene.kind`."""
    each = [flags.of_material(features, features.materials.leaves[kind]) for kind in vertex.kinds]
    if not vertex.shared:
        return each[0]
    # At black materials the end of a path is known late, by its throughput.
    values = {**each[0], "SHADES_SEVERAL": 1, "BSDF_KIND": "scene.kind", "BSDF_ABSORBS": 0}
    for name in ("BSDF_SHINES", "STOCHASTIC_FILTERING"):
        values[name] = max(material[name] for material in each)
    for name in ("BSDF_TRANSMITS", "USES_CHOICE", "BSDF_REUSED"):
        bits = sum(1 << k for k, material in zip(vertex.kinds, each, strict=True) if material[name])
        every = sum(1 << kind for kind in vertex.kinds)
        values[name] = int(bits > 0) if bits in (0, every) else f"((0x{bits:x} >> scene.kind) & 1)"
    return values


def virtual_files(features: Features, vertex: Vertex) -> dict[str, str | tuple[str, ...]]:
    """Return the files in place of the files of a single kind."""
    return {
        "generated/bsdf.cl": _calls_text(features, vertex),
        "generated/pair.cl": ("materials/bsdf.cl#pair_apart",),
    }


_READ = "Scene scene, integer row, TexturePoint point, Wavelengths lambdas"
_READ_PASSED = "scene, row, point, lambdas"


@dataclass(frozen=True)
class PartFunction:
    """A function of a kind's part; takes: its parameters besides `_READ`; value: its result."""

    returns: str
    name: str
    takes: tuple[tuple[str, str], ...]
    value: str

    @property
    def parameters(self) -> str:
        """As they are declared."""
        return ", ".join([_READ, *(f"{type_} {name}" for type_, name in self.takes)])

    @property
    def passed(self) -> str:
        """As they are passed on."""
        return ", ".join([_READ_PASSED, *(name for _, name in self.takes)])


def _functions(features: Features) -> list[PartFunction]:
    """Return the functions that the parts of a scene's kinds have."""
    joined = any(paths.transport.joined for paths in features.passes)
    directions = (("vec3", "wo"), ("vec3", "wi"), ("vec3", "u"), ("uint", "adjoint"))
    answer = f"material_answer(m, wo, wi, u, {'adjoint' if joined else '0'})"
    functions = [PartFunction("BsdfAnswer", "answer", directions, answer)]
    if features.film.layers.words:
        functions.append(PartFunction("Spectrum", "albedo", (), "bsdf_albedo(m)"))
    return functions


def part_text(features: Features, cls: type[Scatterer]) -> str:
    """Return the functions of a kind's part."""
    rows = []
    for part in _functions(features):
        rows.append(f"APART({part.returns}, loop_{cls.kind}_{part.name})({part.parameters})")
        rows.append(f"{{\n    Bsdf m = bsdf_load({_READ_PASSED});\n    return {part.value};\n}}")
    return "\n".join([*rows, ""])


def _calls_text(features: Features, vertex: Vertex) -> str:
    """Return the material of a shared vertex: functions that call those of the kinds' parts."""
    classes = {kind: features.materials.leaves[kind] for kind in vertex.kinds}
    rows = ['#include "generated/bsdf_answer.cl"']
    for part in _functions(features):
        cases = []
        for kind, cls in classes.items():
            called = f"loop_{cls.kind}_{part.name}"
            rows.append(f"{part.returns} {called}({part.parameters});")
            cases.append(f"case {kind}: value = {called}({part.passed}); break;")
        body = (f"{part.returns} value;", "switch (scene.kind) {", *cases, "}", "return value;")
        rows.append(function(f"{part.returns} apart_{part.name}({part.parameters})", *body))
    if features.media.absorbing:
        inside = (f"case {kind}: return {stages.interior(cls)};" for kind, cls in classes.items())
        head = "integer bsdf_interior(Scene scene, integer row)"
        rows.append(function(head, "switch (scene.kind) {", *inside, "}", "return 0;"))
        rows.append("#define BSDF_INTERIOR(row) bsdf_interior(scene, row)")
    return "\n".join([*rows, '#include "materials/bsdf.cl#apart"', ""])
