"""Macros of kernels: the features of a scene and of a material, and arguments.

A true flag is 1. A false flag is not defined: `#if` takes it for 0. `assemble` decides each `#if`,
so that a text has no line for features that its scene does not use. Numbers and names are defined
as they are.

Arguments are records, tables and slabs; trees; film and counters. Each group is declared here once.
From it follow the macro that declares it in a kernel, the macro that passes it on, and the
arguments that the host binds.
"""

from __future__ import annotations

from collections.abc import Callable, Container

from clpt import device
from clpt.records import (
    INSTANCE,
    LAYER_SETTINGS,
    LIGHT,
    REUSE_GROUP,
    SETTINGS,
    SHAPE,
    SLABS,
    TABLES,
)
from clpt.render.flow import blocks
from clpt.render.records import Features
from clpt.render.records.macros import macros_of
from clpt.render.records.textures import IMAGES
from clpt.scene.params import device_params
from clpt.scene.scatterer import Scatterer

Defines = dict[str, str | int]


def walks(features: Features) -> bool:
    """Whether the camera's paths go from collision to collision in media."""
    of_camera = not features.transport.light_paths
    return of_camera and any(cls.is_phase for cls in features.materials.leaves)


def fluoresces(features: Features, cls: type[Scatterer]) -> bool:
    """Whether light may leave a material at another wavelength than it came."""
    return cls.fluoresces and features.spectra.spectral


def ends_light_paths(features: Features, cls: type[Scatterer]) -> bool:
    """Whether a material is not reciprocal, so that light paths end there."""
    return not cls.reversible or fluoresces(features, cls)


def gathers_photons(features: Features, cls: type[Scatterer]) -> bool:
    """Whether paths from the camera are merged with photons on a material."""
    return not (cls.delta or cls.is_null or cls.is_phase or ends_light_paths(features, cls))


def gathers_along(features: Features, cls: type[Scatterer]) -> bool:
    """Whether rays from the camera are merged with photons in media of a phase function."""
    return cls.is_phase and not ends_light_paths(features, cls)


def filters_at_random(features: Features, cls: type[Scatterer]) -> bool:
    """Whether a random texel stands for some parameter of a material."""
    images = {(kind, "reflectance") for kind in IMAGES}
    if images.isdisjoint(features.textures.roles):
        return False
    sources, declared = features.materials.sources_of(cls.kind), device_params(cls)
    return any(p.linear and "texture" in sources.get(n, ()) for n, p in declared.items())


def has_lobe(features: Features, cls: type[Scatterer], name: str) -> bool:
    """Whether a material of the scene has a lobe that a parameter of 0 leaves out."""
    declared, none = device_params(cls), frozenset({"none"})
    sources = features.materials.sources_of(cls.kind)
    return name in declared and sources.get(name, none) != none


def is_chromatic(features: Features, cls: type[Scatterer]) -> bool:
    """Whether densities of a material's directions differ between wavelengths.

    Without dispersion they are equal. The adjoint weight of light paths then follows from eta alone
    (kernels/integrator/particle_tracer.cl), unless lobes that refract and other lobes share
    directions.
    """
    if cls.is_phase:
        return features.materials.phase_varies(cls)
    return cls.chromatic and (features.told_dispersion or not cls.lobes_apart)


def is_null(features: Features, cls: type[Scatterer]) -> bool:
    """Whether paths cross a material as if it were absent."""
    return cls.is_null and features.materials.null_surfaces


def is_guided(features: Features, cls: type[Scatterer]) -> bool:
    """Whether a guide helps to choose directions at a material."""
    unsuited = cls.delta or cls.is_null or cls.no_back or fluoresces(features, cls)
    alone = cls.refracts and features.told_dispersion  # a direction may have a single wavelength
    return features.transport.guided and not (unsuited or alone)


def refracts_widely(features: Features, cls: type[Scatterer]) -> bool:
    """Whether light by time asks for the index that lights have beyond a material."""
    widely = cls.has_across if cls.source is not None else cls.refracts and not cls.delta
    return widely and features.film.layers.time_bins > 0


def asks_chance(features: Features, cls: type[Scatterer]) -> bool:
    """Whether light paths need the probability that a light tree chooses their light here."""
    glossy = features.transport.balanced and features.lights.gloss > 0
    return glossy and not is_null(features, cls)


def between_bodies(features: Features, cls: type[Scatterer]) -> bool:
    """Whether the body outside of a material gives its outer index of refraction."""
    return features.media.bodies and cls.kind in BETWEEN_BODIES


BETWEEN_BODIES = ("dielectric", "rough_dielectric")  # kinds with an outer index of refraction


def is_coated(cls: type[Scatterer]) -> bool:
    """Whether a material's diffuse lobe is below a coat."""
    return cls.has_diffuse_lobe and cls.uses_lobe_sample


# name: its value, of the features and the kind that a program shades
MATERIAL: dict[str, Callable[[Features, type[Scatterer]], int]] = {
    "BSDF_KIND": lambda f, cls: f.materials.leaves.index(cls),
    "BSDF_DELTA": lambda f, cls: cls.delta,
    "BSDF_TRANSMITS": lambda f, cls: int(cls.kind in f.materials.transmitting),  # calculated with
    "BSDF_SHINES": lambda f, cls: cls.kind in f.materials.shining,
    "BSDF_ABSORBS": lambda f, cls: cls.absorbs,
    "BSDF_CHROMATIC": is_chromatic,
    "BSDF_FLUORESCES": fluoresces,
    "BSDF_ENDS_LIGHT_PATHS": lambda f, cls: f.transport.balanced and ends_light_paths(f, cls),
    "BSDF_MERGES": lambda f, cls: (
        f.transport.merged and (gathers_photons(f, cls) or gathers_along(f, cls))
    ),
    "BSDF_GUIDED": is_guided,
    "BSDF_IS_PHASE": lambda f, cls: cls.is_phase,
    "BSDF_IS_NULL": is_null,
    "BSDF_IS_PANE": lambda f, cls: cls.is_pane and f.materials.free_panes,
    "BSDF_REUSED": lambda f, cls: f.film.reuse and cls.has_diffuse_lobe,
    "STOCHASTIC_FILTERING": filters_at_random,
    "USES_CHOICE": lambda f, cls: cls.uses_lobe_sample or cls.fluoresces or not f.lights.few,
}

SCENE = frozenset(dict(macros_of(Features())))  # the names of flags of a scene


def of_scene(features: Features) -> Defines:
    """Return the macros of features."""
    return {name: value for name, value in macros_of(features) if value is not None}


def of_material(features: Features, cls: type[Scatterer]) -> Defines:
    """Return the macros of the kind of material that a program shades.

    A false flag is 0, as kernels also ask for it by `if`.
    """
    return {name: int(value(features, cls)) for name, value in MATERIAL.items()}


SLAB_ARGS = {f"{record.name.lower()}_words": "global float *restrict " for record in SLABS}
SLAB_ARGS["stride"] = "uint "
SCENE_ARGS = {n: f"global const {element} *restrict " for n, (element, _) in TABLES.items()}
SCENE_ARGS["settings"] = "global const Settings *restrict "


def args_text(name: str, args: dict[str, str], behind: bool = False) -> list[str]:
    """Return the macro that declares a group of arguments, and the macro that passes them on.

    behind: with a comma before each argument, so that a group may be empty.
    """
    before = ", " if behind and args else ""
    declared = ", ".join(f"{type_}{argument}" for argument, type_ in args.items())
    return [
        f"#define {name}_ARGS {before}{declared}",
        f"#define {name}_PASSED {before}{', '.join(args)}",
    ]


def virtual_files(features: Features, layout: str) -> dict[str, str]:
    """Return the generated files that define the groups of arguments, a file for each group.

    So a group does not change the text of a stage that takes none of it.
    """
    groups = {
        "trace": (trace_args(features, layout), False),
        "begin": (begin_args(features), False),
        "join": (join_args(features, layout), False),
        "deposit": (deposit_args(features), True),
        "merge": (merge_args(features), True),
        "shade": (shade_args(features), True),
        "layer": (layer_args(features), True),
        "light_layer": (light_layer_args(features), True),
        "flight": (flight_args(features), True),
        "gather": (gather_args(features), True),
    }
    files = {
        "generated/scene.cl": scene_text(blocks.unused(features), features),
        "generated/slab_words.cl": slab_words_text(),
    }
    for name, (args, behind) in groups.items():
        rows = args_text(name.upper(), args, behind)
        files[f"generated/{name}_args.cl"] = "\n".join([*rows, ""])
    return files


def slab_words_text() -> str:
    """Return `RECORD_MEMBER_WORD`, the first word of each member of the slabs, and REUSE_GROUP."""
    rows = [f"#define REUSE_GROUP {REUSE_GROUP}"]
    rows += [
        f"#define {record.name.upper()}_{member.name.upper()}_WORD {member.word}"
        for record in SLABS
        for member in record.members
    ]
    return "\n".join([*rows, ""])


def scene_text(unused: Container[str] = (), features: Features | None = None) -> str:
    """Return records, the `Scene` struct and the macros that carry it through arguments.

    unused: members of the slabs that no kernel of the scene uses. features: without layers, the
    settings end before LAYER_SETTINGS.
    """
    without = () if features is None or features.film.layers.present else LAYER_SETTINGS
    slabs = [record.slab_text(unused) for record in SLABS]
    many_lights = features is not None and not features.lights.few
    rows = [SHAPE.row_text(), INSTANCE.row_text(many=True), LIGHT.row_text(many_lights)]
    members = [
        f"    global const {element} *{name}; /* {doc} */"
        for name, (element, doc) in TABLES.items()
    ]
    slab_sets = [
        f"{record.name.lower()} = {{{name}, SLAB_STEP({record.step}, stride)}}"
        for record, name in zip(SLABS, SLAB_ARGS, strict=False)
    ]
    return "\n".join(
        [
            SETTINGS.without(*without).uniform_text(),
            *slabs,
            "typedef struct {",
            *members,
            "    global const Settings *settings;",
            "    real time; /* of the path that is traced or shaded [s]; 0 where nothing moves */",
            "    uint kind; /* of material, in a vertex of several: materials/bsdf.cl */",
            "} Scene;",
            *rows,
            f"#define SHAPE_ROW_WORDS {SHAPE.words}",
            *(f"#define SHAPE_ROW_{m.name.upper()} {m.word}" for m in SHAPE.members),
            f"#define INSTANCE_ROW_WORDS {INSTANCE.words}",
            f"#define LIGHT_ROW_WORDS {LIGHT.words}",
            *args_text("SCENE", SCENE_ARGS),
            "#define SCENE Scene scene = {SCENE_PASSED};",
            *args_text("SLAB", SLAB_ARGS),
            f"#define SLABS Slab {', '.join(slab_sets)};",
            "",
        ]
    )


def trace_args(features: Features, layout: str) -> dict[str, str]:
    """Return the buffers of all trees."""
    if layout == "brute":
        return {"tris": "global const float *", "triangles": "uint "}
    trees = dict.fromkeys(("nodes", "leaves"), "global const float *")
    if features.geometry.analytic:
        trees |= {"shape_nodes": "global const float *", "shape_indices": "global const uint *"}
    if features.geometry.instances:
        trees["instance_nodes"] = "global const float *"
    return trees


def begin_args(features: Features) -> dict[str, str]:
    """Return arguments of the stage that begins paths."""
    film = ["film", "bands"] if features.film.bands else ["film"]
    footprints = {"footprints": "global long *"} if features.film_weights else {}
    common = {"counters": "global uint *", "work_list": "global const uint *", "samples": "int2 "}
    layers = layer_args(features) | light_layer_args(features)
    return {**dict.fromkeys(film, "global uint *"), **layers, **footprints, **common}


def join_args(features: Features, layout: str) -> dict[str, str]:
    """Return arguments of the stage that tests rays to lights or, in `splat`, to the camera."""
    begin = begin_args(features) if features.transport.light_paths else {}
    splats = {n: type_ for n, type_ in begin.items() if n in ("film", "bands", "counters")}
    return {**trace_args(features, layout), **splats, **light_layer_args(features)}


def deposit_args(features: Features) -> dict[str, str]:
    """Return arguments of the stage that stores light paths as photons."""
    if features.transport.guided and features.transport.light_paths:
        return {"guide": "global uint *"}
    if not (features.transport.merged and features.transport.light_paths):
        return {}
    return dict.fromkeys(("photons", "photon_numbers"), "global uint *")


def merge_args(features: Features) -> dict[str, str]:
    """Return arguments of shading that gathers photons."""
    if features.transport.guided and not features.transport.light_paths:
        return {"guide": "global const uint *"}
    if not features.transport.merged or features.transport.light_paths:
        return {}
    return dict.fromkeys(("photons", "photon_order", "photon_cells"), "global const uint *")


def gather_args(features: Features) -> dict[str, str]:
    """Return arguments of the stage that gathers photons along rays, beside slabs and scene."""
    return {**merge_args(features), **light_layer_args(features)}


def layer_args(features: Features) -> dict[str, str]:
    """Return arguments of stages that add to layers of the first samples, and to mattes."""
    names = ["layers"] * (features.film.layers.words > 0) + ["mattes"] * bool(
        features.film.layers.mattes
    )
    return dict.fromkeys(names, "global uint *")


def light_layer_args(features: Features) -> dict[str, str]:
    """Return arguments of stages that add to layers of light."""
    return {"light_layers": "global uint *"} if features.film.layers.light_pictures else {}


def shade_args(features: Features) -> dict[str, str]:
    """Return arguments of shading, beside slabs and scene."""
    light = {} if features.transport.light_paths else light_layer_args(features)
    return {**merge_args(features), **layer_args(features), **light}


def flight_args(features: Features) -> dict[str, str]:
    """Return arguments of the stage that takes rays through media, beside slabs and scene."""
    gathers = features.media.emissive and not features.transport.light_paths
    return light_layer_args(features) if gathers else {}


def loop_files(features: Features, layout: str) -> dict[str, str]:
    """Return the generated file that defines the arguments of all stages of a loop."""
    return {
        "generated/loop_args.cl": "\n".join([*args_text("LOOP", loop_args(features, layout)), ""])
    }


def loop_args(features: Features, layout: str) -> dict[str, str]:
    """Return arguments of the stages of a loop, of all kinds of paths, beside slabs and scene."""
    args = trace_args(features, layout)
    for paths in features.passes:  # deposit last: it writes arrays that other stages read
        args |= {**shade_args(paths), **begin_args(paths), **join_args(paths, layout)}
    return {**args, **{n: t for paths in features.passes for n, t in deposit_args(paths).items()}}


def loop_arguments(features: Features, layout: str) -> tuple[device.Argument, ...]:
    """Return the arguments of stage/loop.cl: a linked kernel has no argument names."""
    args = {**SLAB_ARGS, **SCENE_ARGS, **loop_args(features, layout), "queue": "global uint *"}
    args |= dict.fromkeys(("share", "begin", "bounces", "restart", "which"), "uint ")
    args["leave"] = "global const volatile uint *"
    return tuple(
        device.Argument(
            name,
            "*" if "*" in type_ else type_.strip(),
            "global" if type_.startswith("global") else "private",
        )
        for name, type_ in args.items()
    )
