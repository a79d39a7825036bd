"""A wavefront whose stages run singly, and launches of its kernels, to be repeated.

A launch has all input and output words. Repeated on another device, or by a program without
optimisation, it must write the same words up to rounding. Each word has a margin m: for m >= 0 the
words are floats that may differ by m; for m < 0 they are whole numbers modulo 2^32 that may differ
by -1 - m. Words of infinite margin are not compared.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import device, version
from clpt.arrays import Words
from clpt.bench.figures import Taken, timed
from clpt.device.building import OPTIONS
from clpt.errors import SceneError
from clpt.files import output_files
from clpt.records import HIT, PATH, PATH_BITS, SHADOW, SLABS
from clpt.records.layout import SLAB_BLOCK, Record
from clpt.render.flow import programs
from clpt.render.flow.scene_to_tables import lower
from clpt.render.wavefront.bounce_loop import Step, beginning
from clpt.render.wavefront.path_buffers import APPENDING, default_slots
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene

ALIVE, FRESH, DONE = (PATH_BITS[name] for name in ("alive", "fresh", "done"))
ENDLESS = 1 << 24  # samples of a pixel
_TYPES = {"integer": np.int32, "natural": np.uint32}


class Flight:
    """A scene's paths in flight, with about a slot for each pixel of a small picture.

    slots: paths in flight, by default the number of a render on the device. Other parameters and
    errors: see clpt.render.wavefront.wavefront.Wavefront.create.
    """

    def __init__(self, on: device.Device, scene: Scene, slots: int | None = None, **wavefront: Any):
        slots = slots or default_slots(on.info)
        width, height = scene.film.size
        side = math.sqrt(slots * width / height)
        width, height = (max(4, round(n / 4) * 4) for n in (side, slots / side))
        film = dataclasses.replace(
            scene.film, width=width, height=height, crop=None, bands=0, time_bins=0
        )
        self.scene = dataclasses.replace(scene, film=film)
        self.device = on
        self.wavefront = Wavefront.create(on, lower(self.scene), slots=slots, **wavefront)
        self.slots = self.wavefront.paths.slots
        self.restart()

    def restart(self) -> None:
        """Empty the film, and restart every slot at its first sample."""
        self.wavefront.clear()
        self.wavefront.paths.restart()
        beginning(self.wavefront.stages).set_args(samples=(0, ENDLESS))

    def bounce(self) -> None:
        """Enqueue the stages of a bounce."""
        for step in self.wavefront.stages:
            self.stage(step)

    def stage(self, step: Step) -> Any:
        """Enqueue a stage; return its event."""
        return self.wavefront.stream.run(step.bound, step.size, step.group)

    def timed(self, step: Step) -> tuple[int, Taken]:
        """Run a stage; return its items and their time."""
        return self.items(step), timed(self.device, lambda: [self.stage(step)])

    def read(self, record: Record, name: str) -> NDArray:
        """Return a member of all slots: (slots,), or (slots, components)."""
        member = next(m for m in record.members if m.name == name)
        wave = self.wavefront
        buffer = wave.paths.arguments[f"{record.name.lower()}_words"]
        streams = np.empty((member.words, self.slots), _TYPES.get(member.type, np.float32))
        for i, stream in enumerate(streams):
            wave.stream.read_rows(buffer, stream, wave.paths.rows(record, member.word + i))
        return streams[0] if member.words == 1 else np.ascontiguousarray(streams.T)

    @property
    def alive(self) -> NDArray[np.bool_]:
        """Which slots have a ray in flight."""
        return (self.read(PATH, "state") & ALIVE) != 0

    @property
    def met(self) -> NDArray[np.bool_]:
        """Which slots' rays have met a surface; after `intersect`."""
        return self.alive & (self.read(HIT, "prim") >= 0)

    @property
    def waiting(self) -> NDArray[np.bool_]:
        """Which slots begin a path in the next bounce: their path has ended or left the scene."""
        state = self.read(PATH, "state")
        alive = (state & ALIVE) != 0
        missed = alive & ((state & FRESH) == 0) & (self.read(HIT, "prim") < 0)
        return ((state & DONE) == 0) & (~alive | missed)

    @property
    def shadowed(self) -> NDArray[np.bool_]:
        """Which slots have an untested shadow ray."""
        return self.read(SHADOW, "t") > 0.0

    @property
    def kinds(self) -> NDArray[np.int32]:
        """The kind of material at each slot's hit, in the order of the features; or -1."""
        word = self.read(HIT, "material").view(np.uint32)
        return np.where(self.met, (word >> 24).astype(np.int32), -1)

    def items(self, step: Step) -> int:
        """Count the slots that a stage has work for."""
        kernel = step.bound.kernel.name
        if kernel in ("generate", "emit"):
            return int(self.waiting.sum())
        if kernel == "intersect":
            return int(self.alive.sum())
        if kernel == "mix_materials":
            return int(self.met.sum())
        if kernel == "shade":
            kinds = self.wavefront.features.materials.kinds
            return int((self.kinds == kinds.index(step.name.removeprefix("shade_"))).sum())
        if kernel in ("shadow", "splat"):
            return int(self.shadowed.sum())
        return self.slots


PLAIN = ("-cl-opt-disable",)  # compiler options against optimisation
ROUNDING = 1e-3  # margin of a float, over its size plus the mean size of its member
EXACT, FREE = -1.0, np.inf  # margins
MOST_OFF = 0.01  # of a launch's changed words: a rounding may decide a path's choice
FREE_MEMBERS = ("low", "high", "cone")  # low digits of sums; packed halves
NAMED = 4  # the most members in a message
COUNTS = ("queue_starts", "queue_counts")  # other compared buffers; the order in queues is free
DATA = Path(__file__).parent / "data"
HOSTS = ("launch.c", "launch.py")  # stored as .txt: they are no part of clpt
_ROW = re.compile(r"^#line \d+.*$", re.MULTILINE)
README = Template("""A launch of an OpenCL kernel, written by clpt $version.

    python launch.py [PLATFORM [DEVICE]]
    cc -std=c99 launch.c -lOpenCL -lm -o launch && ./launch [PLATFORM [DEVICE]]

Each builds kernel.cl, gives the kernel the words of *.before, runs it once, and compares what it
wrote with *.expected. The exit status is 0 for words that are right, 1 for wrong ones, 2 where
nothing ran. launch.txt has the numbers of work-items and the arguments in their order.

scene       $scene
stage       $stage
expected    by $witness
device      $result
on          $label, $opencl, driver $driver

All files hold words of 32 bits in the host's order. *.margins has a float for each word: its
margin. A margin m of 0 or more: the words are floats, and may differ by m. Below 0: they are
whole numbers, and may differ by -1 - m. Infinite: the word is not compared.
""")


@dataclass(frozen=True, eq=False)
class Launch:
    """A launch of a kernel.

    stage: its name in a bounce; text: of its program; size, group: numbers of work-items; before,
    after: the words of each buffer by argument; values: other arguments as bytes, None for a null
    pointer; margins: of the compared words, by buffer.
    """

    stage: str
    kernel: str
    text: device.Source
    size: tuple[int, ...]
    group: tuple[int, ...] | None
    arguments: tuple[device.Argument, ...]
    before: Mapping[str, Words]
    values: Mapping[str, bytes | None]
    after: Mapping[str, Words]
    margins: Mapping[str, NDArray[np.float32]]

    def again(self, on: device.Device, options: Sequence[str] = ()) -> dict[str, Words]:
        """Return the words of the buffers after this launch on a device.

        options: of its compiler. Raises KernelBuildError, DeviceError, MemoryBudgetError.
        """
        kernel = device.build(on, self.text, options).kernel(self.kernel)
        give, stream = device.Buffers(on), device.Stream(on.queue)
        buffers = {name: give.upload(name, words) for name, words in self.before.items()}
        values = {
            name: None if value is None else np.frombuffer(value, np.uint8)
            for name, value in self.values.items()
        }
        stream.run(kernel.bind(**buffers, **values), self.size, self.group)
        after = {}
        for name in self.margins:
            after[name] = stream.read(buffers[name], np.empty_like(self.before[name]))
        give.release(*buffers.values())
        return after

    def expecting(self, after: Mapping[str, Words], flight: Flight) -> Launch:
        """Return this launch with other output words and their margins."""
        margins = {name: _margins(flight, name, after[name]) for name in self.margins}
        return dataclasses.replace(self, after={**self.after, **after}, margins=margins)

    def compare(self, words: Mapping[str, Words], flight: Flight) -> Comparison:
        """Compare a device's output words with this launch's."""
        changed, off = 0, {}
        for name, margins in self.margins.items():
            expected = self.after[name]
            which = is_off(words[name], expected, margins)
            changed += int(((self.before[name] != expected) & (margins != FREE)).sum())
            off[name] = np.flatnonzero(which)
        return Comparison(self, changed, off, _members(flight, off))


@dataclass(frozen=True, eq=False)
class Comparison:
    """A device's words beside a launch: the number of changed words, the indices of wrong words.

    members: names of slabs' members, and of other buffers, with wrong words.
    """

    launch: Launch
    changed: int
    off: Mapping[str, NDArray[np.intp]]
    members: Sequence[str]

    @property
    def share(self) -> float:
        """Wrong words over changed words, at most 1."""
        count = sum(map(len, self.off.values()))
        return min(count / max(self.changed, 1), 1.0)

    @property
    def wrong(self) -> bool:
        """Whether rounding cannot explain all wrong words."""
        return self.share > MOST_OFF

    @property
    def problem(self) -> str:
        """The error as text, or ""."""
        if not self.wrong:
            return ""
        names = ", ".join(self.members[:NAMED]) + (", ..." if len(self.members) > NAMED else "")
        share = f"{max(self.share, 0.01):.0%}".replace("%", " %")
        return f"{share} of what it writes is wrong ({names})"


def launches(flight: Flight) -> Iterator[Launch]:
    """Run a bounce; yield the launch of each stage before the next stage runs."""
    wave = flight.wavefront
    loop, chosen = wave.loops[-1], wave.scene.strategy
    texts = programs.sources(
        loop.features, chosen.layout, wave.lanes, queued=chosen.queued,
        interleaved=chosen.interleaved,
    )  # fmt: skip
    for step in wave.stages:
        yield _launch(flight, step, texts[APPENDING.get(step.name, step.name)])


def _launch(flight: Flight, step: Step, text: device.Source) -> Launch:
    """Run a stage; return its launch."""
    kernel, bound = step.bound.kernel, step.bound.values
    buffers: dict[str, Any] = {}
    values: dict[str, bytes | None] = {}
    for argument in kernel.arguments:
        value = bound[argument.name]
        if argument.by_value:
            values[argument.name] = np.asarray(value).tobytes()
        elif value is None:
            values[argument.name] = None
        else:
            buffers[argument.name] = value
    before = {name: _words(flight, buffer) for name, buffer in buffers.items()}
    flight.stage(step)
    compared = {f"{record.name.lower()}_words" for record in SLABS} | {*COUNTS}
    margins, after = {}, {}
    for name in sorted(compared & buffers.keys()):
        after[name] = _words(flight, buffers[name])
        margins[name] = _margins(flight, name, after[name])
    return Launch(
        step.name, kernel.name, text, step.size, step.group, kernel.arguments, before, values,
        after, margins,
    )  # fmt: skip


def _words(flight: Flight, buffer: Any) -> Words:
    return flight.wavefront.stream.read(buffer, np.empty(buffer.size // 4, np.uint32))


def is_off(words: Words, expected: Words, margins: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return which words differ by more than their margins."""
    with np.errstate(all="ignore"):
        apart = np.abs(words.view(np.float32) - expected.view(np.float32))
        near = apart <= margins
        both_nan = np.isnan(words.view(np.float32)) & np.isnan(expected.view(np.float32))
        steps = np.abs((words - expected).view(np.int32).astype(np.float64))
    floats = (near | both_nan) & (margins >= 0)
    whole = (steps <= -1.0 - margins.astype(np.float64)) & (margins < 0)
    return np.asarray((words != expected) & ~floats & ~whole & (margins != FREE))


def _margins(flight: Flight, name: str, expected: Words) -> NDArray[np.float32]:
    """Return the margin of each word of a buffer."""
    margins: NDArray[np.float32] = np.full(len(expected), EXACT, np.float32)
    record = next((slab for slab in SLABS if f"{slab.name.lower()}_words" == name), None)
    if record is None:
        return margins
    rows, limits = rows_of(flight, record, expected), rows_of(flight, record, margins)
    for member in record.members:
        for word in range(member.word, member.word + member.words):
            digit = ("low", "middle", "high")[word - member.word] if member.type == "fixed" else ""
            limits[:, word] = _member_margins(digit or member.name, member.type, rows[:, word])
    return margins


def _members(flight: Flight, off: Mapping[str, NDArray[np.intp]]) -> list[str]:
    """Return the names of slabs' members, and of other buffers, with wrong words."""
    names: dict[str, None] = {}
    for name, words in off.items():
        record = next((slab for slab in SLABS if f"{slab.name.lower()}_words" == name), None)
        if record is None:
            names |= dict.fromkeys([name] if len(words) else [])
            continue
        stride = flight.wavefront.paths.rows(record, 0).pitch // 4
        in_blocks = flight.wavefront.lanes == 1
        rows = words // SLAB_BLOCK % record.step if in_blocks else words // stride
        for member in record.members:
            if ((rows >= member.word) & (rows < member.word + member.words)).any():
                names[member.name] = None
    return list(names)


def rows_of(flight: Flight, record: Record, words: NDArray) -> NDArray:
    """View a slab's words as (blocks, words, slots of a block)."""
    if flight.wavefront.lanes == 1:
        return words.reshape(-1, record.step, SLAB_BLOCK)
    return words.reshape(1, record.step, -1)


def _member_margins(name: str, kind: str, words: NDArray[np.uint32]) -> NDArray:
    """Return the margins of a member's word for all slots."""
    if name in FREE_MEMBERS:
        return np.full(words.shape, FREE)
    if name == "middle":  # of a sum in units of 2^-48: this word counts units of 2^-16
        signed = np.abs(words.view(np.int32).astype(np.float64))
        return -2.0 - np.ceil(ROUNDING * (signed + signed.mean()))
    if kind in ("integer", "natural", "natural3"):
        return np.full(words.shape, EXACT)
    size = np.abs(words.view(np.float32).astype(np.float64))
    size[~np.isfinite(size)] = 0.0
    return ROUNDING * (size + np.sqrt((size**2).mean()))


def write_program(
    folder: Path, launch: Launch, scene: str, on: device.DeviceInfo, witness: str, result: str
) -> None:
    """Write a launch as a standalone program, which shows a driver's fault without clpt.

    The folder gets the kernel's text, its input words, the expected output words, and a host
    program in C and in Python.

    scene, witness, result: for its README. Raises SceneError if it cannot be written.
    """
    rows, files = _described(launch)
    readme = README.substitute(
        version=version.described(), scene=scene, stage=launch.stage, witness=witness,
        result=result, label=on.label, opencl=on.version, driver=on.driver,
    )  # fmt: skip
    texts = {"launch.txt": "\n".join([*rows, ""]), "README.txt": readme}
    texts["kernel.cl"] = _ROW.sub("", launch.text.text)
    texts |= {name: (DATA / f"{name}.txt").read_text(encoding="utf-8") for name in HOSTS}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in texts.items():
            output_files.write_text(folder / name, text)
        for name, content in files.items():
            output_files.write(folder / name, content)
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=folder) from error


def _described(launch: Launch) -> tuple[list[str], dict[str, bytes]]:
    """Return the rows of launch.txt, and the content of files of words."""
    rows = [" ".join(["options", *OPTIONS]), f"kernel {launch.kernel}"]
    rows.append(" ".join(["size", *map(str, launch.size)]))
    if launch.group:
        rows.append(" ".join(["group", *map(str, launch.group)]))
    changed = sum(
        int(((launch.before[name] != launch.after[name]) & np.isfinite(margins)).sum())
        for name, margins in launch.margins.items()
    )
    rows += [f"allowed {int(MOST_OFF * changed)}", " ".join(["compare", *launch.margins])]
    files: dict[str, bytes] = {}
    for argument in launch.arguments:
        name, kind = argument.name, "buffer" if argument.name in launch.before else "value"
        data = launch.before[name].tobytes() if kind == "buffer" else launch.values[name]
        rows.append(f"argument {kind if data is not None else 'null'} {name} {len(data or b'')}")
        if data is not None:
            files[f"{name}.before"] = data
    for name, margins in launch.margins.items():
        files[f"{name}.expected"] = launch.after[name].tobytes()
        files[f"{name}.margins"] = margins.tobytes()
    return rows, files
