"""Motion of a scene while its shutter is open, and boxes around moving shapes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Boxes
from clpt.errors import SceneError
from clpt.files import budget
from clpt.geometry import shapes, triangles
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.lights import Light
from clpt.scene.motion import Keys, Shutter, arc, decomposed, rotation, slerp
from clpt.scene.shapes import Cylinder, Group, Instance, Shape, Sphere

LOOKS = 33  # evenly spaced times that sample a light's surroundings
TURN = 0.1  # [rad] of a rotation that a box is looked at again
ROUNDING = 4e-6  # growth of a box over its coordinates, as float32 rounds them
EVEN = 1e-5  # largest relative difference of scales of a motion that does not stretch

ROUND = (Sphere, Cylinder)
AT_ONCE = Shutter(0.0, 0.0)


@dataclass(frozen=True)
class Motions:
    """The parts of a scene that move while its shutter is open.

    shapes, lamps: keys by index in the scene's shapes and lights; camera: its keys, or None;
    deforming: for shapes and instances with deforming points, by index, the times of their keys
    from the opening of the shutter to its closing; points move linearly between them.
    """

    shutter: Shutter
    shapes: Mapping[int, Keys]
    lamps: Mapping[int, Keys]
    camera: Keys | None
    deforming: Mapping[int, tuple[float, ...]]

    @classmethod
    def of(cls, scene: Scene) -> Motions:
        """Return the motions of a scene that `at_rest` has returned."""
        of_shapes = {i: s.motion for i, s in enumerate(scene.shapes) if s.motion is not None}
        of_lamps = {i: s.motion for i, s in enumerate(scene.lights) if s.motion is not None}
        shutter = scene.camera.shutter or AT_ONCE
        deforming = {i: _times(s, shutter) for i, s in enumerate(scene.shapes) if _deforms(s)}
        return cls(shutter, of_shapes, of_lamps, scene.camera.motion, deforming)

    def __bool__(self) -> bool:
        return bool(self.shapes or self.lamps or self.camera or self.deforming)

    @property
    def moving(self) -> frozenset[int]:
        """The indices of shapes and instances that move or deform."""
        return frozenset({*self.shapes, *self.deforming})

    @property
    def scales(self) -> bool:
        """Whether something is scaled, or mirrored, while it moves."""
        every = [*self.shapes.values(), *self.lamps.values(), self.camera]
        return any(keys is not None and not is_rigid(keys) for keys in every)

    def looks(self) -> tuple[float, ...]:
        """Return times from the shutter's opening to its closing; a single time without motion."""
        if not self:
            return (self.shutter.open,)
        keys = [*self.shapes.values(), *self.lamps.values(), self.camera]
        times = {t for moving in keys if moving is not None for t in moving.times}
        times |= {t for moments in self.deforming.values() for t in moments}
        inner = {t for t in times if self.shutter.open < t < self.shutter.close}
        even = np.linspace(self.shutter.open, self.shutter.close, LOOKS).tolist()
        return tuple(sorted({*inner, *even}))

    def halfway(self, keys: Keys | None, point: NDArray[Any]) -> NDArray[np.float64]:
        """Return a point (3,) at the middle of the exposure."""
        point = np.asarray(point, np.float64)
        if keys is None:
            return point
        matrix = keys.at((self.shutter.open + self.shutter.close) / 2.0)
        return np.asarray(transforms.transform_points(matrix, point), np.float64)

    def swept(self, number: int, boxes: NDArray[Any]) -> Boxes:
        """Return boxes (n, 2, 3) of a shape of the scene, grown to hold its motion."""
        return swept(self.shapes[number], corners(boxes), self.shutter)


def at_rest(scene: Scene) -> Scene:
    """Return a scene whose keys all belong to objects that move while the shutter is open.

    Other objects with keys get their transform at the opening; a scene without keys is returned as
    it is. Raises SceneError for keys on a shape of a group, and on lights that cannot move.
    """
    changes: dict[str, Any] = {}
    owners = (*scene.shapes, *scene.lights, scene.camera)
    if not all(isinstance(owner, (Shape, Light, Camera)) for owner in owners):
        return scene  # which is refused
    shutter = scene.camera.shutter or AT_ONCE
    if not isinstance(shutter, Shutter):
        raise SceneError(f"must be a Shutter, not {shutter!r}", where="camera.shutter")
    for i, shape in enumerate(scene.shapes):
        for inner in shape.members:
            if inner is not shape and inner.motion is not None:
                message = "a shape of a group cannot move in it: give `motion` to its instance"
                raise SceneError(message, where=shapes.where(inner))
        _check(shape, f"shapes[{i}]")
        if shape.emission is not None and shape.emission.motion is not None:
            message = "an area light moves with its shape: give `motion` to that"
            raise SceneError(message, where=shapes.where(shape))
    for i, light in enumerate(scene.lights):
        _check(light, f"lights[{i}]")
    _check(scene.camera, "camera")
    bent: list[Any] = _undeformed(scene.shapes, shutter)
    if any(new is not old for new, old in zip(bent, scene.shapes, strict=True)):
        changes["shapes"] = bent
    lists: tuple[tuple[str, Sequence[Any]], ...] = (("shapes", bent), ("lights", scene.lights))
    for name, parts in lists:
        if any(part.motion is not None for part in parts):
            changes[name] = [_rest(part, shutter) for part in parts]
    camera = _camera_at_rest(scene.camera, shutter)
    if camera is not scene.camera:
        changes["camera"] = camera
    return replace(scene, **changes) if changes else scene


def _deforms(shape: Shape) -> bool:
    budget.check_time()
    return any(member.deformation is not None for member in shape.members)


def _times(shape: Shape, shutter: Shutter) -> tuple[float, ...]:
    """Return the times [s] of keys; all points of a shape or instance move linearly between."""
    deformations = [member.deformation for member in shape.members]
    times = {t for keys in deformations if keys is not None for t in keys.while_open(shutter)}
    return tuple(sorted(times))


def _undeformed(shapes_: Sequence[Shape], shutter: Shutter) -> list[Shape]:
    """Return the shapes; a deformation stays only if it moves points while the shutter is open."""
    groups: dict[int, Group] = {}
    still: list[Shape] = []
    for shape in shapes_:
        if not _deforms(shape):
            still.append(shape)
        elif (group := shape.group) is not None:
            if id(group) not in groups:
                inner = tuple(_opening(member, shutter) for member in group.shapes)
                groups[id(group)] = replace(group, shapes=inner)
            placing: dict[str, Any] = {"group": groups[id(group)]}
            still.append(replace(shape, **placing))
        else:
            still.append(_opening(shape, shutter))
    return still


def _opening(shape: Any, shutter: Shutter) -> Any:
    """Return a shape with its points at the shutter's opening.

    A shape whose points do not move then has no deformation. Raises SceneError for a deformation
    that does not have the shape's points.
    """
    deformation = shape.deformation
    if deformation is None:
        return shape
    triangles.check_deformation(shape)
    still = len(deformation.while_open(shutter)) == 1
    if not still and shape.emission is not None and shape.kind == "spheres":
        message = "spheres that emit light cannot deform: leave one of the two out"
        raise SceneError(message, where=f"{shapes.where(shape)}.deformation")
    changes = {} if still else {"deformation": deformation}
    return replace(shape.at_time(shutter.open), **changes)


def _check(movable: Any, where: str) -> None:
    if not isinstance(movable.motion, (Keys, type(None))):
        raise SceneError(f"must be Keys, not {movable.motion!r}", where=f"{where}.motion")


def _rest(movable: Any, shutter: Shutter) -> Any:
    """Return a shape or light without keys, if it does not move while the shutter is open."""
    if movable.motion is None or _moves(movable.motion, shutter):
        return movable
    matrix = movable.motion.at(shutter.open)
    if isinstance(movable, ROUND) and not is_even(movable.motion):
        still = replace(movable, motion=None)  # which an instance may stretch
        return Instance(group=Group((still,), movable.kind), to_world=matrix, name=movable.name)
    if hasattr(movable, "to_world"):
        return replace(movable, motion=None, to_world=matrix @ np.asarray(movable.to_world))
    changes: dict[str, Any] = {"motion": None}
    if hasattr(movable, "position"):
        changes["position"] = tuple(transforms.transform_points(matrix, movable.position))
    if hasattr(movable, "direction"):
        changes["direction"] = tuple(transforms.transform_vectors(matrix, movable.direction))
    return replace(movable, **changes)


def _camera_at_rest(camera: Camera, shutter: Shutter) -> Camera:
    """Return a camera without keys, if it does not move while the shutter is open."""
    if camera.motion is None or _moves(camera.motion, shutter):
        return camera
    matrix = camera.motion.at(shutter.open)
    if camera.is_rigid and not _keeps_lengths(matrix):
        return replace(camera, motion=Keys((0.0, 1.0), (matrix, matrix)))
    return replace(camera.moved(matrix), motion=None)


def _keeps_lengths(matrix: NDArray[np.float64]) -> bool:
    linear = matrix[:3, :3]
    return np.allclose(linear.T @ linear, np.eye(3), atol=1e-6)


def _moves(keys: Keys, shutter: Shutter) -> bool:
    """Whether what has keys is elsewhere at some time while the shutter is open."""
    times = [t for t in keys.times if shutter.open < t < shutter.close]
    matrices = [keys.at(t) for t in (shutter.open, *times, shutter.close)]
    return any(not np.array_equal(matrix, matrices[0]) for matrix in matrices)


def check(placed: Sequence[Shape], motions: Motions) -> None:
    """Raise SceneError for lights that move as they cannot; placed: the scene's shapes."""
    for i, keys in motions.lamps.items():
        if not is_rigid(keys):
            message = "a light may be moved and turned, not scaled or mirrored"
            raise SceneError(message, where=f"lights[{i}].motion")
    for i, keys in motions.shapes.items():
        shape = placed[i]
        if any(member.emission is not None for member in shape.members) and not is_even(keys):
            message = "a shape that emits light may be scaled evenly, not stretched"
            raise SceneError(message, where=f"{shapes.where(shape)}.motion")


def is_rigid(keys: Keys) -> bool:
    """Whether keys neither scale nor mirror."""
    parts = (decomposed(matrix)[2] for matrix in keys.transforms)
    return all(np.allclose(part, np.eye(3), atol=1e-6) for part in parts)


def is_even(keys: Keys) -> bool:
    """Whether keys keep angles."""
    parts = (decomposed(matrix)[2] for matrix in keys.transforms)
    return all(np.allclose(p, p[0, 0] * np.eye(3), atol=EVEN * abs(p[0, 0])) for p in parts)


def corners(boxes: NDArray[Any]) -> NDArray[np.float64]:
    """Return the corners (n, 8, 3) of boxes (n, 2, 3)."""
    index = np.array([[bit >> axis & 1 for axis in range(3)] for bit in range(8)])
    return np.asarray(boxes, np.float64)[:, index, np.arange(3)]


def swept(keys: Keys, points: NDArray[np.float64], shutter: Shutter) -> Boxes:
    """Return boxes (n, 2, 3) around the hulls of points (n, p, 3) that move during the exposure.

    Between two looks a point leaves their chord by at most h^2 / 8 of its second derivative; the
    boxes grow by this bound.
    """
    low = np.full((len(points), 3), np.inf)
    high = -low
    grown = np.zeros((len(points), 1))
    times = [t for t in keys.times if shutter.open < t < shutter.close]
    ends = [shutter.open, *times, shutter.close]
    for begin, end in itertools.pairwise(ends):
        (t0, q0, s0), (t1, q1, s1) = (decomposed(keys.at(t)) for t in (begin, end))
        angle = 2.0 * arc(q0, q1)[1]
        steps = max(2, math.ceil(angle / TURN))
        for i in range(steps + 1):
            a = i / steps
            linear = rotation(slerp(q0, q1, a)) @ (s0 + a * (s1 - s0))
            moved = points @ linear.T + (t0 + a * (t1 - t0))
            low = np.minimum(low, moved.min(axis=1))
            high = np.maximum(high, moved.max(axis=1))
        reach, shorter = (np.linalg.norm(points @ s, axis=2).max(axis=1) for s in (s0, s1))
        reach = np.maximum(reach, shorter)[:, None]
        grows = np.linalg.norm(points @ (s1 - s0), axis=2).max(axis=1)[:, None]
        chord = (angle * angle * reach + 2.0 * angle * grows) / (8.0 * steps * steps)
        grown = np.maximum(grown, chord)
    size = np.maximum(np.abs(low), np.abs(high)).max(axis=1, keepdims=True)
    origin = np.linalg.norm(keys.transforms[:, :3, 3], axis=1).max()
    pad = grown + ROUNDING * (size + origin + np.abs(points).max(axis=(1, 2))[:, None])
    return np.stack([low - pad, high + pad], axis=1).astype(np.float32)
