"""Kernel text of the lights: choosing one, sampling it, its pdf, and what infinite ones add."""

from __future__ import annotations

from collections.abc import Iterable

from clpt.device.source import TWIN
from clpt.geometry import shape_records
from clpt.render.records import Features
from clpt.render.records import lights as light_records
from clpt.render.records.dispatch import Case, Function, active, choose, function, masked
from clpt.render.records.lights import (
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
        own = f'{record.row_text()}#include "lights/kinds/{kind}.cl"\n'
        files[f"generated/light/{kind}.cl"] = base + own
    return files


def emission_sources(features: Features) -> frozenset[str]:
    """Return where the emissions of all lights come from."""
    return features.materials.sources_of("emission").get("value", frozenset({"constant"}))


def textured(features: Features) -> bool:
    """Whether some emission is a texture, so that triangles need the uv of their mesh."""
    return "texture" in emission_sources(features)


def kinds_of(features: Features) -> list[str]:
    """Return the kinds of lights in the scene, in the order of their table."""
    return [kind for kind in KINDS if kind in features.lights.kinds]


def surfaces_of(features: Features) -> list[str]:
    """Return the kinds of the scene's lights that are shapes."""
    return [kind for kind in kinds_of(features) if kind in shape_records.RECORDS]


def others_of(features: Features) -> list[str]:
    """Return the kinds of the scene's lights that have parameters of their own, off all shapes."""
    return [kind for kind in kinds_of(features) if kind in RECORDS]


def dispatch_text(features: Features, densities: str = "") -> str:
    """Return the functions over all lights.

    densities: the functions that weigh light paths, where there are some. It includes the files of
    `virtual_files`, here and in clpt.render.geometry.cases.

    light_sample(scene, p, receiver, pick, u, lambdas): chooses a light and a direction to it
    light_pdf(scene, row, p, receiver, wi, t, n): of it, [1/sr], for a ray that met a shape
    light_shows(scene, row, front): whether the side of a shape that was met emits
    infinite_light(scene, row, p, receiver, d, lambdas, ...): radiance and pdf of an infinite one
    infinite_gather(scene, p, receiver, d, pdf, lambdas): what they add to a path that left
    """
    present, others, surfaces = kinds_of(features), others_of(features), surfaces_of(features)
    includes = ["shapes/surface.cl#flags", "shapes/shape.cl", "lights/light.cl", "core/mis.cl"]
    includes += [f"lights/receiver.cl{'' if features.lights.gloss else TWIN}"]
    includes += ["lights/light.cl#choice"]
    includes += ["generated/textures.cl", "generated/medium.cl"] if features.lights.volumes else []
    includes += [f"generated/light/{kind}.cl" for kind in others]
    includes += [f"generated/shape/{kind}.cl" for kind in surfaces]
    includes += ["lights/light.cl#volumes"] if features.lights.volumes else []
    includes += ["lights/area.cl"] if surfaces else []
    includes += ["lights/moving.cl"] if features.motion.lights else []
    includes += ["lights/moving.cl#deforming"] if features.motion.emitters else []
    words = shape_records.RECORDS["triangle"].words
    parts = [f"#define TRIANGLE_ROW_WORDS {words}"] * features.motion.emitters
    parts += [f"#define LIGHT_{kind.upper()} {KINDS.index(kind)}" for kind in present]
    parts += [f"#define GLOSS_BEFORE {features.lights.gloss}"] * (features.lights.gloss > 0)
    parts += [f"#define LIGHT_VOLUMES {KINDS.index(VOLUMES[0])}"] * features.lights.volumes
    parts += [f'#include "{name}"' for name in includes]
    parts += _tree_text() if features.lights.tree else []
    parts += [_sides_text(features), _sample_text(features), _pdf_text(features), densities]
    parts += _volumes_text(features)
    parts += _infinite_text(features)
    return "\n".join(parts) + "\n"


def kind_test(kind: str, kinds: Iterable[str]) -> str:
    """Return the test whether the light `l` is of a kind; "": it always is, no other occurs."""
    return "" if {*kinds} == {kind} else f"l.kind == LIGHT_{kind.upper()}"


def row_text(features: Features, kind: str) -> str:
    """The kind's parameters of the light `l`; other lanes read the first row, see `blank_row`."""
    if features.motion.emitters and kind == "triangle":
        return "triangle_then(scene, l, m)"
    table = "light_params" if kind in RECORDS else "geometry"
    return f"{kind}_row(scene.{table}, {active('l.params')})"


def point_text(kind: str, uv: str) -> list[str]:
    """Lines that set `point`, what a texture sees, where the light `l` is a shape of a kind."""
    if kind not in ("triangle", "sphere"):
        return [f"point = texture_point_sel(m, texture_point({uv}, {NOWHERE}), point);"]
    seen = f"area_{kind}_point(scene, shape, sel_i(m, row, shape.light), {uv})"
    return [
        f"integer at = {active('l.shape')} * SHAPE_ROW_WORDS;",
        "ShapeRow shape = shape_row_row(scene.shapes, at);",
        f"point = texture_point_sel(m, {seen}, point);",
    ]


def mode_text(bit: int) -> str:
    """Return the test whether the light `l` has a bit of LightRow.emission_mode."""
    return f"((l.emission_mode & {bit}) != 0)"


def _tree_text() -> list[str]:
    """Nodes of the tree over lights, and how one goes down in it."""
    node = light_records.NODE
    return [
        node.row_text(many=True),
        f"#define LIGHT_NODE_WORDS {node.words}",
        f"#define LIGHT_TREE_WIDTH {WIDTH}",
        f"#define LIGHT_TREE_LINE {LINE}",
        '#include "lights/light_tree.cl"',
    ]


def _sides_text(features: Features) -> str:
    """Whether the side of a shape that a ray met emits; most scenes need not look at the row."""
    if not (features.lights.two_sided or features.lights.unseen):
        return "#define light_shows(scene, row, front) (front)"
    head = "mask light_shows(Scene scene, integer row, mask front)"
    row = "LightRow l = light_at(scene, max_i(row, (integer)(0)));"
    return function(head, row, f"return (front | {mode_text(BOTH)}) & !{mode_text(UNSEEN)};")


def _pick_text(features: Features) -> list[str]:
    """Choose a row of `lights`, by the tree or by power."""
    number = "FEW_LIGHTS ? &u.x : &pick"
    if not features.lights.tree:
        return [f"integer row = light_pick(scene, {number}, u.y);"]
    picked = f"light_tree_pick(scene, p, receiver, {number}, u.y, &pmf)"
    return ["real pmf;", f"integer row = {picked};"]


def _hemisphere(moving: bool) -> str:
    """The hemisphere by which an infinite light is sampled, which turns with one that moves."""
    return "hemisphere" if moving else "receiver.hemisphere"


def _sample_text(features: Features) -> str:
    """`light_sample`: a light that is chosen by `pick`, and a direction to it."""
    others, surfaces = others_of(features), surfaces_of(features)
    kinds, moving = [*others, *surfaces], features.motion.lights
    head = (
        "LightSample light_sample(Scene scene, vec3 p, Receiver receiver, real pick, vec2 u, "
        "Wavelengths lambdas)"
    )
    if not kinds:
        return function(head, "return light_sample_nothing();")
    rows = [
        *_pick_text(features),
        "LightRow l = light_at(scene, row);",
        "LightSample s = light_sample_nothing();",
    ]
    if moving:
        rows += [
            "Motion motion = motion_of_light(scene, row, l);",
            "vec3 seen_from = p;",
            "p = motion_point_back(motion, p);",
            "vec3 hemisphere = motion_back_unit(motion, receiver.hemisphere);",
        ]
    for kind in others:
        seen = _hemisphere(moving) if kind in INFINITE else "p"
        sampled = f"{kind}_sample({row_text(features, kind)}, scene, {seen}, u, lambdas)"
        rows += choose("s", "LightSample", Case(kind_test(kind, kinds), sampled))
    if surfaces:
        rows += [
            "ShapeSample q = shape_sample_nothing();",
            "TexturePoint point = texture_point_nowhere();",
        ]
    for kind in surfaces:
        sampled = f"ShapeSample r = {kind}_sample({row_text(features, kind)}, p, u);"
        point = point_text(kind, "r.uv") if textured(features) else ()
        rows += choose("q", "ShapeSample", Case(kind_test(kind, kinds), "r", (sampled, *point)))
    if moving:
        rows.append("s = light_moved(motion, s);")
        rows += ["q = area_moved(motion, q);", "p = seen_from;"] if surfaces else []
    if features.lights.two_sided:
        rows.append(f"q = area_turned(q, {mode_text(BOTH)});")
    if surfaces:
        rows += [
            "point.p = madd3(q.wi, q.t, p);",
            "Spectrum le = emission_load(scene, l.radiance, point, lambdas);",
            "s = light_sample_sel(l.shape >= 0, area_sample(q, point.p, le), s);",
        ]
    return function(head, *rows, *_chosen_text(features), "return s;")


def _chosen_text(features: Features) -> list[str]:
    """Return lines by which the sample `s` of the light `l` in row `row` keeps its choice."""
    lights, weighed = features.lights, features.transport.balanced
    pmf = "pmf" if lights.tree else "l.pmf"
    chance = f"sel({mode_text(UNSEEN)}, fabs(s.pdf), {pmf})" if lights.unseen else pmf
    kept = weighed or features.film.layers.light_groups or lights.volumes or lights.unseen
    rows = [f"s = light_chosen(s, {pmf});"]
    rows += [f"s = area_unseen(s, {mode_text(UNSEEN)});"] * lights.unseen
    rows += ["s.row = row;"] if kept else []
    rows += [f"s.chance = {chance};"] if weighed else []
    if features.transport.aimed:
        rows.append(f"s.n = {'q.n' if surfaces_of(features) else NOWHERE};")
    return rows


def _pdf_text(features: Features) -> str:
    """`light_pdf`: of a direction in which a ray has met a light."""
    surfaces = surfaces_of(features)
    at, along, far, front = ("p", "wi", "t", "n")
    before = ["LightRow l = light_at(scene, row);"]
    if features.motion.lights and surfaces:
        at, along, far, front = ("rest", "along", "far", "front")
        before += [
            "Motion motion = motion_of_light(scene, row, l);",
            "vec3 rest = motion_point_back(motion, p), along = motion_back_unit(motion, wi);",
            "vec3 front = motion_front_back(motion, n);",
            "real far = t * motion_length_back(motion, wi);",
        ]
    return Function(
        "real light_pdf(Scene scene, integer row, vec3 p, Receiver receiver, vec3 wi, real t, "
        "vec3 n)",
        "0.0f",
        [
            Case(
                kind_test(kind, surfaces),
                f"{kind}_pdf({row_text(features, kind)}, {at}, {along}, {far}, {front})",
            )
            for kind in surfaces
        ],
        tuple(before),
        f"value * {pmf_text(features)}",
    ).text()


def _volumes_text(features: Features) -> list[str]:
    """Functions of parts of media that emit, with the densities [1/sr] of choosing them from p.

    `brick_light_pdf`: of a point of a brick at a distance t; `body_light_pdf`: of a direction d in
    which a body is.
    """
    made = []
    ways = (BRICK, "brick", "real t", "t"), (BODY, "body", "vec3 d", "p, d")
    for kind, name, given, seen in ways:
        if kind in features.lights.kinds:
            given = f"Scene scene, integer row, vec3 p, Receiver receiver, {given}"
            head = f"real {name}_light_pdf({given})"
            pdf = f"{kind}_pdf({row_text(features, kind)}, {seen})"
            rows = ["LightRow l = light_at(scene, row);", "mask m = mask_of(1);"]
            made.append(function(head, *rows, f"return {pdf} * {pmf_text(features)};"))
    return made


def pmf_text(features: Features) -> str:
    """The chance of the light `l` in row `row`, for a surface at p."""
    chosen = "light_tree_pmf(scene, (integer)(row), p, receiver)"
    return chosen if features.lights.tree else "l.pmf"


def _infinite_text(features: Features) -> list[str]:
    """`infinite_light`, whose `row` is the same in all lanes, and `infinite_gather`."""
    kinds = [kind for kind in others_of(features) if kind in INFINITE]
    moving = features.motion.lights
    if not kinds:
        return []
    rows = [
        "LightRow l = light_at(scene, (integer)(row));",
        "*radiance = spectrum_of(0.0f);",
        "*pdf = 0.0f;",
    ]
    if moving:
        rows += [
            "Motion motion = motion_of_light(scene, (integer)(row), l);",
            "d = motion_back_unit(motion, d);",
            "vec3 hemisphere = motion_back_unit(motion, receiver.hemisphere);",
        ]
    for kind in kinds:
        rows += masked(
            kind_test(kind, kinds),
            f"{RECORDS[kind].name} light = {row_text(features, kind)};",
            f"*radiance = spectrum_sel(m, {kind}_radiance(light, scene, d, lambdas), *radiance);",
            f"*pdf = sel(m, {kind}_pdf(light, scene, {_hemisphere(moving)}, d), *pdf);",
        )
    rows.append(f"*pdf *= {pmf_text(features)};")
    head = (
        "void infinite_light(Scene scene, int row, vec3 p, Receiver receiver, vec3 d, "
        "Wavelengths lambdas, Spectrum *radiance, real *pdf)"
    )
    return [function(head, *rows), '#include "lights/infinite.cl"']
