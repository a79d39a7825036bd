"""Programs: the kernel text of every stage, for the features of a scene.

A stage's text holds only what the scene has; one program per material kind shades, so that a new
material in a scene rebuilds nothing else.
"""

from __future__ import annotations

import dataclasses
import functools

from clpt import bvh, device
from clpt.layout import SLAB_BLOCK
from clpt.render.flow import (
    blocks,
    bounce,
    choices,
    common,
    flags,
    registers,
    signatures,
    stages,
    vertices,
)
from clpt.render.geometry import cases as shapes
from clpt.render.lights import cases as lights
from clpt.render.lights import emission_cases as emission
from clpt.render.materials import cases as parameters
from clpt.render.materials import rough_coat_table
from clpt.render.records import Features, custom_materials
from clpt.render.textures import cases as textures
from clpt.scene.scatterer import Scatterer

BOTH = ("integrator/particle_tracer.cl", "integrator/path.cl#both")

Files = dict[str, str | device.Part | tuple[str, ...]]

# Files of kernels that take the place of others where a work-item shades one path.
_ALONE: device.Virtual = {
    **bvh.ALONE,
    "core/spectrum.cl#at_once": ("core/spectrum.cl#in_turn",),
    "core/grid.cl#texels_at_once": ("core/grid.cl#texels_in_turn",),
    "materials/film_stack.cl#at_once": ("materials/film_stack.cl#in_turn",),
}
_FEW: device.Virtual = {"bvh/hints.cl": ("bvh/hints.cl#few_registers",)}


def sources(
    features: Features, layout: str, lanes: int, *, queued: bool, interleaved: bool = False
) -> dict[str, device.Source]:
    """Return the text of every program of a bounce, by program name.

    layout: of the triangles, a name in clpt.bvh.LAYOUTS; lanes: paths that a work-item shades;
    queued: whether shading goes along queues, which `append` fills, if a work-item shades one path;
    interleaved: a work-item of `intersect` has the rays of `lanes` paths in flight, and where there
    are curves, that of `shadow` or `splat` too.
    """
    queued = queued and lanes == 1
    texts = _stages(features, layout, lanes, interleaved)
    if "flare" in texts:
        return _static(texts)
    texts |= _shading(features, layout, lanes, queued=queued)
    if queued:
        texts["append"] = append_source(features, layout, lanes)
    return _static(texts)


def _stages(
    features: Features, layout: str, lanes: int, interleaved: bool, part: Files | None = None
) -> dict[str, device.Source]:
    """The texts of a bounce but for queues and shading, see `sources`; part: see `_source`."""
    files, defines = _shared(features, layout), _defines(features, lanes)
    make = functools.partial(_source, part=part)
    begin, join = bounce.begin_and_join(features)
    trace_lanes = bounce.trace_lanes(layout, lanes)
    join_lanes = bounce.join_lanes(features, layout, lanes, interleaved)
    rays: Files = {}
    if interleaved and layout != "brute":
        file = "curves" if "curves" in features.geometry.analytic else "trace"
        rays["generated/trace.cl"] = (f"tracing/{file}.cl#interleaved",)
    joins = {**files, **(rays if features.geometry.analytic else {})}
    if begin == "flare":
        return {
            begin: make(begin, files, defines, lanes),
            join: make(join, joins, defines, join_lanes),
        }
    texts = {
        begin: make(begin, files, defines, lanes),
        "intersect": make(
            "intersect", {**files, **rays}, defines, lanes if interleaved else trace_lanes
        ),
    }
    if bounce.joins(features):
        texts[join] = make(join, joins, defines, join_lanes)
    if bounce.deposits(features):
        texts["deposit"] = make("deposit", files, defines, lanes)
    if bounce.trains(features):
        texts["train"] = make("train", files, defines, lanes)
    for cls in bounce.gathered(features):
        own, given = _of_kind(features, cls, files), {**defines, **flags.of_material(features, cls)}
        texts[f"gather_{cls.kind}"] = make(f"gather_{cls.kind}", own, given, lanes, "gather")
    if features.media.present:
        flight = bounce.flight(features)
        texts[flight] = make(flight, files, defines, lanes, "flight")
    if features.materials.mixtures:
        texts["mix"] = make("mix", files, defines, lanes)
    return texts


def _shading(
    features: Features, layout: str, lanes: int, *, queued: bool = False, part: Files | None = None
) -> dict[str, device.Source]:
    """The texts that shade, see `sources`; part: of a loop, all kinds of paths, see `_source`."""
    files, defines = _shared(features, layout), _defines(features, lanes)
    texts: dict[str, device.Source] = {}
    for vertex in vertices.vertices(features, lanes if part is not None else 1):
        cls = vertices.leader(features, vertex)
        own = _of_kind(features, cls, files)
        if vertex.shared:
            own |= vertices.virtual_files(features, vertex)
            texts |= _materials(features, vertex, files, lanes, part)
        if part is not None:
            own["generated/common.cl"] = common.calls_text(common.shared(features, lanes))
        if cls.is_phase:
            own["generated/shading_frame.cl"] = ("media/phase.cl#frame",)
        kind = {**vertices.defines(features, vertex), "QUEUED": int(queued)}
        if part is not None and bounce.has_both(features):
            own["generated/integrator.cl"] = BOTH
            kind["SHADES_BOTH"] = 1
        given = {**defines, **kind}
        texts[vertex.program] = _source(vertex.program, own, given, lanes, "shade", part=part)
    return texts


def _of_kind(features: Features, cls: type[Scatterer], files: Files) -> Files:
    """The files of a scene with those of a kind."""
    return {**files, **choices.material_files(features, cls), **_material(features, cls)}


def _material(features: Features, cls: type[Scatterer]) -> Files:
    """The files of a kind's own functions."""
    own: Files = {"generated/bsdf.cl": stages.bsdf_text(features, cls)}
    if cls.source is not None:
        own[f"{cls.folder}/{cls.kind}.cl"] = custom_materials.text(cls)
    return own


def _materials(
    features: Features, vertex: vertices.Vertex, files: Files, lanes: int, part: Files | None
) -> dict[str, device.Source]:
    """The parts of the kinds of a shared vertex, by program name."""
    texts = {}
    for cls in (features.materials.leaves[kind] for kind in vertex.kinds):
        own = _of_kind(features, cls, files)
        own["generated/material_part.cl"] = vertices.part_text(features, cls)
        given = {**_defines(features, lanes), **flags.of_material(features, cls)}
        name = f"material_{cls.kind}"
        texts[name] = _source(name, own, given, lanes, "material", part=part)
    return texts


def append_source(features: Features, layout: str, lanes: int) -> device.Source:
    """Return the text of `append`, which brings slots into queues.

    lanes: paths that a work-item of the stages before it has, which tells how slabs lie.
    """
    files = _shared(features, layout)
    return _source("append", files, _defines(features, lanes), 1)


def film_sources(features: Features, layout: str) -> dict[str, device.Source]:
    """Return the text of what makes the picture of a film, by program name."""
    return _static(_alone(features, layout, "accumulate"))


def noise_sources(features: Features, layout: str) -> dict[str, device.Source]:
    """Return the text of what tells a film's noise, by program name."""
    return _static(_alone(features, layout, "noise"))


@functools.lru_cache(maxsize=4)
def loop_sources(
    features: Features, layout: str, lanes: int, interleaved: bool = False
) -> dict[str, device.Source]:
    """Return the texts that are linked to the loop of all stages on the device, by name.

    "loop" holds the kernel, which traces each kind of paths of the scene; the others are the stages
    as functions, see kernels/stage/stage.cl. Materials shade all kinds of paths, and other
    stages that are the same for them stand there once. They are kept, since a renderer asks twice:
    to compile ahead, and to link.
    """
    looks_up = lanes > 1 and features.textures.roles
    part = _textures(features, "elsewhere") if looks_up else {}
    made = _shading(features, layout, lanes, part=part)
    used: dict[str, None] = {}
    for own in features.passes:
        made |= _stages(own, layout, lanes, interleaved, part)
        stages_ = bounce.order(own, layout, lanes, interleaved)
        used |= dict.fromkeys(stage.program for stage in stages_ if stage.verb != "shade")
    used |= dict.fromkeys(name for name in made if name.startswith(("shade_", "material_")))
    made |= (shared := _shared_parts(features, layout, lanes, part))
    used |= dict.fromkeys(shared)
    files = {
        **_shared(features, layout),
        **signatures.loop_files(features, layout),
        "generated/block.cl": blocks.blocks_text(features.passes),
        "generated/bounce_stages.cl": bounce.stages_text(features, layout, lanes, interleaved),
    }
    loop = _source("loop", files, _defines(features, lanes), lanes)
    parts = {name: made[name].with_private(name) for name in used}
    return {**parts, "loop": loop.with_private("loop")}


def _shared_parts(
    features: Features, layout: str, lanes: int, part: Files
) -> dict[str, device.Source]:
    """The texts of what other parts of a loop call: for kinds of materials, and of textures."""
    own: dict[str, Files] = {}
    if found := common.shared(features, lanes):
        own["common"] = {"generated/common_part.cl": common.part_text(found), **part}
    if part:
        own["textures"] = _textures(features, "part")
    files, defines = _shared(features, layout), _defines(features, lanes)
    return {name: _source(name, {**files, **its}, defines, lanes) for name, its in own.items()}


def _textures(features: Features, where: textures.Where) -> Files:
    text = textures.dispatch_text(features.textures, stochastic=_stochastic(features), where=where)
    return {"generated/textures.cl": text}


def _stochastic(features: Features) -> bool:
    """Whether a random texel stands for some parameter of a material."""
    return any(flags.filters_at_random(features, cls) for cls in features.materials.leaves)


def _alone(features: Features, layout: str, *names: str) -> dict[str, device.Source]:
    """The texts of programs whose work-items serve a pixel each."""
    files, defines = _shared(features, layout), _defines(features, 1)
    return {name: _source(name, files, defines, 1) for name in names}


def _static(texts: dict[str, device.Source]) -> dict[str, device.Source]:
    return {name: text.with_static() for name, text in texts.items()}


@functools.lru_cache(maxsize=8)
def _defines(features: Features, lanes: int) -> flags.Defines:
    """Return what all programs of a scene define; lanes: paths that a work-item shades."""
    passed = int(lanes > 1 and _stochastic(features))  # by parts of a loop, in one form
    block = SLAB_BLOCK if lanes == 1 else 0
    return {**flags.of_scene(features), "SLAB_BLOCK": block, "TEXELS_AT_RANDOM": passed}


def _source(
    name: str,
    virtual: device.Virtual,
    defines: flags.Defines,
    lanes: int,
    stage: str | None = None,
    *,
    part: Files | None = None,
) -> device.Source:
    """The text of a program; stage: its file, if it is not called so.

    part: of a loop; the files that its parts have in the place of a scene's.
    """
    own: flags.Defines = {"PART": f"loop_{name}"} if part is not None else {}
    given = {"LANES": lanes, "QUEUED": 0, **own, **defines}
    if part and lanes > 1:
        virtual = {**virtual, **part}
    file = f"stage/{stage or name}.cl"
    if not given["SLAB_BLOCK"]:  # a CPU's rays go alone, too
        return device.assemble(file, virtual, given)
    alone = {**virtual, **_ALONE}
    if few := registers.of_amd(name):
        alone |= _FEW
        given["FEW_REGISTERS"] = few
    source = device.assemble(file, alone, given)
    return dataclasses.replace(source, registers=registers.limits(name))


def _shared(features: Features, layout: str) -> Files:
    """The generated files that are the same for all programs of a scene, as a dict of one's own."""
    return dict(_generated(features, layout))


@functools.lru_cache(maxsize=4)
def _generated(features: Features, layout: str) -> Files:
    return {
        **shapes.virtual_files(features),
        **rough_coat_table.virtual_files(),
        **lights.virtual_files(),
        **signatures.virtual_files(features, layout),
        **parameters.virtual_files(features),
        **choices.virtual_files(features, layout),
        "generated/common.cl": common.calls_text(),
        "generated/camera.cl": stages.camera_text(features.camera, moves=features.motion.camera),
        "generated/connect.cl": stages.connect_text(features),
        "generated/grid_words.cl": stages.grid_words_text(features.media.grids),
        "generated/screen.cl": stages.screen_text(features),
        "generated/photon.cl": stages.photon_text(features) if features.transport.merged else "",
        "generated/phases.cl": stages.phases_text(features),
        "generated/emission.cl": emission.dispatch_text(features),
        **_textures(features, "own"),
        "generated/lights.cl": stages.lights_text(features),
        "generated/smooth_boundary.cl": stages.smooth_boundary_text(features),
        "generated/null_transmittance.cl": stages.null_transmittance_text(features),
        "generated/shapes.cl": shapes.points_text(features),
        "generated/shape_tree.cl": shapes.hit_text(features),
        "generated/layout.cl": bvh.traversal_text(layout),
    }
