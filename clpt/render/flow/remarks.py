"""Warnings of parts of a scene that are not rendered as the scene demands."""

from __future__ import annotations

import numpy as np

from clpt import spectra
from clpt.geometry import shapes
from clpt.render.film.colour import sensor
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.find import emissions
from clpt.render.transport import photons
from clpt.scene import materials as mt
from clpt.scene.cameras import CONNECTED
from clpt.scene.integrators import DEEPEST, Film
from clpt.scene.params import params
from clpt.scene.roles import INDEX
from clpt.scene.shapes import Shape


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
    depth, most = integrator.max_depth, photons.DEEPEST if index.merged else DEEPEST
    if depth > most:
        warnings.append(f"integrator.max_depth: {depth} counts as {most}, the longest path")
    if index.spectral and not film.bands and not _sees(film):
        warnings.append(
            f"film.sensor sees nothing from {film.lambda_min:g} to {film.lambda_max:g} nm, so the"
            " picture is black; ask for film.bands"
        )
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
        names = " and ".join(CONNECTED)
        reason = f"a {camera.kind} camera cannot be joined to a point"
        if camera.kind in CONNECTED:
            reason = "its glass disperses"
        name = "light_tracing" if kind == "vcm" else "light_paths"
        warnings.append(f"{kind}.{name}: left aside, as {reason}; {names} can, without such glass")
    if integrator.merging and not index.merged:
        reason = f"a path needs {photons.FIRST + 1} surfaces"
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
