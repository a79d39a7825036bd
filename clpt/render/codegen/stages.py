"""Generated parts of the stages' text: what there is of each sort in a scene, and how it is chosen.

The physics is always in a file.
"""

from __future__ import annotations

from clpt.layout import Record
from clpt.records import SHAPE
from clpt.render.codegen import lights, parameters, thin_films
from clpt.render.contract import camera_records, parameter_words, shape_records
from clpt.render.contract.features import Features, Sources
from clpt.scene import materials
from clpt.scene.params import device_params, interior_params


def spectrum_text(features: Features) -> str:
    """Reading spectra in a mode, and how the camera draws wavelengths."""
    text = f'#include "spectrum/{features.mode}_read.cl"\n'
    if features.mode == "spectral":
        drawn = "density" if features.tabulated_density else "visible"
        text += f'#include "spectrum/{drawn}.cl"\n'
    return text


def sampler_text(kind: str) -> str:
    """A sampler, and how it numbers the places of the film: as they come, or along a curve."""
    order = "_z" if kind == "zsobol" else ""
    return f'#include "sampler/{kind}.cl"\n#include "path/pixel_sampler{order}.cl"\n'


def camera_text(kind: str, glass: bool) -> str:
    record: Record = camera_records.RECORDS[kind]
    camera = f"(global const {record.name} *)(scene).camera"
    made = f"{kind}_ray({camera}, film, lens)"
    if glass:
        row = f"(integer)(({camera})->glass)"
        made = f"{kind}_glass_ray({camera}, film, lens, spectra_row(scene, {row}, lambdas).x)"
    return (
        f'{record.uniform_text()}#include "camera/{kind}.cl"\n'
        f"#define camera_ray(scene, film, lens, lambdas) {made}\n"
    )


def connect_text(kind: str) -> str:
    record: Record = camera_records.RECORDS[kind]
    return (
        f'#include "camera/{kind}_connect.cl"\n#define camera_connect(scene, p, away, lens) '
        f"{kind}_connect((global const {record.name} *)(scene).camera, (scene).settings, "
        "p, away, lens)\n"
    )


def emits_textures(features: Features) -> bool:
    """Whether some emission is a texture."""
    return "texture" in _emissions(features)


def _emissions(features: Features) -> frozenset[str]:
    return features.sources.get("emission", {}).get("value", frozenset({"constant"}))


def lights_text(features: Features) -> str:
    """The loader of emissions, from wherever they come in this scene, and the lights' dispatch."""
    textured = emits_textures(features)
    factors = features.sources.get("factor", {}).get("value", frozenset())
    return (
        ('#include "generated/textures.cl"\n' if textured or "texture" in factors else "")
        + parameters.emission_text(_emissions(features))
        + (parameters.factor_text(factors) if factors else "")
        + lights.dispatch_text(
            features.lights, textured, features.two_sided_lights, features.light_tree
        )
    )


def mixture_text(features: Features) -> str:
    """The loader of the weights of masks and blends."""
    found = features.sources.get("mixture", {}).get("weight", frozenset({"constant"}))
    return parameters.mixture_text(found)


def shading_frame_text(features: Features) -> str:
    """The frame of shading; the loader of the maps that bend it, where there are some."""
    if not features.normal_maps_used:
        return '#include "path/shading_frame.cl"\n'
    found = features.sources["perturbation"]["value"]
    return f'#define NORMAL_MAP_WORDS {parameter_words.NORMAL_MAP_WORDS}\n{parameters.normal_map_text(found)}#include "path/shading_frame_mapped.cl"\n'


def null_transmittance_text(features: Features) -> str:
    """`null_transmittance`: how much of the light passes a surface with some material word.

    A mixture's children are one level below it, since kernels cannot call themselves.
    """
    leaves = enumerate(features.leaves)
    passing = [f"(MATERIAL_KIND(word) == {i})" for i, cls in leaves if cls.is_null]
    arguments = "Scene scene, integer word, TexturePoint point, Wavelengths lambdas"
    lines = [
        f"inline real null_share_0({arguments})",
        "{",
        f"    return sel({' | '.join(passing) or 'mask_of(0)'}, (real)(1.0f), (real)(0.0f));",
        "}",
    ]
    for level in range(1, features.mixtures + 1):
        below = f"null_share_{level - 1}"
        lines += [
            f"inline real null_share_{level}({arguments})",
            "{",
            "    mask mixed = MATERIAL_KIND(word) == 0xff;",
            f"    real share = {below}(scene, word, point, lambdas);",
            "    if (any(mixed)) {",
            "        integer row = sel_i(mixed, MATERIAL_ROW(word), (integer)(0));",
            "        real w = mixture_weight(scene, row, point, lambdas);",
            "        integer a = gather_i(scene.mixtures, row + 2);",
            "        integer b = gather_i(scene.mixtures, row + 3);",
            f"        real first = {below}(scene, a, point, lambdas);",
            f"        real second = {below}(scene, b, point, lambdas);",
            "        share = sel(mixed, first + w * (second - first), share);",
            "    }",
            "    return share;",
            "}",
        ]
    return "\n".join([*lines, f"#define null_transmittance null_share_{features.mixtures}", ""])


def transmittance_text(features: Features) -> str:
    """How much light passes between two points: all or nothing, but where surfaces are null."""
    opaque = "" if features.is_null else "_opaque"
    return f'#include "tracing/transmittance{opaque}.cl"\n'


def medium_text(features: Features) -> str:
    """What absorbs between surfaces, where something does."""
    if not features.absorption:
        return ""
    found = [own.get("absorption", frozenset()) for own in features.sources.values()]
    return parameters.medium_text(frozenset().union(*found)) + '#include "optics/medium.cl"\n'


def _interior_text(features: Features, cls: type[materials.Material]) -> list[str]:
    """How the medium inside of a material is named, see kernels/optics/medium.cl."""
    if not features.absorption:
        return []
    first = 1 + sum(map(parameter_words.words, device_params(cls).values()))
    inside = f"((row) + {first})" if interior_params(cls) else "((integer)(0))"
    if interior_params(cls) and "thin" in device_params(cls):  # a sheet has no inside
        before = [*device_params(cls)].index("thin")
        at = sum(map(parameter_words.words, [*device_params(cls).values()][:before]))
        thin = f"gather_i(scene.materials, (row) + {at}) != 0"
        inside = f"sel_i({thin}, (integer)(0), {inside})"
    return [f"#define BSDF_INTERIOR(row) {inside}"]


def trace_text(layout: str, interleaved: bool = False) -> str:
    rays = "lanes" if layout == "brute" else "interleaved" if interleaved else "one"
    return f'#include "tracing/trace_{rays}.cl"\n'


def _includes(features: Features) -> list[str]:
    return [f'#include "generated/shape/{kind}.cl"' for kind in features.analytic]


def shape_tree_text(features: Features) -> str:
    """Meeting one analytic shape, the same for all lanes, and for one ray the tree over them."""
    if not features.analytic:
        return ""
    word = {member.name: member.word for member in SHAPE.members}
    cases = [
        f"    if (kind == {1 + shape_records.ANALYTIC.index(kind)})\n"
        f"        return {shape_records.ONE_OF.get(kind, kind)}_intersect({_shape_text(kind, 'params')}, "
        "o, d, tmin, tmax);"
        for kind in features.analytic
    ]
    rows = "many" if set(features.analytic) & set(shape_records.ONE_OF) else "single"
    return "\n".join(
        [
            *_includes(features),
            f'#include "tracing/shape_rows_{rows}.cl"',
            "inline ShapeHit shape_hit(Scene scene, int prim, int row, vec3 o, vec3 d, real tmin, "
            "real tmax)",
            "{",
            "    global const uint *shape = scene.shapes + row * SHAPE_ROW_WORDS;",
            f"    int kind = (int)shape[{word['kind']}];",
            f"    integer params = (int)shape[{word['params']}];",
            *cases,
            "    ShapeHit none = {FAR, {0.0f, 0.0f, 1.0f}, {0.0f, 0.0f}};",
            "    return none;",
            "}",
            "",
        ]
    )


def _shape_text(kind: str, params: str, active: str = "mask_of(1)") -> str:
    """The parameters of primitive `prim`, which lie at `params` or, of many in one, beside it."""
    if kind in shape_records.ONE_OF:
        return f"{kind}_one(scene, {params}, prim, {active})"
    return f"{kind}_row(scene.geometry, {params})"


def tangents_text(features: Features) -> str:
    """dpdu and dpdv of analytic shapes, in lanes."""
    if not (features.analytic and features.tangents):
        return ""
    lines = _includes(features)
    for tangent in ("dpdu", "dpdv"):
        lines += [
            f"inline vec3 {tangent}_of_shape(Scene scene, ShapeRow shape, integer prim, vec3 p, "
            "vec2 uv)",
            "{",
            "    vec3 r = v3(0.0f, 0.0f, 0.0f);",
        ]
        for kind in features.analytic:
            lines += [
                "    {",
                f"        mask m = shape.kind == {1 + shape_records.ANALYTIC.index(kind)};",
                "        integer params = sel_i(m, shape.params, (integer)(0));",
                f"        if (any(m)) r = sel3(m, {shape_records.ONE_OF.get(kind, kind)}_{tangent}("
                f"{_shape_text(kind, 'params', 'm')}, p, uv), r);",
                "    }",
            ]
        lines += ["    return r;", "}", ""]
    return "\n".join(lines)


def fluoresces(features: Features, cls: type[materials.Material]) -> bool:
    return cls.fluoresces and features.mode == "spectral"


def functions_text(cls: type[materials.Material], mode: str, sources: Sources) -> str:
    """Return a kind's struct and functions, with what its boundary needs."""
    boundary = thin_films.boundary_text(cls, mode, sources)
    return f'{boundary}{parameters.struct_text(cls)}#include "bsdf/{cls.kind}.cl"\n'


def bsdf_text(features: Features, cls: type[materials.Material]) -> str:
    """A kind's struct, functions and loader, under the names that the integrators use."""
    kind = cls.kind
    reflectivity = "(m).reflectivity" if "reflectivity" in device_params(cls) else "(real)(0.0f)"
    verbs = ("sample", "eval", "pdf", "albedo", "load", *(("pdfs",) if cls.chromatic else ()))
    return "\n".join(
        [
            functions_text(cls, features.mode, features.sources),
            parameters.load_text(cls, features.sources.get(kind, {}), "materials"),
            f"typedef {cls.__name__} Bsdf;",
            f"#define BSDF_REFLECTIVITY(m) {reflectivity}",
            *(f"#define bsdf_{verb} {kind}_{verb}" for verb in verbs),
            *_interior_text(features, cls),
            *(_shift_text(cls) if fluoresces(features, cls) else ()),
            "",
        ]
    )


def _shift_text(cls: type[materials.Material]) -> list[str]:
    """`bsdf_shift`: the wavelengths by which light comes to a surface at `row`."""
    declared = device_params(cls)
    before = [*declared.values()][: [*declared].index("reradiation")]
    table = f"gather_i((scene).materials, (row) + {sum(map(parameter_words.words, before))})"
    own = "&(m).reflectance, &(m).reradiation, (m).amount"
    return [
        '#include "optics/reradiation.cl"',
        "#define bsdf_shift(scene, row, m, lambdas, u, depth) "
        f"reradiation_shift(scene, {table}, {own}, lambdas, u, depth)",
    ]
