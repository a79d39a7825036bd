"""The dispatch over all lights for paths that start at them: `light_emit`."""

from __future__ import annotations

from collections.abc import Iterable

from clpt.render.codegen.dispatch import Case, choose, function
from clpt.render.codegen.lights import kind_test, point_text, row_text
from clpt.render.contract import shape_records
from clpt.render.contract.light_records import ALONG, BASES, BOTH, KINDS, PLACED, RECORDS


def dispatch_text(kinds: Iterable[str], textured: bool, two_sided: bool = False) -> str:
    """Return `light_emit(scene, pick, u, v, lambdas)`: a ray from a light that is chosen by `pick`.

    kinds: of the lights in the scene; textured: some emission is a texture; two_sided: some shape
    emits from its back too. It stands behind the text of clpt.render.codegen.lights.dispatch_text.
    """
    present = [kind for kind in KINDS if kind in set(kinds)]
    others = [kind for kind in present if kind in RECORDS]
    surfaces = [kind for kind in present if kind in shape_records.RECORDS]
    needed = {*present, *(BASES[kind] for kind in present if kind in BASES)}
    files = [k for k in KINDS if k in needed and (k in PLACED or k in shape_records.RECORDS)]
    includes = ['#include "interface/emission.cl"', *(f'#include "emission/{k}.cl"' for k in files)]
    head = "LightRay light_emit(Scene scene, real pick, vec2 u, vec2 v, Wavelengths lambdas)"
    if not present:
        return "\n".join([*includes, function(head, "return light_ray_nothing();")])
    rows = [
        "integer row = light_pick(scene, &pick, u.y);",
        "LightRow l = light_at(scene, row);",
        "LightRay r = light_ray_nothing();",
    ]
    cases = [Case(kind_test(kind, present), _lamp(kind)) for kind in others]
    rows += choose("r", "LightRay", *cases)
    if surfaces:
        rows += _surfaces_text(surfaces, present, textured, two_sided)
    rows += [
        "real share = 1.0f / max_r(l.pmf, (real)(1e-30f));",
        "r.power = spectrum_scale(r.power, share);",
        "r.seen = spectrum_scale(r.seen, share);",
        "return r;",
    ]
    return "\n".join([*includes, function(head, *rows)])


def _lamp(kind: str) -> str:
    """A ray from a lamp; from infinity, its direction is that of a light sample."""
    if kind in PLACED:
        return f"{kind}_emit({row_text(kind)}, scene, u, v, lambdas)"
    nowhere = "v3(0.0f, 0.0f, 0.0f)"
    sample = f"{kind}_sample({row_text(kind)}, scene, {nowhere}, u, lambdas)"
    return f"distant_emit(scene, {sample}, v)"


def _surfaces_text(
    kinds: list[str], present: list[str], textured: bool, two_sided: bool
) -> list[str]:
    """A point of the shape, its emission there, and the ray from it."""
    rows = [
        "SurfacePoint q = surface_point_nothing();",
        "TexturePoint point = texture_point_nowhere();",
    ]
    for kind in kinds:
        chosen = f"SurfacePoint p = {kind}_point({row_text(kind)}, u);"
        point = point_text(kind, "p.uv") if textured else ()
        rows += choose("q", "SurfacePoint", Case(kind_test(kind, present), "p", (chosen, *point)))
    if two_sided:
        rows.append(f"q = surface_point_turned(q, l.emission_mode == {BOTH}, &v);")
    return [
        *rows,
        "point.p = q.p;",
        "Spectrum value = emission_load(scene, l.radiance, point, lambdas);",
        f"LightRay s = surface_emit(q, l.emission_mode == {ALONG}, value, v);",
        "r = light_ray_sel(l.shape >= 0, s, r);",
    ]
