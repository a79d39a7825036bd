"""Kernel text of textures: the look-up in each role, and the loaders that call it."""

from __future__ import annotations

from typing import Literal

from clpt.render.records import TextureFeatures
from clpt.render.records.dispatch import Case, Function, active, function, indented
from clpt.render.records.textures import (
    END,
    IMAGES,
    KINDS,
    MIPS,
    OPERANDS,
    OPERATIONS,
    PROGRAM,
    RECORDS,
    ROLES,
    Structure,
)
from clpt.render.textures.graphs import graph_text
from clpt.scene.params import device_params
from clpt.scene.textures import KINDS as TEXTURE_KINDS
from clpt.scene.textures import MAPPINGS, Graph, Texture

_LOOKED_UP = "(Scene scene, integer row, TexturePoint point, Wavelengths lambdas)"

# Where a program has its loaders: in a part of the loop for all parts, in another part, or in its
# own text.
Where = Literal["part", "elsewhere", "own"]


def dispatch_text(features: TextureFeatures, stochastic: bool = False, where: Where = "own") -> str:
    """Return the look-ups of the (kind, role) pairs in the scene, and the loaders that call them.

    stochastic: some material reads a random texel for a reflectance. where: see `Where`.

    texture_<role>(scene, row, point, lambdas)                 whose row is at a word
    spectrum_texture_<role>(scene, source, point, lambdas)     source: 1 + the row, 0: no texture
    spectrum_texture_texel(scene, source, point, lambdas)      a reflectance, or a texel of it
    real_texture_real(scene, source, point, lambdas)           the same for a real
    """
    pairs, used = set(features.roles), set(features.kinds)
    lines = [f"#define MAPPING_{name.upper()} {i}" for i, name in enumerate(MAPPINGS)]
    lines += [
        f"#define USES_MAPPINGS {int(features.mappings)}",
        f"#define TEXTURE_PERMUTATION {RECORDS['spectral_bitmap'].words}",
    ]
    used |= {level for kind, level in MIPS.items() if kind in used}
    addressed = {"spectral_bitmap", "packed_bitmap", "voxels"}  # as the texels of bitmaps
    used |= {"bitmap"} if used & addressed else set()
    present = [kind for kind in RECORDS if kind in used]
    parts = [*lines, *_kinds_text(present, features)] if used else []
    leaves = {
        role: [kind for kind in present if (kind, role) in pairs]
        for role in sorted({role for _, role in pairs})
    }
    programs = [role for role in leaves if ("program", role) in pairs]
    for role, leaf_kinds in leaves.items():
        parts.append(_look_up(role, leaf_kinds, "texture_leaf" if programs else "texture"))
    if programs:
        parts += _operand_text(leaves, features.depth)
    for role in leaves:
        parts += [_with_programs(role, role in programs)] if programs else []
        parts.append(_parameter(role, where))
    if stochastic:
        parts += _texel_text(leaves["reflectance"], "reflectance" in programs, where)
    return "\n".join([*parts, ""])


def _kinds_text(present: list[str], features: TextureFeatures) -> list[str]:
    """Return the text of kinds; graphs come last, as they look up the others."""
    by_kind = {cls.kind: cls for cls in TEXTURE_KINDS}
    plain = [kind for kind in present if kind != "graph"]
    parts = ['#include "textures/texture.cl"']
    for kind in plain:
        parts += _choice_lines(by_kind[kind]) if kind in by_kind else []
        parts += [RECORDS[kind].row_text(), f'#include "textures/kinds/{kind}.cl"']
    numbers = [kind for kind in plain if (kind, "real") in features.roles]
    return parts + (_graph_text(features.graphs, numbers) if "graph" in present else [])


def _graph_text(structures: tuple[Structure, ...], textures: list[str]) -> list[str]:
    """Return the text of graphs; textures: the kinds that they may look up as numbers."""
    cases = [
        Case(
            f"kind == {KINDS.index(kind)}",
            f"{kind}_real({kind}_row(scene.textures, {active('row')}), scene, point)",
        )
        for kind in textures
    ]
    kind_of = ("integer kind = gather_i(scene.textures, row);",)
    signature = "real graph_texture(Scene scene, integer row, TexturePoint point)"
    return [
        f"#define TEXTURE_GRAPH {KINDS.index('graph')}",
        *_choice_lines(Graph),
        '#include "textures/graph.cl"',
        Function(signature, "0.0f", cases, kind_of).text(),
        RECORDS["graph"].row_text(),
        *graph_text(structures),
        '#include "textures/kinds/graph.cl"',
    ]


def _texel_text(kinds: list[str], programs: bool, where: Where) -> list[str]:
    """Return `spectrum_texture_texel`; programs: some texture is a program, which is filtered."""
    text = _look_up("texel", kinds, "texture_leaf" if programs else "texture")
    lines = [text, _with_programs("texel", True)] if programs else [text]
    lines.append(_parameter("texel", where, how="inline"))  # short, and in few places
    return ["#if STOCHASTIC_FILTERING || TEXELS_AT_RANDOM", *lines, "#endif"]


def _choice_lines(cls: type[Texture]) -> list[str]:
    """Return `#define KIND_PARAMETER_CHOICE` for each choice that a row holds as a number."""
    return [
        f"#define {f'{cls.kind}_{name}_{choice}'.upper()} {number}"
        for name, param in device_params(cls).items()
        for number, choice in enumerate(param.choices)
        if choice != "trilinear"  # a separate kind in the kernels
    ]


def _type(role: str) -> str:
    return "real" if role == "real" else "Spectrum"


def _look_up(role: str, kinds: list[str], name: str) -> str:
    """Return `name`_<role>, which looks up textures that combine no others."""
    zero, more = ("0.0f", "") if role == "real" else ("spectrum_of(0.0f)", ", lambdas")
    row, cases = active("row"), []
    for kind in kinds:
        chosen = role == "texel" and kind in IMAGES
        # Indices and factors have the look-up of reflectances, on other numbers.
        verb = role if chosen or role in ("emission", "real") else "reflectance"
        seen = "point, point.u" if chosen else "point"
        looked_up = f"{kind}_{verb}({kind}_row(scene.textures, {row}), scene, {seen}{more})"
        cases.append(Case(f"kind == {KINDS.index(kind)}", looked_up))
    kind_of = "integer kind = gather_i(scene.textures, row);"
    return Function(f"{_type(role)} {name}_{role}{_LOOKED_UP}", zero, cases, (kind_of,)).text()


def _with_programs(role: str, some: bool) -> str:
    """Return texture_<role> for all textures of a scene with programs.

    some: whether this role has programs.
    """
    program_role = "reflectance" if role == "texel" else role
    run = f"texture_program(scene, TEXTURE_ROLE_{program_role.upper()}, row, m, point, lambdas)"
    forms = {"real": f"{run}.x", "reflectance": f"spectrum_clamped({run})"}
    case = Case(f"gather_i(scene.textures, row) == {PROGRAM}", forms.get(program_role, run))
    leaf = f"texture_leaf_{role}(scene, row, point, lambdas)"
    signature = f"{_type(role)} texture_{role}{_LOOKED_UP}"
    return Function(signature, leaf, [case] if some else []).text()


def _parameter(role: str, where: Where, how: str = "called") -> str:
    """Return the look-up of a parameter's texture; how: see `function`."""
    form = _type(role)
    name = f"{form.lower()}_texture_{role}"
    takes = "(Scene scene, integer source, TexturePoint point, Wavelengths lambdas)"
    if where == "elsewhere":
        return f"{form} loop_{name}{takes};\n#define {name} loop_{name}"
    looked_up = f"return texture_{role}(scene, max_i(source - 1, (integer)(0)), point, lambdas);"
    if where == "part":
        return "\n".join([f"APART({form}, loop_{name}){takes}", "{", *indented(looked_up), "}"])
    return function(f"{form} {name}{takes}", looked_up, how=how)


def _operand_text(kinds: dict[str, list[str]], depth: int) -> list[str]:
    """Return the lines of `texture_operand`, and the look-up of programs after it.

    kinds: by role, the kinds of leaves that occur; depth: the most that a program stacks.
    """
    at = active("argument")
    constant = f"texture_constant(scene, {at}, lambdas)"
    cases = [Case("running & (operand == OPERAND_CONSTANT)", constant)]
    for role in (role for role in ROLES if kinds.get(role)):
        read = f"texture_leaf_{role}(scene, {at}, point, lambdas)"
        # A compiler drops the look-ups of other roles: the role is a constant there.
        tests = [f"((operand == OPERAND_OWN) & mask_of(role == TEXTURE_ROLE_{role.upper()}))"]
        if role == "real":
            read = f"spectrum_of({read})"
            tests.append("((operand == OPERAND_REAL) & mask_of(role != TEXTURE_ROLE_REAL))")
        if role == "reflectance":
            tests.append("((operand == OPERAND_FACTOR) & mask_of(role == TEXTURE_ROLE_EMISSION))")
        cases.append(Case(f"running & ({' | '.join(tests)})", read))
    signature = (
        "Spectrum texture_operand(Scene scene, int role, integer operand, integer argument,"
        " mask running, TexturePoint point, Wavelengths lambdas)"
    )
    return [
        f"#define TEXTURE_DEPTH {depth}",
        *(f"#define OPERAND_{name.upper()} {i}" for i, name in enumerate(OPERANDS)),
        *(f"#define OPERATION_{name.upper()} {code}" for name, code in OPERATIONS.items()),
        f"#define PROGRAM_END {END}",
        *(f"#define TEXTURE_ROLE_{role.upper()} {i}" for i, role in enumerate(ROLES)),
        Function(signature, "spectrum_of(as_real(argument))", cases).text(),
        '#include "textures/texture.cl#program"',
    ]
