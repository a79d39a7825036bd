"""The part of a session that moves the camera: what drags, keys and clicks ask for."""

from __future__ import annotations

import dataclasses
import logging
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Floats
from clpt.scene import Scene, viewpoint
from clpt.scene.cameras import Camera, Matrix, Perspective, ThinLens
from clpt.scene.params import fields_of, params
from clpt.scene.viewpoint import Pose, pose
from clpt.view import saving
from clpt.view.messages import OF_VIEW, CommandError, Reply, Request
from clpt.view.render_loop import RenderLoop
from clpt.view.target import Change

FARTHEST = 1e12  # [m] from the origin, as of vertices
POLE = math.radians(2.0)  # nearest to the pole that a turn ends
log = logging.getLogger(__name__)

LENS_SHARE = 0.01  # of the distance in focus: the radius that a pinhole gets as a lens


def rounded(point: Floats) -> list[float]:
    """Return a point (3,) with six digits, as people write it."""
    return [float(f"{value:.6g}") for value in point]


def is_within_reach(camera: Camera) -> bool:
    """Return whether the numbers of a camera say where it is and looks, and are below FARTHEST."""
    matrix = np.asarray(camera.view if isinstance(camera, Matrix) else camera.to_world, float)
    if transforms.is_singular(matrix):
        return False
    with np.errstate(all="ignore"):
        at = pose(camera)
    numbers = np.concatenate([matrix.ravel(), at.origin, at.left, at.up, at.forward])
    return bool((np.abs(numbers) < FARTHEST).all())


def orbit(camera: Camera, pivot: Floats, up: Floats, dx: float, dy: float) -> Camera:
    """Turn about a point by a drag of (dx, dy) heights of the picture, half a turn each."""
    turn = _turn(pose(camera), up, math.pi * dx, -math.pi * dy)
    around = transforms.translate(pivot) @ turn @ transforms.translate(-pivot)
    return camera.moved(around)


def look(camera: Camera, up: Floats, dx: float, dy: float, aspect: float) -> Camera:
    """Turn the head so that the picture follows a drag of (dx, dy) heights of it."""
    at = pose(camera)
    angle = 2.0 * math.atan(min(camera.half_height(aspect), 1.0))
    turn = _turn(at, up, -angle * dx, angle * dy)
    return camera.moved(transforms.translate(at.origin) @ turn @ transforms.translate(-at.origin))


def pan(camera: Camera, distance: float, dx: float, dy: float, aspect: float) -> Camera:
    """Move across the view so that what is at a distance follows a drag."""
    at, half = pose(camera), camera.half_height(aspect)
    step = 2.0 * half * (distance if camera.enlarged(1.0) is None else 1.0)
    return camera.moved(transforms.translate(step * (dx * at.left + dy * at.up)))


def dolly(camera: Camera, pivot: Floats, by: float) -> Camera:
    """Come nearer to a point: the distance falls by the factor e^by; rays that are parallel meet
    a part of the scene that is smaller by it."""
    if (nearer := camera.enlarged(math.exp(-by))) is not None:
        return nearer
    at = pose(camera)
    along = float(np.dot(pivot - at.origin, at.forward))
    return camera.moved(transforms.translate(at.forward * along * (1.0 - math.exp(-by))))


def fly(camera: Camera, distance: float, right: float, up: float, forward: float) -> Camera:
    """Move along the camera's own axes by shares of a distance."""
    at = pose(camera)
    step = forward * at.forward + up * at.up - right * at.left
    return camera.moved(transforms.translate(distance * step))


def _turn(at: Pose, up: Floats, azimuth: float, elevation: float) -> NDArray[np.float64]:
    """Return the turn about `up`, then about the camera's side, which stops before the pole."""
    height = math.asin(float(np.clip(np.dot(at.forward, up), -1.0, 1.0)))
    limit = math.pi / 2.0 - POLE
    wanted = float(np.clip(height + elevation, min(-limit, height), max(limit, height)))
    side = np.cross(at.forward, up)
    side = _unit(side) if np.linalg.norm(side) > 1e-6 else -at.left
    sideways = transforms.rotate(side, math.degrees(wanted - height))
    return transforms.rotate(up, -math.degrees(azimuth)) @ sideways


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)


class CameraWork:
    """Base of a session: its methods `_do_<command>` that concern the camera, and the pivot.

    scene: the present scene; _first: of the file; the methods without a body are the session's.
    """

    scene: Scene
    _first: Scene
    _loop: RenderLoop
    _pivot: Floats
    _up: Floats
    _aimed: bool  # the pivot lies on a surface

    def post(self, request: Request, reply: Reply) -> None: ...

    def _ask_hit(self, x: int, y: int, reply: Reply, then: Reply) -> None: ...

    def _do_display(self, reply: Reply, exposure: float, tone: str) -> None: ...

    def _tell_state(self) -> None: ...

    def _do_orbit(self, reply: Reply, dx: float, dy: float) -> None:
        self._move(orbit(self.scene.camera, self._pivot, self._up, dx, dy))

    def _do_look(self, reply: Reply, dx: float, dy: float) -> None:
        self._move(look(self.scene.camera, self._up, dx, dy, self._aspect()), takes_pivot=True)

    def _do_pan(self, reply: Reply, dx: float, dy: float) -> None:
        camera = pan(self.scene.camera, self._distance(), dx, dy, self._aspect())
        self._move(camera, takes_pivot=True)

    def _do_dolly(self, reply: Reply, by: float) -> None:
        self._move(dolly(self.scene.camera, self._pivot, by))

    def _do_fly(self, reply: Reply, right: float, up: float, forward: float) -> None:
        camera = fly(self.scene.camera, self._distance(), right, up, forward)
        self._move(camera, takes_pivot=True)

    def _do_home(self, reply: Reply) -> None:
        self._move(self._first.camera)
        self._set_pivot()
        self._tell_state()

    def _do_open_view(self, reply: Reply, camera: object, exposure: float, tone: str) -> None:
        self._move(saving.camera_of(camera, self.scene.camera))
        self._set_pivot()
        if tone == OF_VIEW and self._loop.display.view is None:
            tone = "none"  # it was of another start
        self._do_display(reply, exposure, tone)
        self._tell_state()

    def _do_field_of_view(self, reply: Reply, degrees: float) -> None:
        camera: Any = self.scene.camera
        if "fov" not in params(type(camera)):
            raise CommandError(f"the camera {camera.kind} has no field of view")
        self._move(dataclasses.replace(camera, fov=degrees))
        self._tell_state()

    def _do_look_at(self, reply: Reply) -> None:
        at = viewpoint.pose(self.scene.camera)
        target = at.origin + self._distance() * at.forward
        points = {"origin": at.origin, "target": target, "up": at.up}
        vectors = {name: rounded(point) for name, point in points.items()}
        reply({"type": "look_at", **vectors})

    def _do_pick(self, reply: Reply, x: int, y: int) -> None:
        self._ask_hit(x, y, reply, lambda hit: self._aim_at(hit, reply))

    def _do_focus(self, reply: Reply, x: int, y: int) -> None:
        self._ask_hit(x, y, reply, lambda hit: self._focus_on(hit, reply))

    def _do_pivot(self, reply: Reply, position: list[float]) -> None:
        self._pivot, self._aimed = np.array(position), True

    def _do_focus_at(self, reply: Reply, distance: float) -> None:
        camera: Any = self.scene.camera
        if isinstance(camera, ThinLens):
            camera = dataclasses.replace(camera, focus_distance=distance)
        elif isinstance(camera, Perspective):
            fields = fields_of(camera)
            radius = LENS_SHARE * distance
            camera = ThinLens(**fields, focus_distance=distance, aperture_radius=radius)
        else:
            raise CommandError(f"the camera {camera.kind} has no lens")
        self._move(camera)
        self._tell_state()

    def _aim_at(self, hit: dict[str, Any], reply: Reply) -> None:
        """In the probe's thread: let the pivot be where a pixel looks."""
        if hit["shape"] is None:
            reply({"type": "note", "text": "there is nothing to turn about"})
            return
        self.post(Request("pivot", {"position": hit["position"]}), reply)
        reply({"type": "pivot", "position": hit["position"], "depth": hit["depth"]})

    def _focus_on(self, hit: dict[str, Any], reply: Reply) -> None:
        """In the probe's thread: let the lens focus where a pixel looks."""
        if hit["shape"] is None:
            reply({"type": "note", "text": "there is nothing to focus on"})
            return
        at = viewpoint.pose(self.scene.camera)
        distance = float(np.dot(np.array(hit["position"]) - at.origin, at.forward))
        self.post(Request("focus_at", {"distance": max(distance, 1e-6)}), reply)

    def _aim(self) -> None:
        """Let the pivot be what is in the middle of the picture."""
        self._aimed = True
        film = self.scene.film

        def silent(message: dict[str, Any]) -> None:
            log.debug("%s", message)

        def aim(hit: dict[str, Any]) -> None:
            if hit["shape"] is not None:
                self.post(Request("pivot", {"position": hit["position"]}), silent)

        self._ask_hit(film.width // 2, film.height // 2, silent, aim)

    def _move(self, camera: Camera, takes_pivot: bool = False) -> None:
        """Let another camera look; takes_pivot: the pivot goes where the camera goes.

        Raises CommandError for a camera that float32 cannot tell.
        """
        if not is_within_reach(camera):
            raise CommandError("the camera would be too far away, or see too much or too little")
        if takes_pivot:
            old, new = viewpoint.pose(self.scene.camera), viewpoint.pose(camera)
            away = self._pivot - old.origin
            parts = [float(np.dot(away, axis)) for axis in (old.left, old.up, old.forward)]
            axes = (new.left, new.up, new.forward)
            self._pivot = new.origin + sum(
                part * axis for part, axis in zip(parts, axes, strict=True)
            )
        self.scene = dataclasses.replace(self.scene, camera=camera)
        shown = dataclasses.replace(self._loop.scene, camera=camera)
        self._loop.begin(shown, Change(camera=camera))

    def _set_pivot(self) -> None:
        """Let the pivot be where the camera focuses, or as far away as the world's origin."""
        camera = self.scene.camera
        at = viewpoint.pose(camera)
        distance = float(fields_of(camera).get("focus_distance", np.linalg.norm(at.origin))) or 1.0
        self._pivot, self._up = at.origin + distance * at.forward, viewpoint.upright(camera)
        self._aimed = False

    def _distance(self) -> float:
        away = self._pivot - viewpoint.pose(self.scene.camera).origin
        return float(np.linalg.norm(away)) or 1.0

    def _aspect(self) -> float:
        return self.scene.film.width / self.scene.film.height
