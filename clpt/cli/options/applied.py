"""Scenes as options want them."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import click
import numpy as np

from ... import images, transforms
from ...choices import AUTO
from ...denoise.needs import prepared
from ...errors import SceneError
from ...formats.meshes import framing
from ...scene import Scene, kinds
from ...scene.integrators import NO_AOV, Auto
from ...scene.lights import Envmap
from ...scene.params import Kind, fields_of, params
from ...view.navigation import upright
from .changes import SceneChanges, Transport
from .composition import Composition, Orbit

# The scene's up from +y, by its axis and sign; the front is +z where up is +y, -y where it is +z.
UPS = {
    (0, 1): transforms.rotate([0.0, 0.0, 1.0], -90.0),
    (0, -1): transforms.rotate([0.0, 0.0, 1.0], 90.0),
    (1, 1): transforms.IDENTITY,
    (1, -1): transforms.rotate([0.0, 0.0, 1.0], 180.0),
    (2, 1): framing.Z_UP,
    (2, -1): transforms.rotate([1.0, 0.0, 0.0], -90.0),
}
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
    if transport.integrator is not None and transport.integrator != how.kind:
        how = _of_kind(transport.integrator, how)
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
    if camera is not None or env is not None:
        up = up_of(scene)
        if camera is not None:
            scene = dataclasses.replace(scene, camera=_orbiting(scene, camera, up))
        if env is not None:
            scene = _surrounded(scene, env, up, rotation or 0.0)
    if composition.crop is not None:
        film, (columns, rows) = scene.film, composition.crop
        (x, width), (y, height) = columns.of(film.width), rows.of(film.height)
        film = dataclasses.replace(film, crop=(x, y, width, height))
        scene = dataclasses.replace(scene, film=film)
    return scene


def up_of(scene: Scene) -> transforms.Matrix:
    """Return the rotation (4, 4) that takes +y to the scene's up, and +z to its front.

    Formats of objects have their own; of other scenes up is the axis nearest to the camera's up.
    Raises SceneError for a camera without any.
    """
    if "studio" in scene.extra:
        return framing.up_of(scene.extra["format"])
    try:
        up = upright(scene.camera)
    except np.linalg.LinAlgError:
        raise SceneError("flattens space: its up is not known", where="camera") from None
    axis = int(np.argmax(np.abs(up)))
    return UPS[axis, int(np.sign(up[axis]))]


def _own_shapes(scene: Scene) -> list[Any]:
    """Return the shapes of the scene's file, without those of the studio."""
    return scene.shapes[: len(scene.shapes) - scene.extra.get("studio", {}).get("shapes", 0)]


def _orbiting(scene: Scene, orbit: Orbit, up: transforms.Matrix) -> Any:
    """Return a camera on the orbit. Raises SceneError where the scene is too large."""
    azimuth, elevation = math.radians(orbit.azimuth), math.radians(orbit.elevation)
    aside, ahead = math.sin(azimuth), math.cos(azimuth)
    from_ = (math.cos(elevation) * aside, math.sin(elevation), math.cos(elevation) * ahead)
    top = (-math.sin(elevation) * aside, math.cos(elevation), -math.sin(elevation) * ahead)
    return framing.framing_camera(
        _own_shapes(scene), up, from_=from_, top=top, distance=orbit.distance
    )


def _surrounded(scene: Scene, image: Path, up: transforms.Matrix, rotation: float) -> Scene:
    """Return the scene in an image, without its own surroundings and without the studio's light."""
    images.check_input(image)
    studio = scene.extra.get("studio", {})
    lights = scene.lights[: len(scene.lights) - studio.get("lights", 0)]
    turned = up @ transforms.rotate([0.0, 1.0, 0.0], rotation)
    around = Envmap(image=str(image), to_world=turned)
    return dataclasses.replace(
        scene,
        shapes=_own_shapes(scene),
        lights=[light for light in lights if light.reach != "infinite"] + [around],
        extra=scene.extra | ({"studio": {**studio, "shapes": 0, "lights": 0}} if studio else {}),
    )
