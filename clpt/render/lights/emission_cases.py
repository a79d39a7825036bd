"""The dispatch over all lights for paths that start at them, and for weighing these paths."""

from __future__ import annotations

from clpt.geometry import shape_records
from clpt.render.lights.cases import (
    NOWHERE,
    kind_test,
    kinds_of,
    mode_text,
    others_of,
    pmf_text,
    point_text,
    row_text,
    surfaces_of,
    textured,
)
from clpt.render.records import Features
from clpt.render.records.dispatch import Case, Function, choose, function
from clpt.render.records.lights import ALONG, BASES, BOTH, INFINITE, KINDS, PLACED, UNSEEN


def dispatch_text(features: Features) -> str:
    """Return `light_emit(scene, pick, u, v, lambdas)`: a ray from a light that is chosen by `pick`.

    It stands behind the text of clpt.render.lights.cases.dispatch_text.
    """
    present, surfaces = kinds_of(features), surfaces_of(features)
    aimed, moving = features.transport.aimed, features.motion.lights
    includes = _includes(features)
    head = "LightRay light_emit(Scene scene, real pick, vec2 u, vec2 v, Wavelengths lambdas)"
    if not present:
        return "\n".join([*includes, function(head, "return light_ray_nothing();")])
    rows = [
        "integer row = light_pick(scene, &pick, u.y);",
        "LightRow l = light_at(scene, row);",
        "LightRay r = light_ray_nothing();",
    ]
    if moving:
        rows.append("Motion motion = motion_of_light(scene, row, l);")
    if aimed:
        rows.append("integer chosen = aim_choose(scene, &v.x);")
    cases = [Case(kind_test(kind, present), _lamp(features, kind)) for kind in others_of(features)]
    rows += choose("r", "LightRay", *cases)
    if surfaces:
        rows += _surfaces_text(features)
    if aimed:
        rows += _aimed_text(features)
    rows += [
        "r.row = row;",
        "real share = 1.0f / max_r(l.pmf, (real)(1e-30f));",
        "r.power = spectrum_scale(r.power, share);",
        "r.seen = spectrum_scale(r.seen, share);",
        "return r;",
    ]
    return "\n".join([*includes, function(head, *rows)])


def densities_text(features: Features) -> str:
    """Return what kernels/transport/mis_ratio.cl asks of the light in a row, seen along wi.

    light_emit_pdf(scene, row, wi, t): how densely light_emit sends rays against wi to a surface
    across it at distance t; over the cosine at a light on a shape. Of that, what is left where
    squared distances cancel: [1/(m^2 sr)], and of a light at a point per t^2 [1/m^2], in units of
    Settings.mis_area_unit.
    light_found_pdf(scene, row, p, receiver, wi, t, n): the density with which next-event
    estimation at p finds that point of the light [1/sr]; n: the normal there. Of a delta light it
    is the chance of its row. Where the tree asks for gloss it is without that chance, which is
    known later, see kernels/transport/mis_ratio.cl.
    light_path_pdf(scene, row, p, wi, t, n): light_emit_pdf of light that is aimed, too.
    """
    present, moving = kinds_of(features), features.motion.lights
    motion = ("Motion motion = motion_of_light(scene, row, l);",) * moving
    emitted = Function(
        "real light_emit_pdf(Scene scene, integer row, vec3 wi, real t)",
        "0.0f",
        [Case(kind_test(kind, present), _emit_pdf(features, kind)) for kind in present],
        (
            "LightRow l = light_at(scene, row);",
            "float disk = PI * emission_radius(scene.settings) * emission_radius(scene.settings);",
            *motion,
            *("wi = motion_back_unit(motion, wi);",) * moving,
        ),
        "value * l.pmf * scene.settings->mis_area_unit",
    )
    found = Function(
        "real light_found_pdf(Scene scene, integer row, vec3 p, Receiver receiver, vec3 wi, "
        "real t, vec3 n)",
        "1.0f",
        [
            Case(kind_test(kind, present), f"{kind}_pdf({row_text(features, kind)}, {given})")
            for kind in present
            if (given := _pdf_arguments(kind, moving))
        ],
        ("LightRow l = light_at(scene, row);", *motion, *_BACK * moving),
        "value" if features.lights.gloss else f"value * {pmf_text(features)}",
    )
    either = "#define light_path_pdf(scene, row, p, wi, t, n) light_emit_pdf(scene, row, wi, t)"
    if features.transport.aimed:
        either = f'{_start_pdf_text(features)}#include "lights/aiming.cl"'
    return "\n".join([*_includes(features), emitted.text(), found.text(), either])


def _includes(features: Features) -> list[str]:
    """Lines that include what the kinds of lights emit."""
    present = kinds_of(features)
    needed = {*present, *(BASES[kind] for kind in present if kind in BASES)}
    rows = ['#include "lights/emission.cl"']
    for kind in KINDS:
        if kind in needed and (kind in PLACED or kind in shape_records.RECORDS):
            folder = "lights" if kind in PLACED else "shapes"
            rows.append(f'#include "{folder}/kinds/{kind}.cl#emission"')
    return rows + ['#include "lights/moving.cl#emission"'] * features.motion.lights


def _emit_pdf(features: Features, kind: str) -> str:
    """The density of a kind in light_emit_pdf, but for its row's chance."""
    row = row_text(features, kind)
    if kind in shape_records.RECORDS:
        sides = f" * sel({mode_text(BOTH)}, (real)(0.5f), (real)(1.0f))"
        sides *= features.lights.two_sided
        point = f"{kind}_point({row}, (vec2){{0.5f, 0.5f}})"
        if features.motion.lights:
            point = f"surface_point_moved(motion, {point})"
        return f"INV_PI / {point}.area{sides}"
    if kind in PLACED:
        return f"{kind}_emit_pdf({row}, neg3(wi)) / (t * t)"
    if kind in INFINITE:
        return f"{kind}_pdf({row}, scene, {NOWHERE}, wi) / disk"
    return "(real)(1.0f / disk)"


def _start_pdf_text(features: Features) -> str:
    """`light_start_pdf(scene, row, l, n, d)`: what aiming changes in the density of a ray along d.

    At a light it is the direction's [1/sr], n being the normal on a shape; from infinity the
    place's across it [1/m^2]; 0 where nothing aims.
    """
    cases: list[Case] = []
    present, moving = kinds_of(features), features.motion.lights
    for kind in present:
        density = "1.0f / (PI * emission_radius(scene.settings) * emission_radius(scene.settings))"
        if kind in PLACED:
            along = "motion_back_unit(motion, d)" if moving else "d"
            density = f"{kind}_emit_pdf({row_text(features, kind)}, {along})"
        elif kind in shape_records.RECORDS:
            even = f"!{mode_text(ALONG)} & (dot3(n, d) > 0.0f)"
            density = f"sel({even}, max_r(dot3(n, d), (real)(1e-6f)) * INV_PI, (real)(0.0f))"
        cases.append(Case(kind_test(kind, present), density))
    head = "real light_start_pdf(Scene scene, integer row, LightRow l, vec3 n, vec3 d)"
    before = ("Motion motion = motion_of_light(scene, row, l);",) * moving
    return Function(head, "0.0f", cases, before).text()


def _aimed_text(features: Features) -> list[str]:
    """The ray `r` goes to the sphere `chosen`, and carries light over the density of all rays."""
    present = kinds_of(features)
    rows = ["mask turned;", f"vec3 n = {NOWHERE};"]
    if surfaces_of(features):
        rows += [
            "n = sel3(l.shape >= 0, r.n, n);",
            f"chosen = sel_i({mode_text(ALONG)}, (integer)(-1), chosen);",
        ]
    rows.append("r = aim_turn(scene, chosen, r, n, v, &turned);")
    placed = [kind for kind in present if kind in PLACED]
    along = "r.d"
    if features.motion.lights and placed:
        along = "along"
        rows.append("vec3 along = motion_back_unit(motion, r.d);")
    for kind in placed:
        row = row_text(features, kind)
        sent = f"{kind}_intensity({row}, scene, {along}, lambdas)"
        power = f"aim_power(r, turned, {sent}, {kind}_emit_pdf({row}, {along}))"
        rows += choose("r", "LightRay", Case(kind_test(kind, present), power))
    return [
        *rows,
        "r.gain = light_gain(scene, row, l, chosen, r.o, n, r.d, r.away);",
        "r.power = spectrum_scale(r.power, 1.0f / r.gain);",
    ]


# of a point that a light shines on, where the light was lowered
_BACK = (
    "vec3 rest = motion_point_back(motion, p), along = motion_back_unit(motion, wi);",
    "vec3 front = motion_front_back(motion, n);",
    "vec3 side = motion_back_unit(motion, receiver.hemisphere);",
    "real far = t * motion_length_back(motion, wi);",
)


def _pdf_arguments(kind: str, moving: bool) -> str:
    """Return the arguments of `<kind>_pdf`, "" for delta lights, which have none."""
    if kind in shape_records.RECORDS:
        return "rest, along, far, front" if moving else "p, wi, t, n"
    if kind in INFINITE:
        return "scene, side, along" if moving else "scene, receiver.hemisphere, wi"
    return ""


def _lamp(features: Features, kind: str) -> str:
    """A ray from a lamp; from infinity, its direction is that of a light sample."""
    row, moving = row_text(features, kind), features.motion.lights
    if kind in PLACED:
        ray = f"{kind}_emit({row}, scene, u, v, lambdas)"
        return f"light_ray_moved(motion, {ray})" if moving else ray
    sample = f"{kind}_sample({row}, scene, {NOWHERE}, u, lambdas)"
    if moving:
        sample = f"light_moved(motion, {sample})"
    return f"distant_emit(scene, {sample}, v)"


def _surfaces_text(features: Features) -> list[str]:
    """A point of the shape, its emission there, and the ray from it."""
    rows = [
        "SurfacePoint q = surface_point_nothing();",
        "TexturePoint point = texture_point_nowhere();",
    ]
    for kind in surfaces_of(features):
        chosen = f"SurfacePoint p = {kind}_point({row_text(features, kind)}, u);"
        point = point_text(kind, "p.uv") if textured(features) else ()
        test = kind_test(kind, kinds_of(features))
        rows += choose("q", "SurfacePoint", Case(test, "p", (chosen, *point)))
    if features.motion.lights:
        rows.append("q = surface_point_moved(motion, q);")
    if features.lights.two_sided:
        rows.append(f"q = surface_point_turned(q, {mode_text(BOTH)}, &v);")
    return [
        *rows,
        "point.p = q.p;",
        "Spectrum value = emission_load(scene, l.radiance, point, lambdas);",
        f"LightRay s = surface_emit(q, {mode_text(ALONG)}, value, v);",
        *(f"s.seen = spectrum_sel({mode_text(UNSEEN)}, spectrum_of(0.0f), s.seen);",)
        * features.lights.unseen,
        "r = light_ray_sel(l.shape >= 0, s, r);",
    ]
