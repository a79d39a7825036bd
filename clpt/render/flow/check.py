"""Checks of a whole scene; values of parameters are checked where each is declared."""

from __future__ import annotations

from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.geometry.instancing import distinct
from clpt.geometry.motion import Motions, at_rest
from clpt.geometry.motion import check as check_motion
from clpt.render.camera.encode import check_camera
from clpt.render.film.check import check_film
from clpt.render.geometry.check import check_instances, check_shapes
from clpt.render.lights.check import check_light
from clpt.render.materials.check import check_material
from clpt.render.media.bodies import check_bodies
from clpt.render.records.lowering_cache import LoweringCache
from clpt.render.transport.check import check_light_paths, check_lit_media
from clpt.scene import Scene, check_parts, checked_seed
from clpt.scene.integrators import Film
from clpt.scene.lights import with_emission
from clpt.scene.shapes import Instance, Shape
from clpt.scene.textures import check_textures


def check(scene: Scene) -> None:
    """Raise SceneError for a scene that cannot be rendered, whatever the device.

    A scene that passes is refused later only for contents of files, and for sizes.
    """
    check_at_rest(at_rest(scene), LoweringCache())


def check_at_rest(scene: Scene, cache: LoweringCache) -> None:
    """Raise SceneError as `check` does, for a scene that is `at_rest`; cache: of its analysis."""
    check_parts(scene)
    checked_seed(scene.seed)
    shapes_ = list(distinct(scene.shapes))
    check_film(scene)
    check_camera(scene.camera, scene.film)
    for light in scene.lights:
        check_light(light)
    check_shapes(shapes_)
    check_instances(scene.shapes)
    _check_surfaces(shapes_, scene.film)
    check_light_paths(scene, shapes_)
    check_motion(scene, Motions.of(scene))
    check_bodies([*shapes_, *(s for s in scene.shapes if isinstance(s, Instance))])
    if scene.integrator.from_lights_alone:
        check_lit_media(scene, cache)


def _check_surfaces(shapes_: list[Shape], film: Film) -> None:
    """Raise SceneError for materials and lights of shapes; each is checked once."""
    seen: set[int] = set()
    for shape in shapes_:
        try:
            if id(shape.material) not in seen:
                check_material(shape.material, film)
            if shape.emission is not None and id(shape.emission) not in seen:
                check_textures(shape.emission)
                with_emission(shape.emission, area=1.0)  # of any area it is 0, or it is not
        except SceneError as error:
            raise SceneError(str(error), where=shapes.where(shape)) from None
        seen |= {id(shape.material), id(shape.emission)}
