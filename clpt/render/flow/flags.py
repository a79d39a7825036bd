"""Flags: macros that tell kernels the features of a scene and of a material.

A true flag is 1. A false flag is not defined: `#if` takes it for 0. `assemble` decides each `#if`,
so that a text has no line for features that its scene does not use. Numbers and names are defined
as they are.
"""

from __future__ import annotations

from collections.abc import Callable

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


def asks_chance(features: Features, cls: type[Scatterer]) -> bool:
    """Whether light paths need the probability that a light tree chooses their light here."""
    glossy = features.transport.balanced and features.lights.gloss > 0
    return glossy and not is_null(features, cls)


def between_bodies(features: Features, cls: type[Scatterer]) -> bool:
    """Whether the body outside of a material gives its outer index of refraction."""
    return features.media.bodies and cls.kind in BETWEEN_BODIES


BETWEEN_BODIES = ("dielectric", "rough_dielectric")  # kinds with an outer index of refraction

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
