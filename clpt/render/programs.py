"""Programs: the kernel text of every stage, for the features of a scene.

A stage's text holds only what the scene has; one program per material kind shades, so that a new
material in a scene rebuilds nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass

from clpt import device
from clpt.layout import Record
from clpt.records import INSTANCE, LIGHT, SETTINGS, SHAPE, SLABS, TABLES
from clpt.render import (
    bends,
    cameras,
    emission,
    films,
    kinds,
    lights,
    outside,
    shapes,
    textures,
)
from clpt.render.features import Features, Sources
from clpt.render.reradiation import STEP as SHIFT_STEP
from clpt.scene import materials
from clpt.scene.params import device_params, interior_params


def sources(
    features: Features, layout: str, lanes: int, *, queued: bool
) -> dict[str, device.Source]:
    """Return the text of every program that a scene needs, by program name.

    layout: of the triangles, a name in clpt.bvh.LAYOUTS; lanes: paths that a work-item shades;
    queued: whether shading goes along sorted queues.
    """
    trace_lanes = lanes if layout == "brute" else 1
    shared = _shared(features, layout)
    common = _defines(features)
    begin, test = stages(features)
    made = {
        begin: _source(begin, shared, common, lanes),
        "intersect": _source("intersect", shared, common, trace_lanes),
        test: _source(test, shared, common, trace_lanes),
        "accumulate": _source("accumulate", shared, common, 1),
    }
    if features.bands:
        made["bands"] = _source("bands", shared, common, 1)
    if features.mixtures:
        made["mix"] = _source("mix", shared, common, lanes)
    if queued:
        made["sort"] = _source("sort", shared, common, 1)
    for number, cls in enumerate(features.leaves):
        own: dict[str, str | device.Part] = {
            **shared,
            "generated/bsdf.cl": _bsdf_text(features, cls),
        }
        if cls.source is not None:
            own[f"bsdf/{cls.kind}.cl"] = outside.text(cls)
        defines = {
            **common,
            "BSDF_KIND": number,
            "BSDF_DELTA": int(cls.delta),
            "BSDF_CHROMATIC": int(cls.chromatic),
            "BSDF_SHIFTS": int(_shifts(features, cls)),
            "BSDF_PASSES": int(cls.passes and features.passes),
            "USES_CHOICE": int(cls.choosy or cls.shifts or features.many_lights),
            "QUEUED": int(queued),
        }
        made[f"shade_{cls.kind}"] = _source("shade", own, defines, lanes)
    return made


@dataclass(frozen=True)
class Stage:
    """A stage of a bounce: its program, its kernel there, how many slots a work-item serves."""

    program: str
    kernel: str
    lanes: int


def order(features: Features, layout: str, lanes: int) -> list[Stage]:
    """Return the stages of a bounce in their order, but for sorting."""
    trace_lanes = lanes if layout == "brute" else 1
    begin, test = stages(features)
    made = [Stage(begin, begin, lanes)]
    if features.light_paths and features.visible_lights:
        made.append(Stage(test, test, trace_lanes))
    made.append(Stage("intersect", "intersect", trace_lanes))
    if features.mixtures:
        made.append(Stage("mix", "mix_materials", lanes))
    made += [Stage(f"shade_{kind}", "shade", lanes) for kind in features.materials]
    if any(not cls.delta for cls in features.leaves):
        made.append(Stage(test, test, trace_lanes))
    return made


def loop_sources(features: Features, layout: str, lanes: int) -> dict[str, device.Source]:
    """Return the texts that are linked to the loop of all stages on the device, by name.

    "loop" holds the kernel; the others are the stages as functions, see kernels/lib/stage.cl.
    """
    made = sources(features, layout, lanes, queued=False)
    bounce = order(features, layout, lanes)
    names = dict.fromkeys(stage.program for stage in bounce)
    parts = {name: made[name].with_private(name, {"PART": f"loop_{name}"}) for name in names}
    shared = {**_shared(features, layout), "generated/loop.cl": _loop_text(features, bounce)}
    loop = _source("loop", shared, _defines(features), lanes)
    return {**parts, "loop": loop.with_private("loop")}


def _loop_text(features: Features, bounce: list[Stage]) -> str:
    """What loop.cl calls: `loop_begin`, and `loop_bounce`, all other stages in their order."""
    begin, test = stages(features)
    extra = {begin: ["BEGIN"], "intersect": ["TRACE"], test: ["JOIN"]}
    groups = {s.program: ["SLAB", "SCENE", *extra.get(s.program, ())] for s in bounce}
    lines = [
        f"void loop_{name}({', '.join(f'{group}_ARGS' for group in own)}, uint at);"
        for name, own in groups.items()
    ]
    lines += [
        f"#define loop_begin loop_{begin}",
        "inline void loop_bounce(SLAB_ARGS, SCENE_ARGS, TRACE_ARGS, BEGIN_ARGS, uint at)",
        "{",
    ]
    for stage in bounce[1:]:
        times = "LANES" if stage.lanes == 1 else "1"
        passed = ", ".join(f"{group}_PASSED" for group in groups[stage.program])
        lines.append(
            f"    for (uint i = 0; i < {times}; i++) loop_{stage.program}({passed}, at + i);"
        )
    return "\n".join([*lines, "}", ""])


def stages(features: Features) -> tuple[str, str]:
    """Return the stage that begins paths, and the one that tests what waits to be joined."""
    return ("emit", "splat") if features.light_paths else ("generate", "shadow")


def _source(stage: str, virtual: device.Virtual, defines: dict, lanes: int) -> device.Source:
    return device.assemble(f"stage/{stage}.cl", virtual, {"LANES": lanes, "QUEUED": 0, **defines})


def _defines(features: Features) -> dict[str, str | int | float]:
    made: dict[str, str | int | float] = {
        "BSDF_COUNT": len(features.materials),
        "USES_NORMALS": int(features.normals),
        "USES_UVS": int(features.uvs),
        "USES_TANGENTS": int(features.tangents),
        "USES_ATTRIBUTES": int(features.attributes),
        "USES_ANALYTIC": int(bool(features.analytic)),
        "USES_INFINITE": int(features.infinite),
        "USES_DISPERSION": int(features.dispersion and features.mode == "spectral"),
        "CAMERA_DISPERSES": int(features.glass_lens),
        "USES_SHIFTS": int(any(_shifts(features, cls) for cls in features.leaves)),
        "SPECTRA_SIZE": features.spectra_size,
        "SHIFT_STEP": SHIFT_STEP,
        "SPECTRA_STEP": f"{features.spectra_step}f",
        "FEW_LIGHTS": int(not features.many_lights),
        "USES_LIGHTS": int(bool(features.lights)),
        "USES_SURFACE_LIGHTS": int(bool(set(features.lights) & set(shapes.RECORDS))),
    }
    if features.absorption:
        made["USES_ABSORPTION"] = 1
    if features.passes:
        made["USES_PASSING"] = 1
    if features.filter == "box":
        made["FILTER_BOX"] = 1
    if features.light_paths:
        made["LIGHT_PATHS"] = 1
        made["USES_VISIBLE_LIGHTS"] = int(features.visible_lights)
    if features.channel:
        made["CHANNEL"] = f"CHANNEL_{features.channel.upper()}"
    if features.bands:
        made["USES_BANDS"] = 1
    if features.instances:
        made["USES_INSTANCES"] = 1
    return made


def _shared(features: Features, layout: str) -> dict[str, str]:
    """The generated files that are the same for all programs of a scene."""
    return {
        **shapes.virtual_files(),
        **lights.virtual_files(),
        "generated/scene.cl": scene_text(),
        "generated/spectrum.cl": f'#include "spectrum/{features.mode}.cl"\n',
        "generated/spectrum_read.cl": _spectrum_text(features),
        "generated/bands.cl": '#include "lib/bands.cl"\n' if features.bands else "",
        "generated/sampler.cl": f'#include "sampler/{features.sampler}.cl"\n',
        "generated/camera.cl": _camera_text(features.camera, features.glass_lens),
        "generated/connect.cl": _connect_text(features.camera),
        "generated/emission.cl": emission.dispatch_text(
            features.lights, _textured(features), features.two_sided_lights
        ),
        "generated/textures.cl": textures.dispatch_text(
            features.textures,
            features.texture_roles,
            features.texture_depth,
            features.texture_mappings,
        ),
        "generated/lights.cl": _lights_text(features),
        "generated/mixture.cl": _mixture_text(features),
        "generated/facing.cl": _facing_text(features),
        "generated/open.cl": f'#include "lib/open{"_through" * features.passes}.cl"\n',
        "generated/null_share.cl": _null_share_text(features),
        "generated/medium.cl": _medium_text(features),
        "generated/shapes.cl": _tangents_text(features),
        "generated/trace.cl": _trace_text(layout),
        "generated/layout.cl": layout_text(layout),
        "generated/trace_args.cl": "\n".join(
            [*_args_text("TRACE", _trace_args(features, layout)), "#define TRACE TRACE_PASSED", ""]
        ),
        "generated/stage_args.cl": "\n".join(
            [
                *_args_text("BEGIN", _begin_args(features)),
                *_args_text("JOIN", _join_args(features, layout)),
                "",
            ]
        ),
        "generated/shape_tree.cl": _shape_tree_text(features),
        "generated/shape_traversal.cl": '#include "bvh/shapes.cl"\n' if features.analytic else "",
        "generated/instances.cl": '#include "lib/instances.cl"\n' if features.instances else "",
        "generated/instance_traversal.cl": (
            f'#include "lib/instances_{layout}.cl"\n#include "lib/trace_instances.cl"\n'
            if features.instances
            else ""
        ),
        "generated/integrator.cl": f'#include "integrator/{features.integrator}.cl"\n',
    }


def layout_text(layout: str) -> str:
    """Return the traversal of a layout, whose verbs are then LAYOUT(closest), LAYOUT(occluded)."""
    return f'#include "bvh/{layout}.cl"\n#define LAYOUT(verb) {layout}_##verb\n'


def _spectrum_text(features: Features) -> str:
    """Reading spectra in a mode, and how the camera draws wavelengths."""
    text = f'#include "spectrum/{features.mode}_read.cl"\n'
    if features.mode == "spectral":
        drawn = "density" if features.tabulated_density else "visible"
        text += f'#include "spectrum/{drawn}.cl"\n'
    return text


def scene_text() -> str:
    """Return records, the `Scene` struct and the macros that carry it through arguments."""
    slabs = [record.slab_text() for record in SLABS]
    rows = [record.row_text() for record in (SHAPE, INSTANCE, LIGHT)]
    members = [
        f"    global const {element} *{name}; /* {doc} */"
        for name, (element, doc) in TABLES.items()
    ]
    slab_sets = [
        f"{record.name.lower()} = {{{name}, stride}}"
        for record, name in zip(SLABS, _SLAB_ARGS, strict=False)
    ]
    return "\n".join(
        [
            SETTINGS.uniform_text(),
            *slabs,
            "typedef struct {",
            *members,
            "    global const Settings *settings;",
            "} Scene;",
            *rows,
            f"#define SHAPE_ROW_WORDS {SHAPE.words}",
            f"#define SHAPE_ROW_PRIM {next(m.word for m in SHAPE.members if m.name == 'prim')}",
            f"#define INSTANCE_ROW_WORDS {INSTANCE.words}",
            f"#define LIGHT_ROW_WORDS {LIGHT.words}",
            *_args_text("SCENE", _SCENE_ARGS),
            "#define SCENE Scene scene = {SCENE_PASSED};",
            *_args_text("SLAB", _SLAB_ARGS),
            f"#define SLABS Slab {', '.join(slab_sets)};",
            "",
        ]
    )


def _camera_text(kind: str, glass: bool) -> str:
    record: Record = cameras.RECORDS[kind]
    camera = f"(global const {record.name} *)(scene).camera"
    made = f"{kind}_ray({camera}, film, lens)"
    if glass:
        row = f"(integer)(({camera})->glass)"
        made = f"{kind}_glass_ray({camera}, film, lens, spectra_row(scene, {row}, lambdas).x)"
    return (
        f'{record.uniform_text()}#include "camera/{kind}.cl"\n'
        f"#define camera_ray(scene, film, lens, lambdas) {made}\n"
    )


def _connect_text(kind: str) -> str:
    record: Record = cameras.RECORDS[kind]
    return (
        f'#include "camera/{kind}_connect.cl"\n#define camera_connect(scene, p, away, lens) '
        f"{kind}_connect((global const {record.name} *)(scene).camera, (scene).settings, "
        "p, away, lens)\n"
    )


def _textured(features: Features) -> bool:
    """Whether some emission is a texture."""
    return "texture" in _emissions(features)


def _emissions(features: Features) -> frozenset[str]:
    return features.sources.get("emission", {}).get("value", frozenset({"constant"}))


def _lights_text(features: Features) -> str:
    """The loader of emissions, from wherever they come in this scene, and the lights' dispatch."""
    textured = _textured(features)
    factors = features.sources.get("factor", {}).get("value", frozenset())
    return (
        ('#include "generated/textures.cl"\n' if textured or "texture" in factors else "")
        + kinds.emission_text(_emissions(features))
        + (kinds.factor_text(factors) if factors else "")
        + lights.dispatch_text(
            features.lights, textured, features.two_sided_lights, features.light_tree
        )
    )


def _mixture_text(features: Features) -> str:
    """The loader of the weights of masks and blends."""
    found = features.sources.get("mixture", {}).get("weight", frozenset({"constant"}))
    return kinds.mixture_text(found)


def _facing_text(features: Features) -> str:
    """The frame of shading; the loader of the maps that bend it, where there are some."""
    if not features.bends:
        return '#include "lib/facing.cl"\n'
    found = features.sources["bend"]["value"]
    return f'#define BEND_WORDS {bends.WORDS}\n{bends.text(found)}#include "lib/facing_bent.cl"\n'


def _null_share_text(features: Features) -> str:
    """`null_share`: how much of the light passes a surface with some material word.

    A mixture's children are one level below it, since kernels cannot call themselves.
    """
    leaves = enumerate(features.leaves)
    passing = [f"(MATERIAL_KIND(word) == {i})" for i, cls in leaves if cls.passes]
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
    return "\n".join([*lines, f"#define null_share null_share_{features.mixtures}", ""])


def _medium_text(features: Features) -> str:
    """What absorbs between surfaces, where something does."""
    if not features.absorption:
        return ""
    found = [own.get("absorption", frozenset()) for own in features.sources.values()]
    return kinds.medium_text(frozenset().union(*found)) + '#include "lib/medium.cl"\n'


def _interior_text(features: Features, cls: type[materials.Material]) -> list[str]:
    """How the medium inside of a material is named, see kernels/lib/medium.cl."""
    if not features.absorption:
        return []
    first = 1 + sum(map(kinds.words, device_params(cls).values()))
    inside = f"((row) + {first})" if interior_params(cls) else "((integer)(0))"
    if interior_params(cls) and "thin" in device_params(cls):  # a sheet has no inside
        before = [*device_params(cls)].index("thin")
        at = sum(map(kinds.words, [*device_params(cls).values()][:before]))
        thin = f"gather_i(scene.materials, (row) + {at}) != 0"
        inside = f"sel_i({thin}, (integer)(0), {inside})"
    return [f"#define BSDF_INTERIOR(row) {inside}"]


def _trace_text(layout: str) -> str:
    return f'#include "lib/trace_{"lanes" if layout == "brute" else "one"}.cl"\n'


def _args_text(name: str, args: dict[str, str]) -> list[str]:
    """Macros with arguments as they are declared, and as they are passed on."""
    declared = ", ".join(f"{type_}{own}" for own, type_ in args.items())
    return [f"#define {name}_ARGS {declared}", f"#define {name}_PASSED {', '.join(args)}"]


_SLAB_ARGS = {f"{record.name.lower()}_words": "global float *restrict " for record in SLABS}
_SLAB_ARGS["stride"] = "uint "
_SCENE_ARGS = {n: f"global const {element} *restrict " for n, (element, _) in TABLES.items()}
_SCENE_ARGS["settings"] = "global const Settings *restrict "


def _trace_args(features: Features, layout: str) -> dict[str, str]:
    """The buffers of all trees, in which rays are traced."""
    if layout == "brute":
        return {"tris": "global const float *", "triangles": "uint "}
    trees = dict.fromkeys(("nodes", "leaves"), "global const float *")
    if features.analytic:
        trees |= {"shape_nodes": "global const float *", "shape_indices": "global const uint *"}
    if features.instances:
        trees["instance_nodes"] = "global const float *"
    return trees


def _begin_args(features: Features) -> dict[str, str]:
    """What the stage takes that begins paths."""
    film = ["film", "bands"] if features.bands else ["film"]
    counters = {"counters": "global uint *"}
    return {**dict.fromkeys(film, "global float *"), **counters, "first": "int ", "end": "int "}


def _join_args(features: Features, layout: str) -> dict[str, str]:
    """What the stage takes that tests whether paths can be joined to a light, or the camera."""
    own = _begin_args(features) if features.light_paths else {}
    there = {name: type_ for name, type_ in own.items() if name in ("film", "counters")}
    return {**_trace_args(features, layout), **there}


def loop_arguments(features: Features, layout: str) -> tuple[device.Argument, ...]:
    """Return what the kernel of stage/loop.cl takes: linked kernels do not tell it themselves."""
    args = {**_SLAB_ARGS, **_SCENE_ARGS, **_trace_args(features, layout), **_begin_args(features)}
    args["turns"] = "uint "
    return tuple(
        device.Argument(
            name,
            "*" if "*" in type_ else type_.strip(),
            "global" if type_.startswith("global") else "private",
        )
        for name, type_ in args.items()
    )


def _includes(features: Features) -> list[str]:
    return [f'#include "generated/shape/{kind}.cl"' for kind in features.analytic]


def _shape_tree_text(features: Features) -> str:
    """Meeting one analytic shape, the same for all lanes, and for one ray the tree over them."""
    if not features.analytic:
        return ""
    word = {member.name: member.word for member in SHAPE.members}
    cases = [
        f"    if (kind == {1 + shapes.ANALYTIC.index(kind)})\n"
        f"        return {shapes.ONE_OF.get(kind, kind)}_intersect({_shape_text(kind, 'params')}, "
        "o, d, tmin, tmax);"
        for kind in features.analytic
    ]
    rows = "many" if set(features.analytic) & set(shapes.ONE_OF) else "single"
    return "\n".join(
        [
            *_includes(features),
            f'#include "lib/shape_rows_{rows}.cl"',
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
    if kind in shapes.ONE_OF:
        return f"{kind}_one(scene, {params}, prim, {active})"
    return f"{kind}_row(scene.geometry, {params})"


def _tangents_text(features: Features) -> str:
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
                f"        mask m = shape.kind == {1 + shapes.ANALYTIC.index(kind)};",
                "        integer params = sel_i(m, shape.params, (integer)(0));",
                f"        if (any(m)) r = sel3(m, {shapes.ONE_OF.get(kind, kind)}_{tangent}("
                f"{_shape_text(kind, 'params', 'm')}, p, uv), r);",
                "    }",
            ]
        lines += ["    return r;", "}", ""]
    return "\n".join(lines)


def _shifts(features: Features, cls: type[materials.Material]) -> bool:
    return cls.shifts and features.mode == "spectral"


def functions_text(cls: type[materials.Material], mode: str, sources: Sources) -> str:
    """Return a kind's struct and functions, with what its boundary needs."""
    boundary = films.boundary_text(cls, mode, sources)
    return f'{boundary}{kinds.struct_text(cls)}#include "bsdf/{cls.kind}.cl"\n'


def _bsdf_text(features: Features, cls: type[materials.Material]) -> str:
    """A kind's struct, functions and loader, under the names that the integrators use."""
    kind = cls.kind
    reflectivity = "(m).reflectivity" if "reflectivity" in device_params(cls) else "(real)(0.0f)"
    verbs = ("sample", "eval", "pdf", "albedo", "load", *(("pdfs",) if cls.chromatic else ()))
    return "\n".join(
        [
            functions_text(cls, features.mode, features.sources),
            kinds.load_text(cls, features.sources.get(kind, {}), "materials"),
            f"typedef {cls.__name__} Bsdf;",
            f"#define BSDF_REFLECTIVITY(m) {reflectivity}",
            *(f"#define bsdf_{verb} {kind}_{verb}" for verb in verbs),
            *_interior_text(features, cls),
            *(_shift_text(cls) if _shifts(features, cls) else ()),
            "",
        ]
    )


def _shift_text(cls: type[materials.Material]) -> list[str]:
    """`bsdf_shift`: the wavelengths by which light comes to a surface at `row`."""
    declared = device_params(cls)
    before = [*declared.values()][: [*declared].index("reradiation")]
    table = f"gather_i((scene).materials, (row) + {sum(map(kinds.words, before))})"
    own = "&(m).reflectance, &(m).reradiation, (m).amount"
    return [
        '#include "lib/reradiation.cl"',
        "#define bsdf_shift(scene, row, m, lambdas, u, depth) "
        f"reradiation_shift(scene, {table}, {own}, lambdas, u, depth)",
    ]
