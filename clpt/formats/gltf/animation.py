"""Animations: transforms of nodes, morph weights and, by pointers, other numbers at a time.

glTF 3.11 and its appendix C; KHR_animation_pointer. While a shutter is open, the scene at several
times becomes keys of motions.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, Matrix
from clpt.errors import SceneError
from clpt.formats.gltf.accessors import floats
from clpt.formats.gltf.document import Document, Element
from clpt.geometry.motion import is_even
from clpt.scene import Scene
from clpt.scene.motion import Deformation, Shutter, placement, through
from clpt.scene.shapes import Group, Instance, Mesh, Shape

PATHS = {
    "translation": ("VEC3",),
    "rotation": ("VEC4",),
    "scale": ("VEC3",),
    "weights": ("SCALAR",),
    "pointer": ("SCALAR", "VEC2", "VEC3", "VEC4"),
}
INTERPOLATIONS = ("LINEAR", "STEP", "CUBICSPLINE")


def pose(document: Document, chosen: str | None, time: float) -> dict[tuple[int, str], Floats]:
    """Return the values by (node, "rotation" or the like) that an animation sets at a time [s].

    chosen: its number or name; None: the first animation. Values that pointers set elsewhere are
    written into the document. Raises SceneError if there is no such animation.
    """
    pose_values: dict[tuple[int, str], Floats] = {}
    for channel in _chosen(document, chosen).children("channels"):
        target = channel.needed("target")
        node = target.index("node", "nodes", None)
        path = target.text("path")
        if path == "pointer":
            names = parts(channel)
            on_node = node_path(names)
            if on_node is not None and on_node[0] < document.root.count("nodes"):
                pose_values[on_node] = _sampled(channel, on_node[1], time)
            elif not put(document.root, names, _sampled(channel, path, time)):
                channel.warn(f"left out: nothing is known to move at '/{'/'.join(names)}'")
            continue
        if node is None or path not in PATHS:
            channel.warn(f"left out: {path!r} of no node that is known")
            continue
        pose_values[node, path] = _sampled(channel, path, time)
    return pose_values


def descriptions(document: Document) -> list[str]:
    """Return the name of each animation, or its number, and the time of its last key [s]."""
    animations = document.root.children("animations")
    return [f"{a.text('name', str(i))}{_length(a)}" for i, a in enumerate(animations)]


def _length(animation: Element) -> str:
    """Return how long an animation takes, for people; nothing where the file does not say."""
    ends: list[float] = []
    with suppress(SceneError):  # a broken animation is reported when it is chosen
        for sampler in animation.children("samplers"):
            times = sampler.entry("input", "accessors")
            ends += () if times is None else times.numbers("max", None, ())
    return f", {max(ends):g} s" if ends else ""


def _chosen(document: Document, chosen: str | None) -> Element:
    animations = document.root.children("animations")
    if not animations:
        raise document.root.error("has no animation, so there is no time to choose")
    if chosen is None:
        return animations[0]
    for number, animation in enumerate(animations):
        if chosen in (str(number), animation.text("name", None)):
            return animation
    names = ", ".join(a.text("name", str(i)) for i, a in enumerate(animations))
    raise document.root.error(f"has no animation {chosen!r}; it has: {names}")


def _sampled(channel: Element, path: str, time: float) -> Floats:
    """The values of a channel at a time; beyond its ends those at the ends."""
    animation = channel.path.rpartition(".channels")[0]
    owner = channel.document.entry("animations", int(animation.partition("[")[2][:-1]))
    samplers = owner.children("samplers")
    number = channel.integer("sampler")
    if number >= len(samplers):
        raise channel.error(f"there is no samplers[{number}]", "sampler")
    sampler = samplers[number]
    how = sampler.text("interpolation", "LINEAR", INTERPOLATIONS)
    times = _values(sampler, "input", ("SCALAR",))[:, 0]
    stored = _values(sampler, "output", PATHS[path])
    triple = 3 if how == "CUBICSPLINE" else 1
    if (np.diff(times) <= 0.0).any() or len(stored) % (triple * len(times)):
        raise sampler.error("its times do not increase, or its values are not as many as they are")
    keys = stored.reshape(len(times), triple, -1)
    after = int(np.clip(np.searchsorted(times, time, "right"), 1, max(len(times) - 1, 1)))
    before = after - 1
    if len(times) == 1 or time <= times[0] or time >= times[-1]:
        return _unit(keys[0 if time <= times[0] else -1, triple // 2], path)
    step = times[after] - times[before]
    return _unit(_between(how, path, keys[before], keys[after], step, time - times[before]), path)


def _between(how: str, path: str, a: Floats, b: Floats, step: float, past: float) -> Floats:
    t = past / step
    if how == "STEP":
        return a[0]
    if how == "LINEAR":
        return _slerp(a[0], b[0], t) if path == "rotation" else a[0] + t * (b[0] - a[0])
    # Hermite: values in the middle, the tangent out of a after it, that into b before it.
    return (
        (2 * t**3 - 3 * t**2 + 1) * a[1]
        + step * (t**3 - 2 * t**2 + t) * a[2]
        + (3 * t**2 - 2 * t**3) * b[1]
        + step * (t**3 - t**2) * b[0]
    )


def _slerp(a: Floats, b: Floats, t: float) -> Floats:
    """Between two unit quaternions, the shorter way (Shoemake 1985)."""
    cosine = float(a @ b)
    b, cosine = (-b, -cosine) if cosine < 0.0 else (b, cosine)
    angle = np.arccos(min(cosine, 1.0))
    if angle < 1e-4:
        return a + t * (b - a)
    return (np.sin((1.0 - t) * angle) * a + np.sin(t * angle) * b) / np.sin(angle)


def _unit(values: Floats, path: str) -> Floats:
    length = np.linalg.norm(values)
    return values / length if path == "rotation" and length > 0.0 else values


def _values(sampler: Element, key: str, types: tuple[str, ...]) -> Floats:
    accessor = sampler.entry(key, "accessors")
    if accessor is None:
        raise sampler.error(f"{key!r} is missing")
    return floats(accessor, types).astype(np.float64)


KEYS = 9  # while the shutter is open
NEAR = 1e-3  # largest distance of a vertex from its path between keys, over the mesh's size


def _lit_evenly(shape: Shape, warnings: list[str]) -> Shape:
    """Return a shape without its light, with a warning, where its motion stretches it."""
    if shape.motion is None or shape.emission is None or is_even(shape.motion):
        return shape
    warnings.append(f"{shape.name}: its light is left out, as its motion stretches it")
    return shape.altered(emission=None)


def scene_over_shutter(load: Callable[[float], Scene], time: float, length: float) -> Scene:
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
    added = scene.extra["studio"]  # what stands still, see clpt.formats.framing
    count = len(scene.shapes) - added["shapes"]
    groups: dict[int, Group] = {}
    shapes: list[Any] = []
    for i in range(count):
        ways = [each.shapes[i] for each in scenes]
        moved = _lit_evenly(_moving(ways, times, warnings, f"shapes[{i}]"), warnings)
        shapes.append(_deforming(moved, ways, times, warnings, groups))
    shapes += scene.shapes[count:]
    lights: list[Any] = list(scene.lights)
    camera: Any = scene.camera
    if not added["lights"]:
        lights = [
            _moving([each.lights[i] for each in scenes], times, warnings, f"lights[{i}]")
            for i in range(len(lights))
        ]
    if not added["camera"]:
        camera = _moving([each.camera for each in scenes], times, warnings, "camera")
    shutter = Shutter(time, time + length)
    camera = dataclasses.replace(camera, shutter=shutter)
    return dataclasses.replace(
        scene, shapes=shapes, lights=lights, camera=camera, warnings=warnings
    )


def _deforming(
    shape: object, ways: Sequence[Any], times: Matrix, warnings: list[str], groups: dict[int, Group]
) -> Any:
    """A shape with keys of its vertices, if they are elsewhere at other times.

    ways: the shape at all times; groups: those of instances, by that of the first time.
    """
    if isinstance(shape, Instance) and all(isinstance(way, Instance) for way in ways):
        first = ways[0].group
        if id(first) not in groups:
            at_all = zip(*(way.group.shapes for way in ways), strict=False)
            parts = [_deforming(shapes[0], shapes, times, warnings, groups) for shapes in at_all]
            same = all(new is old for new, old in zip(parts, first.shapes, strict=False))
            groups[id(first)] = first if same else dataclasses.replace(first, shapes=tuple(parts))
        return dataclasses.replace(shape, group=groups[id(first)])
    if not (isinstance(shape, Mesh) and all(isinstance(way, Mesh) for way in ways)):
        return shape
    name = f"shutter: {f'mesh {shape.name!r}' if shape.name else 'a mesh'} stays as at `time`"
    if any(not np.array_equal(way.faces, shape.faces) for way in ways):
        warnings.append(f"{name}: its triangles are others at other times")
        return shape
    if all(way.vertices is shape.vertices and way.normals is shape.normals for way in ways):
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
            scene_over_shutter = points[first] * (1.0 - share) + points[first + step] * share
            far = max(far, float(np.abs(points[first : first + step] - scene_over_shutter).max()))
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


POINTER = "KHR_animation_pointer"
OF_NODES = ("translation", "rotation", "scale", "weights")
TABLES = ("materials", "cameras", "meshes", "extensions")  # whose numbers may change
LISTS = ("weights",)  # even a single number of them is a list


def parts(channel: Element) -> list[str]:
    """Return the parts of a channel's pointer (RFC 6901). Raises SceneError where it is none."""
    extension = channel.needed("target").extension(POINTER)
    if extension is None:
        raise channel.error(f"a target of the path 'pointer' needs {POINTER}", "target")
    text = extension.text("pointer")
    if not text.startswith("/"):
        raise extension.error(f"{text!r} is no JSON pointer: it must begin with '/'", "pointer")
    return [part.replace("~1", "/").replace("~0", "~") for part in text[1:].split("/")]


def node_path(names: list[str]) -> tuple[int, str] | None:
    """Return the node and the path of a pointer that means what other channels mean, or None."""
    if len(names) == 3 and names[0] == "nodes" and names[1].isdigit() and names[2] in OF_NODES:
        return int(names[1]), names[2]
    return None


def put(root: Element, names: list[str], values: NDArray[np.float64]) -> bool:
    """Write values where a pointer points to; return False if the document has no such member.

    Omitted objects on the path are added, as their numbers have defaults. An omitted texture is
    not, as it needs an image.
    """
    if names[0] not in TABLES or len(names) < 3 or (names[0] == "meshes" and names[2:] != [*LISTS]):
        return False
    at: Any = root.value
    for number, name in enumerate(names[:-1]):
        if name.endswith("Texture") and not (isinstance(at, dict) and name in at):
            return False
        if isinstance(at, dict) and (number > 1 or name in at):
            at = at.setdefault(name, {})
        elif isinstance(at, list) and name.isdigit() and int(name) < len(at):
            at = at[int(name)]
        else:
            return False
    last, single = names[-1], len(values) == 1 and names[-1] not in LISTS
    stored: Any = float(values[0]) if single else values.tolist()
    if isinstance(at, list) and last.isdigit() and int(last) < len(at):
        at[int(last)] = stored
        return True
    if not isinstance(at, dict) or isinstance(at.get(last), str | dict):
        return False
    at[last] = values[0] > 0.5 if isinstance(at.get(last), bool) else stored
    return True
