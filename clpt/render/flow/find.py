"""Analysis: facts about a scene and decisions that follow, before anything becomes words."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.geometry.lamps import plainly_lit
from clpt.geometry.motion import at_rest
from clpt.render.flow.check import check_at_rest
from clpt.render.geometry import surroundings
from clpt.render.geometry.find import Geometry, assembled
from clpt.render.geometry.surroundings import (
    bodies_around,
    bodies_at,
    boundaries,
    camera_origin,
    contested,
    index_around,
    media_around,
    media_at,
    stands_still,
    warnings_of,
)
from clpt.render.lights.aims import aims
from clpt.render.lights.find import Sources, sources_of
from clpt.render.lights.openings import Openings, openings_around
from clpt.render.media.bodies import escape_lamps, matter_of, sealed_media
from clpt.render.media.light_media import NOWHERE, LightMedia, light_media
from clpt.render.records.tables import LoweringCache
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.find import Look
from clpt.render.transport.hard_light import Lit, decided
from clpt.scene import Scene
from clpt.scene.integrators import Integrator
from clpt.scene.media import Medium


@dataclass(frozen=True)
class Analysis:
    """The facts about a scene that lowering encodes.

    index: with the chosen integrator; reason: of the choice, "" without a choice; sphere: centre
    and radius of a sphere around the scene [m]; sources: emission of its lights; sealed: media that
    rays to lights cannot leave; light_media: media around lights; around: the media, or the matter
    of bodies, at the camera; at_camera: the index of refraction there and its slope, 1 and 0 where
    light is not sorted by time; aims (k, 5): spheres that paths aim at, see `aims` and
    `escape_lamps`; openings: of a room, for infinite lights; warnings: of media.
    """

    index: SceneIndex
    reason: str
    geometry: Geometry
    sphere: tuple[NDArray[np.float64], float]
    sources: Sources
    sealed: frozenset[Medium]
    light_media: LightMedia
    around: tuple[Any, ...]
    at_camera: tuple[float, float]
    aims: NDArray[np.float32]
    openings: Openings
    warnings: tuple[str, ...]


def analyse(
    scene: Scene,
    cache: LoweringCache,
    former: Integrator | None = None,
    *,
    lit_before: bool | None = None,
    openings: Openings | None = None,
    shared: bool = False,
) -> Analysis:
    """Return the facts about a scene; cache: with results of the analysis before.

    former, lit_before, openings: the integrator, whether light paths were ghosts of a lens, and the
    openings before an edit, which stay as they are; shared: see `SceneIndex`.

    Raises SceneError for an invalid scene; it names the shape, light or material.
    """
    check_at_rest(scene := at_rest(scene), cache)
    scene = plainly_lit(scene)
    index = replace(SceneIndex.of(scene, shared), lit_before=lit_before)
    geometry, look = assembled(index, cache), Look.of(scene.film, cache)
    sphere = geometry.bounding_sphere()
    sources = sources_of(index, geometry, sphere[1], look)
    index, lit = _media_at_lights(index, geometry, sources, sphere, cache)
    index, reason = decided(Lit(index, geometry, look, sources, sphere, lit.extinction), former)
    around, warnings = _at_the_camera(scene, index, cache)
    sealed = sealed_media(index, cache) if index.media else frozenset()
    return Analysis(
        index=index,
        reason=reason,
        geometry=geometry,
        sphere=sphere,
        sources=sources,
        sealed=sealed,
        light_media=lit,
        around=around,
        openings=openings_around(index, geometry, cache) if openings is None else openings,
        at_camera=index_around(scene, cache) if index.timed else (1.0, 0.0),
        aims=_aims(index, geometry, sphere[1], sealed, cache, former is not None),
        warnings=(*warnings, *surroundings.warnings_of_holes(index, cache)),
    )


def _aims(
    index: SceneIndex,
    geometry: Geometry,
    radius: float,
    sealed: frozenset[Medium],
    cache: LoweringCache,
    edited: bool,
) -> NDArray[np.float32]:
    """Return the spheres that light paths, or rays that leave sealed media, aim at."""
    aimed = aims(index, geometry, radius, edited)
    return aimed if len(aimed) else escape_lamps(index, sealed, cache)


def _media_at_lights(
    index: SceneIndex,
    geometry: Geometry,
    sources: Sources,
    sphere: tuple[NDArray[np.float64], float],
    cache: LoweringCache,
) -> tuple[SceneIndex, LightMedia]:
    """Return the index with whether paths can start at lights in media, and the lights' media."""
    if not index.has_insides or not index.may_have_light_paths:
        return index, NOWHERE
    media = light_media(index, geometry, sources, sphere, cache)
    return replace(index, lit_media=media.refusal), media


def _at_the_camera(
    scene: Scene, index: SceneIndex, cache: LoweringCache
) -> tuple[tuple[Any, ...], list[str]]:
    """Return the media or the bodies at the camera, and warnings."""
    around: tuple[Any, ...] = ()
    if index.nested:
        around = bodies_around(scene, matter_of, cache)
        warnings = contested(scene.shapes, matter_of, cache)
    else:
        around = media_around(scene, cache) if index.has_insides else ()
        warnings = warnings_of(around)
    if index.motions and index.has_media and scene.camera.medium is None:
        warnings += _passed_through(index, cache)
    return around, warnings


def _passed_through(index: SceneIndex, cache: LoweringCache) -> list[str]:
    """Return a warning if the camera enters other media while the shutter is open."""
    bounding = boundaries(index.listed, matter_of if index.nested else None)
    if index.motions.camera is None and stands_still(bounding):
        return []
    entered: list[tuple[Any, ...]] = []
    for time in index.motions.looks():
        origin = camera_origin(index.camera, index.film, time)
        entered.append(
            bodies_at(bounding, matter_of, origin, time, cache)
            if index.nested
            else media_at(bounding, origin, time, cache)
        )
    if all(media == entered[0] for media in entered):
        return []
    return [
        "camera: it comes into another medium while the shutter is open; all its paths begin in "
        "what is around it when that opens"
    ]
