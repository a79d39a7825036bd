"""Kernel text of the lights for light paths: what kernels/lights/emission.cl asks of each kind."""

from __future__ import annotations

from clpt.geometry import shape_records
from clpt.render.lights.cases import (
    NOWHERE,
    either,
    included,
    kind_test,
    kinds_of,
    others_of,
    point_text,
    row_text,
    surfaces_of,
)
from clpt.render.records import Features
from clpt.render.records.dispatch import Case, Function
from clpt.render.records.lights import BASES, INFINITE, KINDS, PLACED


def dispatch_text(features: Features) -> str:
    """Return `light_emit`, a ray from a light, behind the text of the lights' dispatch_text."""
    present, aimed = kinds_of(features), features.transport.aimed
    rows = included(*_includes(features))
    if present:
        rows += [_lamps_text(features), *_areas_text(features)]
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
        *included(*_includes(features)),
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


def _includes(features: Features) -> list[str]:
    """Return the files of the emission of the kinds of lights."""
    present, lights = kinds_of(features), features.lights
    needed = {*present, *(BASES[kind] for kind in present if kind in BASES)}
    names = ["lights/emission.cl"]
    for kind in KINDS:
        if kind in needed and (kind in PLACED or kind in shape_records.RECORDS):
            folder = "lights" if kind in PLACED else "shapes"
            names.append(f"{folder}/kinds/{kind}.cl#emission")
    return [
        *names,
        either(features.motion.lights, "lights/moving.cl#emission"),
        either(lights.two_sided, "lights/emission.cl#two_sided"),
        either(lights.unseen, "lights/emission.cl#unseen"),
    ]


def _emit_pdf(kind: str, row: str) -> str:
    """The density of light_emit for a kind, without the probability of its row."""
    if kind in shape_records.RECORDS:
        point = f"{kind}_point({row}, (vec2){{0.5f, 0.5f}})"
        return f"INV_PI / surface_point_moved(view, {point}).area * area_sides_pdf(l)"
    if kind in PLACED:
        return f"{kind}_emit_pdf({row}, neg3(wi)) / (t * t)"
    if kind in INFINITE:
        return f"{kind}_pdf({row}, scene, {NOWHERE}, wi) / disk"
    return "(real)(1.0f / disk)"


def _nee_pdf(kind: str, row: str) -> str:
    """The density of next-event estimation for a kind, "" for delta lights."""
    if kind in shape_records.RECORDS:
        return f"{kind}_pdf({row}, view.p, view.wi, view.t, view.n)"
    return f"{kind}_pdf({row}, scene, view.hemisphere, view.wi)" if kind in INFINITE else ""


def _start_pdf(kind: str, row: str) -> str:
    """The density of a ray along d that aiming changes, see kernels/lights/aiming.cl."""
    if kind in PLACED:
        return f"{kind}_emit_pdf({row}, along)"
    if kind in shape_records.RECORDS:
        even = "!light_mode(l, EMISSION_ALONG) & (dot3(n, d) > 0.0f)"
        return f"sel({even}, max_r(dot3(n, d), (real)(1e-6f)) * INV_PI, (real)(0.0f))"
    return "(real)(1.0f / disk)"


def _lamps_text(features: Features) -> str:
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


def _areas_text(features: Features) -> list[str]:
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
