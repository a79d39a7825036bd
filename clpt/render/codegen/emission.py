"""The dispatch over all lights for paths that start at them: `light_emit`."""

from __future__ import annotations

from collections.abc import Iterable

from clpt.render.codegen.lights import case_text, point_text, row_text
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
    lines = ['#include "interface/emission.cl"', *(f'#include "emission/{k}.cl"' for k in files)]
    head = "LightRay light_emit(Scene scene, real pick, vec2 u, vec2 v, Wavelengths lambdas)"
    if not present:
        return "\n".join([*lines, f"inline {head} {{ return light_ray_nothing(); }}", ""])
    lines += [
        f"inline {head}",
        "{",
        "    integer row = light_pick(scene, &pick);",
        "    LightRow l = light_at(scene, row);",
        "    LightRay r = light_ray_nothing();",
    ]
    for kind in others:
        lines += case_text(kind, len(present) == 1, [f"r = light_ray_sel(m, {_lamp(kind)}, r);"])
    if surfaces:
        lines += _surfaces_text(surfaces, len(present) == 1, textured, two_sided)
    lines += [
        "    real share = 1.0f / max_r(l.pmf, (real)(1e-30f));",
        "    r.power = spectrum_scale(r.power, share);",
        "    r.seen = spectrum_scale(r.seen, share);",
        "    return r;",
        "}",
    ]
    return "\n".join([*lines, ""])


def _lamp(kind: str) -> str:
    """A ray from a lamp; from infinity, its direction is that of a light sample."""
    if kind in PLACED:
        return f"{kind}_emit({row_text(kind)}, scene, u, v, lambdas)"
    nowhere = "v3(0.0f, 0.0f, 0.0f)"
    sample = f"{kind}_sample({row_text(kind)}, scene, {nowhere}, u, lambdas)"
    return f"distant_emit(scene, {sample}, v)"


def _surfaces_text(kinds: list[str], only: bool, textured: bool, two_sided: bool) -> list[str]:
    """A point of the shape, its emission there, and the ray from it."""
    lines = [
        "    SurfacePoint q = surface_point_nothing();",
        "    TexturePoint point = texture_point_nowhere();",
    ]
    for kind in kinds:
        body = [f"SurfacePoint p = {kind}_point({row_text(kind)}, u);"]
        body += point_text(kind, "p.uv") if textured else []
        lines += case_text(kind, only, [*body, "q = surface_point_sel(m, p, q);"])
    if two_sided:
        lines.append(f"    q = surface_point_turned(q, l.emission_mode == {BOTH}, &v);")
    return [
        *lines,
        "    point.p = q.p;",
        "    Spectrum value = emission_load(scene, l.radiance, point, lambdas);",
        f"    LightRay s = surface_emit(q, l.emission_mode == {ALONG}, value, v);",
        "    r = light_ray_sel(l.shape >= 0, s, r);",
    ]
