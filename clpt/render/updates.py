"""A scene that changes while it is rendered: what differs goes to the device, the rest stays."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Sequence
from typing import Any

import numpy as np

from clpt import bvh, device
from clpt.errors import SceneError
from clpt.records import TABLES
from clpt.render import programs
from clpt.render.cameras import dispersive_glass, lower_camera
from clpt.render.instancing import distinct
from clpt.render.lower import CLEAR, Lowered
from clpt.render.wavefront import QUEUE, Wavefront
from clpt.scene import Scene
from clpt.scene.materials import COMPOSITES, Material
from clpt.scene.params import params

log = logging.getLogger(__name__)

GAP = 256  # words that are written though they are the same, rather than by two commands
PIECES = 64  # writes from which the whole range between the first and the last is one
FITTED = "the tree"  # among what has moved: it is not that which would be built
FIXED = ("width", "height", "crop_x", "crop_y", "film_width", "film_height", "bands")
KEPT = ("slots", "per_plane", "planes")  # settings that follow from the film and the device


def rewrite(fronts: Sequence[Wavefront], former: Scene, scene: Scene) -> bool:
    """Bring a scene to the device that differs from the one there in values only: a few words.

    It may differ in its camera, which must be of the same kind, and in values of materials. Returns
    False, with nothing changed, where more than that differs. Raises SceneError as `lower` does.
    """
    front = fronts[0]
    lowered, encoder = front.lowered, front.lowered.encoder
    pairs = [] if scene.shapes is former.shapes else _pairs(former, scene)
    if pairs is None or (pairs and encoder is None):
        return False
    if scene.camera is not former.camera:
        if dispersive_glass(scene.camera) != dispersive_glass(former.camera):
            return False
        film, row = scene.film, lowered.glass_row
        kind, words = lower_camera(scene.camera, film.width, film.height, row)
        if kind != lowered.features.camera:
            return False
    rows: list[tuple[int, Any]] = []
    for old, new in pairs:
        found = encoder.replaced(old, new, "materials") if encoder else None
        if found is None:
            for one in fronts:
                one.lowered.encoder = None  # it has been written to; the next lowering has another
            return False
        rows += found
    if scene.camera is not former.camera:
        front.stream.write(front.named["camera"], words)
        lowered.tables["camera"] = words
    table = lowered.tables["materials"]
    for first, new in rows:
        own = table[first : first + len(new)]
        for begin, end in ranges(own, new):
            front.stream.write(front.named["materials"], new[begin:end], 4 * (first + begin))
        own[:] = new
    return True


def _pairs(former: Scene, scene: Scene) -> list[tuple[Any, Any]] | None:
    """The leaf materials that took the places of others, None where more than values differs."""
    found: dict[int, tuple[Any, Any]] = {}
    for old, new in zip(distinct(former.shapes), distinct(scene.shapes), strict=True):
        if not _pair(old.material, new.material, found):
            return None
    changed = [(old, new) for old, new in found.values() if old is not new]
    return [(old, new) for old, new in changed if not isinstance(old, COMPOSITES)]


def _pair(old: Any, new: Any, found: dict[int, tuple[Any, Any]]) -> bool:
    """Note what took the place of what; whether the two may differ in values only."""
    if id(old) in found:
        return found[id(old)][1] is new
    found[id(old)] = old, new
    if old is new and not isinstance(old, COMPOSITES):
        return True
    if type(old) is not type(new):
        return False
    if not isinstance(old, COMPOSITES):
        absorb = [getattr(one, "absorption", CLEAR) != CLEAR for one in (old, new)]
        traits = [(one.transmits, one.turns) for one in (old, new)]
        return absorb[0] == absorb[1] and traits[0] == traits[1]
    for name in params(type(old)):
        a, b = getattr(old, name), getattr(new, name)
        if isinstance(a, Material) and isinstance(b, Material):
            if not _pair(a, b, found):
                return False
        elif a is not b and name != "name":
            return False
    return True


def take(fronts: Sequence[Wavefront], lowered: Lowered, refit: bool = False) -> None:
    """Let another lowering take the place of the one that is rendered.

    fronts: all of a renderer, the first one and its siblings; refit: fit the tree over triangles
    that only moved, which is faster, and leaves a tree that is slower where they went far. Programs
    are built where the features differ, trees where triangles or boxes do; of tables the words that
    differ are written. The picture is then that of a new renderer.

    Raises SceneError for a film of another size, KernelBuildError, MemoryBudgetError.
    """
    first = fronts[0]
    former = first.lowered
    if any(former.settings[name] != lowered.settings[name] for name in FIXED):
        raise SceneError("its size and bands stay as they are; make a new Renderer", where="film")
    for name in KEPT:
        lowered.settings[name] = former.settings[name]
    layout, queued = first.suited(lowered)
    anew = former.features != lowered.features
    anew |= (layout, queued) != (first.tree.layout, first.queued)
    if anew:
        before = first.device.builds.programs
        texts = programs.sources(lowered.features, layout, first.lanes, queued=queued)
        device.build_all(first.device, texts)  # before anything changes: it may fail
        built = first.device.builds.programs - before
        log.info("another set of kernels: %d programs were built", built)
    first.lowered, first.queued = lowered, queued
    known = dict(first.named)
    _write_tables(first, former)
    _follow(first, former, layout, refit)
    if anew:
        first.allocate_queue()
    moved = {name: now for name, now in first.named.items() if known.get(name) is not now}
    own = ("film", "image", "bands", "band_image")
    for front in fronts:
        if front is not first:
            channel = front.lowered.features.channel
            features = dataclasses.replace(lowered.features, channel=channel)
            front.lowered = dataclasses.replace(lowered, features=features)
            front.tree, front.box_trees, front.queued = first.tree, first.box_trees, queued
            front.named = {**first.named, **{n: front.named[n] for n in own if n in front.named}}
        if anew or moved:
            front.bind_again(rebuilt=anew)
    for name in moved:
        if name in (*TABLES, *QUEUE) and name in known and name not in former.lent:
            first.buffers.release(known[name])


def _write_tables(front: Wavefront, former: Lowered) -> None:
    """Enqueue that words of tables become what they are now; what has another size is made anew."""
    for name in TABLES:
        old, new = former.table(name), front.lowered.table(name)
        if name == "instances":
            continue  # their rows name the trees, see `_follow`
        lent = front.lowered.lent.get(name)
        if lent is not None:
            front.named[name] = lent
        elif name in former.lent or old.nbytes != new.nbytes:
            front.named[name] = front.buffers.upload(f"the table of {name}", new)
        elif name in front.moved:
            front.stream.write(front.named[name], new)
        else:
            _write(front, name, old, new)
    _write(front, "settings", former.settings.reshape(1), front.lowered.settings.reshape(1))


def _write(front: Wavefront, name: str, old: np.ndarray, new: np.ndarray) -> None:
    """Enqueue that a buffer which holds old values gets the new ones where they differ."""
    words = _words(new)
    for begin, end in ranges(_words(old), words):
        front.stream.write(front.named[name], words[begin:end], 4 * begin)


def ranges(old: np.ndarray, new: np.ndarray) -> list[tuple[int, int]]:
    """Return the parts, begin and end, that hold all words in which two tables differ."""
    differ = np.flatnonzero(old != new)
    if not len(differ):
        return []
    far = np.flatnonzero(np.diff(differ) > GAP)
    begins, ends = differ[np.r_[0, far + 1]], differ[np.r_[far, len(differ) - 1]] + 1
    if len(begins) > PIECES:
        return [(int(begins[0]), int(ends[-1]))]
    return list(zip(begins.tolist(), ends.tolist(), strict=True))


def _words(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values).reshape(-1).view(np.uint32)


def _same(some: np.ndarray, others: np.ndarray) -> bool:
    """Whether two arrays hold the same bits."""
    if some is others:
        return True
    return some.shape == others.shape and np.array_equal(_words(some), _words(others))


def _follow(front: Wavefront, former: Lowered, layout: str, refit: bool) -> None:
    """Let trees follow the tables: build them anew, or fit that over triangles that only moved."""
    lowered, moved = front.lowered, front.moved - {FITTED}
    fitted = FITTED in front.moved
    front.moved.clear()
    other = layout != front.tree.layout or former.instances.triangles != lowered.instances.triangles
    other |= not (_same(former.faces, lowered.faces) and _same(former.tags, lowered.tags))
    shifted = "vertices" in moved or not _same(former.vertices, lowered.vertices)
    anew = other or (not refit and (shifted or fitted))
    boxes = anew or moved or not _same(former.boxes, lowered.boxes)
    parts = zip(vars(former.instances).values(), vars(lowered.instances).values(), strict=True)
    boxes = boxes or not all(_same(*map(np.asarray, pair)) for pair in parts)
    if shifted and not anew:
        building = bvh.Building(front.device, stream=front.stream)
        bvh.refit(building, front.tree, front.named["vertices"], front.named["faces"])
    if not anew and (shifted or fitted):
        front.moved.add(FITTED)
    if anew or boxes:
        front.stream.wait()  # what trees are built of has to be there
        if anew:
            front.build_triangles(layout)
        front.build_boxes()
        log.info("trees are built over %s", "triangles and boxes" if anew else "boxes")
