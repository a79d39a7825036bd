"""Checks of a whole scene, and warnings of parts that are not rendered as the scene demands.

Values of parameters are checked where each is declared.
"""

from __future__ import annotations

import numpy as np

from clpt import spectra
from clpt.errors import SceneError
from clpt.geometry import shapes
from clpt.geometry.instancing import distinct
from clpt.geometry.motion import Motions, at_rest
from clpt.geometry.motion import check as check_motion
from clpt.render.camera import check_camera
from clpt.render.film.check import check_film
from clpt.render.film.colour import sensor
from clpt.render.geometry.check import check_instances, check_shapes
from clpt.render.lights.check import check_light
from clpt.render.materials.check import check_material
from clpt.render.media.bodies import check_bodies
from clpt.render.records.tables import LoweringCache
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.find import emissions
from clpt.render.transport import light_caches
from clpt.render.transport.check import check_light_paths, check_lit_media
from clpt.scene import Scene, check_parts, checked_seed
from clpt.scene import materials as mt
from clpt.scene.cameras import CONNECTED
from clpt.scene.integrators import DEEPEST, Film
from clpt.scene.lights import with_emission
from clpt.scene.params import params
from clpt.scene.roles import INDEX
from clpt.scene.shapes import Instance, Shape
from clpt.scene.textures import check_textures

DATA_END = 830.0  # nm, of the CIE's tables
FAINT = 0.05  # of a spectrum's largest value: an end below it is no step


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
    if scene.integrator.merging and scene.camera.rolls:
        message = "photons of a pass are all at one time, rows are not: use path"
        raise SceneError(message, where="camera.shutter.readout")
    for light in scene.lights:
        check_light(light)
    check_shapes(shapes_)
    check_instances(scene.shapes)
    _check_surfaces(shapes_, scene.film)
    check_light_paths(scene, shapes_)
    check_motion(scene.shapes, Motions.of(scene))
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


def warnings_of(index: SceneIndex) -> list[str]:
    """Return warnings of parts of a scene that are not rendered as the scene demands."""
    film, integrator = index.film, index.integrator
    warnings = list(index.warnings)
    if index.mode == "rgb" and index.camera.dispersive_glasses:
        warnings.append(f"{index.camera.kind}.glass: in RGB mode all wavelengths have one focus")
    if index.mode == "rgb" and any(map(_disperses, index.shapes)):
        warnings.append("in rgb mode glass does not disperse: ask for the spectral mode")
    if index.motions:
        warnings += _of_motion(index)
    if integrator.light_paths:
        warnings += _left_to_the_camera(index)
    if integrator.guiding and not index.lights_reach:
        warnings.append(f"{integrator.kind}.guiding: left aside, as {index.lit_media}")
    if integrator.reuse and not index.can_reuse:
        warnings.append(
            f"{integrator.kind}.reuse: left aside, because of motion, media, fluorescence, "
            "layers of light, a limit of noise, or a max_depth below 3"
        )
    depth, most = integrator.max_depth, light_caches.DEEPEST if index.merged else DEEPEST
    if depth > most:
        warnings.append(f"integrator.max_depth: {depth} counts as {most}, the longest path")
    if index.spectral and not film.bands and not _sees(film):
        warnings.append(
            f"film.sensor sees nothing from {film.lambda_min:g} to {film.lambda_max:g} nm, so the"
            " picture is black; ask for film.bands"
        )
    warnings += _ending_early(index)
    if not index.lights and next(emissions(index), None) is None:
        warnings.append("no light in the scene, so the picture is black: add one to `lights`")
    if film.mode == "rgb" and mt.Fluorescent in index.leaves:
        warnings.append("in rgb mode fluorescent paint has its colour under D65, at most white")
    if film.mode == "rgb" and any(medium.glows for medium in index.media):
        warnings.append("in rgb mode dyes in media only absorb: ask for the spectral mode")
    return warnings


def _disperses(shape: Shape) -> bool:
    """Whether a shape refracts wavelengths differently, in the spectral mode."""
    return any(
        param.role is INDEX and not isinstance(spectra.index(vars(part)[name]), spectra.Constant)
        for part in mt.parts(shape.material)
        if part.refracts
        for name, param in params(type(part)).items()
    )


def _ending_early(index: SceneIndex) -> list[str]:
    """Return a warning of lamps whose data end within the infrared of a film."""
    film = index.film
    if not index.spectral or film.lambda_max <= DATA_END:
        return []
    lambdas = np.arange(film.lambda_min, film.lambda_max + 0.5)
    ends = set()
    for spectrum in emissions(index):
        values = spectrum.sample(lambdas)
        lit = np.flatnonzero(values)
        if len(lit) and lit[-1] + 2 < len(lambdas) and values[lit[-1]] > FAINT * values.max():
            ends.add(float(lambdas[lit[-1]]))
    return [
        f"a lamp's spectrum ends at {end:g} nm, the film at {film.lambda_max:g} nm: it is dark "
        "beyond; give a temperature, or a table to there"
        for end in sorted(ends)
    ]


def _of_motion(index: SceneIndex) -> list[str]:
    """Return warnings of shapes that move while the grid of their medium stays."""
    warnings: list[str] = []
    for i in index.motions.shapes:
        shape = index.listed[i]
        media = (medium for s in shape.members for medium in (s.interior, s.exterior))
        if any(medium is not None and medium.lattice is not None for medium in media):
            warnings.append(
                f"{shapes.where(shape)}.motion: its boundary moves, the grid of its medium stays"
            )
    return warnings


def _left_to_the_camera(index: SceneIndex) -> list[str]:
    """Return warnings of light that only paths from the camera find."""
    camera, integrator = index.camera, index.integrator
    kind, warnings = integrator.kind, []
    if integrator.light_tracing and not index.joined:
        reason = f"a {camera.kind} camera cannot be joined to a point; {CONNECTED} can"
        if camera.connects:
            reason = f"its glass disperses; {CONNECTED} can, without such glass"
            if camera.rolls:
                reason = "its shutter opens row by row; without readout it can"
        name = "light_tracing" if kind == "vcm" else "light_paths"
        warnings.append(f"{kind}.{name}: left aside, as {reason}")
    if integrator.merging and not index.merged:
        reason = f"a path needs {light_caches.FIRST_STORED + 1} surfaces"
        if not index.lights_reach:
            reason = index.lit_media
        if index.shifts:
            reason = "what fluoresces gives light other wavelengths"
        warnings.append(f"{kind}.merging: left aside, as {reason}")
    if not index.lights_reach:
        warnings.append(f"{kind}.light_paths: left aside, as {index.lit_media}")
    if index.balanced:
        warnings += [
            f"{kind}.light_paths: none start at lights[{i}], whose light does not fall with "
            "distance"
            for i, light in enumerate(index.lights)
            if light.reach == "placed" and not light.falloff
        ]
    return warnings


def _sees(film: Film) -> bool:
    """Whether a film's sensor responds to any of its wavelengths."""
    return bool(sensor(film).sample(np.linspace(film.lambda_min, film.lambda_max, 2001)).any())
