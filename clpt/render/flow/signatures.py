"""Arguments of kernels, as macros: records, tables and slabs; trees; film and counters.

Each group of arguments is declared here once. From it follow the macro that declares it in a
kernel, the macro that passes it on, and the arguments that the host binds.
"""

from __future__ import annotations

from collections.abc import Container

from clpt import device
from clpt.records import INSTANCE, LAYER_SETTINGS, LIGHT, SETTINGS, SHAPE, SLABS, TABLES
from clpt.render.flow import blocks
from clpt.render.records import Features

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
    files = {"generated/scene.cl": scene_text(blocks.unused(features), features)}
    for name, (args, behind) in groups.items():
        rows = args_text(name.upper(), args, behind)
        files[f"generated/{name}_args.cl"] = "\n".join([*rows, ""])
    return files


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
    return {"light_layers": "global uint *"} if features.film.layers.lights else {}


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
