"""A glTF animation while a shutter is open: the scene at several times becomes keys of motions."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.errors import SceneError
from clpt.scene import Scene
from clpt.scene.motion import Keys, Shutter
from clpt.scene.shapes import Mesh

KEYS = 9  # in the time for which the shutter is open

Matrix = NDArray[np.float64]


def between(load: Callable[[float], Scene], time: float, length: float) -> Scene:
    """Return the scene at a time [s], whose nodes move while a shutter is open for `length` [s].

    load: gives the scene at a time. Skins and morphs stay as they are at `time`, with a warning.
    """
    times = np.linspace(time, time + length, KEYS)
    scenes = [load(float(t)) for t in times]
    scene, warnings = scenes[0], list(scenes[0].warnings)
    if any(len(other.shapes) != len(scene.shapes) for other in scenes):
        warnings.append("shutter: shapes come or go while it is open, so that nothing moves")
        return dataclasses.replace(scene, warnings=warnings)
    added = scene.extra["studio"]  # what stands still, see clpt.formats.meshes.framing
    own = len(scene.shapes) - added["shapes"]
    shapes: list[Any] = [
        _moving([one.shapes[i] for one in scenes], times, warnings, f"shapes[{i}]")
        for i in range(own)
    ]
    shapes += scene.shapes[own:]
    bent = sum(
        isinstance(first, Mesh)
        and isinstance(last, Mesh)
        and not np.array_equal(np.asarray(first.vertices), np.asarray(last.vertices))
        for first, last in zip(scene.shapes, scenes[-1].shapes, strict=True)
    )
    if bent:
        warnings.append(f"shutter: the vertices of {bent} meshes (skins, morphs) stay as at `time`")
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


def _moving(ways: Sequence[Any], times: Matrix, warnings: list[str], where: str) -> Any:
    """A thing at its first time with keys, if it is elsewhere at others."""
    first = ways[0]
    placed = [_placement(way) for way in ways]
    if any(matrix is None for matrix in placed):
        return first
    matrices = np.stack([matrix for matrix in placed if matrix is not None])
    if np.array_equal(matrices, np.broadcast_to(matrices[0], matrices.shape)):
        return first
    try:
        keys = Keys(times.tolist(), matrices)
        return _at_origin(first, keys)
    except SceneError as error:
        warnings.append(f"shutter: {where} stays as at `time`: {error}")
        return first


def _placement(thing: Any) -> Matrix | None:
    """Where a shape, light or camera is, (4, 4); None for what is at no place."""
    if hasattr(thing, "to_world"):
        return np.asarray(thing.to_world, np.float64)
    if hasattr(thing, "position"):
        return transforms.translate(thing.position)
    if hasattr(thing, "direction"):
        d = np.asarray(thing.direction, np.float64)
        up = [0.0, 1.0, 0.0] if abs(d[1]) < 0.9 * np.linalg.norm(d) else [1.0, 0.0, 0.0]
        return transforms.look_at([0.0, 0.0, 0.0], d, up)
    return None


def _at_origin(thing: Any, keys: Keys) -> Any:
    """A thing as it is before the placements that are its keys."""
    if hasattr(thing, "to_world"):
        return dataclasses.replace(thing, to_world=np.eye(4), motion=keys)
    if hasattr(thing, "position"):
        return dataclasses.replace(thing, position=(0.0, 0.0, 0.0), motion=keys)
    return dataclasses.replace(thing, direction=(0.0, 0.0, 1.0), motion=keys)
