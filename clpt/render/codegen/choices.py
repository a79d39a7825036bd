"""Choices: the virtual files that only choose which files of the kernels folder a scene needs."""

from __future__ import annotations

from collections.abc import Callable

from clpt import bvh
from clpt.render.codegen import flags
from clpt.render.contract.camera_records import WEIGHTED
from clpt.render.contract.features import Features
from clpt.scene.scatterer import Scatterer


def when(holds: object, *files: str) -> tuple[str, ...]:
    """Return the files where a condition holds, else none."""
    return files if holds else ()


def either(holds: object, file: str) -> tuple[str, ...]:
    """Return a file where a condition holds, else its twin that does nothing, `<name>_none.cl`."""
    return (file if holds else f"{file.removesuffix('.cl')}_none.cl",)


# name: the files that stand for it, for a scene's features and the layout of its triangles
CHOICES: dict[str, Callable[[Features, str], tuple[str, ...]]] = {
    "generated/spectrum.cl": lambda f, _: (f"spectrum/{f.mode}.cl",),
    "generated/spectrum_read.cl": lambda f, _: _spectrum_read(f),
    "generated/sampler.cl": lambda f, _: (
        f"sampler/{f.sampler}.cl",
        f"path/pixel_sampler{'_z' * (f.sampler == 'zsobol')}.cl",
    ),
    "generated/exposure.cl": lambda f, _: (
        "film/splatting.cl" if f.film_weights else "film/exposure.cl",
    ),
    "generated/bands.cl": lambda f, _: ("film/bands.cl",) * f.bands,
    "generated/integrator.cl": lambda f, _: (f"integrator/{f.integrator}.cl",),
    "generated/merging.cl": lambda f, _: either(f.merged, "merging/area.cl"),
    "generated/cone.cl": lambda f, _: either(f.mips, "path/cone.cl"),
    "generated/vertex_media.cl": lambda f, _: (
        when(f.bodies, "path/vertex_bodies.cl")
        or either(f.absorption or f.media, "path/vertex_media.cl")
    ),
    "generated/front_motion.cl": lambda f, _: either("camera" in f.moving, "path/front_motion.cl"),
    "generated/ghosts.cl": lambda f, _: either(f.lit_ghosts, "path/ghosts.cl"),
    "generated/first_ray.cl": lambda f, _: (
        f"path/first_ray{'_weighted' * (f.camera in WEIGHTED)}.cl",
    ),
    "generated/sky.cl": lambda f, _: (
        *either(f.infinite, "path/sky.cl"),
        *either(f.infinite and bool(f.light_layers), "path/sky_layers.cl"),
    ),
    "generated/join_light.cl": lambda f, _: either(f.shows_lights, "lighting/join_light.cl"),
    "generated/layer_sums.cl": lambda f, _: (
        *either(f.layer_words > 0, "film/layers.cl"),
        *_screen_motion(f),
    ),
    "generated/layers.cl": lambda f, _: (
        when(
            f.layer_words > 0,
            "generated/layer_args.cl",
            *_screen_motion(f),
            *either(f.screen_motion, "path/screen_motion_record.cl"),
            "path/layers.cl",
        )
        or ("path/layers_none.cl",)
    ),
    "generated/mattes.cl": lambda f, _: either(f.mattes, "path/mattes.cl"),
    "generated/light_layers.cl": lambda f, _: (
        *when(f.light_layers, "generated/light_layer_args.cl", "generated/sampler.cl"),
        *either(f.light_layers, "film/light_layers.cl"),
    ),
    "generated/met_weight.cl": lambda f, _: either(f.balanced, "steps/met_weight.cl"),
    "generated/flight_layers.cl": lambda f, _: (
        ("film/light_layers.cl",)
        * (bool(f.light_layers) and f.emissive_media and not f.light_paths)
    ),
    "generated/medium.cl": lambda f, _: (
        ("generated/medium_coefficients.cl", "media/medium.cl") * (f.absorption or f.media)
        + ("media/dye_flight.cl",) * f.dyed_media
        + ("media/medium_grid.cl",) * f.grids
        + ("media/medium_grid_light.cl",) * f.emissive_grids
        + ("generated/body_index.cl",) * f.bodies
        + either(f.bodies, "media/bodies.cl") * f.media
    ),
    "generated/grid_flight.cl": lambda f, _: (
        ("generated/lights.cl", "path/met_light.cl") * f.emissive_grids
        + ("media/grid_flight.cl",) * f.grids
    ),
    "generated/light_medium.cl": lambda f, _: (
        ("generated/textures.cl", "generated/medium.cl")
        if f.light_media
        else ("media/light_medium_none.cl",)
    ),
    "generated/shading_frame.cl": lambda f, _: (
        ("generated/normal_map.cl", "path/shading_frame_mapped.cl")
        if f.normal_mapped
        else ("path/shading_frame.cl",)
    ),
    "generated/transmittance.cl": lambda f, _: (f"tracing/transmittance{_passing(f)}.cl",),
    "generated/shadow_ray.cl": lambda f, _: (f"path/shadow_ray{'_media' * f.shadow_media}.cl",),
    "generated/trace.cl": lambda _, layout: (
        f"tracing/trace_{'lanes' if layout == 'brute' else 'one'}.cl",
    ),
    "generated/curve_others.cl": lambda f, _: (
        f"tracing/curve_others{'_none' * (f.analytic == ('curves',))}.cl",
    ),
    "generated/shape_traversal.cl": lambda f, layout: (
        (f"bvh/{bvh.shapes_layout(layout)}.cl", "bvh/shapes.cl") * bool(f.analytic)
    ),
    "generated/hit_space.cl": lambda f, _: either(f.instances, "surface/hit_space.cl"),
    "generated/surface_steps.cl": lambda f, _: (
        "generated/motion.cl",
        *either(f.attributes, "surface/attributes.cl"),
        *either(f.screen_motion and "vertices" in f.moving, "surface/deforms.cl"),
        *either(f.normals or f.uvs or f.tangents, "surface/triangle.cl"),
        *either(f.analytic, "surface/analytic.cl"),
    ),
    "generated/corner_rows.cl": lambda f, _: (
        f"surface/corner_rows{'_keyed' * _corners_move(f)}.cl",
    ),
    "generated/triangle_steps.cl": lambda f, _: (
        *either(f.normals, "surface/triangle_normal.cl"),
        *either(f.uvs, "surface/triangle_uv.cl"),
        *either(f.uvs and f.tangents and f.vertex_tangents, "surface/triangle_tangents.cl"),
    ),
    "generated/uv_tangents.cl": lambda f, _: either(f.tangents, "surface/uv_tangents.cl"),
    "generated/analytic_steps.cl": lambda f, _: (
        *either("shapes" in f.moving, "surface/shape_motion.cl"),
        *either(f.screen_motion and "spheres" in f.moving, "surface/spheres_move.cl"),
        *either(f.tangents, "surface/analytic_tangents.cl"),
    ),
    "generated/instances.cl": lambda f, _: ("tracing/instances.cl",) * f.instances,
    "generated/motion.cl": lambda f, _: (
        *either(bool(f.moving), "tracing/motion.cl"),
        *when({"vertices", "spheres"} & {*f.moving}, "tracing/vertex_keys.cl"),
    ),
    "generated/keyed_layout.cl": lambda f, layout: (
        (f"bvh/{layout}_keyed.cl",) * ("vertices" in f.moving and layout != "brute")
    ),
    "generated/instance_traversal.cl": lambda f, layout: (
        (
            f"tracing/instances_{'few' if f.few_instances else layout}.cl",
            "tracing/trace_instances.cl",
        )
        * f.instances
    ),
}

_RIVALS = (
    "generated/merging.cl",
    "interface/camera.cl",
    "generated/camera.cl",
    "film/connect.cl",
    "generated/connect.cl",
    "lighting/rivals.cl",
)


def _merges(features: Features, cls: type[Scatterer]) -> bool:
    """Whether paths from the camera are merged with photons at a material."""
    return features.merged and flags.gathers_photons(features, cls)


# likewise, for a scene's features and the kind of material that a program shades
MATERIAL_CHOICES: dict[str, Callable[[Features, type[Scatterer]], tuple[str, ...]]] = {
    "generated/rivals.cl": lambda f, cls: (
        when(f.balanced and not flags.is_null(f, cls), *_RIVALS) or ("lighting/rivals_none.cl",)
    ),
    "generated/guide.cl": lambda f, cls: (
        ("guiding/guided_vertex.cl",)
        if flags.is_guided(f, cls) and not f.light_paths
        else ("guiding/guide_none.cl",)
    ),
    "generated/path_steps.cl": lambda f, cls: (
        *either(cls.kind in f.shining, "steps/met_emission.cl"),
        *when(_merges(f, cls), "generated/photon.cl", "merging/gather.cl"),
        *either(_merges(f, cls), "steps/merge.cl"),
        *either(f.lights and not cls.delta, "steps/next_event.cl"),
        *either(not flags.is_null(f, cls), "steps/roulette.cl"),
        *either(not flags.is_null(f, cls), "steps/scatters.cl"),
    ),
    "generated/light_path_steps.cl": lambda f, cls: (
        *either(f.joined and not cls.delta, "steps/join_camera.cl"),
        "steps/adjoint_weight.cl",
        *either(not flags.is_null(f, cls), "steps/light_path_roulette.cl"),
    ),
    "generated/vertex_steps.cl": lambda f, cls: (
        *either(flags.names_surfaces(f), "path/vertex_names.cl"),
        *(
            when(f.bodies, "path/vertex_bodies_ways.cl")
            or either(f.absorption or f.media, "path/vertex_media_ways.cl")
        ),
        *either(flags.between_bodies(f, cls), "path/between_bodies.cl"),
        *either(flags.has_lobe(f, cls, "clearcoat_apart"), "path/coat_normal.cl"),
    ),
}


def _screen_motion(features: Features) -> tuple[str, ...]:
    """How what is seen moves across the film, where a layer tells it."""
    files = ("interface/camera.cl", "generated/camera.cl", "generated/screen.cl")
    needed = when(features.screen_motion, *files)
    return (*needed, *either(features.screen_motion, "path/screen_motion.cl"))


def _corners_move(features: Features) -> bool:
    """Whether shading asks for rows of vertices, of meshes that deform."""
    return "vertices" in features.moving and (features.normals or features.tangents)


def _passing(features: Features) -> str:
    """How the name of what tells which light passes ends."""
    if features.shadow_media:
        return "_media"
    return "" if features.null_surfaces else "_opaque"


def _spectrum_read(features: Features) -> tuple[str, ...]:
    """The look-up of spectra, and in spectral mode how the camera draws wavelengths."""
    read = f"spectrum/{features.mode}_read.cl"
    drawn = f"spectrum/{'density' if features.tabulated_density else 'visible'}.cl"
    return (read, drawn) if features.mode == "spectral" else (read,)


def virtual_files(features: Features, layout: str) -> dict[str, tuple[str, ...]]:
    """Return the files that stand for each name in CHOICES."""
    return {name: choose(features, layout) for name, choose in CHOICES.items()}


def material_files(features: Features, cls: type[Scatterer]) -> dict[str, tuple[str, ...]]:
    """Return the files that stand for each name in MATERIAL_CHOICES."""
    return {name: choose(features, cls) for name, choose in MATERIAL_CHOICES.items()}
