"""The memory of paths in flight: slots, slabs of path state, queues, counters, the work list.

The work list gives each slot of a plane its pixels, their order, and the end of their samples.
Pixels are numbered in the order of 4x4 tiles, with padding, see kernels/film/film.cl. For adaptive
sampling the film is cut into squares, and the pixels of a square into the two colours of a
chessboard: two cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import device
from clpt.arrays import Integers
from clpt.device.buffers import Buffers
from clpt.errors import MemoryBudgetError
from clpt.records import COUNTER_NUMBERS, PATH, PATH_BITS, RAY_ORDER, SLABS
from clpt.records.layout import SLAB_BLOCK, Record
from clpt.render.flow.scene_to_tables import Lowered
from clpt.render.flow.settings import SQUARE

FOREVER = np.iinfo(np.int32).max  # an end that no sample reaches
SIDE = 16  # pixels of a square's side, a multiple of four


def pixels(settings: NDArray[np.void]) -> tuple[Integers, Integers]:
    """Return x and y in the picture of every padded pixel, (padded_pixels,) each."""
    index, margin = np.arange(int(settings["padded_pixels"])), int(settings["margin"])
    row, column = np.divmod(index >> 4, int(settings["tiles_x"]))
    return column * 4 + (index & 3) - margin, row * 4 + (index >> 2 & 3) - margin


def inside(settings: NDArray[np.void]) -> Integers:
    """Return the pixels in the picture, ascending: its sides need not be multiples of four."""
    return _within(settings, 0)


def picture(settings: NDArray[np.void], stored: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return stored values of pixels, (..., padded_pixels), as pictures, (..., h, w)."""
    across, margin = int(settings["tiles_x"]), int(settings["margin"])
    tiles = stored.reshape(*stored.shape[:-1], -1, across, 4, 4).swapaxes(-3, -2)
    rows = tiles.reshape(*stored.shape[:-1], -1, 4 * across)
    width, height = int(settings["width"]), int(settings["height"])
    return rows[..., margin : margin + height, margin : margin + width]


def sampled_pixels(settings: NDArray[np.void]) -> Integers:
    """Return the pixels that have samples, ascending: those of the picture and its margin."""
    return _within(settings, int(settings["margin"]))


def in_groups(settings: NDArray[np.void], reach: int) -> Integers:
    """Return the pixels that have samples in the order of groups, see kernels/transport/reuse.cl.

    The pixels of a group lie anywhere in a square of the whole film, so that their noise, which is
    alike, forms no pattern. All of a square have samples: so a crop has the groups of the film.
    reach: of the filter [pixels].
    """
    crop = [int(settings[name]) for name in ("crop_x", "crop_y")]
    places = [xy + at for xy, at in zip(pixels(settings), crop, strict=True)]
    squares: list[Integers] = []
    inside = np.ones(len(places[0]), bool)
    for place, at, size in zip(places, crop, ("width", "height"), strict=True):
        squares.append(place // SQUARE)
        inside &= (at - reach) // SQUARE <= squares[-1]
        inside &= squares[-1] <= (at + int(settings[size]) + reach - 1) // SQUARE
    keys: list[NDArray[Any]] = [_scattered(*places), *squares]
    order = np.lexsort(keys)
    return order[inside[order]]


def _scattered(x: Integers, y: Integers) -> NDArray[np.uint32]:
    """Return a number for each pixel of the whole film, without any order among neighbours."""
    word = x.astype(np.uint32) * np.uint32(0x9E3779B1) ^ y.astype(np.uint32) * np.uint32(0x85EBCA77)
    for shift in (15, 13):
        word = (word ^ word >> np.uint32(shift)) * np.uint32(0x2C1B3C6D)
    return word ^ word >> np.uint32(16)


def _within(settings: NDArray[np.void], margin: int) -> Integers:
    """The pixels in the picture and in a margin around it."""
    x, y = pixels(settings)
    width, height = int(settings["width"]), int(settings["height"])
    across = (-margin <= x) & (x < width + margin)
    return np.flatnonzero(across & (-margin <= y) & (y < height + margin))


def work_table(
    settings: NDArray[np.void], order: Integers, ends: Integers | None = None
) -> NDArray[np.uint32]:
    """Deal pixels in turn to the slots of a plane; return `work_list` of kernels/film/film.cl.

    order: the pixels, in the order of their samples; ends: the end of the samples of each pixel, by
    default the end of the render. (2 * padded_pixels + per_plane,) uint32: the pixel that follows
    each pixel, the end of each, and the first pixel of each slot; padded_pixels stands for none.
    """
    padded_pixels, slots = int(settings["padded_pixels"]), int(settings["per_plane"])
    words = np.full(2 * padded_pixels + slots, padded_pixels, np.uint32)
    words[order[:-slots]] = order[slots:]
    words[padded_pixels : 2 * padded_pixels] = FOREVER
    if ends is not None:
        words[padded_pixels + order] = ends
    words[2 * padded_pixels :][: len(order)] = order[:slots]
    return words


class CellGrid:
    """The cell of each pixel; settings: of the paths, which give the film's size.

    across: squares in a row; inside: the pixels of the picture, see `inside`; cell:
    (padded_pixels,) of each pixel; pixels: (cells,) number of pixels in each cell.
    """

    def __init__(self, settings: NDArray[np.void]):
        x, y = pixels(settings)
        self.inside = inside(settings)
        self.across, down = (-(-int(settings[name]) // SIDE) for name in ("width", "height"))
        self.cell: Integers = 2 * (y // SIDE * self.across + x // SIDE) + (x + y) % 2
        count = 2 * self.across * down
        self.pixels: Integers = np.bincount(self.cell[self.inside], minlength=count)


COUNTERS = COUNTER_NUMBERS.names
PADDING = 80  # words between runs of all slots: powers of two collide in a cache
GROUP = 64  # slots are a multiple of it; the local size of kernels with a single lane
# The kernel that fills the queue of a stage, by the stage's kernel.
QUEUEING = {"shade": "append", "generate": "append_ended", "shadow": "append_shadows"}
QUEUEING["intersect"] = "rays_place"  # only where rays are sorted
# Kernels that fill queues, and their programs.
APPENDING = {"append_begin": "append", "append": "append"}
APPENDING |= {"append_ended": "append_some", "append_shadows": "append_some"}
SORTING = ("rays_begin", "rays_count", "rays_sum", "rays_place")  # in order
APPENDING |= dict.fromkeys(SORTING, "sort_rays")
QUEUE_GROUP = 256  # work-items that append to queues together
FRESH = PATH_BITS["fresh"]
CPU_SLOTS = 1 << 14
UNIT_SLOTS = 1 << 14  # of a GPU's compute unit, which runs about an eighth of them at once
MOST_SLOTS = 1 << 22  # beyond, more slots bring no speed
# Few slots, measured on CPUs: a core keeps its paths in its second cache. If each slot has to take
# many samples, the core waits less for its longest path.
LOOP_SLOTS = 1 << 10  # of a core
WORDS = sum(record.step for record in SLABS) + 2  # of a slot, with the words of queues
LARGEST = max(record.step for record in SLABS)


def path_word(name: str) -> int:
    """Return the first word of a member of `PATH`."""
    return next(m.word for m in PATH.members if m.name == name)


def queue_sizes(slots: int, kinds: int, queued: bool) -> dict[str, int]:
    """Return the words of each buffer: a queue for every kind, or a single queue for the loop.

    Queues bring together the slots that wait for a kind of material. `append` reserves entries for
    a whole group of work-items at once, for a host that enqueues stages. In the loop on the device
    (kernels/stage/loop.cl) a work-item sorts its own slots. The picture is the same to the bit,
    since the work of a slot does not depend on its position in a queue.
    """
    if not queued:
        return {"queue": slots}
    kinds = max(kinds, 1)  # the stages before and after shading have queue 0
    keys = dict.fromkeys(("ray_counts", "ray_starts"), _ray_keys(slots))
    return {"queue": slots * kinds, "queue_starts": kinds, "queue_counts": kinds, **keys}


def queue_steps(
    slots: int, kinds: int, kernel: str = "append"
) -> list[tuple[str, int, int | None]]:
    """Return the kernels that fill queues, in order: name, work-items, work-items of a group.

    kernel: a value of QUEUEING.
    """
    appended = -(-slots // QUEUE_GROUP) * QUEUE_GROUP
    if kernel in SORTING:
        each, every = (_ray_keys(slots), None), (appended, QUEUE_GROUP)
        return [(name, *size) for name, size in zip(SORTING, (each, every) * 2, strict=True)]
    return [("append_begin", kinds, None), (kernel, appended, QUEUE_GROUP)]


def _ray_keys(slots: int) -> int:
    """Keys of rays in all windows, see kernels/stage/sort_rays.cl."""
    return -(-slots // RAY_ORDER["window"]) * RAY_ORDER["keys"]


@dataclass(frozen=True)
class Slots:
    """The number of paths in flight: slots of each plane, and planes.

    The slots of a plane share the pixels of the film; planes share the samples of a pixel. halves:
    2 where even and odd samples are kept apart, and planes are an even number; else 1. octaves: 2
    where octaves of samples are, see kernels/film/film.cl; else 1.
    """

    per_plane: int
    planes: int
    halves: int = 1
    octaves: int = 1

    @property
    def total(self) -> int:
        return self.per_plane * self.planes


def default_slots(info: device.DeviceInfo, footprint: int = 0) -> int:
    """Return the number of paths in flight for a device.

    A CPU gets as many as its cache holds. A GPU gets several times as many as it runs at once, so
    that no compute unit is idle while the last work-items of a queue run. footprint: words of a
    slot beside its state.
    """
    if info.is_cpu:
        return CPU_SLOTS * WORDS // (WORDS + footprint)
    return min(info.compute_units * UNIT_SLOTS, MOST_SLOTS)


def divide_film(
    info: device.DeviceInfo,
    padded_pixels: int,
    memory: int,
    slots: int | None,
    looped: bool,
    halves: bool = False,
    footprint: int = 0,
) -> Slots:
    """Return the division of a film among slots.

    memory: limit of all buffers [bytes]; slots get at most half. slots: the wanted number, None for
    the default of the device; footprint: words of a slot beside its state. A film with fewer pixels
    than slots gets several planes, with halves an even number of planes. The picture does not
    depend on the division.

    Raises MemoryBudgetError.
    """
    words, largest = WORDS + footprint, max(LARGEST, footprint)
    room = min(memory // 2 // (4 * words), info.max_alloc // 4 // largest)
    wanted = min(slots or default_slots(info, footprint), int(room) - PADDING)
    if wanted < GROUP:
        advice = "close other programs or choose another device"
        raise MemoryBudgetError(
            "the least number of paths", 8 * words * GROUP, 8 * words * max(int(room), 0), advice
        )
    film = -(-padded_pixels // GROUP) * GROUP
    per_plane = min(wanted // GROUP * GROUP, film)
    planes = max(1, wanted // film) if per_plane == film else 1
    if halves and planes % 2:
        planes += 1
        per_plane = max(wanted // planes // GROUP, 1) * GROUP
    if slots is None and looped and info.is_cpu:
        fewer = max(LOOP_SLOTS * info.compute_units // planes // GROUP, 1) * GROUP
        per_plane = min(fewer, per_plane)
    return Slots(per_plane, planes, 2 if halves else 1)


class PathBuffers:
    """The state of the paths in flight on a device.

    settings: a copy of the lowered scene's, with the numbers of slots and planes and the seed of
    the samples; pixels: number of sampled pixels, with the margin; blocks: slots beyond the slots
    of the paths, see kernels/transport/queue.cl; in_blocks: whether slabs are in blocks, see
    kernels/core/slab.cl.

    Raises MemoryBudgetError.
    """

    def __init__(
        self,
        stream: device.Stream,
        buffers: Buffers,
        lowered: Lowered,
        slots: Slots,
        blocks: int,
        queued: bool,
        in_blocks: bool,
    ):
        self.stream, self.buffers, self._in_blocks = stream, buffers, in_blocks
        self._slots, self.slots = slots, slots.total
        self._stride = -(-(slots.total + blocks) // SLAB_BLOCK) * SLAB_BLOCK
        if not in_blocks:
            self._stride += PADDING
        self.settings = self._with_slots(lowered.settings)
        self._fixed: dict[str, Any] = {"stride": self._stride, "slots": self.slots}
        for record in SLABS:
            name, size = f"{record.name.lower()}_words", 4 * record.step * self._stride
            buffer = buffers.allocate(name, size, "lower the number of slots")
            stream.fill(buffer, 0, 0, size)
            self._fixed[name] = buffer
        if footprint := lowered.features.footprint_words:
            size = 4 * footprint * self.slots
            buffer = buffers.allocate("the footprints", size, "lower the number of slots")
            stream.fill(buffer, 0, 0, size)
            self._fixed["footprints"] = buffer
        self._fixed["counters"] = buffers.allocate("the counters", 8 * len(COUNTERS))
        self._fixed["settings"] = buffers.upload("the settings", _words(self.settings))
        film = lowered.features.film
        if film.reuse:
            sampled = in_groups(self.settings, film.filter.reach)
        else:
            sampled = sampled_pixels(self.settings)
        self.pixels = len(sampled)
        every_pixel = work_table(self.settings, sampled)
        self._fixed["work_list"] = buffers.upload("the work list", every_pixel)
        self.queue = self.new_queue(queued, len(lowered.features.materials.kinds))

    @property
    def arguments(self) -> dict[str, Any]:
        """The kernels' arguments by name."""
        return {**self._fixed, **self.queue}

    @cached_property
    def cells(self) -> CellGrid:
        """The cells of the film."""
        return CellGrid(self.settings)

    def new_queue(self, queued: bool, kinds: int) -> dict[str, Any]:
        """Return new buffers for queues of slots, by the names of kernels' arguments."""
        sizes = queue_sizes(self.slots, kinds, queued)
        return {name: self.buffers.allocate("the queues", 4 * n) for name, n in sizes.items()}

    def set_work_list(self, padded_pixels: Integers, ends: Integers | None = None) -> None:
        """Enqueue that slots sample these pixels from now on, each up to its end."""
        table = work_table(self.settings, padded_pixels, ends)
        self.stream.write(self._fixed["work_list"], table)

    def set_seed(self, seed: int) -> None:
        """Enqueue that samples are those of a seed from now on."""
        changed = self.settings.copy()
        changed["seed"] = seed % 2**32
        self._set(changed)

    def set_settings(self, settings: NDArray[np.void]) -> None:
        """Enqueue the settings of another lowering, of a film of the same size."""
        self._set(self._with_slots(settings))

    def restart(self) -> None:
        """Enqueue that every slot begins its list of pixels again."""
        self.stream.fill_rows(self._fixed["path_words"], FRESH, self.rows(PATH, path_word("state")))
        self.stream.fill(self._fixed["counters"], 0, 0, 8)

    def abandon(self) -> None:
        """Let every path in flight end where it is, with the light that it has; wait.

        Its sample counts as rejected. The film itself counts light that is not finite.
        """
        states, light = self._read_words("state"), self._read_words("radiance").view(np.float32)
        ends = states & PATH_BITS["alive"] != 0
        states &= ~np.uint32(PATH_BITS["alive"])
        rows = self.rows(PATH, path_word("state"))
        self.stream.write_rows(self._fixed["path_words"], states, rows)
        counters, event = self.read_counters()
        device.wait(event)
        counters[COUNTERS.index("rejected")] += np.count_nonzero(ends & np.isfinite(light))
        self.stream.write(self._fixed["counters"], counters)

    def _read_words(self, name: str) -> NDArray[np.uint32]:
        """Wait and return the first word of a member of `PATH` of each slot, (slots,)."""
        rows = self.rows(PATH, path_word(name))
        words = np.zeros(self.slots, np.uint32)
        return self.stream.read_rows(self._fixed["path_words"], words, rows)

    def rows(self, record: Record, word: int) -> device.Rows:
        """Where a slab has a word of all slots that hold paths."""
        if not self._in_blocks:
            stride = 4 * self._stride
            return device.Rows(word * stride, 4 * self.slots, stride, 1)
        size = 4 * SLAB_BLOCK
        return device.Rows(word * size, size, record.step * size, self.slots // SLAB_BLOCK)

    def clear_counters(self) -> None:
        """Enqueue that every counter is zero."""
        self.stream.fill(self._fixed["counters"], 0, 0, 8 * len(COUNTERS))

    def read_counters(self) -> tuple[NDArray[np.uint64], cl.Event]:
        """Enqueue a read of the counters; return the array on the host, and the event."""
        host = np.zeros(len(COUNTERS), np.uint64)
        return host, self.stream.read_later(self._fixed["counters"], host)

    def _with_slots(self, settings: NDArray[np.void]) -> NDArray[np.void]:
        changed = settings.copy()
        changed["per_plane"], changed["planes"] = self._slots.per_plane, self._slots.planes
        changed["slots"], changed["halves"] = self._slots.total, self._slots.halves
        changed["octaves"] = self._slots.octaves
        leave = np.count_nonzero(sampled_pixels(changed) < changed["photon_pixels"])
        groups = max(int(changed["wavelength_groups"]), 1)
        changed["photon_paths"] = leave * int(changed["light_paths"]) / groups
        return changed

    def _set(self, settings: NDArray[np.void]) -> None:
        if settings.tobytes() != self.settings.tobytes():  # numpy swallows Ctrl-C in a !=
            self.stream.write(self._fixed["settings"], _words(settings))
            self.settings = settings


def _words(settings: NDArray[np.void]) -> NDArray[np.uint32]:
    return settings.reshape(1).view(np.uint32)
