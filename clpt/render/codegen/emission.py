"""The dispatch over all lights for paths that start at them, and for weighing these paths."""

from __future__ import annotations

from collections.abc import Iterable

from clpt.geometry import shape_records
from clpt.render.codegen.dispatch import Case, Function, choose, function
from clpt.render.codegen.lights import NOWHERE, kind_test, pmf_text, point_text, row_text
from clpt.render.contract.light_records import (
    ALONG,
    BASES,
    BOTH,
    INFINITE,
    KINDS,
    PLACED,
    RECORDS,
)


def dispatch_text(
    kinds: Iterable[str],
    textured: bool,
    two_sided: bool = False,
    aimed: bool = False,
    moving: bool = False,
    deforming: bool = False,
) -> str:
    """Return `light_emit(scene, pick, u, v, lambdas)`: a ray from a light that is chosen by `pick`.

    kinds: of the lights in the scene; textured: some emission is a texture; two_sided: some shape
    emits from its back too; aimed: some rays go to what is sharp; moving: some lights move;
    deforming: triangles of some have a row for each key. It stands behind the text of
    clpt.render.codegen.lights.dispatch_text.
    """
    present = [kind for kind in KINDS if kind in set(kinds)]
    others = [kind for kind in present if kind in RECORDS]
    surfaces = [kind for kind in present if kind in shape_records.RECORDS]
    includes = _includes(present, moving)
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
    cases = [Case(kind_test(kind, present), _lamp(kind, moving)) for kind in others]
    rows += choose("r", "LightRay", *cases)
    if surfaces:
        rows += _surfaces_text(surfaces, present, textured, two_sided, moving, deforming)
    if aimed:
        rows += _aimed_text(present, bool(surfaces), moving)
    rows += [
        "r.row = row;",
        "real share = 1.0f / max_r(l.pmf, (real)(1e-30f));",
        "r.power = spectrum_scale(r.power, share);",
        "r.seen = spectrum_scale(r.seen, share);",
        "return r;",
    ]
    return "\n".join([*includes, function(head, *rows)])


def densities_text(
    kinds: Iterable[str],
    two_sided: bool,
    tree: bool,
    aimed: bool,
    moving: bool = False,
    deforming: bool = False,
) -> str:
    """Return what kernels/lighting/rivals.cl asks of the light in a row, seen along wi.

    light_emit_pdf(scene, row, wi, t): how densely light_emit sends rays against wi to a surface
    across it at distance t; over the cosine at a light on a shape. Of that, what is left where
    squared distances cancel: [1/(m^2 sr)], and of a light at a point per t^2 [1/m^2], in units of
    Settings.rival_area.
    light_found_pdf(scene, row, p, hemisphere, wi, t, n): the density with which next-event
    estimation at p finds that point of the light [1/sr]; n: the normal there. Of a delta light it
    is the chance of its row.
    light_path_pdf(scene, row, p, wi, t, n): light_emit_pdf of light that is aimed, too.
    """
    present = [kind for kind in KINDS if kind in set(kinds)]
    motion = ("Motion motion = motion_of_light(scene, row, l);",) * moving
    emitted = Function(
        "real light_emit_pdf(Scene scene, integer row, vec3 wi, real t)",
        "0.0f",
        [
            Case(kind_test(kind, present), _emit_pdf(kind, two_sided, moving, deforming))
            for kind in present
        ],
        (
            "LightRow l = light_at(scene, row);",
            "float disk = PI * emission_radius(scene.settings) * emission_radius(scene.settings);",
            *motion,
            *("wi = motion_back_unit(motion, wi);",) * moving,
        ),
        "value * l.pmf * scene.settings->rival_area",
    )
    found = Function(
        "real light_found_pdf(Scene scene, integer row, vec3 p, vec3 hemisphere, vec3 wi, real t, "
        "vec3 n)",
        "1.0f",
        [
            Case(kind_test(kind, present), f"{kind}_pdf({row_text(kind, deforming)}, {given})")
            for kind in present
            if (given := _pdf_arguments(kind, moving))
        ],
        ("LightRow l = light_at(scene, row);", *motion, *_BACK * moving),
        f"value * {pmf_text(tree)}",
    )
    either = "#define light_path_pdf(scene, row, p, wi, t, n) light_emit_pdf(scene, row, wi, t)"
    if aimed:
        either = f'{_start_pdf_text(present, moving)}#include "lighting/aiming.cl"'
    return "\n".join([*_includes(present, moving), emitted.text(), found.text(), either])


def _includes(present: list[str], moving: bool) -> list[str]:
    """Lines that include what lights of these kinds emit."""
    needed = {*present, *(BASES[kind] for kind in present if kind in BASES)}
    files = [k for k in KINDS if k in needed and (k in PLACED or k in shape_records.RECORDS)]
    files += ["moving"] * moving
    return ['#include "interface/emission.cl"', *(f'#include "emission/{k}.cl"' for k in files)]


def _emit_pdf(kind: str, two_sided: bool, moving: bool, deforming: bool) -> str:
    """The density of a kind in light_emit_pdf, but for its row's chance."""
    row = row_text(kind, deforming)
    if kind in shape_records.RECORDS:
        sides = f" * sel(l.emission_mode == {BOTH}, (real)(0.5f), (real)(1.0f))" * two_sided
        point = f"{kind}_point({row}, (vec2){{0.5f, 0.5f}})"
        if moving:
            point = f"surface_point_moved(motion, {point})"
        return f"INV_PI / {point}.area{sides}"
    if kind in PLACED:
        return f"{kind}_emit_pdf({row}, neg3(wi)) / (t * t)"
    if kind in INFINITE:
        return f"{kind}_pdf({row}, scene, {NOWHERE}, wi) / disk"
    return "(real)(1.0f / disk)"


def _start_pdf_text(present: list[str], moving: bool) -> str:
    """`light_start_pdf(scene, row, l, n, d)`: what aiming changes in the density of a ray along d.

    At a light it is the direction's [1/sr], n being the normal on a shape; from infinity the
    place's across it [1/m^2]; 0 where nothing aims.
    """
    cases = []
    for kind in present:
        density = "1.0f / (PI * emission_radius(scene.settings) * emission_radius(scene.settings))"
        if kind in PLACED:
            along = "motion_back_unit(motion, d)" if moving else "d"
            density = f"{kind}_emit_pdf({row_text(kind)}, {along})"
        elif kind in shape_records.RECORDS:
            even = f"(l.emission_mode != {ALONG}) & (dot3(n, d) > 0.0f)"
            density = f"sel({even}, max_r(dot3(n, d), (real)(1e-6f)) * INV_PI, (real)(0.0f))"
        cases.append(Case(kind_test(kind, present), density))
    head = "real light_start_pdf(Scene scene, integer row, LightRow l, vec3 n, vec3 d)"
    before = ("Motion motion = motion_of_light(scene, row, l);",) * moving
    return Function(head, "0.0f", cases, before).text()


def _aimed_text(present: list[str], surfaces: bool, moving: bool) -> list[str]:
    """The ray `r` goes to the sphere `chosen`, and carries light over the density of all rays."""
    rows = ["mask turned;", f"vec3 n = {NOWHERE};"]
    if surfaces:
        rows += [
            "n = sel3(l.shape >= 0, r.n, n);",
            f"chosen = sel_i(l.emission_mode == {ALONG}, (integer)(-1), chosen);",
        ]
    rows.append("r = aim_turn(scene, chosen, r, n, v, &turned);")
    placed = [kind for kind in present if kind in PLACED]
    along = "r.d"
    if moving and placed:
        along = "along"
        rows.append("vec3 along = motion_back_unit(motion, r.d);")
    for kind in placed:
        row = row_text(kind)
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
    "vec3 front = motion_front_back(motion, n), side = motion_back_unit(motion, hemisphere);",
    "real far = t * motion_length_back(motion, wi);",
)


def _pdf_arguments(kind: str, moving: bool) -> str:
    """What `<kind>_pdf` is given, "" for delta lights, which have none."""
    if kind in shape_records.RECORDS:
        return "rest, along, far, front" if moving else "p, wi, t, n"
    if kind in INFINITE:
        return "scene, side, along" if moving else "scene, hemisphere, wi"
    return ""


def _lamp(kind: str, moving: bool) -> str:
    """A ray from a lamp; from infinity, its direction is that of a light sample."""
    if kind in PLACED:
        ray = f"{kind}_emit({row_text(kind)}, scene, u, v, lambdas)"
        return f"light_ray_moved(motion, {ray})" if moving else ray
    sample = f"{kind}_sample({row_text(kind)}, scene, {NOWHERE}, u, lambdas)"
    if moving:
        sample = f"light_moved(motion, {sample})"
    return f"distant_emit(scene, {sample}, v)"


def _surfaces_text(
    kinds: list[str],
    present: list[str],
    textured: bool,
    two_sided: bool,
    moving: bool,
    deforming: bool,
) -> list[str]:
    """A point of the shape, its emission there, and the ray from it."""
    rows = [
        "SurfacePoint q = surface_point_nothing();",
        "TexturePoint point = texture_point_nowhere();",
    ]
    for kind in kinds:
        chosen = f"SurfacePoint p = {kind}_point({row_text(kind, deforming)}, u);"
        point = point_text(kind, "p.uv") if textured else ()
        rows += choose("q", "SurfacePoint", Case(kind_test(kind, present), "p", (chosen, *point)))
    if moving:
        rows.append("q = surface_point_moved(motion, q);")
    if two_sided:
        rows.append(f"q = surface_point_turned(q, l.emission_mode == {BOTH}, &v);")
    return [
        *rows,
        "point.p = q.p;",
        "Spectrum value = emission_load(scene, l.radiance, point, lambdas);",
        f"LightRay s = surface_emit(q, l.emission_mode == {ALONG}, value, v);",
        "r = light_ray_sel(l.shape >= 0, s, r);",
    ]
