"""Viewpoints: poses of cameras, orbits around a scene, surroundings."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clpt import images, transforms
from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.scene import Scene, studio
from clpt.scene.cameras import Camera, Matrix, Perspective
from clpt.scene.lights import Envmap
from clpt.scene.shapes import Shape
from clpt.scene.studio import UPS as STUDIO_UPS
from clpt.scene.studio import Z_UP

# The scene's up from +y, by its axis and sign; the front is +z where up is +y, -y where it is +z.
UPS = {
    (0, 1): transforms.rotate([0.0, 0.0, 1.0], -90.0),
    (0, -1): transforms.rotate([0.0, 0.0, 1.0], 90.0),
    (1, 1): transforms.IDENTITY,
    (1, -1): transforms.rotate([0.0, 0.0, 1.0], 180.0),
    (2, 1): Z_UP,
    (2, -1): transforms.rotate([1.0, 0.0, 0.0], -90.0),
}
_EYE_TO_CAMERA = np.diag([-1.0, 1.0, -1.0, 1.0])  # OpenGL's eye space looks along -z, +x right


@dataclass(frozen=True)
class Pose:
    """Where a camera is: a point, and unit vectors (3,) to its left, up and forward."""

    origin: Floats
    left: Floats
    up: Floats
    forward: Floats


def pose(camera: Camera) -> Pose:
    """Return where a camera is and looks."""
    if isinstance(camera, Matrix):
        matrix = np.linalg.inv(np.asarray(camera.view, float)) @ _EYE_TO_CAMERA
    else:
        matrix = np.asarray(camera.to_world, float)
    left, up, forward = (_unit(matrix[:3, i]) for i in range(3))
    return Pose(matrix[:3, 3].copy(), left, up, forward)


def upright(camera: Camera) -> Floats:
    """Return the axis of the world that is nearest to the camera's own up, (3,)."""
    up = pose(camera).up
    axis = int(np.argmax(np.abs(up)))
    return np.eye(3)[axis] * math.copysign(1.0, up[axis])


def up_of(scene: Scene) -> transforms.Matrix:
    """Return the rotation (4, 4) that takes +y to the scene's up, and +z to its front.

    The studio knows its own; of other scenes up is the axis nearest to the camera's up. Raises
    SceneError for a camera without any.
    """
    if "studio" in scene.extra:
        return STUDIO_UPS[scene.extra["studio"]["up"]]
    try:
        up = upright(scene.camera)
    except np.linalg.LinAlgError:
        raise SceneError("flattens space: its up is not known", where="camera") from None
    axis = int(np.argmax(np.abs(up)))
    return UPS[axis, int(np.sign(up[axis]))]


def orbiting(scene: Scene, azimuth: float, elevation: float, distance: float = 1.0) -> Perspective:
    """Return a camera that looks at the middle of a scene and sees all of it.

    azimuth [degrees]: 0 is in front, 90 on the right; elevation [degrees]: 90 is above; distance: a
    factor on the distance that frames the whole scene. Raises SceneError where the scene is too
    large.
    """
    around, above = math.radians(azimuth), math.radians(elevation)
    aside, ahead = math.sin(around), math.cos(around)
    from_ = (math.cos(above) * aside, math.sin(above), math.cos(above) * ahead)
    top = (-math.sin(above) * aside, math.cos(above), -math.sin(above) * ahead)
    return studio.framing_camera(
        _own_shapes(scene), up_of(scene), from_=from_, top=top, distance=distance
    )


def surrounded(scene: Scene, image: str | Path, rotation: float = 0.0) -> Scene:
    """Return a scene in an image, without its own surroundings and without the studio's light.

    rotation: of the image about the vertical [degrees]. A 1 in the image shows 1 on a screen, so
    the film's `display_exposure` is taken off. Raises SceneError for a file that is no image.
    """
    images.check_input(Path(image))
    studio = scene.extra.get("studio", {})
    lights = scene.lights[: len(scene.lights) - studio.get("lights", 0)]
    turned = up_of(scene) @ transforms.rotate([0.0, 1.0, 0.0], rotation)
    scale = 2.0**-scene.film.display_exposure
    around = Envmap(image=str(image), scale=scale, to_world=turned)
    return dataclasses.replace(
        scene,
        shapes=_own_shapes(scene),
        lights=[light for light in lights if light.reach != "infinite"] + [around],
        extra=scene.extra | ({"studio": {**studio, "shapes": 0, "lights": 0}} if studio else {}),
    )


def _own_shapes(scene: Scene) -> list[Shape]:
    """Return the shapes of a scene without those of the studio."""
    return scene.shapes[: len(scene.shapes) - scene.extra.get("studio", {}).get("shapes", 0)]


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)
