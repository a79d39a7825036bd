"""Kernel text of the lights: their cases in kernels/lights.

sampling.cl and infinite.cl ask them of each kind, and emission.cl for light paths.
"""

from __future__ import annotations

from collections.abc import Iterable

from clpt.device.source import TWIN
from clpt.geometry import shapes
from clpt.render.records import Features
from clpt.render.records import lights as light_records
from clpt.render.records.dispatch import Case, Function, function, masked
from clpt.render.records.lights import (
    ALONG,
    BASES,
    BODY,
    BOTH,
    BRICK,
    DIRECTED,
    INFINITE,
    KINDS,
    LINE,
    PLACED,
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
    return [kind for kind in kinds_of(features) if kind in shapes.RECORDS]


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
    rows += _infinite_case(features)
    if present:
        rows += [_lamps_text(features), *_areas_text(features)]
    rows += _openings_text(features)
    rows += included(either(present, "lights/sampling.cl"))
    rows.append(densities)
    if BRICK in present:
        rows += included(f"lights/kinds/{BRICK}.cl#chosen")
    if BODY in present:
        rows += included(f"lights/kinds/{BODY}.cl#chosen")
    infinite = included("lights/infinite.cl") if features.lights.infinite else []
    return "\n".join([*rows, *infinite, ""])


def _numbers(features: Features, present: list[str]) -> list[str]:
    """Return the macros of constants."""
    modes = {"ALONG": ALONG, "BOTH": BOTH, "UNSEEN": UNSEEN, "DIRECTED": DIRECTED}
    words = shapes.RECORDS["triangle"].words
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
        either(lights.directed, "lights/area.cl#directed"),
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
    """Return `area_point`, a point of a light on a shape, and `area_pdf`, its density [1/sr].

    Idle lanes have row 0 of `lights`, which may be a lamp: its parameters are not in `geometry`.
    """
    kinds, surfaces = kinds_of(features), surfaces_of(features)
    points, densities = [], []
    for kind in surfaces:
        row = row_text(features, kind, test := kind_test(kind, kinds))
        sampled = f"{kind}_sample({row}, view.p, u)"
        if point := point_text(features, kind, "r.uv", test):
            points.append(Case(test, "r", (f"ShapeSample r = {sampled};", *point)))
        else:
            points.append(Case(test, sampled))
        row = row_text(features, kind, test := kind_test(kind, kinds))
        densities.append(Case(test, f"{kind}_pdf({row}, view.p, view.wi, view.t, view.n)"))
    head = "Scene scene, integer row, LightRow l, LightView view, vec2 u, TexturePoint *point"
    points_of = Function(f"ShapeSample area_point({head})", "shape_sample_nothing()", points)
    pdf = Function("real area_pdf(Scene scene, LightRow l, LightView view)", "0.0f", densities)
    areas = included(either(surfaces, "lights/sampling.cl#areas"))
    return [*([points_of.text()] * bool(surfaces)), pdf.text(), *areas]


def _infinite_case(features: Features) -> list[str]:
    """Return `infinite_case`: radiance and density of an infinite light, where it was lowered."""
    kinds = [kind for kind in others_of(features) if kind in INFINITE]
    if not kinds:
        return []
    tests = " | ".join(f"(l.kind == LIGHT_{kind.upper()})" for kind in kinds)
    rows = ["*radiance = spectrum_of(0.0f);", "*pdf = 0.0f;"]
    for kind in kinds:
        row = row_text(features, kind, test := kind_test(kind, kinds))
        rows += masked(
            test,
            f"{RECORDS[kind].name} light = {row};",
            f"*pdf = sel(m, {kind}_pdf(light, scene, hemisphere, d), *pdf);",
            f"*radiance = spectrum_sel(m, {kind}_radiance(light, scene, d, lambdas), *radiance);",
        )
    head = (
        "void infinite_case(Scene scene, LightRow l, vec3 hemisphere, vec3 d, Wavelengths lambdas, "
        "Spectrum *radiance, real *pdf)"
    )
    return [function(head, *rows), f"#define light_is_infinite(l) ({tests})"]


def _openings_text(features: Features) -> list[str]:
    """Return the openings of a room, and their record."""
    if not features.lights.openings:
        return included(f"lights/openings.cl{TWIN}")
    opening = light_records.OPENING
    words = f"#define OPENING_WORDS {opening.words}"
    return [opening.row_text(), words, *included("lights/openings.cl")]


def emission_text(features: Features) -> str:
    """Return `light_emit`, a ray from a light, behind the text of the lights' dispatch_text."""
    present, aimed = kinds_of(features), features.transport.aimed > 0
    rows = included(*_emission_includes(features))
    if present:
        rows += [_emission_lamps_text(features), *_emission_areas_text(features)]
        rows += [_aimed_text(features)] * aimed
        rows += included(either(aimed, "lights/aiming.cl"), either(aimed, "lights/aiming.cl#ray"))
    rows += included(either(present, "lights/emission.cl#emit"))
    return "\n".join([*rows, ""])


def densities_text(features: Features) -> str:
    """Return the densities that kernels/transport/mis_ratio.cl asks for."""
    kinds = kinds_of(features)
    emitted, chosen, started = [], [], []
    for kind in kinds:
        row = row_text(features, kind, test := kind_test(kind, kinds))
        emitted.append(Case(test, _emit_pdf(kind, row)))
        started.append(Case(test, _start_pdf(kind, row)))
        if pdf := _nee_pdf(kind, row):
            chosen.append(Case(test, pdf))
    view = "Scene scene, LightRow l, LightView view"
    parts = [
        *included(*_emission_includes(features)),
        Function(f"real emit_case({view}, vec3 wi, real t, float disk)", "0.0f", emitted).text(),
        Function(f"real nee_case({view})", "1.0f", chosen).text(),
        *included("lights/emission.cl#densities"),
    ]
    if features.transport.aimed:
        disk = (
            "float disk = PI * emission_radius(scene.settings) * emission_radius(scene.settings);"
        )
        head = f"real start_case({view}, vec3 n, vec3 d, vec3 along)"
        parts.append(Function(head, "0.0f", started, (disk,)).text())
    return "\n".join([*parts, *included(either(features.transport.aimed, "lights/aiming.cl"))])


def _emission_includes(features: Features) -> list[str]:
    """Return the files of the emission of the kinds of lights."""
    present, lights = kinds_of(features), features.lights
    needed = {*present, *(BASES[kind] for kind in present if kind in BASES)}
    names = ["lights/emission.cl"]
    for kind in KINDS:
        if kind in needed and (kind in PLACED or kind in shapes.RECORDS):
            folder = "lights" if kind in PLACED else "shapes"
            names.append(f"{folder}/kinds/{kind}.cl#emission")
    return [
        *names,
        either(features.motion.lights, "lights/moving.cl#emission"),
        either(lights.two_sided, "lights/emission.cl#two_sided"),
        either(lights.unseen or lights.directed, "lights/emission.cl#unseen"),
    ]


def _emit_pdf(kind: str, row: str) -> str:
    """The density of light_emit for a kind, without the probability of its row."""
    if kind in shapes.RECORDS:
        point = f"{kind}_point({row}, (vec2){{0.5f, 0.5f}})"
        return f"INV_PI / surface_point_moved(view, {point}).area * area_sides_pdf(l)"
    if kind in PLACED:
        return f"{kind}_emit_pdf({row}, neg3(wi)) / (t * t)"
    if kind in INFINITE:
        return f"{kind}_pdf({row}, scene, {NOWHERE}, wi) / disk"
    return "(real)(1.0f / disk)"


def _nee_pdf(kind: str, row: str) -> str:
    """The density of next-event estimation for a kind, "" for delta lights."""
    if kind in shapes.RECORDS:
        return f"{kind}_pdf({row}, view.p, view.wi, view.t, view.n)"
    return f"{kind}_pdf({row}, scene, view.hemisphere, view.wi)" if kind in INFINITE else ""


def _start_pdf(kind: str, row: str) -> str:
    """The density of a ray along d that aiming changes, see kernels/lights/aiming.cl."""
    if kind in PLACED:
        return f"{kind}_emit_pdf({row}, along)"
    if kind in shapes.RECORDS:
        even = "!light_mode(l, EMISSION_ALONG) & (dot3(n, d) > 0.0f)"
        return f"sel({even}, max_r(dot3(n, d), (real)(1e-6f)) * INV_PI, (real)(0.0f))"
    return "(real)(1.0f / disk)"


def _emission_lamps_text(features: Features) -> str:
    """Return `lamp_emit`: a ray from a light off all shapes; from infinity along a light sample."""
    kinds, cases = kinds_of(features), []
    for kind in others_of(features):
        row = row_text(features, kind, test := kind_test(kind, kinds))
        ray = f"light_ray_moved(view, {kind}_emit({row}, scene, u, v, lambdas))"
        if kind not in PLACED:
            sample = f"{kind}_sample({row}, scene, {NOWHERE}, u, lambdas)"
            ray = f"distant_emit(scene, light_moved(view, {sample}), v)"
        cases.append(Case(test, ray))
    arguments = "Scene scene, LightRow l, LightView view, vec2 u, vec2 v, Wavelengths lambdas"
    return Function(f"LightRay lamp_emit({arguments})", "light_ray_nothing()", cases).text()


def _emission_areas_text(features: Features) -> list[str]:
    """Return `area_surface_point`: a point of a light on a shape, as that was lowered."""
    surfaces, cases = surfaces_of(features), []
    for kind in surfaces:
        row = row_text(features, kind, test := kind_test(kind, kinds_of(features)))
        if point := point_text(features, kind, "p.uv", test):
            cases.append(Case(test, "p", (f"SurfacePoint p = {kind}_point({row}, u);", *point)))
        else:
            cases.append(Case(test, f"{kind}_point({row}, u)"))
    arguments = "Scene scene, integer row, LightRow l, vec2 u, TexturePoint *point"
    head = f"SurfacePoint area_surface_point({arguments})"
    points = [Function(head, "surface_point_nothing()", cases).text()] * bool(surfaces)
    return [*points, *included(either(surfaces, "lights/emission.cl#areas"))]


def _aimed_text(features: Features) -> str:
    """Return `lamp_aimed`: the power of a turned ray from a light at a point."""
    kinds, cases = kinds_of(features), []
    for kind in kinds:
        if kind in PLACED:
            row = row_text(features, kind, test := kind_test(kind, kinds))
            sent = f"{kind}_intensity({row}, scene, along, lambdas)"
            cases.append(Case(test, f"aim_power(r, turned, {sent}, {kind}_emit_pdf({row}, along))"))
    arguments = "Scene scene, LightRow l, vec3 along, mask turned, Wavelengths lambdas, LightRay r"
    return Function(f"LightRay lamp_aimed({arguments})", "r", cases).text()
