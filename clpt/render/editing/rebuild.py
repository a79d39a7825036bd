"""A scene that changes while it is rendered: what differs goes to the device, the rest stays."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyopencl as cl

from clpt import bvh
from clpt.errors import SceneError
from clpt.records import TABLES
from clpt.render.lowering.scene import Lowered
from clpt.render.wavefront.queues import QUEUE
from clpt.render.wavefront.wavefront import Wavefront, use_interleaved_rays

log = logging.getLogger(__name__)

GAP = 256  # words that are written though they are the same, rather than by two commands
PIECES = 64  # writes from which the whole range between the first and the last is one
FITTED = "the tree"  # among what has moved: it is not that which would be built
FIXED = ("width", "height", "crop_x", "crop_y", "film_width", "film_height", "bands")
KEPT = ("slots", "per_plane", "planes")  # settings that follow from the film and the device
OWN = ("film", "image", "bands", "band_image")  # buffers of one wavefront, not of all


@dataclass(frozen=True)
class _Changes:
    """What becomes of kernels and trees: kernels, triangles, boxes: made anew; fit: fitted."""

    layout: str
    queued: str
    kernels: bool
    triangles: bool
    boxes: bool
    fit: bool


def take(fronts: Sequence[Wavefront], lowered: Lowered, refit: bool = False) -> None:
    """Let another lowering take the place of the one that is rendered.

    fronts: all of a renderer, the first one and its siblings; refit: fit the tree over triangles
    that only moved, which is faster, and leaves a tree that is slower where they went far. Programs
    are built where the features differ, trees where triangles or boxes do; of tables the words that
    differ are written. The picture is then that of a new renderer.

    Raises SceneError for a film of another size, KernelBuildError, MemoryBudgetError; nothing has
    changed then.
    """
    first = fronts[0]
    former, known = first.lowered, first.named
    if any(former.settings[name] != lowered.settings[name] for name in FIXED):
        raise SceneError("its size and bands stay as they are; make a new Renderer", where="film")
    for name in KEPT:
        lowered.settings[name] = former.settings[name]
    changes = _changes(first, lowered, refit)
    _make(first, lowered, changes)
    moved = {name for name, now in first.named.items() if known.get(name) is not now}
    _write_tables(first, former, moved)
    _fit(first, changes)
    for front in fronts:
        if front is not first:
            channel = front.lowered.features.channel
            features = dataclasses.replace(lowered.features, channel=channel)
            front.lowered = dataclasses.replace(lowered, features=features)
            front.tree, front.box_trees, front.queued = first.tree, first.box_trees, first.queued
            front.named = {**first.named, **{n: front.named[n] for n in OWN if n in front.named}}
        if changes.kernels or moved:
            front.bind_again(rebuilt=changes.kernels)
    for name in moved & {*TABLES, *QUEUE} & known.keys() - former.zero_copy.keys():
        first.buffers.release(known[name])


def _changes(front: Wavefront, lowered: Lowered, refit: bool) -> _Changes:
    """What another lowering needs."""
    former, moved = front.lowered, front.moved - {FITTED}
    layout, queued = front.suited(lowered)
    other = layout != front.tree.layout or former.instances.triangles != lowered.instances.triangles
    other |= not (_same(former.faces, lowered.faces) and _same(former.tags, lowered.tags))
    shifted = "vertices" in moved or not _same(former.vertices, lowered.vertices)
    triangles = other or (not refit and (shifted or FITTED in front.moved))
    parts = zip(vars(former.instances).values(), vars(lowered.instances).values(), strict=True)
    kernels = former.features != lowered.features
    flew = use_interleaved_rays(front.device, former, front.tree.layout)
    kernels |= flew != use_interleaved_rays(front.device, lowered, layout)
    return _Changes(
        layout,
        queued,
        kernels=kernels or (layout, queued) != (front.tree.layout, front.queued),
        triangles=triangles,
        boxes=triangles
        or bool(moved)
        or not _same(former.boxes, lowered.boxes)
        or not all(_same(*map(np.asarray, pair)) for pair in parts),
        fit=shifted and not triangles,
    )


def _make(front: Wavefront, lowered: Lowered, changes: _Changes) -> None:
    """Make kernels, buffers and trees that are new, and let them take their places.

    What is on the device stays as it is; should something not fit there, all is as before.
    """
    before, used = dict(vars(front)), front.buffers.used
    try:
        if changes.kernels:
            built = front.device.builds.programs
            front.build_ahead(lowered, changes.layout, changes.queued)
            built = front.device.builds.programs - built
            log.info("the scene needs other kernels: %d programs were built", built)
        front.named = {**front.named, **_new_tables(front, lowered, changes)}
        front.lowered, front.queued = lowered, changes.queued
        if changes.triangles:
            front.build_triangles(changes.layout)
        if changes.boxes:
            front.build_boxes()
            which = "triangles and boxes" if changes.triangles else "boxes"
            log.info("trees are built over %s", which)
        if changes.kernels:
            front.allocate_queue()
    except BaseException:
        vars(front).update(before)
        front.buffers.used = used
        raise


def _new_tables(front: Wavefront, lowered: Lowered, changes: _Changes) -> dict[str, cl.Buffer]:
    """Buffers of tables of another size, and those that are lent or lent no more."""
    former, made = front.lowered, {}
    for name in TABLES:
        old, new = former.table(name), lowered.table(name)
        zero_copy = lowered.zero_copy.get(name)
        built = name == "vertices" and changes.triangles  # what a tree is built of is there before
        if zero_copy is not None:
            made[name] = zero_copy
        elif name == "instances":
            continue  # `build_boxes` makes it
        elif name in former.zero_copy or old.nbytes != new.nbytes or built:
            made[name] = front.buffers.upload(f"the table of {name}", new)
    return made


def _write_tables(front: Wavefront, former: Lowered, new: set[str]) -> None:
    """Enqueue that words of tables become what they are now, but in buffers that are new."""
    for name in TABLES:
        old, now = former.table(name), front.lowered.table(name)
        if name in new or name in front.lowered.zero_copy or name == "instances":
            continue
        if name in front.moved:
            front.stream.write(front.named[name], now)
        else:
            _write(front, name, old, now)
    _write(front, "settings", former.settings.reshape(1), front.lowered.settings.reshape(1))


def _fit(front: Wavefront, changes: _Changes) -> None:
    """Let the tree over triangles follow them where it was not built anew."""
    fitted = FITTED in front.moved and not changes.triangles
    front.moved.clear()
    if changes.fit:
        building = bvh.Building(front.device, stream=front.stream)
        bvh.refit(building, front.tree, front.named["vertices"], front.named["faces"])
    if changes.fit or fitted:
        front.moved.add(FITTED)


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
