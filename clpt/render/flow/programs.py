"""Programs: the kernel text of every stage, for the features of a scene.

A stage's text holds only code that the scene uses; each material kind has a program that shades
it, so that a new material in a scene rebuilds nothing else.

`library` is the text that an application puts in front of its own OpenCL program.
"""

from __future__ import annotations

import dataclasses
import functools
import re

from clpt import bvh, device
from clpt.device.source import TWIN
from clpt.errors import SceneError, UnknownKindError
from clpt.records.layout import SLAB_BLOCK
from clpt.render.flow import blocks, bounce, choices, flags, stages, vertices
from clpt.render.flow.stages import functions_text
from clpt.render.geometry import cases as shapes
from clpt.render.lights import cases as lights
from clpt.render.materials import cases as parameters
from clpt.render.materials import rough_coat_table
from clpt.render.records import Features, materials
from clpt.render.textures import cases as textures
from clpt.scene.integrators import PIXELWISE
from clpt.scene.materials import LEAVES, Material
from clpt.scene.scatterer import Scatterer

BOTH = ("integrator/particle_tracer.cl", "integrator/path.cl#both")

Files = dict[str, str | device.Part | tuple[str, ...]]

# Replacements of kernel files for work-items that shade a single path.
_ALONE: device.Virtual = {
    **bvh.ALONE,
    "core/spectrum.cl#at_once": ("core/spectrum.cl#in_turn",),
    "core/grid.cl#texels_at_once": ("core/grid.cl#texels_in_turn",),
    **{
        f"transport/reuse.cl#{step}": (f"transport/reuse.cl#{step}{TWIN}",)
        for step in ("lobe", "vertex", "passed", "end")
    },
    "materials/film_stack.cl#at_once": ("materials/film_stack.cl#in_turn",),
}
# The fewest registers of a work-item of a GPU, by program, as limits that are tried by
# `native_programs.with_fewest_registers`. Left alone, compilers take more than some programs need,
# and fewer work-items run at once. A program within a limit that does not spill has at most 4 %
# more instructions: `python -m bench.gpu_compilers` uses them.
_REGISTERS: dict[str, tuple[int, ...]] = {
    "generate": (80, 96, 112),
    "flight": (128, 144),
    "intersect": (96, 128),
    "shadow": (72, 80, 96),
    "splat": (72, 80, 96),
    "shade_diffuse": (80, 96, 112),
    "shade_dielectric": (96, 112, 144),
    "shade_plastic": (96, 112),
    "shade_rough_conductor": (112, 128),
    "shade_rough_plastic": (112, 128, 136, 144),
    "shade_rough_dielectric": (112, 128, 144),
}
_REGISTERS_OF_AMD = {
    **dict.fromkeys(("generate", "emit", "shadow", "splat"), 128),
    "shade_reradiating": 96,
    **dict.fromkeys(("shade_diffuse", "shade_rough_plastic"), 168),
}
_FEW: device.Virtual = {"bvh/hints.cl": ("bvh/hints.cl#few_registers",)}


def sources(
    features: Features, layout: str, lanes: int, *, queued: bool, interleaved: bool = False
) -> dict[str, device.Source]:
    """Return the text of every program of a bounce, by program name.

    layout: of the triangles, a name in clpt.bvh.LAYOUTS; lanes: paths that a work-item shades;
    queued: whether work-items that shade a single path take slots from queues, which `append`
    fills, and `sort_rays` where there are trees; interleaved: whether a work-item of `intersect`,
    and with curves of `shadow` or `splat`, has the rays of `lanes` paths in flight.
    """
    queued = queued and lanes == 1
    texts = _stages(features, layout, lanes, interleaved, queued=queued)
    if "flare" in texts:
        return _static(texts)
    texts |= _shading(features, layout, lanes, queued=queued)
    if queued:
        texts["append"] = append_source(features, layout, lanes)
        files, defines = _shared(features, layout), _defines(features, lanes)
        if not features.transport.light_paths:
            texts["append_some"] = _source("append_some", files, defines, 1)
        if layout != "brute":
            texts["sort_rays"] = _source("sort_rays", files, defines, 1)
    return _static(texts)


def _stages(
    features: Features,
    layout: str,
    lanes: int,
    interleaved: bool,
    part: Files | None = None,
    *,
    queued: bool = False,
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
    in_queue = {**defines, "QUEUED": int(queued)}
    sortable = in_queue if layout != "brute" else defines
    if begin == "flare":
        return {
            begin: make(begin, files, defines, lanes),
            join: make(join, joins, defines, join_lanes),
        }
    texts = {
        begin: make(begin, files, in_queue if begin == "generate" else defines, lanes),
        "intersect": make(
            "intersect", {**files, **rays}, sortable, lanes if interleaved else trace_lanes
        ),
    }
    if bounce.joins(features):
        texts[join] = make(join, joins, in_queue if join == "shadow" else defines, join_lanes)
    if features.film.reuse and lanes > 1:
        texts["reuse"] = make("reuse", files, defines, trace_lanes)
    if bounce.deposits(features):
        texts["deposit"] = make("deposit", files, defines, lanes)
    if bounce.trains(features):
        texts["train"] = make("train", files, defines, lanes)
    for cls in bounce.gathered(features):
        name, kind = f"gather_{cls.kind}", flags.of_material(features, cls)
        kind_files = _of_kind(features, cls, files)
        texts[name] = make(name, kind_files, {**defines, **kind}, lanes, "gather")
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
        virtual = _of_kind(features, cls, files)
        if vertex.shared:
            virtual |= vertices.virtual_files(features, vertex)
            texts |= _materials(features, vertex, files, lanes, part)
        if part is not None:
            virtual["generated/common.cl"] = vertices.calls_text(vertices.shared(features, lanes))
        if cls.is_phase:
            virtual["generated/shading_frame.cl"] = ("media/phase.cl#frame",)
        kind = {**vertices.defines(features, vertex), "QUEUED": int(queued)}
        if part is not None and bounce.has_both(features):
            virtual["generated/integrator.cl"] = BOTH
            kind["SHADES_BOTH"] = 1
        name, kind = vertex.program, {**defines, **kind}
        texts[name] = _source(name, virtual, kind, lanes, "shade", part=part)
    return texts


def _of_kind(features: Features, cls: type[Scatterer], files: Files) -> Files:
    """The files of a scene with the files of a kind."""
    return {**files, **choices.material_files(features, cls), **_material(features, cls)}


def _material(features: Features, cls: type[Scatterer]) -> Files:
    """The files of a kind's own functions."""
    files: Files = {"generated/bsdf.cl": stages.bsdf_text(features, cls)}
    if cls.source is not None:
        files[f"{cls.folder}/{cls.kind}.cl"] = materials.text(cls)
    return files


def _materials(
    features: Features, vertex: vertices.Vertex, files: Files, lanes: int, part: Files | None
) -> dict[str, device.Source]:
    """The parts of the kinds of a shared vertex, by program name."""
    texts = {}
    for cls in (features.materials.leaves[kind] for kind in vertex.kinds):
        virtual = _of_kind(features, cls, files)
        virtual["generated/material_part.cl"] = vertices.part_text(features, cls)
        defines = {**_defines(features, lanes), **flags.of_material(features, cls)}
        name = f"material_{cls.kind}"
        texts[name] = _source(name, virtual, defines, lanes, "material", part=part)
    return texts


def append_source(features: Features, layout: str, lanes: int) -> device.Source:
    """Return the text of `append`, which puts slots into queues.

    lanes: paths of a work-item in other stages, which decides the layout of slabs.
    """
    files = _shared(features, layout)
    return _source("append", files, _defines(features, lanes), 1)


@functools.lru_cache(maxsize=32)
def film_sources(features: Features, layout: str) -> dict[str, device.Source]:
    """Return the programs that make the picture of a film, by name."""
    return _static(_alone(features, layout, "accumulate"))


def noise_sources(features: Features, layout: str) -> dict[str, device.Source]:
    """Return the programs that measure the noise of a film, by name."""
    return _static(_alone(features, layout, "noise"))


@functools.lru_cache(maxsize=32)
def loop_sources(
    features: Features, layout: str, lanes: int, interleaved: bool = False
) -> dict[str, device.Source]:
    """Return the texts that are linked to the loop of all stages on the device, by name.

    "loop" holds the kernel, which traces each kind of paths of the scene; the others are the stages
    as functions, see kernels/stage/stage.cl. Materials shade all kinds of paths, and other stages
    that are equal for all kinds stand there once. The texts are cached, since a renderer asks
    twice: to compile ahead, and to link. Random scenes come back to a few sets of kinds.
    """
    looks_up = lanes > 1 and features.textures.roles
    part = _textures(features, "elsewhere") if looks_up else {}
    texts = _shading(features, layout, lanes, part=part)
    used: dict[str, None] = {}
    for paths in features.passes:
        texts |= _stages(paths, layout, lanes, interleaved, part)
        stages_ = bounce.order(paths, layout, lanes, interleaved)
        used |= dict.fromkeys(stage.program for stage in stages_ if stage.verb != "shade")
    used |= dict.fromkeys(name for name in texts if name.startswith(("shade_", "material_")))
    texts |= (shared := _shared_parts(features, layout, lanes, part))
    used |= dict.fromkeys(shared)
    files = {
        **_shared(features, layout),
        **flags.loop_files(features, layout),
        "generated/block.cl": blocks.blocks_text(features.passes),
        "generated/bounce_stages.cl": bounce.stages_text(features, layout, lanes, interleaved),
    }
    loop = _source("loop", files, _defines(features, lanes), lanes)
    parts = {name: texts[name].with_private(name) for name in used}
    return {**parts, "loop": loop.with_private("loop")}


def _shared_parts(
    features: Features, layout: str, lanes: int, part: Files
) -> dict[str, device.Source]:
    """The parts of a loop that other parts call: common functions and textures."""
    parts: dict[str, Files] = {}
    if functions := vertices.shared(features, lanes):
        parts["common"] = {"generated/common_part.cl": vertices.common_part_text(functions), **part}
    if part:
        parts["textures"] = _textures(features, "part")
    files, defines = _shared(features, layout), _defines(features, lanes)
    return {name: _source(name, {**files, **its}, defines, lanes) for name, its in parts.items()}


def _textures(features: Features, where: textures.Where) -> Files:
    text = textures.dispatch_text(features.textures, stochastic=_stochastic(features), where=where)
    return {"generated/textures.cl": text}


def _stochastic(features: Features) -> bool:
    """Whether a random texel stands for some parameter of a material."""
    return any(flags.filters_at_random(features, cls) for cls in features.materials.leaves)


def _alone(features: Features, layout: str, *names: str) -> dict[str, device.Source]:
    """The programs whose work-items serve a pixel each."""
    files, defines = _shared(features, layout), _defines(features, 1)
    return {name: _source(name, files, defines, 1) for name in names}


def _static(texts: dict[str, device.Source]) -> dict[str, device.Source]:
    return {name: text.with_static() for name, text in texts.items()}


@functools.lru_cache(maxsize=8)
def _defines(features: Features, lanes: int) -> flags.Defines:
    """Return what all programs of a scene define; lanes: paths that a work-item shades."""
    passed = int(
        lanes > 1 and _stochastic(features)
    )  # parts of a loop pass texels in the same form
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

    part: of a loop; the files of its parts in place of a scene's.
    """
    of_part: flags.Defines = {"PART": f"loop_{name}"} if part is not None else {}
    defines = {"LANES": lanes, "QUEUED": 0, **of_part, **defines}
    if part and lanes > 1:
        virtual = {**virtual, **part}
    file = f"stage/{stage or name}.cl"
    if not defines["SLAB_BLOCK"]:  # a CPU also traces single rays
        return device.assemble(file, virtual, defines)
    alone = {**virtual, **_ALONE}
    if few := _REGISTERS_OF_AMD.get(name):
        alone |= _FEW
        defines["FEW_REGISTERS"] = few
    source = device.assemble(file, alone, defines)
    return dataclasses.replace(source, registers=_REGISTERS.get(name, ()))


def _shared(features: Features, layout: str) -> Files:
    """The generated files that all programs of a scene share, as a new dict."""
    return dict(_generated(features, layout))


@functools.lru_cache(maxsize=32)
def _generated(features: Features, layout: str) -> Files:
    return {
        **shapes.virtual_files(features),
        **rough_coat_table.virtual_files(),
        **lights.virtual_files(),
        **flags.virtual_files(features, layout),
        **parameters.virtual_files(features),
        **choices.virtual_files(features, layout),
        "generated/common.cl": vertices.calls_text(),
        "generated/camera.cl": stages.camera_text(features.camera, moves=features.motion.camera),
        "generated/connect.cl": stages.connect_text(features),
        "generated/grid_words.cl": stages.grid_words_text(features.media.grids),
        "generated/screen.cl": stages.screen_text(features),
        "generated/photon.cl": stages.photon_text(features) if features.transport.merged else "",
        "generated/phases.cl": stages.phases_text(features),
        "generated/emission.cl": lights.emission_text(features),
        **_textures(features, "own"),
        "generated/lights.cl": stages.lights_text(features),
        "generated/smooth_boundary.cl": stages.smooth_boundary_text(features),
        "generated/null_transmittance.cl": stages.null_transmittance_text(features),
        "generated/shapes.cl": shapes.points_text(features),
        "generated/shape_tree.cl": shapes.hit_text(features),
        "generated/layout.cl": bvh.traversal_text(layout),
    }


LANES = (1, 8, 16)
_MATH = ("core/lanes.cl", "core/math.cl")
_SPECTRUM = (*_MATH, "generated/spectrum.cl", "core/spectrum.cl")
PARTS: dict[str, tuple[str, ...]] = {
    "lanes": ("core/lanes.cl",),
    "math": _MATH,
    "frame": (*_MATH, "core/frame.cl"),
    "warp": (*_MATH, "core/warp.cl"),
    "mis": ("core/lanes.cl", "core/mis.cl"),
    "random": ("core/lanes.cl", "core/random.cl", "generated/sampler.cl"),
    "spectrum": _SPECTRUM,
    "fresnel": (*_SPECTRUM, "materials/fresnel.cl"),
    "microfacet": (*_MATH, "materials/microfacet.cl"),
    "bvh": ("bvh/library.cl",),
}
_INLINE = """\
#ifdef NOT_INLINED
#define CLPT_INLINE inline
#else
#define CLPT_INLINE __attribute__((always_inline)) inline
#endif
"""
BSDF = (*_SPECTRUM, "core/frame.cl", "core/warp.cl", "materials/bsdf.cl")


def kernel_source(
    *parts: str | type[Material],
    mode: str = "rgb",
    lanes: int = 1,
    layout: str = "wide8",
    sampler: str = "independent",
    lines: bool = True,
) -> str:
    """Return OpenCL C 1.2 to stand in front of an application's own kernels.

    parts: "bvh", "random", "math", "warp" and the others of docs/kernel_library.md, "bsdf/" and the
    name of a material, or a material's class; what they share is put in once. mode: "rgb" or
    "spectral", what a Spectrum is; lanes: 1, 8 or 16, how many values a `real` is; layout: of the
    tree that "bvh" traces, that of the `Accel`; sampler: what "random" is, "independent" or
    "sobol"; lines: whether a compiler is told which of clpt's files a line is from, the lines
    behind the text are then those of "program".

    Raises SceneError for an option that is not there, UnknownKindError for such a part.
    """
    if not parts:
        raise SceneError(f"name a part, such as {', '.join(map(repr, PARTS))}", where="parts")
    options = {"mode": (mode, ("rgb", "spectral")), "lanes": (lanes, LANES)}
    options |= {"layout": (layout, bvh.TREES)}
    options |= {"sampler": (sampler, tuple(cls.kind for cls in PIXELWISE))}
    for name, (value, known) in options.items():
        if value not in known:
            raise SceneError(f"{value!r} is none of {', '.join(map(str, known))}", where=name)
    virtual: dict[str, str | device.Part | tuple[str, ...]] = {
        "generated/spectrum.cl": (f"spectra/{mode}.cl",),
        "generated/sampler.cl": (f"samplers/kinds/{sampler}.cl",),
        "generated/layout.cl": bvh.traversal_text(layout),
        **rough_coat_table.virtual_files(),
    }
    files: list[str] = []
    for part in parts:
        files += PARTS[part] if part in PARTS else _bsdf(part, mode, virtual)
    virtual["library"] = tuple(files)
    source = device.assemble("library", virtual, {"LANES": lanes}, library=True)
    text = _own_inline(source.text)
    if lines:
        return text + '#line 1 "program"\n'
    return re.sub(r"^#line .*\n", "", text, flags=re.MULTILINE)


def _own_inline(text: str) -> str:
    """Return the text with a macro of clpt's name where it redefines `inline` for itself.

    The application's own `inline` then stays what its compiler takes it for.
    """
    text = re.sub(r"^#define inline .*", "", text, flags=re.MULTILINE)
    return _INLINE + re.sub(r"^inline\b", "CLPT_INLINE", text, flags=re.MULTILINE)


def _bsdf(part: str | type[Material], mode: str, virtual: dict) -> tuple[str, ...]:
    """The files of a material kind; those that are not on disk are put into `virtual`."""
    if isinstance(part, str):
        known = {f"bsdf/{cls.kind}": cls for cls in LEAVES}
        if part not in known:
            raise UnknownKindError("part of the kernels", part, (*PARTS, *known))
        part = known[part]
    if part not in LEAVES:
        materials.check(part)
        virtual[f"materials/kinds/{part.kind}.cl"] = materials.text(part)
    virtual[f"generated/{part.kind}.cl"] = functions_text(part, mode)
    return (*BSDF, f"generated/{part.kind}.cl")
