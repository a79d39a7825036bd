"""Plans: changes of the scene on a device that are prepared, but not yet written.

Where only parameters of the camera and of materials differ, a plan writes a few words. After
another lowering it writes or builds only differences.
"""

from __future__ import annotations

import dataclasses
import logging
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import bvh
from clpt.errors import SceneError
from clpt.geometry.instancing import distinct
from clpt.render.camera import encode_camera
from clpt.render.edit.scene_edit import Replacements
from clpt.render.flow.scene_to_tables import Lowered
from clpt.render.lights.aims import is_sharp
from clpt.render.materials.check import check_material
from clpt.render.materials.encode import gloss_word
from clpt.render.wavefront import device_scene
from clpt.render.wavefront.device_scene import UPLOADED, DeviceScene
from clpt.render.wavefront.strategy import Strategy
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.materials import Material
from clpt.scene.params import fields_of
from clpt.scene.shapes import Shape


class Plan(ABC):
    """A prepared change of a scene on its device; the change happens when it is written.

    refusals: errors of `write` after which nothing has changed.
    """

    refusals: tuple[type[BaseException], ...] = ()

    @property
    def repeatable(self) -> bool:
        """Whether `write` may be called again after an error."""
        return True

    @abstractmethod
    def write(self) -> None:
        """Enqueue the change. The picture is then of another scene, from its first sample on."""


log = logging.getLogger(__name__)

GAP = 256  # most equal words between two differences that share a write
MOST_WRITES = 64  # if more are needed, a single write covers the whole range
OF_FILM = (
    "width", "height", "margin", "crop_x", "crop_y", "film_width", "film_height", "bands", "alpha",
)  # fmt: skip
OF_LAYERS = ("names", "light_groups", "time_bins")
OF_PATHS = ("light_paths", "guide_paths", "photon_places", "photon_pixels")


@dataclass(frozen=True)
class _Changes:
    """The changes by another lowering: new kernels, new trees of triangles or boxes, or a refit."""

    strategy: Strategy
    kernels: bool
    triangles: bool
    boxes: bool
    refit: bool


@dataclass(frozen=True, eq=False)
class Rebuild(Plan):
    """Another lowering for a wavefront, with new buffers, trees and queues that nothing uses yet.

    tables: new buffers by name; other tables are written where their words differ. replaced: the
    buffers that the new buffers replace, until they are released.
    """

    wavefront: Wavefront
    lowered: Lowered
    changes: _Changes
    tables: dict[str, cl.Buffer]
    trees: device_scene.Trees
    queue: dict[str, Any]
    replaced: list[cl.Buffer]

    def write(self) -> None:
        scene, changes = self.wavefront.scene, self.changes
        _write_tables(scene, self.lowered, self.tables)
        self.wavefront.paths.set_settings(self.lowered.settings)
        scene.tables |= self.tables
        scene.lowered, scene.strategy, scene.trees = self.lowered, changes.strategy, self.trees
        scene.fill_grids()
        self.wavefront.paths.queue = self.queue
        _refit(scene, changes)
        if changes.kernels or changes.boxes or self.replaced or self.tables:
            self.wavefront.bind_again(rebuilt=changes.kernels)
        while self.replaced:
            scene.buffers.release(self.replaced.pop())


def prepare_rebuild(
    wavefront: Wavefront, lowered: Lowered, refit: bool = False, beside: DeviceScene | None = None
) -> Rebuild:
    """Return the plan after which a wavefront renders another lowering.

    refit: refit the tree over triangles that only moved; this is faster than a new tree, but rays
    are slower if triangles moved far. Programs are built if the features differ, trees if triangles
    or boxes differ; words of tables are written where they differ. The picture equals that of a new
    renderer. beside: a scene on the device, whose trees are taken over if they are the same.

    Both lowerings must have the same kinds of paths, see `has_other_paths`. Raises SceneError as in
    `refusal`, KernelBuildError, MemoryBudgetError; the wavefront is then unchanged.
    """
    refused = refusal(wavefront.scene.lowered, lowered)
    if refused is not None:
        raise refused
    changes = _changes(wavefront, lowered, refit)
    with wavefront.scene.buffers.all_or_nothing():
        return _stage(wavefront, lowered, changes, beside)


def refusal(former: Lowered, new: Lowered) -> SceneError | None:
    """Return why a renderer cannot change from a lowering to another; None if it can."""
    old, now = former.settings, new.settings
    if any(old[name] != now[name] for name in OF_FILM):
        message = "its size, bands, alpha and the reach of its filter stay; make a new Renderer"
        return SceneError(message, where="film")
    layers, others = former.features.film.layers, new.features.film.layers
    if any(vars(layers)[name] != vars(others)[name] for name in OF_LAYERS):
        return SceneError("other layers need a new Renderer", where="film.layers")
    return None


def kinds_of_paths(lowered: Lowered) -> tuple[float, ...]:
    """Return the numbers that a lowering has in common with others whose films have its form."""
    return tuple(float(lowered.settings[name]) for name in OF_PATHS)


def has_other_paths(former: Lowered, new: Lowered) -> bool:
    """Return whether a lowering asks for other kinds of paths, so for a film of another form."""
    return kinds_of_paths(former) != kinds_of_paths(new)


def _changes(wavefront: Wavefront, lowered: Lowered, refit: bool) -> _Changes:
    """Return the changes that another lowering needs."""
    scene = wavefront.scene
    former, strategy = scene.lowered, wavefront.choose_strategy(lowered)
    groups = former.instances.triangles != lowered.instances.triangles
    groups |= former.instances.keys != lowered.instances.keys
    faces = not (_same(former.faces, lowered.faces) and _same(former.tags, lowered.tags))
    moved = "vertices" in scene.moved_tables or not _same(former.vertices, lowered.vertices)
    triangles = strategy.layout != scene.strategy.layout or groups or faces
    keyed = any(count > 1 for count in lowered.instances.keys)
    triangles |= (keyed or not refit) and (moved or scene.tree_refitted)
    parts = zip(vars(former.instances).values(), vars(lowered.instances).values(), strict=True)
    instances = not all(_same(*map(np.asarray, pair)) for pair in parts)
    boxes = instances or bool(scene.moved_tables) or not _same(former.boxes, lowered.boxes)
    return _Changes(
        strategy,
        kernels=former.features != lowered.features or strategy != scene.strategy,
        triangles=triangles,
        boxes=triangles or boxes,
        refit=moved and not triangles,
    )


def _stage(
    wavefront: Wavefront, lowered: Lowered, changes: _Changes, beside: DeviceScene | None
) -> Rebuild:
    """Build new kernels, buffers and trees beside the present scene, which stays unchanged."""
    scene, paths, queue = wavefront.scene, wavefront.paths, wavefront.paths.queue
    if changes.kernels:
        before = scene.device.builds.programs
        wavefront.build_ahead(lowered, changes.strategy)
        built = scene.device.builds.programs - before
        log.info("the scene needs other kernels: %d programs were built", built)
    tables, new_trees = _new_tables(scene, lowered, changes), scene.trees
    if changes.boxes and beside is not None and _has_same_trees(beside, scene, lowered, changes):
        new_trees = dataclasses.replace(beside.trees, shared=True)
    elif changes.boxes:
        vertices = tables.get("vertices", scene.tables["vertices"])
        former = None if changes.triangles else scene.trees
        layout, quality = changes.strategy.layout, scene.tree_quality
        new_trees = device_scene.build(scene.buffers, lowered, vertices, layout, quality, former)
        which = "triangles and boxes" if changes.triangles else "boxes"
        log.info("trees are built over %s", which)
    if changes.kernels:
        queue = paths.new_queue(changes.strategy.queued, len(lowered.features.materials.kinds))
    replaced = _replaced(wavefront, tables, new_trees, queue)
    return Rebuild(wavefront, lowered, changes, tables, new_trees, queue, replaced)


def _has_same_trees(
    beside: DeviceScene, scene: DeviceScene, lowered: Lowered, changes: _Changes
) -> bool:
    """Return whether the trees of another scene are those of a lowering."""
    layout, other = changes.strategy.layout, beside.lowered
    if beside.moved_tables or beside.tree_refitted or beside.strategy.layout != layout:
        return False
    if beside.device.context != scene.device.context or beside.tree_quality != scene.tree_quality:
        return False
    parts = zip(vars(other.instances).values(), vars(lowered.instances).values(), strict=True)
    return all(_same(*map(np.asarray, pair)) for pair in parts) and all(
        _same(vars(other)[name], vars(lowered)[name])
        for name in ("vertices", "faces", "tags", "boxes")
    )


def _new_tables(scene: DeviceScene, lowered: Lowered, changes: _Changes) -> dict[str, cl.Buffer]:
    """Return buffers for tables with a new size or a new owner, clpt or the caller."""
    former, tables = scene.lowered, {}
    for name in UPLOADED:
        old, new = former.table(name), lowered.table(name)
        of_caller = lowered.zero_copy.get(name)
        built_of = name == "vertices" and changes.triangles  # the tree is built of a whole table
        if of_caller is not None:
            if scene.tables[name] is not of_caller:
                tables[name] = of_caller
        elif name in former.zero_copy or old.nbytes != new.nbytes or built_of:
            tables[name] = scene.upload(name, new)
    return tables


def _replaced(
    wavefront: Wavefront,
    tables: dict[str, cl.Buffer],
    new_trees: device_scene.Trees,
    queue: dict[str, Any],
) -> list[cl.Buffer]:
    """Return the buffers of clpt that new tables, trees and a new queue replace."""
    scene, former = wavefront.scene, wavefront.paths.queue
    of_caller = scene.lowered.zero_copy
    buffers = [scene.tables[name] for name in tables if name not in of_caller]
    if new_trees is not scene.trees and not scene.trees.shared:
        buffers.append(scene.trees.instances)
    if queue is not former:
        buffers += [value for value in former.values() if isinstance(value, cl.Buffer)]
    return buffers


def _write_tables(scene: DeviceScene, lowered: Lowered, new: dict[str, cl.Buffer]) -> None:
    """Enqueue the words of tables that differ from a lowering, except in new buffers."""
    for name in UPLOADED:
        if name in new or name in lowered.zero_copy:
            continue
        filled = name == "images" and _room(scene.lowered) != _room(lowered)
        if name in scene.moved_tables or filled:
            scene.stream.write(scene.tables[name], lowered.table(name))
            continue
        words = _words(lowered.table(name))
        for begin, end in ranges(_words(scene.lowered.table(name)), words):
            scene.stream.write(scene.tables[name], words[begin:end], 4 * begin)


def _room(lowered: Lowered) -> list[tuple[int, tuple[int, ...]]]:
    """Return the places in `images` where kernels write bricks of densities."""
    return [(grid.first, grid.bricks) for grid in lowered.device_grids]


def _refit(scene: DeviceScene, changes: _Changes) -> None:
    """Refit the tree over triangles to their vertices, unless it is new."""
    if changes.refit:
        building = bvh.Building(scene.device, stream=scene.stream)
        triangles = scene.trees.triangles
        bvh.refit(building, triangles, scene.tables["vertices"], scene.tables["faces"])
    scene.tree_refitted = changes.refit or (scene.tree_refitted and not changes.triangles)
    scene.moved_tables.clear()


def ranges(old: NDArray[Any], new: NDArray[Any]) -> list[tuple[int, int]]:
    """Return ranges, begin and end, that cover all different words of two tables."""
    differ = np.flatnonzero(old != new)
    if not len(differ):
        return []
    far = np.flatnonzero(np.diff(differ) > GAP)
    begins, ends = differ[np.r_[0, far + 1]], differ[np.r_[far, len(differ) - 1]] + 1
    if len(begins) > MOST_WRITES:
        return [(int(begins[0]), int(ends[-1]))]
    return list(zip(begins.tolist(), ends.tolist(), strict=True))


def _words(values: NDArray[Any]) -> NDArray[np.uint32]:
    return np.ascontiguousarray(values).reshape(-1).view(np.uint32)


def _same(some: NDArray[Any], others: NDArray[Any]) -> bool:
    """Whether two arrays hold the same bits."""
    if some is others:
        return True
    return some.shape == others.shape and np.array_equal(_words(some), _words(others))


@dataclass(frozen=True, eq=False)
class Patch(Plan):
    """New words of the camera, unless it is None, and of rows of materials.

    rows: the first word of each row in `materials`, and its words.
    """

    target: DeviceScene
    camera: NDArray[np.float32] | None
    rows: list[tuple[int, Any]]

    def write(self) -> None:
        lowered, stream = self.target.lowered, self.target.stream
        tables = dict(lowered.tables)
        if self.camera is not None:
            stream.write(self.target.tables["camera"], self.camera)
            tables["camera"] = self.camera
        if self.rows:
            table = tables["materials"] = tables["materials"].copy()
            for first, new in self.rows:
                row = table[first : first + len(new)]
                for begin, end in ranges(row, new):
                    buffer = self.target.tables["materials"]
                    stream.write(buffer, new[begin:end], 4 * (first + begin))
                row[:] = new
        self.target.lowered = dataclasses.replace(lowered, tables=tables)


def prepare_patch(on_device: DeviceScene, former: Scene, scene: Scene) -> Patch | str:
    """Return the words that change from a former scene to a scene.

    The scenes may differ in the camera, of the same kind, and in values of materials. Else the
    function returns the difference as a text. Raises SceneError as `lower` does.
    """
    lowered = on_device.lowered
    pairs = [] if scene.shapes is former.shapes else _pairs(former.shapes, scene.shapes)
    if pairs is None:
        return "a material is of another kind or structure"
    if lowered.features.transport.balanced and any(
        is_sharp(old) != is_sharp(new) for old, new in pairs
    ):
        return "light paths aim at what is sharp, and a material is so now, or no more"
    if lowered.features.media.bodies and pairs:
        return "bodies that overlap know each other's indices"
    camera = None
    if scene.camera is not former.camera:
        if scene.camera.dispersive_glasses != former.camera.dispersive_glasses:
            return "the camera's lens is of another glass"
        film, rows_ = scene.film, lowered.glass_rows
        camera = encode_camera(scene.camera, film.width, film.height, rows_)
        kind = lowered.features.camera.kind
        if scene.camera.kind != kind or len(camera) != len(lowered.tables["camera"]):
            return "the camera is of another kind"
        if _reflects(scene.camera) != _reflects(former.camera):
            return "the camera's lens reflects, or no more"
    if pairs and lowered.features.grouped:
        return "slopes of indices stand before the rows of materials"
    rows: list[tuple[int, Any]] = []
    for old, new in pairs:
        check_material(new, scene.film)
        changed = lowered.encoder.replaced(old, new, "materials")
        if changed is None:
            return f"parameters of a {new.kind} come from elsewhere, such as a texture or a table"
        rows += changed
        if before := lowered.features.lights.gloss:
            word = np.array([gloss_word(new)], np.uint32)
            rows += [(row - before, word) for row, _ in changed]
    return Patch(on_device, camera, rows)


def _reflects(camera: Camera) -> tuple[bool, bool]:
    return camera.reflects, camera.has_ghosts


def _pairs(former: Sequence[Shape], placed: Sequence[Shape]) -> list[tuple[Any, Any]] | None:
    """Return pairs of old and new leaf materials; None if more than values differs."""
    pairs: Replacements = {}
    for old, new in zip(distinct(former), distinct(placed), strict=True):
        if not _pair(old.material, new.material, pairs):
            return None
    changed = [(old, new) for old, new in pairs.values() if old is not new]
    return [(old, new) for old, new in changed if not old.is_composite]


def _pair(old: Material, new: Material, pairs: Replacements) -> bool:
    """Note that a material replaces another; return whether only values may differ."""
    if id(old) in pairs:
        return pairs[id(old)][1] is new
    pairs[id(old)] = old, new
    if old is new and not old.is_composite:
        return True
    if type(old) is not type(new):
        return False
    if not old.is_composite:
        traits = [(m.absorbs_inside, m.transmits, m.uses_tangents) for m in (old, new)]
        return traits[0] == traits[1]
    parts, others = old.shared_parts, fields_of(new)
    if parts.keys() != new.shared_parts.keys():
        return False
    free = parts.keys() | {"name"}
    same = all(a is others[name] for name, a in fields_of(old).items() if name not in free)
    return same and all(_pair(part, others[name], pairs) for name, part in parts.items())
