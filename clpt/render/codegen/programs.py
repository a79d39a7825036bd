"""Programs: the kernel text of every stage, for the features of a scene.

A stage's text holds only what the scene has; one program per material kind shades, so that a new
material in a scene rebuilds nothing else.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

from clpt import bvh, device
from clpt.render.codegen import (
    blocks,
    choices,
    emission,
    flags,
    lights,
    parameters,
    shapes,
    signatures,
    stages,
    textures,
)
from clpt.render.contract import custom_materials
from clpt.render.contract.features import Features

Files = dict[str, str | device.Part | tuple[str, ...]]


@dataclass(frozen=True)
class Stage:
    """A stage of a bounce: its program, its kernel there, how many slots a work-item serves."""

    program: str
    kernel: str
    lanes: int


def sources(
    features: Features, layout: str, lanes: int, *, queued: bool, interleaved: bool = False
) -> dict[str, device.Source]:
    """Return the text of every program of a bounce, by program name.

    layout: of the triangles, a name in clpt.bvh.LAYOUTS; lanes: paths that a work-item shades;
    queued: whether shading goes along queues, which `append` fills, if a work-item shades one path;
    interleaved: a work-item of `intersect` has the rays of `lanes` paths in flight.
    """
    queued = queued and lanes == 1
    texts = _stages(features, layout, lanes, queued, interleaved)
    if queued:
        texts |= _alone(features, layout, "append")
    return _static(texts)


def _stages(
    features: Features, layout: str, lanes: int, queued: bool, interleaved: bool
) -> dict[str, device.Source]:
    """The texts of a bounce but for queues, see `sources`."""
    files, defines = _shared(features, layout), flags.defines(flags.SCENE, features)
    begin, join = begin_and_join(features)
    trace_lanes = _trace_lanes(layout, lanes)
    rays: Files = {}
    if interleaved and layout != "brute":
        rays["generated/trace.cl"] = ("tracing/trace_interleaved.cl",)
    texts = {
        begin: _source(begin, files, defines, lanes),
        "intersect": _source(
            "intersect", {**files, **rays}, defines, lanes if interleaved else trace_lanes
        ),
    }
    if _joins(features):
        texts[join] = _source(join, files, defines, trace_lanes)
    if _deposits(features):
        texts["deposit"] = _source("deposit", files, defines, lanes)
    if features.mixtures:
        texts["mix"] = _source("mix", files, defines, lanes)
    for cls in features.leaves:
        own = {**files, "generated/bsdf.cl": stages.bsdf_text(features, cls)}
        if cls.source is not None:
            own[f"bsdf/{cls.kind}.cl"] = custom_materials.text(cls)
        kind = {**flags.defines(flags.MATERIAL, features, cls), "QUEUED": int(queued)}
        texts[f"shade_{cls.kind}"] = _source("shade", own, {**defines, **kind}, lanes)
    return texts


def film_sources(features: Features, layout: str) -> dict[str, device.Source]:
    """Return the texts of what makes pictures of a film, by program name."""
    names = ("accumulate", *(("bands",) if features.bands else ()))
    return _static(_alone(features, layout, *names))


def noise_sources(features: Features, layout: str) -> dict[str, device.Source]:
    """Return the text of what tells a film's noise, by program name."""
    return _static(_alone(features, layout, "noise"))


def order(features: Features, layout: str, lanes: int, interleaved: bool = False) -> list[Stage]:
    """Return the stages of a bounce in their order, but for sorting."""
    trace_lanes = _trace_lanes(layout, lanes)
    begin, join = begin_and_join(features)
    bounce = [Stage(begin, begin, lanes)]
    if features.shows_lights:
        bounce.append(Stage(join, join, trace_lanes))
    bounce.append(Stage("intersect", "intersect", lanes if interleaved else trace_lanes))
    if _deposits(features):
        bounce.append(Stage("deposit", "deposit", lanes))
    if features.mixtures:
        bounce.append(Stage("mix", "mix_materials", lanes))
    bounce += [Stage(f"shade_{kind}", "shade", lanes) for kind in features.materials]
    if _joins(features) and any(not cls.delta for cls in features.leaves):
        bounce.append(Stage(join, join, trace_lanes))
    return bounce


@functools.lru_cache(maxsize=4)
def loop_sources(
    features: Features, layout: str, lanes: int, interleaved: bool = False
) -> dict[str, device.Source]:
    """Return the texts that are linked to the loop of all stages on the device, by name.

    "loop" holds the kernel; the others are the stages as functions, see kernels/interface/stage.cl.
    They are kept, since a renderer asks twice: to compile ahead, and to link.
    """
    texts = _stages(features, layout, lanes, False, interleaved)
    bounce = order(features, layout, lanes, interleaved)
    names = dict.fromkeys(stage.program for stage in bounce)
    parts = {name: texts[name].with_private(name, {"PART": f"loop_{name}"}) for name in names}
    files = {
        **_shared(features, layout),
        "generated/block.cl": blocks.block_text(features),
        "generated/loop.cl": _loop_text(features, bounce),
    }
    loop = _source("loop", files, flags.defines(flags.SCENE, features), lanes)
    return {**parts, "loop": loop.with_private("loop")}


def _loop_text(features: Features, bounce: list[Stage]) -> str:
    """What loop.cl calls: `loop_begin`, and `loop_bounce`, all other stages in their order."""
    begin, join = begin_and_join(features)
    shading = [stage.program for stage in bounce if stage.kernel == "shade"]
    extra = {begin: ", BEGIN_", "intersect": ", TRACE_", join: ", JOIN_", "deposit": " DEPOSIT_"}
    extra |= dict.fromkeys(shading, " MERGE_")

    def group(program: str, form: str) -> str:
        """The arguments of a stage as it declares them, or as they are passed on."""
        own = f"{extra[program]}{form}" if program in extra else ""
        return f"SLAB_{form}, SCENE_{form}{own}"

    names = dict.fromkeys(stage.program for stage in bounce)
    lines = [f"void loop_{name}({group(name, 'ARGS')}, uint at);" for name in names]
    lines += [
        f"#define loop_begin loop_{begin}",
        "inline void loop_bounce(SLAB_ARGS, SCENE_ARGS, TRACE_ARGS, BEGIN_ARGS DEPOSIT_ARGS "
        "MERGE_ARGS, global uint *queue, uint first, uint end)",
        "{",
        "    SLABS",
        "    uint starts[BSDF_COUNT + 1], block = settings->slots + get_global_id(0) * LANES;",
    ]
    for stage in bounce[1:]:
        call = f"loop_{stage.program}({group(stage.program, 'PASSED')}, "
        step = "LANES" if stage.lanes > 1 else "1"
        plain = f"for (uint at = first; at < end; at += {step}) {call}at);"
        if stage.program not in shading:
            lines.append(f"    {plain}")
            continue
        kind = shading.index(stage.program)
        if kind == 0:
            lines.append("    queue_sort(path, hit, queue, starts, first, end);")
        begins, ends = f"starts[{kind}]", f"starts[{kind + 1}]"
        lines += [
            f"    if (queue_is_dense({ends} - {begins}, end - first)) {{",
            f"        {plain}",
            "    } else {",
            f"        for (uint entry = {begins}; entry < {ends}; entry += LANES) {{",
            f"            queue_take(path, hit, shadow, queue, entry, {ends}, block);",
            f"            {call}block);",
            f"            queue_return(path, shadow, queue, entry, {ends}, block);",
            "        }",
            "    }",
        ]
    return "\n".join([*lines, "}", ""])


def begin_and_join(features: Features) -> tuple[str, str]:
    """Return the stage that begins paths, and the one that tests the rays that join them to a light
    or, of paths that start at lights, to the camera."""
    return ("emit", "splat") if features.light_paths else ("generate", "shadow")


def _joins(features: Features) -> bool:
    """Whether paths are joined to lights or, those that start at lights, to the camera."""
    return not features.light_paths or features.joined


def _deposits(features: Features) -> bool:
    """Whether paths leave photons."""
    return features.light_paths and features.merged


def _trace_lanes(layout: str, lanes: int) -> int:
    """How many rays a work-item traces: those of one path, but where there is no tree."""
    return lanes if layout == "brute" else 1


def _alone(features: Features, layout: str, *names: str) -> dict[str, device.Source]:
    """The texts of programs whose work-items serve a pixel each."""
    files, defines = _shared(features, layout), flags.defines(flags.SCENE, features)
    return {name: _source(name, files, defines, 1) for name in names}


def _static(texts: dict[str, device.Source]) -> dict[str, device.Source]:
    return {name: text.with_static() for name, text in texts.items()}


def _source(
    stage: str, virtual: device.Virtual, defines: flags.Defines, lanes: int
) -> device.Source:
    return device.assemble(f"stage/{stage}.cl", virtual, {"LANES": lanes, "QUEUED": 0, **defines})


def _shared(features: Features, layout: str) -> Files:
    """The generated files that are the same for all programs of a scene."""
    textured = "texture" in stages.emission_sources(features)
    return {
        **shapes.virtual_files(),
        **lights.virtual_files(),
        **signatures.virtual_files(features, layout),
        **parameters.virtual_files(features),
        **choices.virtual_files(features, layout),
        "generated/camera.cl": stages.camera_text(features.camera, features.glass_lens),
        "generated/connect.cl": stages.connect_text(features),
        "generated/photon.cl": stages.photon_text(features) if features.merged else "",
        "generated/emission.cl": emission.dispatch_text(
            features.lights, textured, features.two_sided_lights, features.aimed
        ),
        "generated/textures.cl": textures.dispatch_text(
            features.textures,
            features.texture_roles,
            features.texture_depth,
            features.texture_mappings,
            any(flags.filters_at_random(features, cls) for cls in features.leaves),
        ),
        "generated/lights.cl": stages.lights_text(features),
        "generated/null_transmittance.cl": stages.null_transmittance_text(features),
        "generated/shapes.cl": shapes.points_text(features),
        "generated/shape_tree.cl": shapes.hit_text(features),
        "generated/layout.cl": bvh.traversal_text(layout),
    }
