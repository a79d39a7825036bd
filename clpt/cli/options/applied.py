"""Scenes as options want them."""

from __future__ import annotations

import dataclasses
from typing import Any

import click

from ...choices import AUTO
from ...denoise.needs import prepared
from ...formats import brought
from ...scene import Scene, kinds, viewpoint
from ...scene.integrators import NO_AOV, Auto
from ...scene.params import Kind, fields_of, params
from .changes import Composition, SceneChanges, Transport

PARAMETERS = {  # of integrators, and what an integrator without one has not
    "max_depth": "depth",
    "light_paths": "light paths beside it",
    "radius": "photons",
    "guiding": "guiding",
}


def changed(scene: Scene, changes: SceneChanges) -> Scene:
    """Return the scene as the options want it.

    Raises click.BadParameter, and SceneError for an invalid film.
    """
    sampling, film = changes.sampling, changes.film.values()
    if changes.composition.crop is not None:
        film["crop"] = None  # that of the file may not fit the new size
    if sampling.noise is not None:
        scene = dataclasses.replace(scene, noise=sampling.noise or None)
    given: dict[str, Any] = {"spp": sampling.spp, "seed": sampling.seed}
    given = {name: value for name, value in given.items() if value is not None}
    if changes.transport.sampler is not None:
        given["sampler"] = kinds("sampler")[changes.transport.sampler]()
    given["film"] = dataclasses.replace(scene.film, **film)
    given["integrator"] = _integrator(scene.integrator, changes.transport)
    scene = composed(dataclasses.replace(scene, **given), changes.composition)
    return prepared(scene, changes.denoise)


def _integrator(how: Any, transport: Transport) -> Any:
    """Return an integrator, as the options want it. Raises click.BadParameter."""
    if transport.integrator is not None and transport.integrator.lower() != how.kind:
        how = _of_kind(transport.integrator.lower(), how)
    if isinstance(how, Auto) and transport.implied != how.kind:
        how = _of_kind(transport.implied, how)
    for name, what in PARAMETERS.items():
        value = vars(transport)[name]
        if value is None:
            continue
        if name not in params(type(how)):
            message = f"the integrator {how.kind} has no {what}"
            raise click.BadParameter(message, param_hint=f"--{name.replace('_', '-')}")
        how = dataclasses.replace(how, **{name: value})
    return how


def _of_kind(name: str, old: Kind) -> Any:
    """Return an integrator of another kind, with the parameters that both have."""
    known = kinds("integrator")
    if name not in known:
        message = NO_AOV if name == "aov" else f"{name!r} is none of {', '.join(known)}"
        raise click.BadParameter(message, param_hint="--integrator")
    given = {key: value for key, value in fields_of(old).items() if key in params(known[name])}
    if name == "vcm" and "light_paths" in given:  # a whole number, 1 or more
        number = given.pop("light_paths")
        given |= {} if number == AUTO else {"light_paths": max(round(number), 1)}
    return known[name](**given)


def composed(scene: Scene, composition: Composition) -> Scene:
    """Return the scene as these options want it. Raises click.BadParameter, SceneError."""
    camera, env, rotation = composition.camera, composition.env, composition.env_rotation
    if env is None and rotation is not None:
        raise click.BadParameter("there is no --env to turn", param_hint="--env-rotation")
    if env is not None:
        scene = viewpoint.surrounded(scene, brought(env), rotation or 0.0)
    if camera is not None:
        seen = viewpoint.orbiting(scene, camera.azimuth, camera.elevation, camera.distance)
        scene = dataclasses.replace(scene, camera=seen)
    if composition.crop is not None:
        film, (columns, rows) = scene.film, composition.crop
        (x, width), (y, height) = columns.of(film.width), rows.of(film.height)
        film = dataclasses.replace(film, crop=(x, y, width, height))
        scene = dataclasses.replace(scene, film=film)
    return scene
