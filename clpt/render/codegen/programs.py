"""Programs: the kernel text of every stage, for the features of a scene.

A stage's text holds only what the scene has; one program per material kind shades, so that a new
material in a scene rebuilds nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass

from clpt import bvh, device
from clpt.render.codegen import emission, lights, shapes, signatures, stages, textures
from clpt.render.contract import custom_materials, shape_records
from clpt.render.contract.features import Features
from clpt.render.contract.parameter_words import RERADIATION_STEP


def sources(
    features: Features, layout: str, lanes: int, *, queued: bool | str, interleaved: bool = False
) -> dict[str, device.Source]:
    """Return the text of every program of a bounce, by program name.

    layout: of the triangles, a name in clpt.bvh.LAYOUTS; lanes: paths that a work-item shades;
    queued: whether shading goes along queues, or how: one of clpt.render.wavefront.queues.WAYS; "sort" if
    True; flights: whether `intersect` has the rays of several paths in flight, see `flies`.
    """
    trace_lanes = lanes if layout == "brute" else 1
    shared = _shared(features, layout)
    common = _defines(features)
    begin, test = ends(features)
    made = {
        begin: _source(begin, shared, common, lanes),
        "intersect": _source(
            "intersect",
            {**shared, "generated/trace.cl": stages.trace_text(layout, interleaved)},
            common,
            lanes if interleaved else trace_lanes,
        ),
        test: _source(test, shared, common, trace_lanes),
    }
    if features.mixtures:
        made["mix"] = _source("mix", shared, common, lanes)
    if queued:
        way = "sort" if queued is True else queued
        made[way] = _source(way, shared, common, 1)
    for number, cls in enumerate(features.leaves):
        own: dict[str, str | device.Part] = {
            **shared,
            "generated/bsdf.cl": stages.bsdf_text(features, cls),
        }
        if cls.source is not None:
            own[f"bsdf/{cls.kind}.cl"] = custom_materials.text(cls)
        defines = {
            **common,
            "BSDF_KIND": number,
            "BSDF_DELTA": int(cls.delta),
            "BSDF_TRANSMITS": int(cls.kind in features.transmitting),
            "BSDF_CHROMATIC": int(cls.chromatic),
            "BSDF_FLUORESCES": int(stages.fluoresces(features, cls)),
            "BSDF_IS_NULL": int(cls.is_null and features.is_null),
            "USES_CHOICE": int(cls.uses_lobe_sample or cls.fluoresces or features.many_lights),
            "QUEUED": int(bool(queued)),
        }
        made[f"shade_{cls.kind}"] = _source("shade", own, defines, lanes)
    return made


def film_sources(features: Features, layout: str) -> dict[str, device.Source]:
    """Return the texts of what makes pictures of a film, by program name."""
    shared, common = _shared(features, layout), _defines(features)
    names = ["accumulate", *(["bands"] if features.bands else [])]
    return {name: _source(name, shared, common, 1) for name in names}


def noise_sources(features: Features, layout: str) -> dict[str, device.Source]:
    """Return the text of what tells a film's noise, by program name."""
    return {"noise": _source("noise", _shared(features, layout), _defines(features), 1)}


@dataclass(frozen=True)
class Stage:
    """A stage of a bounce: its program, its kernel there, how many slots a work-item serves."""

    program: str
    kernel: str
    lanes: int


def order(features: Features, layout: str, lanes: int, interleaved: bool = False) -> list[Stage]:
    """Return the stages of a bounce in their order, but for sorting."""
    trace_lanes = lanes if layout == "brute" else 1
    begin, test = ends(features)
    made = [Stage(begin, begin, lanes)]
    if features.light_paths and features.visible_lights:
        made.append(Stage(test, test, trace_lanes))
    made.append(Stage("intersect", "intersect", lanes if interleaved else trace_lanes))
    if features.mixtures:
        made.append(Stage("mix", "mix_materials", lanes))
    made += [Stage(f"shade_{kind}", "shade", lanes) for kind in features.materials]
    if any(not cls.delta for cls in features.leaves):
        made.append(Stage(test, test, trace_lanes))
    return made


def loop_sources(
    features: Features, layout: str, lanes: int, interleaved: bool = False
) -> dict[str, device.Source]:
    """Return the texts that are linked to the loop of all stages on the device, by name.

    "loop" holds the kernel; the others are the stages as functions, see kernels/interface/stage.cl.
    """
    made = sources(features, layout, lanes, queued=False, interleaved=interleaved)
    bounce = order(features, layout, lanes, interleaved)
    names = dict.fromkeys(stage.program for stage in bounce)
    parts = {name: made[name].with_private(name, {"PART": f"loop_{name}"}) for name in names}
    shared = {**_shared(features, layout), "generated/loop.cl": _loop_text(features, bounce)}
    loop = _source("loop", shared, _defines(features), lanes)
    return {**parts, "loop": loop.with_private("loop")}


def _loop_text(features: Features, bounce: list[Stage]) -> str:
    """What loop.cl calls: `loop_begin`, and `loop_bounce`, all other stages in their order."""
    begin, test = ends(features)
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


def ends(features: Features) -> tuple[str, str]:
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
        "USES_FLUORESCENCE": int(any(stages.fluoresces(features, cls) for cls in features.leaves)),
        "SPECTRA_SIZE": features.spectra_size,
        "SHIFT_STEP": RERADIATION_STEP,
        "SPECTRA_STEP": f"{features.spectra_step}f",
        "FEW_LIGHTS": int(not features.many_lights),
        "USES_LIGHTS": int(bool(features.lights)),
        "USES_SURFACE_LIGHTS": int(bool(set(features.lights) & set(shape_records.RECORDS))),
    }
    if features.absorption:
        made["USES_ABSORPTION"] = 1
    if features.is_null:
        made["USES_NULL_SURFACES"] = 1
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
        **signatures.virtual_files(features, layout),
        "generated/spectrum.cl": f'#include "spectrum/{features.mode}.cl"\n',
        "generated/spectrum_read.cl": stages.spectrum_text(features),
        "generated/bands.cl": '#include "film/bands.cl"\n' if features.bands else "",
        "generated/sampler.cl": stages.sampler_text(features.sampler),
        "generated/camera.cl": stages.camera_text(features.camera, features.glass_lens),
        "generated/connect.cl": stages.connect_text(features.camera),
        "generated/emission.cl": emission.dispatch_text(
            features.lights, stages.emits_textures(features), features.two_sided_lights
        ),
        "generated/textures.cl": textures.dispatch_text(
            features.textures,
            features.texture_roles,
            features.texture_depth,
            features.texture_mappings,
        ),
        "generated/lights.cl": stages.lights_text(features),
        "generated/mixture.cl": stages.mixture_text(features),
        "generated/shading_frame.cl": stages.shading_frame_text(features),
        "generated/transmittance.cl": stages.transmittance_text(features),
        "generated/null_transmittance.cl": stages.null_transmittance_text(features),
        "generated/medium.cl": stages.medium_text(features),
        "generated/shapes.cl": stages.tangents_text(features),
        "generated/trace.cl": stages.trace_text(layout),
        "generated/layout.cl": bvh.traversal_text(layout),
        "generated/shape_tree.cl": stages.shape_tree_text(features),
        "generated/shape_traversal.cl": '#include "bvh/shapes.cl"\n' if features.analytic else "",
        "generated/instances.cl": '#include "tracing/instances.cl"\n' if features.instances else "",
        "generated/instance_traversal.cl": (
            f'#include "tracing/instances_{layout}.cl"\n#include "tracing/trace_instances.cl"\n'
            if features.instances
            else ""
        ),
        "generated/integrator.cl": f'#include "integrator/{features.integrator}.cl"\n',
    }
