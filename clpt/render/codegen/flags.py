"""Flags: the macros by which kernels ask what a scene has, each with its condition.

A flag that holds is 1. One that does not hold is not defined: `#if` takes it for 0, and a text has
no line for what its scene has not. Numbers and names are defined as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from clpt.render.contract.features import Features
from clpt.render.contract.parameter_words import RERADIATION_STEP
from clpt.render.contract.texture_records import IMAGES
from clpt.scene.integrators import IDS, LAYERS
from clpt.scene.materials import Material
from clpt.scene.params import device_params

Defines = dict[str, str | int]


def fluoresces(features: Features, cls: type[Material]) -> bool:
    """Whether light may leave a material at another wavelength than it came."""
    return cls.fluoresces and features.mode == "spectral"


def ends_light_paths(features: Features, cls: type[Material]) -> bool:
    """Whether a material does not do to light that comes the other way what it does to this."""
    return not cls.reversible or fluoresces(features, cls)


def gathers_photons(features: Features, cls: type[Material]) -> bool:
    """Whether paths from the camera are merged with photons at a material."""
    return not (cls.delta or cls.is_null or ends_light_paths(features, cls))


def filters_at_random(features: Features, cls: type[Material]) -> bool:
    """Whether a random texel stands for some parameter of a material."""
    images = {(kind, "reflectance") for kind in IMAGES}
    if features.channel or images.isdisjoint(features.texture_roles):
        return False
    sources, declared = features.sources_of(cls.kind), device_params(cls)
    return any(p.linear and "texture" in sources.get(n, ()) for n, p in declared.items())


def _layer_place(name: str) -> Callable[[Features], int | bool]:
    """The first word of a layer, False where there is none."""
    return lambda features: features.layer_places.get(name, False)


# name: its value, of a scene's features
SCENE: dict[str, Callable[[Features], str | int]] = {
    "BSDF_COUNT": lambda f: len(f.materials),
    "USES_NORMALS": lambda f: f.normals,
    "USES_UVS": lambda f: f.uvs,
    "USES_TANGENTS": lambda f: f.tangents,
    "USES_ATTRIBUTES": lambda f: f.attributes,
    "USES_ANALYTIC": lambda f: bool(f.analytic),
    "USES_INSTANCES": lambda f: f.instances,
    "USES_NULL_SURFACES": lambda f: f.null_surfaces,
    "USES_ABSORPTION": lambda f: f.absorption,
    "USES_DISPERSION": lambda f: f.dispersion and f.mode == "spectral",
    "USES_FLUORESCENCE": lambda f: any(fluoresces(f, cls) for cls in f.leaves),
    "USES_BANDS": lambda f: f.bands,
    "USES_ALPHA": lambda f: f.alpha,
    "USES_INFINITE": lambda f: f.infinite,
    "USES_HEMISPHERE": lambda f: f.infinite or f.light_tree or (f.weighed and f.light_paths),
    "USES_LIGHTS": lambda f: bool(f.lights),
    "USES_VISIBLE_LIGHTS": lambda f: f.shows_lights,
    "FEW_LIGHTS": lambda f: not f.many_lights,
    "LIGHT_PATHS": lambda f: f.light_paths,
    "WEIGHS_LIGHT_PATHS": lambda f: f.weighed,
    "JOINS_CAMERA": lambda f: f.joined,
    "MERGES": lambda f: f.merged,
    "USES_GUIDE": lambda f: f.guided,
    "AIMS_LIGHT_PATHS": lambda f: f.aimed,
    "CAMERA_DISPERSES": lambda f: f.glass_lens,
    "FILTER_BOX": lambda f: f.filter == "box",
    "FILTER_TAPS": lambda f: f.filter_taps,
    "FILTER_REACH": lambda f: f.filter_reach,
    "FILTER_PROFILE": lambda f: f.filter_profile,
    "FILM_GROUP": lambda f: f.weighed and f.film_group,
    "FILM_WORDS": lambda f: f.weighed and f.film_words,
    "FILM_WEIGHTS": lambda f: f.film_weights,
    "USES_LAYERS": lambda f: bool(f.layers),
    "LAYER_FIRST": lambda f: any(not LAYERS[name].denoising for name in f.layers),
    "LAYER_DENOISING": lambda f: any(LAYERS[name].denoising for name in f.layers),
    **{f"LAYER_{name.upper()}": _layer_place(name) for name in LAYERS},
    "CHANNEL": lambda f: bool(f.channel) and f"CHANNEL_{f.channel.upper()}",
    "CHANNEL_IS_ID": lambda f: f.channel in IDS,
    "SPECTRA_SIZE": lambda f: f.spectra_size,
    "SPECTRA_STEP": lambda f: f"{f.spectra_step}f",
    "RERADIATION_STEP": lambda f: RERADIATION_STEP,
}

# likewise, of the features and the kind of material that a program shades
MATERIAL: dict[str, Callable[[Features, type[Material]], str | int]] = {
    "BSDF_KIND": lambda f, cls: f.leaves.index(cls),
    "BSDF_DELTA": lambda f, cls: cls.delta,
    "BSDF_TRANSMITS": lambda f, cls: int(cls.kind in f.transmitting),  # kernels calculate with it
    "BSDF_SHINES": lambda f, cls: cls.kind in f.shining,
    "BSDF_ABSORBS": lambda f, cls: cls.absorbs,
    "BSDF_CHROMATIC": lambda f, cls: cls.chromatic,
    "BSDF_FLUORESCES": fluoresces,
    "BSDF_ENDS_LIGHT_PATHS": lambda f, cls: f.weighed and ends_light_paths(f, cls),
    "BSDF_MERGES": lambda f, cls: f.merged and gathers_photons(f, cls),
    "BSDF_GUIDED": lambda f, cls: f.guided and cls.guided,
    "BSDF_IS_NULL": lambda f, cls: cls.is_null and f.null_surfaces,
    "STOCHASTIC_FILTERING": filters_at_random,
    "USES_CHOICE": lambda f, cls: cls.uses_lobe_sample or cls.fluoresces or f.many_lights,
}


def defines(table: Mapping[str, Callable[..., str | int]], *given: Any) -> Defines:
    """Return the macros of SCENE for its features, or of MATERIAL for features and a class."""
    values = {name: value(*given) for name, value in table.items()}
    return {
        name: int(value) if isinstance(value, bool) else value
        for name, value in values.items()
        if value is not False
    }
