"""Scenes with the changes that options make."""

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
from .changes import SceneChanges, Transport

PARAMETERS = {  # of integrators, with their names in messages
    "max_depth": "depth",
    "light_paths": "light paths beside it",
    "radius": "photons",
    "guiding": "guiding",
    "reuse": "path reuse",
}


def changed(scene: Scene, changes: SceneChanges) -> Scene:
    """Return the scene, changed by the options.

    Raises click.BadParameter, and SceneError for an invalid film.
    """
    film = changes.film.values()
    if changes.crop is not None:
        film["crop"] = None  # that of the file may not fit the new size
    if changes.noise is not None:
        scene = dataclasses.replace(scene, noise=changes.noise or None)
    replaced: dict[str, Any] = {"spp": changes.spp, "seed": changes.seed}
    replaced = {name: value for name, value in replaced.items() if value is not None}
    if changes.transport.sampler is not None:
        replaced["sampler"] = kinds("sampler")[changes.transport.sampler]()
    replaced["film"] = dataclasses.replace(scene.film, **film)
    replaced["integrator"] = _integrator(scene.integrator, changes.transport)
    scene = composed(dataclasses.replace(scene, **replaced), changes)
    return prepared(scene, changes.denoise)


def _integrator(how: Any, transport: Transport) -> Any:
    """Return an integrator, changed by the options. Raises click.BadParameter."""
    if transport.integrator is not None and transport.integrator.lower() != how.kind:
        how = _of_kind(transport.integrator.lower(), how)
    if isinstance(how, Auto) and transport.implied != how.kind:
        how = _of_kind(transport.implied, how)
    for name, meaning in PARAMETERS.items():
        value = vars(transport)[name]
        if value is None:
            continue
        if name not in params(type(how)):
            message = f"the integrator {how.kind} has no {meaning}"
            raise click.BadParameter(message, param_hint=f"--{name.replace('_', '-')}")
        how = dataclasses.replace(how, **{name: value})
    return how


def _of_kind(name: str, old: Kind) -> Any:
    """Return an integrator of another kind, with the parameters that both have."""
    known = kinds("integrator")
    if name not in known:
        message = NO_AOV if name == "aov" else f"{name!r} is none of {', '.join(known)}"
        raise click.BadParameter(message, param_hint="--integrator")
    shared = {key: value for key, value in fields_of(old).items() if key in params(known[name])}
    if name == "vcm" and "light_paths" in shared:  # a whole number, 1 or more
        number = shared.pop("light_paths")
        shared |= {} if number == AUTO else {"light_paths": max(round(number), 1)}
    return known[name](**shared)


def composed(scene: Scene, changes: SceneChanges) -> Scene:
    """Return the scene with its camera, crop and surroundings changed.

    Raises click.BadParameter, SceneError.
    """
    env, rotation = changes.env, changes.env_rotation
    if env is None and rotation is not None:
        raise click.BadParameter("there is no --env to turn", param_hint="--env-rotation")
    if env is not None:
        scene = viewpoint.surrounded(scene, brought(env), rotation or 0.0)
    if changes.camera is not None:
        scene = dataclasses.replace(scene, camera=viewpoint.orbiting(scene, *changes.camera))
    if changes.crop is not None:
        film, (columns, rows) = scene.film, changes.crop
        (x, width), (y, height) = columns.of(film.width), rows.of(film.height)
        film = dataclasses.replace(film, crop=(x, y, width, height))
        scene = dataclasses.replace(scene, film=film)
    return scene
