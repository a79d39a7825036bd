"""Choices: the virtual files that only choose which files of the kernels folder a scene needs."""

from __future__ import annotations

from collections.abc import Callable

from clpt import bvh
from clpt.device.source import TWIN
from clpt.render.flow import flags
from clpt.render.records import Features
from clpt.scene.materials import Dielectric
from clpt.scene.scatterer import Scatterer


def when(holds: object, *files: str) -> tuple[str, ...]:
    """Return the files where a condition holds, else none."""
    return files if holds else ()


def either(holds: object, file: str) -> tuple[str, ...]:
    """Return a file where a condition holds, else its twin that does nothing."""
    return (file if holds else f"{file}{TWIN}",)


def _grid_collision(features: Features) -> tuple[str, ...]:
    """Return the file about collisions in grids."""
    grids = features.media.grids
    if grids.mixed:
        return ("media/grid_flight.cl#collision_mixed",)
    varied = features.ratios and (grids.coloured or grids.tinted)
    return either(varied, "media/grid_flight.cl#collision")


# name: the files that stand for it, for a scene's features and the layout of its triangles
CHOICES: dict[str, Callable[[Features, str], tuple[str, ...]]] = {
    "generated/spectrum.cl": lambda f, _: (f"spectra/{f.spectra.mode}.cl",),
    "generated/spectrum_read.cl": lambda f, _: _spectrum_read(f),
    "generated/sampler.cl": lambda f, _: (
        f"samplers/kinds/{f.transport.sampler}.cl",
        f"samplers/pixel_sampler.cl{'#z' * (f.transport.sampler == 'zsobol')}",
    ),
    "generated/exposure.cl": lambda f, _: (
        f"film/exposure.cl#{'splatting' if f.film_weights else 'own_pixel'}",
    ),
    "generated/bands.cl": lambda f, _: ("film/bands.cl",) * f.film.bands,
    "generated/integrator.cl": lambda f, _: (f"integrator/{f.transport.integrator}.cl#vertex",),
    "generated/walk.cl": lambda f, _: either(flags.walks(f), "media/walk.cl"),
    "generated/merging.cl": lambda f, _: either(f.transport.merged, "transport/photons/area.cl"),
    "generated/collisions.cl": lambda f, _: either(
        f.media.present, "transport/photons/collisions.cl"
    ),
    "generated/train_steps.cl": lambda f, _: either(
        f.media.present, "transport/guiding/guide.cl#collisions"
    ),
    "generated/reuse_meets.cl": lambda f, _: either(f.film.reuse, "transport/reuse.cl#meets"),
    "generated/reuse.cl": lambda f, _: (
        *either(f.film.coats, "transport/reuse.cl#passed"),
        *either(f.film.reuse, "transport/reuse.cl#end"),
    ),
    "generated/bsdf_answer.cl": lambda f, _: either(f.film.coats, "materials/bsdf.cl#answer"),
    "generated/reuse_due.cl": lambda f, _: either(f.film.reuse, "transport/reuse.cl#due"),
    "generated/cone.cl": lambda f, _: either(f.textures.mips, "textures/cone.cl"),
    "generated/vertex_media.cl": lambda f, _: (
        when(f.media.bodies, "media/bodies.cl#vertex")
        or either(f.media.absorbing, "media/vertex_media.cl")
    ),
    "generated/front_motion.cl": lambda f, _: either(f.motion.camera, "cameras/motion.cl#front"),
    "generated/ghosts.cl": lambda f, _: either(f.transport.lit_ghosts, "cameras/ghosts.cl"),
    "generated/first_cone.cl": lambda f, _: (
        f"textures/cone.cl#{'unrelated' if f.camera.listed else 'first'}",
    ),
    "generated/first_ray.cl": lambda f, _: (
        f"cameras/first_ray.cl{'#weighted' * f.camera.weighs}",
    ),
    "generated/sky.cl": lambda f, _: (
        *either(f.lights.infinite, "lights/sky.cl"),
        *either(f.lights.infinite and f.film.layers.light_pictures, "lights/sky.cl#layers"),
    ),
    "generated/join_light.cl": lambda f, _: either(f.shows_lights, "lights/emission.cl#join"),
    "generated/layer_sums.cl": lambda f, _: (
        "generated/layer_args.cl",
        *either(f.film.layers.words > 0, "film/layers.cl"),
        *_screen_motion(f),
    ),
    "generated/layers.cl": lambda f, _: (
        "generated/layer_args.cl",
        *when(
            f.film.layers.words > 0,
            *_screen_motion(f),
            *either(f.screen_motion, "film/screen_motion.cl#record"),
            *either(f.motion.camera, "cameras/motion.cl#axis"),
        ),
        *either(f.film.layers.words > 0, "film/layers.cl#record"),
    ),
    "generated/path_covers.cl": lambda f, _: either(f.film.alpha, "film/covers.cl"),
    "generated/path_start.cl": lambda f, _: either(
        f.film.alpha and f.camera.weighs, "cameras/first_ray.cl#again"
    ),
    "generated/scouts.cl": lambda f, _: either(f.scouts, "film/scouts.cl"),
    "generated/scouts_begin.cl": lambda f, _: either(f.scouts, "film/scouts.cl#begin"),
    "generated/scout_choice.cl": lambda f, _: either(f.scouts, "film/scouts.cl#choice"),
    "generated/mattes.cl": lambda f, _: either(f.film.layers.mattes, "film/layers.cl#mattes"),
    "generated/light_layers.cl": lambda f, _: (
        *when(f.film.layers.light_pictures, "generated/sampler.cl"),
        *either(f.film.layers.light_pictures, "film/light_layers.cl"),
    ),
    "generated/row_delay.cl": lambda f, _: either(f.motion.rolling, "motion/motion.cl#rolling"),
    "generated/optical_length.cl": lambda f, _: either(
        f.film.layers.time_bins, "transport/optical_length.cl"
    ),
    "generated/met_weight.cl": lambda f, _: (
        when(f.media.escapes, "integrator/steps/met_emission.cl#weight_escapes")
        or either(f.transport.balanced, "integrator/steps/met_emission.cl#weight")
    ),
    "generated/escape_light.cl": lambda f, _: either(f.media.escapes, "tracing/escape_light.cl"),
    "generated/medium.cl": lambda f, _: (
        ("generated/medium_coefficients.cl", "media/medium.cl") * (f.media.absorbing)
        + ("media/medium_grid.cl",) * f.media.grids.present
        + ("media/medium_grid_light.cl",) * f.media.grids.emissive
        + ("generated/body_index.cl",) * f.media.bodies
        + either(f.media.bodies, "media/bodies.cl") * f.media.present
    ),
    "generated/grid_flight.cl": lambda f, _: (
        *(
            ("generated/lights.cl", "lights/light.cl#met")
            if f.media.grids.emissive or f.lights.bodies
            else when(f.media.grids.present, f"lights/receiver.cl{TWIN}")
        ),
        *when(f.media.grids.present, "media/grid_flight.cl"),
    ),
    "generated/kept_hemisphere.cl": lambda f, _: (
        when(f.lights.gloss, "lights/receiver.cl#kept")
        or either(f.hemispheres, "lights/receiver.cl#kept_hemisphere")
    ),
    "generated/seen_wavelengths.cl": lambda f, _: either(
        f.fluorescence, "spectra/wavelengths.cl#seen"
    ),
    "generated/infinite_weight.cl": lambda f, _: either(
        f.transport.balanced, "lights/infinite.cl#weight"
    ),
    "generated/diffuse_roulette.cl": lambda f, _: either(
        f.dull_paths_end, "transport/roulette.cl#diffuse"
    ),
    "generated/light_path_endless.cl": lambda f, _: either(
        f.media.grids.present, "transport/light_path.cl#endless"
    ),
    "generated/emit_steps.cl": lambda f, _: (
        *either(f.transport.aimed, "transport/mis_ratio.cl#aimed"),
        *either(f.transport.balanced, "lights/emission.cl#kept"),
    ),
    "generated/medium_steps.cl": lambda f, _: either(f.media.present, "media/medium.cl#flies"),
    "generated/medium_dims.cl": lambda f, _: either(not f.shadow_media, "media/medium.cl#dims"),
    "generated/light_media.cl": lambda f, _: either(f.light_media, "media/medium.cl#lights"),
    "generated/grid_numbers.cl": lambda f, _: either(
        f.media.grids.bytes, "media/medium_grid.cl#bytes"
    ),
    "generated/grid_steps.cl": lambda f, _: (
        "generated/grid_words.cl",
        *either(f.media.grids.coloured, "media/medium_grid.cl#coloured"),
        *either(f.media.grids.tinted, "media/medium_grid.cl#tinted"),
        *either(f.media.grids.mixed, "media/medium_grid.cl#mixed"),
    ),
    "generated/grid_glow.cl": lambda f, _: (
        *when(
            f.media.grids.hot, *either(f.spectra.spectral, "media/medium_grid_light.cl#black_body")
        ),
        *either(f.media.grids.hot, "media/medium_grid_light.cl#glow"),
    ),
    "generated/flight_steps_of_grids.cl": lambda f, _: (
        *either(f.ratios, "media/grid_flight.cl#weigh"),
        *either(f.media.grids.emissive, "media/grid_flight.cl#gather"),
        *_grid_collision(f),
    ),
    "generated/brick_weight.cl": lambda f, _: either(
        f.lights.bricks, "media/grid_flight.cl#brick_weight"
    ),
    "generated/body_weight.cl": lambda f, _: either(
        f.lights.bodies, "media/flight.cl#emission_weight"
    ),
    "generated/aim_cone.cl": lambda f, _: either(f.media.aim_cones, "media/equiangular.cl#cone"),
    "generated/flight_medium.cl": lambda f, _: either(f.media.bodies, "media/flight.cl#medium"),
    "generated/flight_steps.cl": lambda f, _: (
        *either(f.media.bodies, "media/flight.cl#medium"),
        *either(f.media.grids.present, "media/flight.cl#grids"),
        *either(f.media.aims and not f.transport.light_paths, "media/equiangular.cl"),
        *either(f.media.dyed, "media/flight.cl#dye"),
        *either(f.ratios, "media/flight.cl#weight"),
        *either(f.media.emissive, "media/flight.cl#emission"),
    ),
    "generated/light_of_flight.cl": lambda f, _: either(
        f.film.layers.light_pictures and not f.transport.light_paths, "media/flight.cl#light_layers"
    ),
    "generated/way_steps.cl": lambda f, _: (
        *either(f.media.grids.present, "media/medium_grid.cl#shadow"),
        *either(f.media.bodies, "media/bodies.cl#shadow"),
    ),
    "generated/light_medium.cl": lambda f, _: (
        ("generated/textures.cl", "generated/medium.cl")
        if f.light_media
        else (f"media/medium.cl#lights{TWIN}", f"media/medium.cl#dims{TWIN}")
    ),
    "generated/shading_frame.cl": lambda f, _: (
        *when(f.materials.normal_mapped, "generated/normal_map.cl"),
        *either(f.materials.normal_mapped, "materials/shading_frame.cl"),
    ),
    "generated/transmittance.cl": lambda f, _: (f"tracing/transmittance.cl#{_passing(f)}",),
    "generated/shadow_ray.cl": lambda f, _: (
        when(f.shadow_media, "transport/shadow_ray.cl#media")
        or when(f.media.escapes, "transport/shadow_ray.cl#escapes")
        or ("transport/shadow_ray.cl",)
    ),
    "generated/trace.cl": lambda _, layout: (
        f"tracing/trace.cl#{'lanes' if layout == 'brute' else 'single'}",
    ),
    "generated/curve_others.cl": lambda f, _: either(
        f.geometry.analytic != ("curves",), "tracing/curves.cl#others"
    ),
    "generated/shape_traversal.cl": lambda f, layout: (
        (f"bvh/shapes.cl#{bvh.shapes_layout(layout).removeprefix('shapes_')}",)
        * bool(f.geometry.analytic)
    ),
    "generated/hit_space.cl": lambda f, _: either(f.geometry.instances, "shapes/hit_space.cl"),
    "generated/surface_steps.cl": lambda f, _: (
        "generated/motion.cl",
        *either(f.textures.attributes, "shapes/surface.cl#attributes"),
        *either(f.screen_motion and f.motion.vertices, "shapes/surface.cl#deforms"),
        *either(f.geometry.normals or f.geometry.uvs or f.geometry.tangents, "shapes/triangle.cl"),
        *either(f.geometry.analytic, "shapes/analytic.cl"),
    ),
    "generated/corner_rows.cl": lambda f, _: (
        f"shapes/triangle.cl#{'keyed' if _corners_move(f) else 'still'}_rows",
    ),
    "generated/triangle_steps.cl": lambda f, _: (
        *either(f.geometry.normals, "shapes/triangle.cl#normal"),
        *either(f.geometry.uvs, "shapes/triangle.cl#uv"),
        *either(
            f.geometry.tangents and f.textures.mappings and f.textures.attributes,
            "shapes/triangle.cl#second_uv",
        ),
        *either(
            f.geometry.uvs and f.geometry.tangents and f.geometry.vertex_tangents,
            "shapes/triangle.cl#tangents",
        ),
    ),
    "generated/uv_tangents.cl": lambda f, _: either(
        f.geometry.tangents, "shapes/triangle.cl#uv_tangents"
    ),
    "generated/analytic_steps.cl": lambda f, _: (
        *either(f.motion.shapes, "shapes/analytic.cl#motion"),
        *either(f.screen_motion and f.motion.spheres, "shapes/analytic.cl#spheres_move"),
        *either(f.geometry.tangents, "shapes/analytic.cl#tangents"),
    ),
    "generated/instances.cl": lambda f, _: ("tracing/instances.cl",) * f.geometry.instances,
    "generated/motion.cl": lambda f, _: (
        *either(f.motion.present, "motion/motion.cl"),
        *when(f.motion.vertices or f.motion.spheres, "motion/motion.cl#vertex_keys"),
    ),
    "generated/keyed_layout.cl": lambda f, layout: (
        (f"bvh/{layout}.cl#keyed",) * (f.motion.vertices and layout != "brute")
    ),
    "generated/instance_traversal.cl": lambda f, layout: (
        (
            f"tracing/instances.cl#{'few' if f.geometry.few_instances else layout}",
            "tracing/instances.cl#hits",
        )
        * f.geometry.instances
    ),
}

_MIS_RATIO = (
    "generated/merging.cl",
    "cameras/camera.cl",
    "generated/camera.cl",
    "film/connect.cl",
    "generated/connect.cl",
)


def _merges(features: Features, cls: type[Scatterer]) -> bool:
    """Whether paths from the camera are merged with photons at a material."""
    return features.transport.merged and flags.gathers_photons(features, cls)


def _escapes(features: Features, cls: type[Scatterer]) -> str:
    """Return the file about rays that leave sealed media."""
    if not features.media.escapes:
        return f"integrator/steps/escapes.cl{TWIN}"
    step = "" if cls.is_phase else "#out" if cls is Dielectric else "#end"
    return f"integrator/steps/escapes.cl{step}"


# likewise, for a scene's features and the kind of material that a program shades
MATERIAL_CHOICES: dict[str, Callable[[Features, type[Scatterer]], tuple[str, ...]]] = {
    "generated/mis_ratio.cl": lambda f, cls: (
        *when(weighs := f.transport.balanced and not flags.is_null(f, cls), *_MIS_RATIO),
        *either(weighs, "transport/mis_ratio.cl"),
    ),
    "generated/mis_ratio_steps.cl": lambda f, cls: (
        *either(f.transport.merged, "transport/mis_ratio.cl#merging"),
        *either(f.transport.joined and not cls.delta, "transport/mis_ratio.cl#camera"),
    ),
    "generated/mis_merging_area.cl": lambda f, cls: (
        f"transport/mis_ratio.cl#area{'_along' * cls.is_phase}",
    ),
    "generated/hero_steps.cl": lambda f, cls: (
        *either(
            f.ratios and flags.is_chromatic(f, cls) and f.spectra.spectral, "spectra/hero.cl#weighs"
        ),
        *either(f.told_dispersion, "spectra/hero.cl#alone"),
        *(
            either(
                flags.is_chromatic(f, cls) and (f.told_dispersion or cls.is_phase),
                "materials/bsdf.cl#mis_pdf",
            )
            if f.transport.balanced and not flags.is_null(f, cls)
            else ("materials/bsdf.cl#no_mis_pdf",)
        ),
    ),
    "generated/pair.cl": lambda f, cls: ("materials/bsdf.cl#pair",),
    "generated/guide.cl": lambda f, cls: (
        (
            f"transport/guiding/guide.cl#at_{'collision' if cls.is_phase else 'surface'}",
            "transport/guiding/guided_vertex.cl",
        )
        if flags.is_guided(f, cls) and not f.transport.light_paths
        else (f"transport/guiding/guided_vertex.cl{TWIN}",)
    ),
    "generated/path_steps.cl": lambda f, cls: (
        *either(f.grouped and cls.refracts, "transport/optical_length.cl#slopes"),
        *either(cls.kind in f.materials.shining, "integrator/steps/met_emission.cl"),
        *when(_merges(f, cls), "generated/photon.cl", "transport/photons/gather.cl"),
        *either(_merges(f, cls), "integrator/steps/merge.cl"),
        *either(f.film.coats and not flags.is_null(f, cls), "transport/reuse.cl#lobe"),
        *either(f.film.reuse and not flags.is_null(f, cls), "transport/reuse.cl#vertex"),
        *either(f.lights.kinds and not cls.delta, "integrator/steps/next_event.cl"),
        *either(not flags.is_null(f, cls), "integrator/steps/roulette.cl#path"),
        *either(not flags.is_null(f, cls), "integrator/steps/scatters.cl"),
        _escapes(f, cls),
    ),
    "generated/index_across.cl": lambda f, cls: either(
        flags.refracts_widely(f, cls), "transport/optical_length.cl#crossing"
    ),
    "generated/light_path_steps.cl": lambda f, cls: (
        *either(f.transport.joined and not cls.delta, "integrator/steps/join_camera.cl"),
        *either(flags.asks_chance(f, cls), "transport/mis_ratio.cl#chosen"),
        *either(f.dull_paths_end and not cls.delta, "integrator/steps/roulette.cl#diffuse"),
        *either(not flags.is_null(f, cls), "integrator/steps/roulette.cl#light_path"),
    ),
    "generated/scout.cl": lambda f, cls: either(
        f.scouts and not cls.is_phase, "film/scouts.cl#vertex"
    ),
    "generated/vertex_steps.cl": lambda f, cls: (
        *either(f.names_surfaces, "transport/vertex.cl#names"),
        *(
            when(f.media.bodies, "media/vertex_ways.cl#bodies")
            or either(f.media.absorbing, "media/vertex_ways.cl#media")
        ),
        *either(flags.between_bodies(f, cls), "media/bodies.cl#between"),
        *either(
            flags.has_lobe(f, cls, "clearcoat_apart"), "materials/shading_frame.cl#coat_normal"
        ),
        *either(flags.has_lobe(f, cls, cls.turning_lobe), "materials/shading_frame.cl#anisotropy"),
    ),
}


def _screen_motion(features: Features) -> tuple[str, ...]:
    """Return the files of the motion of points on the film, for the layer that shows it."""
    files = ("cameras/camera.cl", "generated/camera.cl", "generated/screen.cl")
    needed = when(features.screen_motion, *files)
    return (*needed, *either(features.screen_motion, "film/screen_motion.cl"))


def _corners_move(features: Features) -> bool:
    """Whether shading asks for rows of vertices, of meshes that deform."""
    return features.motion.vertices and (features.geometry.normals or features.geometry.tangents)


def _passing(features: Features) -> str:
    """Return the step that tells which light passes."""
    if features.shadow_media:
        return "media"
    return "surfaces" if features.materials.null_surfaces else "opaque"


def _spectrum_read(features: Features) -> tuple[str, ...]:
    """The look-up of spectra, and in spectral mode how the camera draws wavelengths."""
    read = f"spectra/{features.spectra.mode}.cl#read"
    step = "density" if features.spectra.tabulated_density else "visible"
    return (read, *when(features.spectra.spectral, f"spectra/wavelengths.cl#{step}"))


def virtual_files(features: Features, layout: str) -> dict[str, tuple[str, ...]]:
    """Return the files that stand for each name in CHOICES."""
    return {name: choose(features, layout) for name, choose in CHOICES.items()}


def material_files(features: Features, cls: type[Scatterer]) -> dict[str, tuple[str, ...]]:
    """Return the files that stand for each name in MATERIAL_CHOICES."""
    return {name: choose(features, cls) for name, choose in MATERIAL_CHOICES.items()}
