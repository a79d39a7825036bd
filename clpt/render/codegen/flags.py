"""Flags: the macros by which kernels ask what a scene has, each with its condition.

A flag that holds is 1. One that does not hold is not defined: `#if` takes it for 0. `assemble`
decides each `#if`, so that a text has no line for what its scene has not. Numbers and names are
defined as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from clpt.render.contract.camera_records import WEIGHTED
from clpt.render.contract.features import Features
from clpt.render.contract.light_records import VOLUME
from clpt.render.contract.parameter_words import RERADIATION_STEP
from clpt.render.contract.texture_records import IMAGES
from clpt.scene.layers import LAYERS, MATTE_SLOTS, WORDS
from clpt.scene.params import device_params
from clpt.scene.scatterer import Scatterer

Defines = dict[str, str | int]


def fluoresces(features: Features, cls: type[Scatterer]) -> bool:
    """Whether light may leave a material at another wavelength than it came."""
    return cls.fluoresces and features.mode == "spectral"


def ends_light_paths(features: Features, cls: type[Scatterer]) -> bool:
    """Whether a material does not do to light that comes the other way what it does to this."""
    return not cls.reversible or fluoresces(features, cls)


def gathers_photons(features: Features, cls: type[Scatterer]) -> bool:
    """Whether paths from the camera are merged with photons at a material."""
    return not (cls.delta or cls.is_null or cls.is_phase or ends_light_paths(features, cls))


def phase_varies(features: Features, cls: type[Scatterer]) -> bool:
    """Whether a phase function of a scene differs between wavelengths."""
    found = features.sources_of(cls.kind).values()
    varies = cls.is_phase and cls.chromatic
    return varies and any(source not in ("grey", "row") for one in found for source in one)


def filters_at_random(features: Features, cls: type[Scatterer]) -> bool:
    """Whether a random texel stands for some parameter of a material."""
    images = {(kind, "reflectance") for kind in IMAGES}
    if images.isdisjoint(features.texture_roles):
        return False
    sources, declared = features.sources_of(cls.kind), device_params(cls)
    return any(p.linear and "texture" in sources.get(n, ()) for n, p in declared.items())


def has_lobe(features: Features, cls: type[Scatterer], name: str) -> bool:
    """Whether a material of the scene has a lobe that a parameter of 0 leaves out."""
    declared, none = device_params(cls), frozenset({"none"})
    return name in declared and features.sources_of(cls.kind).get(name, none) != none


def _layer_place(name: str) -> Callable[[Features], int]:
    """The first word of a layer, 0 where there is none: kernels also ask for it by `if`."""
    return lambda features: features.layer_places.get(name, 0)


def _number(name: str, names: tuple[str, ...]) -> int:
    """1 more than where a name stands, 0 where it does not."""
    return names.index(name) + 1 if name in names else 0


def _first_for_denoisers(features: Features) -> int:
    """The first word of the layers for denoisers, which come last; 0 where there is none."""
    places = features.layer_places
    return min((places[name] for name in places if LAYERS[name].denoising), default=0)


def is_null(features: Features, cls: type[Scatterer]) -> bool:
    """Whether a material is none: paths cross it as if nothing were there."""
    return cls.is_null and features.null_surfaces


def is_guided(features: Features, cls: type[Scatterer]) -> bool:
    """Whether a guide helps to choose directions at a material."""
    return features.guided and cls.guided


def names_surfaces(features: Features) -> bool:
    """Whether some layer tells which surface is seen."""
    named = any(LAYERS[name].form in ("id", "matte") for name in features.layers)
    return features.screen_motion or named


def between_bodies(features: Features, cls: type[Scatterer]) -> bool:
    """Whether the index outside of a material is that of a body there."""
    return features.bodies and cls.kind in BETWEEN_BODIES


BETWEEN_BODIES = ("dielectric", "rough_dielectric")  # their index outside is that of a body there

# name: its value, of a scene's features
SCENE: dict[str, Callable[[Features], str | int]] = {
    "BSDF_COUNT": lambda f: len(f.materials),
    "USES_NORMALS": lambda f: f.normals,
    "USES_UVS": lambda f: f.uvs,
    "USES_TANGENTS": lambda f: f.tangents,
    "VERTEX_TANGENTS": lambda f: (f.tangents and f.vertex_tangents) or False,
    "USES_MIPS": lambda f: f.mips,
    "USES_ATTRIBUTES": lambda f: f.attributes,
    "USES_ANALYTIC": lambda f: bool(f.analytic),
    "USES_INSTANCES": lambda f: f.instances,
    "ONLY_INSTANCES": lambda f: f.only_instances,
    "FEW_INSTANCES": lambda f: f.few_instances or False,
    "USES_MOTION": lambda f: bool(f.moving),
    "MOVES_INSTANCES": lambda f: "instances" in f.moving,
    "MOVES_VERTICES": lambda f: "vertices" in f.moving,
    "MOVES_SPHERES": lambda f: "spheres" in f.moving,
    "MOVES_SHAPES": lambda f: "shapes" in f.moving,
    "MOTION_SCALES": lambda f: f.motion_scales,
    "MOTION_ROW": lambda f: bool(f.moving) and f.motion_row,
    "USES_NULL_SURFACES": lambda f: f.null_surfaces,
    "FREE_PANES": lambda f: f.free_panes,
    "USES_ABSORPTION": lambda f: f.absorption or f.media,
    "USES_MEDIA": lambda f: f.media,
    "MEDIA_EMIT": lambda f: f.emissive_media,
    "GRIDS_EMIT": lambda f: f.emissive_grids,
    "GRIDS_GLOW": lambda f: f.hot_grids,
    "BRICK_LIGHTS": lambda f: VOLUME in f.lights,
    "USES_GRIDS": lambda f: f.grids,
    "GRIDS_TINTED": lambda f: f.tinted_grids,
    "USES_DYES": lambda f: f.dyed_media,
    "GRIDS_COLOURED": lambda f: f.coloured_grids,
    "GRIDS_MIXED": lambda f: f.mixed_grids or False,
    "USES_BYTES": lambda f: f.byte_grids,
    "USES_BODIES": lambda f: f.bodies,
    "SHADOW_MEDIA": lambda f: f.shadow_media,
    "LIGHT_MEDIA": lambda f: f.light_media,
    "MEDIUM_AIMS": lambda f: f.medium_aims,
    "SEALED_MEDIA": lambda f: f.sealed_media,
    "USES_DISPERSION": lambda f: f.dispersion and f.mode == "spectral",
    "USES_RATIO": lambda f: (
        f.chromatic_media
        or (f.mode == "spectral" and (f.dispersion or any(phase_varies(f, c) for c in f.leaves)))
    ),
    "USES_FLUORESCENCE": lambda f: any(fluoresces(f, cls) for cls in f.leaves),
    "USES_BANDS": lambda f: f.bands,
    "USES_ALPHA": lambda f: f.alpha,
    "USES_INFINITE": lambda f: f.infinite,
    "USES_HEMISPHERE": lambda f: f.infinite or f.light_tree or (f.balanced and f.light_paths),
    "USES_LIGHTS": lambda f: bool(f.lights),
    "USES_VISIBLE_LIGHTS": lambda f: f.shows_lights,
    "FEW_LIGHTS": lambda f: not f.many_lights,
    "LIGHT_PATHS": lambda f: f.light_paths,
    "WEIGHS_LIGHT_PATHS": lambda f: f.balanced,
    "SUMS_LIGHT_PATHS": lambda f: f.weighed,
    "JOINS_CAMERA": lambda f: f.joined,
    "MERGES": lambda f: f.merged,
    "USES_GUIDE": lambda f: f.guided,
    "AIMS_LIGHT_PATHS": lambda f: f.aimed,
    "CAMERA_DISPERSES": lambda f: f.glass_lens,
    "CAMERA_WEIGHS": lambda f: f.camera in WEIGHTED,
    "LENS_LOSSES": lambda f: f.lens_losses,
    "LENS_GHOSTS": lambda f: f.lens_ghosts,
    "LIT_GHOSTS": lambda f: f.lit_ghosts,
    "FILTER_BOX": lambda f: f.filter == "box",
    "FILTER_TAPS": lambda f: f.filter_taps,
    "FILTER_REACH": lambda f: f.filter_reach,
    "FILTER_PROFILE": lambda f: f.filter_profile,
    "FILM_GROUP": lambda f: f.weighed and f.film_group,
    "FILM_WORDS": lambda f: f.weighed and f.film_words,
    "FILM_WEIGHTS": lambda f: f.film_weights,
    "USES_LAYERS": lambda f: f.layer_words > 0,
    "SCREEN_MOTION": lambda f: f.screen_motion,
    "MATTES": lambda f: len(f.mattes) or False,
    "MATTE_SLOTS": lambda f: bool(f.mattes) and MATTE_SLOTS,
    "MATTE_OBJECT": lambda f: _number("crypto_object", f.mattes),
    "MATTE_MATERIAL": lambda f: _number("crypto_material", f.mattes),
    "MATERIAL_NUMBERS": lambda f: f.material_numbers or False,
    "LIGHT_LAYERS": lambda f: f.light_pictures or False,
    "LIGHT_LAYER_DIRECT": lambda f: _number("direct", f.light_layers),
    "LIGHT_LAYER_INDIRECT": lambda f: _number("indirect", f.light_layers),
    "LIGHT_LAYER_GROUPS": lambda f: _number("light_groups", f.light_layers),
    "LIGHT_GROUPS": lambda f: f.light_groups > 0 and f.light_group_row,
    "PIXEL_LAYER_WORDS": lambda f: f.layer_words or False,
    "LAYER_DENOISING": lambda f: _first_for_denoisers(f),
    **{f"LAYER_{n.upper()}": _layer_place(n) for n in LAYERS if LAYERS[n].form in WORDS},
    "SPECTRA_SIZE": lambda f: f.spectra_size,
    "SPECTRA_STEP": lambda f: f"{f.spectra_step}f",
    "RERADIATION_STEP": lambda f: RERADIATION_STEP,
}

# likewise, of the features and the kind of material that a program shades
MATERIAL: dict[str, Callable[[Features, type[Scatterer]], str | int]] = {
    "BSDF_KIND": lambda f, cls: f.leaves.index(cls),
    "BSDF_DELTA": lambda f, cls: cls.delta,
    "BSDF_TRANSMITS": lambda f, cls: int(cls.kind in f.transmitting),  # kernels calculate with it
    "BSDF_SHINES": lambda f, cls: cls.kind in f.shining,
    "BSDF_ABSORBS": lambda f, cls: cls.absorbs,
    "BSDF_CHROMATIC": lambda f, cls: phase_varies(f, cls) if cls.is_phase else cls.chromatic,
    "BSDF_FLUORESCES": fluoresces,
    "BSDF_ENDS_LIGHT_PATHS": lambda f, cls: f.balanced and ends_light_paths(f, cls),
    "BSDF_MERGES": lambda f, cls: f.merged and gathers_photons(f, cls),
    "BSDF_GUIDED": is_guided,
    "BSDF_IS_PHASE": lambda f, cls: cls.is_phase,
    "BSDF_IS_NULL": is_null,
    "BSDF_IS_PANE": lambda f, cls: cls.is_pane and f.free_panes,
    "STOCHASTIC_FILTERING": filters_at_random,
    "USES_CHOICE": lambda f, cls: cls.uses_lobe_sample or cls.fluoresces or f.many_lights,
}


def defines(table: Mapping[str, Callable[..., str | int]], *given: Any) -> Defines:
    """Return the macros of SCENE for its features, or of MATERIAL for features and a class.

    Those of a material are 0 where they do not hold: kernels also ask for them by `if`.
    """
    values = {name: value(*given) for name, value in table.items()}
    return {
        name: int(value) if isinstance(value, bool) else value
        for name, value in values.items()
        if value is not False or table is MATERIAL
    }
