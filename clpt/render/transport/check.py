"""Rules for scenes whose integrator has light paths alone."""

from __future__ import annotations

from typing import NoReturn

from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.render.geometry.find import assembled
from clpt.render.media import light_media
from clpt.render.records.tables import LoweringCache
from clpt.render.scene_index import SceneIndex
from clpt.scene import Scene
from clpt.scene.cameras import CONNECTED
from clpt.scene.materials import parts
from clpt.scene.media import Medium
from clpt.scene.shapes import Shape


def check_light_paths(scene: Scene, shapes_: list[Shape]) -> None:
    """Raise SceneError for a directional_area light, or parts that particle_tracer refuses."""
    if not scene.integrator.from_lights_alone:
        for shape in shapes_:
            if shape.emission is not None and shape.emission.only_light_paths:
                raise SceneError(
                    "only the integrator particle_tracer finds a directional_area light, "
                    f"not {scene.integrator.kind}",
                    where=shapes.where(shape),
                )
        return
    spectral = scene.film.mode == "spectral"
    if not scene.camera.connects:
        _refuse(f"the cameras {CONNECTED}, not {scene.camera.kind}", "camera")
    if scene.camera.rolls:
        _refuse("a shutter without readout", "camera.shutter.readout")
    if scene.film.alpha:
        _refuse("a film without alpha", "film.alpha")
    if spectral and scene.camera.dispersive_glasses:
        _refuse("a lens whose glass does not disperse", "camera.glass")
    for i, light in enumerate(scene.lights):
        if light.reach == "placed" and not light.falloff:
            _refuse("a point light whose irradiance falls with distance", f"lights[{i}]")
    for shape in shapes_:
        _check_surface(shape, spectral)


def check_lit_media(scene: Scene, cache: LoweringCache) -> None:
    """Raise SceneError if the medium around a light is unknown to paths from lights."""
    index = SceneIndex.of(scene)
    if not (index.light_paths and index.has_media):
        return
    geometry = assembled(index, cache)
    try:
        light_media.around(index, geometry, geometry.bounding_sphere(), cache)
    except light_media.Unknown as reason:
        message = f"particle_tracer has no light paths: {reason}"
        raise SceneError(message, where=reason.where or "integrator") from None


def _check_surface(shape: Shape, spectral: bool) -> None:
    """Raise SceneError for materials and media that paths from lights cannot cross."""
    materials = list(parts(shape.material))
    if spectral and any(part.fluoresces for part in materials):
        _refuse("materials that keep the wavelength", shapes.where(shape))
    if spectral and any(_gives_other_light(medium) for medium in (shape.interior, shape.exterior)):
        _refuse("media that keep the wavelength", shapes.where(shape))
    if any(part.no_back for part in materials):
        _refuse("materials that are reciprocal, which hair is not", shapes.where(shape))


def _refuse(needed: str, where: str) -> NoReturn:
    raise SceneError(f"particle_tracer needs {needed}", where=where)


def _gives_other_light(medium: Medium | None) -> bool:
    phases = () if medium is None else medium.collisions(True)
    return any(leaf.fluoresces for phase in phases for leaf in phase.leaves)
