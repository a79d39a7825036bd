"""Kernel text of the kinds: structs, loaders, dispatch. The physics is always in a file."""

from __future__ import annotations

from collections.abc import Mapping

from clpt.render.contract.parameter_words import (
    ORDERS_WORDS,
    REAL_WORDS,
    SPECTRAL,
    SPECTRUM_WORDS,
    words,
)
from clpt.scene.params import (
    Kind,
    Param,
    device_params,
)


def lane_type(param: Param) -> str:
    """Return the parameter's type in a kind's struct."""
    if param.role in SPECTRAL:
        return "Spectrum"
    given = {"real": "real", "orders": "real", "layers": "Layers"}
    return given.get(param.role, "integer")


def array_size(param: Param) -> int:
    """Return how many values of `lane_type` a parameter has in a kind's struct."""
    return ORDERS_WORDS if param.role == "orders" else 1


def struct_text(cls: type[Kind]) -> str:
    """Return `typedef struct {...} Kind;` with one member per device parameter."""
    rows = []
    for name, param in device_params(cls).items():
        size = f"[{array_size(param)}]" if array_size(param) > 1 else ""
        rows.append(f"    {lane_type(param)} {name}{size}; /* {param.doc} */")
    if cls.tints:
        rows.append("    real luminance; /* of base_color, where a tint is above 0 */")
    if cls.needs_wavelengths:
        rows.append("    Spectrum lambdas; /* the path's wavelengths [nm] */")
    rows = rows or ["    integer unused; /* no parameters */"]
    return "\n".join(["typedef struct {", *rows, f"}} {cls.__name__};", ""])


def load_text(cls: type[Kind], sources: Mapping[str, frozenset[str]], table: str) -> str:
    """Return `kind_load(scene, row, point, lambdas)`, which reads a row at the path's wavelengths.

    sources: per parameter, where the values in this scene come from: "none" (0 leaves a lobe out),
    "constant", "table" (a tabulated spectrum), "texture", "layers". Text is made only for what is
    there.
    """
    body, at = [], 0
    for name, param in device_params(cls).items():
        found = sources.get(name) or frozenset({"constant"})
        kind = lane_type(param).lower()
        if array_size(param) > 1:
            body += [
                f"    for (int i = 0; i < {array_size(param)}; i++)",
                f"        r.{name}[i] = gather_w(scene.{table}, row + {at} + i);",
            ]
        else:
            body += _member(name, param, kind, f"row + {at}", found, table)
        at += words(param)
    head = (
        f"inline {cls.__name__} {cls.kind}_load"
        "(Scene scene, integer row, TexturePoint point, Wavelengths lambdas)"
    )
    if cls.tints:
        before, lines = _luminance(cls, sources, table)
        head, body = f"{before}{head}", [*body, lines]
    if cls.needs_wavelengths:
        body.append("    r.lambdas = lambdas;")
    body = body or ["    r.unused = 0;"]
    return "\n".join([head, "{", f"    {cls.__name__} r;", *body, "    return r;", "}", ""])


def _luminance(
    cls: type[Kind], sources: Mapping[str, frozenset[str]], table: str
) -> tuple[str, str]:
    """What loads `base_color` alone, and the lines that ask it at luminance's own wavelengths."""
    declared = device_params(cls)
    at = sum(words(declared[name]) for name in [*declared][: [*declared].index("base_color")])
    found = sources.get("base_color") or frozenset({"constant"})
    tests = " | ".join(f"(r.{name} > 0.0f)" for name in cls.tints)
    return value_text(f"{cls.kind}_colour", declared["base_color"], found, table), "\n".join(
        [
            "    r.luminance = 1.0f;",
            f"    if (any({tests}))",
            f"        r.luminance = luminance_of({cls.kind}_colour"
            f"(scene, row + {at}, point, luminance_lambdas()));",
        ]
    )


def _member(
    name: str, param: Param, kind: str, at: str, found: frozenset[str], table: str
) -> list[str]:
    """The lines that load one member from the sources that occur."""
    if kind == "integer":
        return [f"    r.{name} = gather_i(scene.{table}, {at});"]
    if kind == "layers":
        made = f"layers_load(scene, {at}, point, lambdas)" if "layers" in found else "layers_none()"
        return [f"    r.{name} = {made};"]
    if found == {"none"}:
        return [f"    r.{name} = {'spectrum_of(0.0f)' if kind == 'spectrum' else '(real)(0.0f)'};"]
    found = found if "none" not in found else found - {"none"} | {"constant"}
    forms = {
        "constant": f"{kind}_constant(scene.{table}, {at}, lambdas)",
        "table": f"{kind}_table(scene, scene.{table}, {at}, lambdas)",
        "texture": f"{kind}_texture_{param.role}(scene, scene.{table}, {at}, point, lambdas)",
    }
    present = [form for form in forms if form in found]
    lines = [f"    r.{name} = {forms[present[0]]};"]
    source = f"{at} + {(SPECTRUM_WORDS if kind == 'spectrum' else REAL_WORDS) - 1}"
    choose = "spectrum_sel" if kind == "spectrum" else "sel"
    for form in present[1:]:
        test = "< 0" if form == "table" else "> 0"
        lines += [
            "    {",
            f"        mask m = gather_i(scene.{table}, {source}) {test};",
            f"        if (any(m)) r.{name} = {choose}(m, {forms[form]}, r.{name});",
            "    }",
        ]
    return lines


def emission_text(found: frozenset[str]) -> str:
    """Return `emission_load(scene, at, point, lambdas)`, which reads five words of `light_params`."""
    return value_text("emission_load", Param("emission", "", textured=True), found, "light_params")


def factor_text(found: frozenset[str]) -> str:
    """Return `factor_load(scene, at, point, lambdas)`, which reads five words of `light_params`."""
    return value_text("factor_load", Param("reflectance", "", textured=True), found, "light_params")


def mixture_text(found: frozenset[str]) -> str:
    """Return `mixture_weight(scene, at, point, lambdas)`, which reads two words of `mixtures`."""
    return value_text("mixture_weight", Param("real", "", textured=True), found, "mixtures")


def medium_text(found: frozenset[str]) -> str:
    """Return `medium_absorption(scene, at, point, lambdas)`: five words of `materials`."""
    return value_text("medium_absorption", Param("coefficient", ""), found)


def value_text(name: str, param: Param, found: frozenset[str], table: str = "materials") -> str:
    """Return `name(scene, at, point, lambdas)`, which loads a single parameter."""
    form = lane_type(param)
    return "\n".join(
        [
            f"inline {form} {name}"
            "(Scene scene, integer at, TexturePoint point, Wavelengths lambdas)",
            "{",
            f"    struct {{ {form} value; }} r;",
            *_member("value", param, form.lower(), "at", found, table),
            "    return r.value;",
            "}",
            "",
        ]
    )


def normal_map_text(found: frozenset[str]) -> str:
    """Return `bend_real(scene, at, point, lambdas)`, which reads two words of `materials`."""
    return value_text("bend_real", Param("real", "", textured=True), found, "materials")
