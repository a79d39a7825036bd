"""Kernel text of the lights: what kernels/lights/sampling.cl and infinite.cl ask of each kind."""

from __future__ import annotations

from collections.abc import Iterable

from clpt.device.source import TWIN
from clpt.geometry import shape_records
from clpt.render.records import Features
from clpt.render.records import lights as light_records
from clpt.render.records.dispatch import Case, Function, function, masked
from clpt.render.records.lights import (
    ALONG,
    BASES,
    BODY,
    BOTH,
    BRICK,
    INFINITE,
    KINDS,
    LINE,
    RECORDS,
    UNSEEN,
    VALUES,
    VOLUMES,
    WIDTH,
)

NOWHERE = "v3(0.0f, 0.0f, 0.0f)"  # the hemisphere of a light that is sampled for all directions


def virtual_files() -> dict[str, str]:
    """Return what lights give, and generated/light/<kind>.cl: struct, loader and functions."""
    files = {f"generated/{record.snake_name}.cl": record.select_text() for record in VALUES}
    for kind, record in RECORDS.items():
        base = f'#include "generated/light/{BASES[kind]}.cl"\n' if kind in BASES else ""
        text = f'{record.row_text()}#include "lights/kinds/{kind}.cl"\n'
        files[f"generated/light/{kind}.cl"] = base + text
    return files


def emission_sources(features: Features) -> frozenset[str]:
    """Return where the emissions of all lights come from."""
    return features.materials.sources_of("emission").get("value", frozenset({"constant"}))


def kinds_of(features: Features) -> list[str]:
    """Return the kinds of lights in the scene, in the order of their table."""
    return [kind for kind in KINDS if kind in features.lights.kinds]


def surfaces_of(features: Features) -> list[str]:
    """Return the kinds of the scene's lights that are shapes."""
    return [kind for kind in kinds_of(features) if kind in shape_records.RECORDS]


def others_of(features: Features) -> list[str]:
    """Return the kinds of the scene's lights that have parameters of their own, off all shapes."""
    return [kind for kind in kinds_of(features) if kind in RECORDS]


def included(*names: str) -> list[str]:
    """Return rows that include kernel files."""
    return [f'#include "{name}"' for name in names]


def either(holds: object, name: str) -> str:
    """Return the name of a step where a condition holds, else of its twin that does nothing."""
    return name if holds else f"{name}{TWIN}"


def dispatch_text(features: Features, densities: str = "") -> str:
    """Return the functions over all lights, see kernels/lights/sampling.cl and infinite.cl.

    densities: the functions of MIS weights for light paths, where there are some. It includes the
    files of `virtual_files`, here and in clpt.render.geometry.cases.
    """
    present = kinds_of(features)
    rows = [*_numbers(features, present), *included(*_includes(features))]
    rows += _tree_text() if features.lights.tree else included("lights/light.cl#by_power")
    if present:
        rows += [_lamps_text(features), *_areas_text(features)]
    rows += included(either(present, "lights/sampling.cl"))
    rows.append(densities)
    if BRICK in present:
        rows += included(f"lights/kinds/{BRICK}.cl#chosen")
    if BODY in present:
        rows += included(f"lights/kinds/{BODY}.cl#chosen")
    return "\n".join([*rows, *_infinite_text(features), ""])


def _numbers(features: Features, present: list[str]) -> list[str]:
    """Return the macros of constants."""
    modes = {"ALONG": ALONG, "BOTH": BOTH, "UNSEEN": UNSEEN}
    words = shape_records.RECORDS["triangle"].words
    return [
        *([f"#define TRIANGLE_ROW_WORDS {words}"] * features.motion.emitters),
        *(f"#define LIGHT_{kind.upper()} {KINDS.index(kind)}" for kind in present),
        *(f"#define EMISSION_{name} {bit}" for name, bit in modes.items()),
        f"#define GLOSS_BEFORE {features.lights.gloss}",
        *([f"#define LIGHT_VOLUMES {KINDS.index(VOLUMES[0])}"] * features.lights.volumes),
    ]


def _includes(features: Features) -> list[str]:
    """Return the files that the functions over all lights need."""
    lights, surfaces = features.lights, surfaces_of(features)
    return [
        *("shapes/surface.cl#flags", "shapes/shape.cl", "lights/light.cl", "core/mis.cl"),
        either(lights.gloss, "lights/receiver.cl"),
        "lights/light.cl#choice",
        *(("generated/textures.cl", "generated/medium.cl") * lights.volumes),
        *(f"generated/light/{kind}.cl" for kind in others_of(features)),
        *(f"generated/shape/{kind}.cl" for kind in surfaces),
        *(("lights/light.cl#volumes",) * lights.volumes),
        *(("lights/area.cl",) * bool(surfaces)),
        either(features.motion.lights, "lights/moving.cl"),
        *(("lights/moving.cl#deforming",) * features.motion.emitters),
        either(lights.two_sided, "lights/area.cl#two_sided"),
        either(lights.unseen, "lights/area.cl#unseen"),
        either(lights.two_sided or lights.unseen, "lights/area.cl#shows"),
    ]


def kind_test(kind: str, kinds: Iterable[str]) -> str:
    """Return the test whether the light `l` is of a kind; "": it always is, no other occurs."""
    return "" if {*kinds} == {kind} else f"l.kind == LIGHT_{kind.upper()}"


def row_text(features: Features, kind: str, test: str) -> str:
    """Return the kind's parameters of the light `l`, in the lanes of a `kind_test`.

    Other lanes read the first row, see `blank_row`.
    """
    if features.motion.emitters and kind == "triangle":
        return f"triangle_then(scene, l, {'m' if test else 'mask_of(1)'})"
    table = "light_params" if kind in RECORDS else "geometry"
    return f"{kind}_row(scene.{table}, {_in_lanes('l.params', test)})"


def point_text(features: Features, kind: str, uv: str, test: str) -> tuple[str, ...]:
    """Return statements that set `*point`, what textures see at uv of a light on a shape.

    There are none where no emission has a texture.
    """
    if "texture" not in emission_sources(features):
        return ()
    seen = f"texture_point({uv}, {NOWHERE})"
    before: tuple[str, ...] = ()
    if kind in ("triangle", "sphere"):
        row = f"sel_i(m, row, shape.light), {uv}" if test else f"row, {uv}"
        seen = f"area_{kind}_point(scene, shape, {row})"
        at = f"{_in_lanes('l.shape', test)} * SHAPE_ROW_WORDS"
        before = (f"ShapeRow shape = shape_row_row(scene.shapes, {at});",)
    return (*before, f"*point = {f'texture_point_sel(m, {seen}, *point)' if test else seen};")


def _in_lanes(index: str, test: str) -> str:
    """Return an index in the lanes of a test, 0 in the others."""
    return f"sel_i(m, {index}, (integer)(0))" if test else index


def _tree_text() -> list[str]:
    """Return the tree over lights, and the record of its nodes."""
    node = light_records.NODE
    return [
        node.row_text(many=True),
        f"#define LIGHT_NODE_WORDS {node.words}",
        f"#define LIGHT_TREE_WIDTH {WIDTH}",
        f"#define LIGHT_TREE_LINE {LINE}",
        *included("lights/light_tree.cl"),
    ]


def _lamps_text(features: Features) -> str:
    """Return `lamp_sample`: a sample of a light off all shapes, where that was lowered."""
    kinds, cases = kinds_of(features), []
    for kind in others_of(features):
        seen = "view.hemisphere" if kind in INFINITE else "view.p"
        row = row_text(features, kind, test := kind_test(kind, kinds))
        cases.append(Case(test, f"{kind}_sample({row}, scene, {seen}, u, lambdas)"))
    arguments = "Scene scene, LightRow l, LightView view, vec2 u, Wavelengths lambdas"
    return Function(f"LightSample lamp_sample({arguments})", "light_sample_nothing()", cases).text()


def _areas_text(features: Features) -> list[str]:
    """Return `area_point`, a point of a light on a shape, and `area_pdf`, its density [1/sr]."""
    kinds, surfaces = kinds_of(features), surfaces_of(features)
    points, densities = [], []
    for kind in surfaces:
        row = row_text(features, kind, test := kind_test(kind, kinds))
        sampled = f"{kind}_sample({row}, view.p, u)"
        if point := point_text(features, kind, "r.uv", test):
            points.append(Case(test, "r", (f"ShapeSample r = {sampled};", *point)))
        else:
            points.append(Case(test, sampled))
        row = row_text(features, kind, test := kind_test(kind, surfaces))
        densities.append(Case(test, f"{kind}_pdf({row}, view.p, view.wi, view.t, view.n)"))
    head = "Scene scene, integer row, LightRow l, LightView view, vec2 u, TexturePoint *point"
    points_of = Function(f"ShapeSample area_point({head})", "shape_sample_nothing()", points)
    pdf = Function("real area_pdf(Scene scene, LightRow l, LightView view)", "0.0f", densities)
    areas = included(either(surfaces, "lights/sampling.cl#areas"))
    return [*([points_of.text()] * bool(surfaces)), pdf.text(), *areas]


def _infinite_text(features: Features) -> list[str]:
    """Return `infinite_case`: radiance and density of an infinite light, where it was lowered."""
    kinds = [kind for kind in others_of(features) if kind in INFINITE]
    if not kinds:
        return []
    rows = ["*radiance = spectrum_of(0.0f);", "*pdf = 0.0f;"]
    for kind in kinds:
        row = row_text(features, kind, test := kind_test(kind, kinds))
        rows += masked(
            test,
            f"{RECORDS[kind].name} light = {row};",
            f"*radiance = spectrum_sel(m, {kind}_radiance(light, scene, d, lambdas), *radiance);",
            f"*pdf = sel(m, {kind}_pdf(light, scene, hemisphere, d), *pdf);",
        )
    head = (
        "void infinite_case(Scene scene, LightRow l, vec3 hemisphere, vec3 d, Wavelengths lambdas, "
        "Spectrum *radiance, real *pdf)"
    )
    return [function(head, *rows), *included("lights/infinite.cl")]
