"""A glTF animation while a shutter is open: the scene at several times becomes keys of motions."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Matrix
from clpt.errors import SceneError
from clpt.scene import Scene
from clpt.scene.motion import Deformation, Shutter, placement, through
from clpt.scene.shapes import Group, Instance, Mesh

KEYS = 9  # in the time for which the shutter is open
NEAR = 1e-3  # of a mesh's size, by which a vertex may be off its way between keys


def between(load: Callable[[float], Scene], time: float, length: float) -> Scene:
    """Return the scene at a time [s], whose nodes move while a shutter is open for `length` [s].

    load: gives the scene at a time. What skins and morphs move has as few keys as keep vertices
    within NEAR of the mesh's size of where they are at KEYS times.
    """
    times = np.linspace(time, time + length, KEYS)
    scenes = [load(float(t)) for t in times]
    scene, warnings = scenes[0], list(scenes[0].warnings)
    if any(len(other.shapes) != len(scene.shapes) for other in scenes):
        warnings.append("shutter: shapes come or go while it is open, so that nothing moves")
        return dataclasses.replace(scene, warnings=warnings)
    added = scene.extra["studio"]  # what stands still, see clpt.formats.meshes.framing
    own = len(scene.shapes) - added["shapes"]
    groups: dict[int, Group] = {}
    shapes: list[Any] = []
    for i in range(own):
        ways = [one.shapes[i] for one in scenes]
        moved = _moving(ways, times, warnings, f"shapes[{i}]")
        shapes.append(_deforming(moved, ways, times, warnings, groups))
    shapes += scene.shapes[own:]
    lights: list[Any] = list(scene.lights)
    camera: Any = scene.camera
    if not added["lights"]:
        lights = [
            _moving([one.lights[i] for one in scenes], times, warnings, f"lights[{i}]")
            for i in range(len(lights))
        ]
    if not added["camera"]:
        camera = _moving([one.camera for one in scenes], times, warnings, "camera")
    shutter = Shutter(time, time + length)
    camera = dataclasses.replace(camera, shutter=shutter)
    return dataclasses.replace(
        scene, shapes=shapes, lights=lights, camera=camera, warnings=warnings
    )


def _deforming(
    shape: object,
    ways: Sequence[Any],
    times: Matrix,
    warnings: list[str],
    groups: dict[int, Group],
) -> Any:
    """A shape with keys of its vertices, if they are elsewhere at other times.

    ways: the shape at all times; groups: those of instances, by that of the first time.
    """
    if isinstance(shape, Instance) and all(isinstance(way, Instance) for way in ways):
        first = ways[0].group
        if id(first) not in groups:
            at_all = zip(*(way.group.shapes for way in ways), strict=False)
            parts = [_deforming(one[0], one, times, warnings, groups) for one in at_all]
            same = all(new is old for new, old in zip(parts, first.shapes, strict=False))
            groups[id(first)] = first if same else dataclasses.replace(first, shapes=tuple(parts))
        return dataclasses.replace(shape, group=groups[id(first)])
    if not (isinstance(shape, Mesh) and all(isinstance(way, Mesh) for way in ways)):
        return shape
    name = f"shutter: {f'mesh {shape.name!r}' if shape.name else 'a mesh'} stays as at `time`"
    if any(not np.array_equal(way.faces, shape.faces) for way in ways):
        warnings.append(f"{name}: its triangles are others at other times")
        return shape
    points = np.stack([np.asarray(way.vertices) for way in ways])
    normals = None
    if all(way.normals is not None for way in ways):
        normals = np.stack([np.asarray(way.normals) for way in ways])
    if not np.ptp(points, axis=0).any() and (normals is None or not np.ptp(normals, axis=0).any()):
        return shape
    step = _step(points)
    normals = None if normals is None else normals[::step]
    keys = Deformation(times[::step].tolist(), points[::step], normals)
    return dataclasses.replace(shape, deformation=keys)


def _step(points: NDArray[np.float32]) -> int:
    """Return the step of the keys that are enough; (k, n, 3), even, k - 1 a power of two."""
    last = len(points) - 1
    allowed = NEAR * float(np.ptp(points.reshape(-1, 3), axis=0).max())
    step = last
    while step > 1:
        share = np.arange(step)[:, None, None] / step
        far = 0.0
        for first in range(0, last, step):
            between = points[first] * (1.0 - share) + points[first + step] * share
            far = max(far, float(np.abs(points[first : first + step] - between).max()))
        if far <= allowed:
            break
        step //= 2
    return step


def _moving(ways: Sequence[Any], times: Matrix, warnings: list[str], where: str) -> Any:
    """A thing at its first time with keys, if it is elsewhere at others."""
    first = ways[0]
    placed = [placement(way) for way in ways]
    if any(matrix is None for matrix in placed):
        return first
    matrices = np.stack([matrix for matrix in placed if matrix is not None])
    if np.array_equal(matrices, np.broadcast_to(matrices[0], matrices.shape)):
        return first
    try:
        return through(first, times.tolist(), matrices)
    except SceneError as error:
        warnings.append(f"shutter: {where} stays as at `time`: {error}")
        return first
