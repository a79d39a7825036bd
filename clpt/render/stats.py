"""Figures of a renderer: numbers of things, bytes, seconds."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.flow.flags import ends_light_paths
from clpt.render.records import Features
from clpt.render.wavefront.wavefront import Wavefront


@dataclass(frozen=True)
class RenderStats:
    """Figures of a renderer, for people and reports; `dataclasses.asdict` makes them JSON.

    triangles: on the device; triangles_instanced: as many as instances show; analytic: shapes that
    are intersected without triangles; lights: rows to choose from; integrator: its kind, and
    light_paths: for each sample, with the reason where clpt chose them, else ""; light_paths_end:
    where they end, so that what follows is left to the camera's paths: kinds of materials, and
    "normal maps"; photons: most of a pass; photon_radius: of the first pass's disks [m]. tables,
    trees: bytes by name; photon_memory: bytes of the photons; memory: of all buffers on the device.
    programs: built before the first sample; programs_cached: those of them that were in clpt's
    cache (a driver does not tell what it takes from its own). seconds: of `lower`, `trees` and
    `programs`; from the start to `ready`, when samples may begin, and to
    `first_sample`, after the first sample.
    """

    triangles: int
    triangles_instanced: int
    instances: int
    analytic: int
    lights: int
    integrator: str
    light_paths: float
    reason: str
    light_paths_end: tuple[str, ...]
    photons: int
    photon_radius: float
    photon_memory: int
    tables: dict[str, int]
    trees: dict[str, int]
    memory: int
    programs: int
    programs_cached: int
    seconds: dict[str, float]


def collect(
    wavefront: Wavefront, programs: int, cached: int, seconds: dict[str, float]
) -> RenderStats:
    """Return the figures of a render's wavefront.

    programs, cached: how many were built, and how many of them came from clpt's cache.
    """
    scene, photons = wavefront.scene, wavefront.photons
    lowered, instances = scene.lowered, scene.lowered.instances
    of_world = len(lowered.faces) - sum(instances.triangles)
    instanced = sum(instances.triangles[prototype] for prototype in instances.prototypes.tolist())
    arrays = {**lowered.tables, "vertices": lowered.vertices, "faces": lowered.faces}
    return RenderStats(
        triangles=len(lowered.faces),
        triangles_instanced=of_world + instanced,
        instances=len(instances.rows),
        analytic=len(lowered.boxes),
        lights=int(lowered.settings["light_count"]),
        integrator=lowered.integrator.kind,
        light_paths=float(lowered.settings["light_paths"]),
        reason=lowered.reason,
        light_paths_end=_light_paths_end(lowered.features),
        photons=photons.places if photons else 0,
        photon_radius=float(lowered.settings["radius"]),
        photon_memory=photons.bytes if photons else 0,
        # A table that the scene does not need has a single word.
        tables={name: array.nbytes for name, array in arrays.items() if array.size > 1},
        trees=scene.trees.bytes,
        memory=scene.buffers.used + sum(scene.trees.bytes.values()),
        programs=programs,
        programs_cached=cached,
        seconds=seconds,
    )


def _light_paths_end(features: Features) -> tuple[str, ...]:
    """Return the kinds of materials where paths from lights end that are weighed."""
    if not features.transport.balanced:
        return ()
    kinds = [cls.kind for cls in features.materials.leaves if ends_light_paths(features, cls)]
    return (*kinds, *["normal maps"] * features.materials.normal_mapped)
