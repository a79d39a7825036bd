"""Choices: the virtual files that only choose which files of the kernels folder a scene needs."""

from __future__ import annotations

from collections.abc import Callable

from clpt import bvh
from clpt.render.contract.features import Features

Files = tuple[str, ...]


def when(holds: object, *files: str) -> Files:
    """Return the files where a condition holds, else none."""
    return files if holds else ()


def either(holds: object, file: str) -> Files:
    """Return a file where a condition holds, else its twin that does nothing, `<name>_none.cl`."""
    return (file if holds else f"{file.removesuffix('.cl')}_none.cl",)


# name: the files that stand for it, for a scene's features and the layout of its triangles
CHOICES: dict[str, Callable[[Features, str], Files]] = {
    "generated/spectrum.cl": lambda f, _: (f"spectrum/{f.spectra.mode}.cl",),
    "generated/spectrum_read.cl": lambda f, _: _spectrum_read(f),
    "generated/sampler.cl": lambda f, _: (
        f"sampler/{f.transport.sampler}.cl",
        f"path/pixel_sampler{'_z' * (f.transport.sampler == 'zsobol')}.cl",
    ),
    "generated/exposure.cl": lambda f, _: (
        "film/splatting.cl" if f.film_weights else "film/exposure.cl",
    ),
    "generated/bands.cl": lambda f, _: when(f.film.bands, "film/bands.cl"),
    "generated/integrator.cl": lambda f, _: (f"integrator/{f.transport.integrator}.cl",),
    "generated/merging.cl": lambda f, _: either(f.transport.merged, "merging/area.cl"),
    "generated/cone.cl": lambda f, _: either(f.textures.mips, "path/cone.cl"),
    "generated/ghosts.cl": lambda f, _: either(f.transport.lit_ghosts, "path/ghosts.cl"),
    "generated/first_ray.cl": lambda f, _: (f"path/first_ray{'_weighted' * f.camera.weighs}.cl",),
    "generated/sky.cl": lambda f, _: (
        *either(f.lights.infinite, "path/sky.cl"),
        *either(f.lights.infinite and f.film.layers.lights, "path/sky_layers.cl"),
    ),
    "generated/join_light.cl": lambda f, _: either(f.shows_lights, "lighting/join_light.cl"),
    "generated/guide.cl": lambda f, _: when(f.transport.guided, "guiding/guide.cl"),
    "generated/gather.cl": lambda f, _: when(
        f.transport.merged and not f.transport.light_paths,
        "generated/photon.cl",
        "merging/gather.cl",
    ),
    "generated/layer_sums.cl": lambda f, _: (
        *either(f.film.layers.first_samples, "film/layers.cl"),
        *_screen_motion(f),
    ),
    "generated/layers.cl": lambda f, _: when(
        f.film.layers.first_samples,
        "generated/layer_args.cl",
        *_screen_motion(f),
        "path/layers.cl",
    ),
    "generated/light_layers.cl": lambda f, _: when(
        f.film.layers.lights,
        "generated/light_layer_args.cl",
        "generated/sampler.cl",
        "film/light_layers.cl",
    ),
    "generated/flight_layers.cl": lambda f, _: when(
        f.film.layers.lights and f.media.emissive and not f.transport.light_paths,
        "film/light_layers.cl",
    ),
    "generated/rivals.cl": lambda f, _: when(
        f.transport.balanced,
        "generated/merging.cl",
        "interface/camera.cl",
        "generated/camera.cl",
        "film/connect.cl",
        "generated/connect.cl",
        "lighting/rivals.cl",
    ),
    "generated/medium.cl": lambda f, _: (
        *when(f.media.absorbing, "generated/medium_coefficients.cl", "media/medium.cl"),
        *when(f.media.dyed, "media/dye_flight.cl"),
        *when(f.media.grids.present, "media/medium_grid.cl"),
        *when(f.media.grids.emissive, "media/medium_grid_light.cl"),
        *when(f.media.bodies, "generated/body_index.cl"),
        *when(f.media.present, *either(f.media.bodies, "media/bodies.cl")),
    ),
    "generated/grid_flight.cl": lambda f, _: (
        *when(f.media.grids.emissive, "generated/lights.cl", "path/met_light.cl"),
        *when(f.media.grids.present, "media/grid_flight.cl"),
    ),
    "generated/light_medium.cl": lambda f, _: (
        ("generated/textures.cl", "generated/medium.cl")
        if f.light_media
        else ("media/light_medium_none.cl",)
    ),
    "generated/shading_frame.cl": lambda f, _: (
        ("generated/normal_map.cl", "path/shading_frame_mapped.cl")
        if f.materials.normal_mapped
        else ("path/shading_frame.cl",)
    ),
    "generated/transmittance.cl": lambda f, _: (f"tracing/transmittance{_passing(f)}.cl",),
    "generated/shadow_ray.cl": lambda f, _: (f"path/shadow_ray{'_media' * f.shadow_media}.cl",),
    "generated/trace.cl": lambda _, layout: (
        f"tracing/trace_{'lanes' if layout == 'brute' else 'one'}.cl",
    ),
    "generated/curve_others.cl": lambda f, _: (
        f"tracing/curve_others{'_none' * (f.geometry.analytic == ('curves',))}.cl",
    ),
    "generated/shape_traversal.cl": lambda f, layout: when(
        f.geometry.analytic, f"bvh/{bvh.shapes_layout(layout)}.cl", "bvh/shapes.cl"
    ),
    "generated/instances.cl": lambda f, _: when(f.geometry.instances, "tracing/instances.cl"),
    "generated/motion.cl": lambda f, _: (
        *either(f.motion.present, "tracing/motion.cl"),
        *when(f.motion.vertices or f.motion.spheres, "tracing/vertex_keys.cl"),
    ),
    "generated/keyed_layout.cl": lambda f, layout: when(
        f.motion.vertices and layout != "brute", f"bvh/{layout}_keyed.cl"
    ),
    "generated/instance_traversal.cl": lambda f, layout: when(
        f.geometry.instances,
        f"tracing/instances_{'few' if f.geometry.few_instances else layout}.cl",
        "tracing/trace_instances.cl",
    ),
}


def _screen_motion(features: Features) -> Files:
    """How what is seen moves across the film, where a layer tells it."""
    files = ("interface/camera.cl", "generated/camera.cl", "generated/screen.cl")
    needed = when(features.screen_motion, *files)
    return (*needed, *either(features.screen_motion, "path/screen_motion.cl"))


def _passing(features: Features) -> str:
    """How the name of what tells which light passes ends."""
    if features.shadow_media:
        return "_media"
    return "" if features.materials.null_surfaces else "_opaque"


def _spectrum_read(features: Features) -> Files:
    """The look-up of spectra, and in spectral mode how the camera draws wavelengths."""
    own = features.spectra
    drawn = f"spectrum/{'density' if own.tabulated_density else 'visible'}.cl"
    return (f"spectrum/{own.mode}_read.cl", *when(own.spectral, drawn))


def virtual_files(features: Features, layout: str) -> dict[str, Files]:
    """Return the files that stand for each name in CHOICES."""
    return {name: choose(features, layout) for name, choose in CHOICES.items()}
