"""Animations: what nodes' transforms, morph weights and, by pointers, other numbers are at a time.

glTF 3.11 and its appendix C; KHR_animation_pointer.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.formats.gltf import pointers
from clpt.formats.gltf.accessors import floats
from clpt.formats.gltf.document import Document, Element

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

    chosen: its number or name; the first one if None. What pointers point to elsewhere is written
    into the document. Raises SceneError if there is no such animation.
    """
    found: dict[tuple[int, str], Floats] = {}
    for channel in _chosen(document, chosen).children("channels"):
        target = channel.needed("target")
        node = target.index("node", "nodes", None)
        path = target.text("path")
        if path == "pointer":
            names = pointers.parts(channel)
            on_node = pointers.node_path(names)
            if on_node is not None and on_node[0] < document.root.count("nodes"):
                found[on_node] = _sampled(channel, on_node[1], time)
            elif not pointers.put(document.root, names, _sampled(channel, path, time)):
                channel.warn(f"left out: nothing is known to move at '/{'/'.join(names)}'")
            continue
        if node is None or path not in PATHS:
            channel.warn(f"left out: {path!r} of no node that is known")
            continue
        found[node, path] = _sampled(channel, path, time)
    return found


def descriptions(document: Document) -> list[str]:
    """Return the name of each animation, or its number, and the time of its last key [s]."""
    animations = document.root.children("animations")
    return [f"{a.text('name', str(i))}{_length(a)}" for i, a in enumerate(animations)]


def _length(animation: Element) -> str:
    """Return how long an animation takes, for people; nothing where the file does not say."""
    ends: list[float] = []
    with suppress(SceneError):  # one that is broken is told when it is chosen
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
