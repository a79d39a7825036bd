"""Speed of each stage of a render: items a second, and bytes a second beside a copy's.

Each stage runs on the state that former stages have left; its items are the slots with work for it.
`traffic` counts the bytes: loads and stores of slabs (clpt/records) in the program's text. Reads
of the scene's tables, trees and textures depend on rays and are not counted: a figure is a lower
bound.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from clpt import device
from clpt.bench.figures import Copying, Figure, Taken, clock_complaint, timed
from clpt.bench.launches import Flight
from clpt.records import SLABS
from clpt.render.film.state import FILM_WORDS
from clpt.render.flow import blocks, programs
from clpt.render.records import Features
from clpt.render.wavefront.path_buffers import APPENDING, queue_sizes, queue_steps
from clpt.scene import Scene

_WORD = 4  # bytes
_COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
_CALL = re.compile(r"(?<!\w)(?P<verb>load|store)_(?P<member>\w+)\((?!Slab )")
_QUEUED = {
    "append": (0, 1),
    "shade": (1, 0),
    "generate": (1, 0),
    "shadow": (1, 0),
}  # words read and written of a queue
WARM = 4  # bounces before the measurement, so that paths of all depths are in flight
BOUNCES = 4  # of a round: in a single bounce few paths may begin

Work = tuple[int, Taken]  # items, and their time


@dataclass(frozen=True)
class Moved:
    """Bytes that an item of a stage reads and writes, with all branches taken."""

    read: int
    written: int

    @property
    def total(self) -> int:
        return self.read + self.written


def traffic(features: Features, layout: str, *, queued: bool = False) -> dict[str, Moved]:
    """Return the traffic of an item in each program, by the names of `programs.sources`.

    An item is a slot with work: in `generate` a path that ends and its successor, in `intersect`
    and `shade_...` a ray and its hit, in `shadow` a shadow ray, in `append` a slot.
    """
    sizes = words_of_members(features)
    moved = {}
    for name, source in programs.sources(features, layout, 1, queued=queued).items():
        read, written = (_QUEUED.get(name.split("_")[0]) if queued else None) or (0, 0)
        loads, stores = members_moved(source.text, sizes)
        read += sum(sizes[member] for member in loads)
        written += sum(sizes[member] for member in stores)
        moved[name] = Moved(_WORD * read, _WORD * written)
    return moved


def words_of_members(features: Features) -> dict[str, int]:
    """Return the words of the slabs' members that a scene uses, by names such as `path_beta`."""
    unused = blocks.unused(features)
    return {
        f"{record.name.lower()}_{member.name}": member.words
        - (member.type == "spectrum" and not features.spectra.spectral)
        for record in SLABS
        for member in record.members
        if member.name not in unused
    }


def members_moved(text: str, sizes: Mapping[str, int]) -> tuple[set[str], set[str]]:
    """Return the members of `sizes` that a program's text loads, and those that it stores."""
    members: dict[str, set[str]] = {"load": set(), "store": set()}
    for call in _CALL.finditer(_COMMENT.sub("", text)):
        if call["member"] in sizes:
            members[call["verb"]].add(call["member"])
    return members["load"], members["store"]


def measure(
    on: device.Device,
    scene: Scene,
    rounds: int,
    only: Sequence[str] = (),
    **wavefront: Any,
) -> Iterator[Figure]:
    """Yield figures of every stage, in Mitems/s; a round has a few bounces.

    only: names of stages, or prefixes such as `shade`; by default all.
    wavefront: parameters of clpt.render.wavefront.wavefront.Wavefront.create, with its errors.
    """
    flight, copying = Flight(on, scene, **wavefront), Copying(on)
    for _ in range(WARM):
        flight.bounce()
    noted: dict[str, list[Work]] = {}
    for number in range(rounds):
        for step in flight.wavefront.stages * BOUNCES:
            noted.setdefault(step.name, []).append(flight.timed(step))
        for name, each in noted.items():
            noted[name] = [*each[:number], _round(each[number:])]
    wave = flight.wavefront
    features, layout = wave.features, wave.scene.strategy.layout
    moved = traffic(features, layout, queued=wave.scene.strategy.queued)
    for name, work in noted.items():
        if name not in APPENDING and _selected(name, only):
            yield _figure(flight, copying, name, moved[name].total, work)
    if _selected("append", only):
        yield _queue(flight, copying, rounds)
    if _selected("accumulate", only):
        yield _accumulate(flight, copying, rounds)


def _round(each: Sequence[Work]) -> Work:
    """Return the sum of a round's bounces, without idle bounces."""
    busy = [(items, taken) for items, taken in each if items]
    taken = Taken(sum(t.device for _, t in busy), sum(t.host for _, t in busy))
    return sum(items for items, _ in busy), taken


def _selected(name: str, only: Sequence[str]) -> bool:
    return not only or any(name == stage or name.startswith(f"{stage}_") for stage in only)


def _figure(flight: Flight, copying: Copying, name: str, nbytes: float, work: list[Work]) -> Figure:
    """Return the speed of a stage, without idle rounds."""
    busy = [(items, taken) for items, taken in work if items]
    within = 4 * sum(record.step for record in SLABS) * flight.slots
    speeds = tuple(items * 1e-6 / taken.device for items, taken in busy)
    more: dict[str, Any] = {"stage": name, "slots": flight.slots}
    if not busy:
        more["note"] = "no slot had work for it"
        return Figure("stages", name, "Mitems/s", (), flight.scene.name, more)
    copied = copying.rate(within) * 1e-9
    gigabytes = float(np.median(speeds)) * nbytes * 1e-3
    more |= {
        "items": float(np.mean([items for items, _ in busy])),
        "bytes": nbytes,
        "gbytes": gigabytes,
        "copy_gbytes": copied,
        "of_copy": gigabytes / copied,
        "lanes": flight.wavefront.lanes,
        "layout": flight.wavefront.scene.strategy.layout,
        "mode": flight.scene.film.mode,
    }
    figure = Figure("stages", name, "Mitems/s", speeds, flight.scene.name, more)
    wrong = [copying.complaint(nbytes * i, t.device, within) for i, t in busy]
    return figure.refuse(clock_complaint(t for _, t in busy), *wrong)


def _queue(flight: Flight, copying: Copying, rounds: int) -> Figure:
    """Sort all slots into queues by their material's kind, and check the queues."""
    on, wave = flight.device, flight.wavefront
    features, layout = wave.features, wave.scene.strategy.layout
    kinds = len(features.materials.kinds)
    for step in wave.stages:  # up to unshaded hits
        if step.bound.kernel.name in ("shade", "append"):
            break
        flight.stage(step)
    program = device.build(on, programs.append_source(features, layout, wave.lanes))
    named, give = dict(wave.arguments), device.Buffers(on)
    for name, size in queue_sizes(flight.slots, kinds, True).items():
        named[name] = give.allocate("the queues", 4 * size)
    steps = []
    for name, size, group in queue_steps(flight.slots, kinds):
        kernel = program.kernel(name)
        bound = kernel.bind(**{a.name: named[a.name] for a in kernel.arguments})
        steps.append((bound, (size,), (group,) if group else None))
    work: list[Work] = []
    for _ in range(rounds + 1):
        wave.stream.fill(named["queue"], 0xFFFFFFFF, 0, named["queue"].size)
        taken = timed(on, lambda: [wave.stream.run(*step) for step in steps])
        work.append((flight.slots, taken))
    nbytes = traffic(features, layout, queued=True)["append"].total
    figure = _figure(flight, copying, "append", nbytes, work[1:])
    queue, starts, counts = (
        give.download(named[name], (named[name].size // 4,), np.uint32)
        for name in ("queue", "queue_starts", "queue_counts")
    )
    wrong = 0
    for kind in range(kinds):
        slots = queue[starts[kind] :][: counts[kind]]
        expected = np.flatnonzero(flight.kinds == kind)
        wrong += (
            int((np.sort(slots) != expected).sum())
            if len(slots) == len(expected)
            else len(expected)
        )
    return figure.refuse(f"{wrong:,} slots are not where they belong" if wrong else "")


def _accumulate(flight: Flight, copying: Copying, rounds: int) -> Figure:
    """Measure the development of the film; items are pixels."""
    wave = flight.wavefront
    size = flight.scene.film.size
    nbytes = 4.0 * (FILM_WORDS + 4)
    work: list[Work] = []
    for _ in range(rounds + 1):
        taken = timed(flight.device, lambda: [wave.accumulate_film()])
        work.append((size[0] * size[1], taken))
    return _figure(flight, copying, "accumulate", nbytes, work[1:])
