"""What the stages of a render get through: items a second, and bytes beside a copy's.

Each stage runs on the state that the stages before have left; its items are the slots that it has
work for. Bytes are those of the slabs' members that it reads and writes of each item, without the
scene's tables, trees and textures: so much must be moved, more may be.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from clpt import device
from clpt.records import SLABS
from clpt.render import programs
from clpt.render.resident import CHUNK, QUEUE
from clpt.render.wavefront import FILM_WORDS, Step
from clpt.scene import Scene

from .bandwidth import Copying
from .figures import Figure, Taken, clock_complaint, timed
from .flight import Flight

SORT = ("sort_count", "sort_scan", "sort_place")
WARM = 4  # bounces before anything is noted, so that paths of all depths are in flight

# kernel: (members read, members written) of the slabs Path, Hit and Shadow
MOVED: dict[str, tuple[str, str]] = {
    "generate": (
        "state prim radiance lambdas place sample sum rest samples weight",
        "state sample sum rest samples weight o d lambdas beta radiance pdf eta",
    ),
    "intersect": ("state o d pdf", "hit.t u v n prim shape material"),
    "shade": (
        "state prim material shape o d beta radiance lambdas pdf place sample hit.t u v n eta",
        "o d beta radiance pdf state eta shadow.o shadow.d shadow.t value",
    ),
    "shadow": ("shadow.t shadow.o shadow.d value radiance lambdas", "radiance shadow.t"),
    "mix_materials": ("state prim material hit.t u v o d", "material"),
    "sort": ("state prim material state prim material", ""),
}
MOVED |= {"emit": MOVED["generate"], "splat": MOVED["shadow"]}


def words(kernel: str) -> int:
    """Words of the slabs that a stage reads and writes of each item."""
    return sum(_words(name) for names in MOVED[kernel] for name in names.split())


def _words(name: str) -> int:
    record, _, member = name.rpartition(".")
    for own in SLABS if not record else [r for r in SLABS if r.name.lower() == record]:
        for m in own.members:
            if m.name == member:
                return m.words
    raise KeyError(name)


def measure(
    on: device.Device,
    scene: Scene,
    rounds: int,
    only: Sequence[str] = (),
    **wavefront: Any,
) -> Iterator[Figure]:
    """Figures of every stage, in Mitems/s, each round a bounce. only: names of stages, or all.

    wavefront: parameters of clpt.render.wavefront.Wavefront; raises as that does.
    """
    flight, copying = Flight(on, scene, **wavefront), Copying(on)
    for _ in range(WARM):
        flight.bounce()
    noted: dict[str, list[tuple[int, Taken]]] = {}

    def note(step: Step, enqueue: Callable[[], Any]) -> None:
        items = flight.items(step)
        noted.setdefault(step.name, []).append((items, timed(on, lambda: [enqueue()])))

    for _ in range(rounds):
        flight.bounce(note)
    kernels = {step.name: step.bound.kernel.name for step in flight.wavefront.stages}
    for name, found in noted.items():
        if name not in SORT and (not only or name in only):
            yield _figure(flight, copying, name, 4 * words(kernels[name]), found)
    if not only or "sort" in only:
        yield _sort(flight, copying, rounds)
    if not only or "accumulate" in only:
        yield _accumulate(flight, copying, rounds)


def _figure(
    flight: Flight, copying: Copying, name: str, nbytes: float, found: list[tuple[int, Taken]]
) -> Figure:
    """What a stage got through; rounds in which it had nothing to do count for nothing."""
    busy = [(items, taken) for items, taken in found if items]
    within = 4 * sum(record.words for record in SLABS) * flight.slots
    speeds = tuple(items * 1e-6 / taken.device for items, taken in busy)
    more: dict[str, Any] = {"stage": name, "slots": flight.slots}
    if not busy:
        more["note"] = "no slot had work for it"
        return Figure("stages", name, "Mitems/s", (), flight.scene.name, more)
    copied = copying.rate(within) * 1e-9
    gigabytes = float(np.median(speeds)) * nbytes * 1e-3
    more |= {
        "items": float(np.mean([items for items, _ in found])),
        "bytes": nbytes,
        "gbytes": gigabytes,
        "copy_gbytes": copied,
        "of_copy": gigabytes / copied,
        "lanes": flight.wavefront.lanes,
        "layout": flight.wavefront.tree.layout,
        "mode": flight.scene.film.mode,
    }
    figure = Figure("stages", name, "Mitems/s", speeds, flight.scene.name, more)
    wrong = [copying.complaint(nbytes * i, t.device, within) for i, t in busy]
    return figure.refuse(clock_complaint(t for _, t in busy), *wrong)


def _sort(flight: Flight, copying: Copying, rounds: int) -> Figure:
    """The counting sort of all slots by the kind of their material, looked at afterwards."""
    on, wave = flight.device, flight.wavefront
    features = wave.lowered.features
    for step in wave.stages:  # so that hits wait to be shaded
        if step.bound.kernel.name == "shade" or step.name in SORT:
            break
        flight.stage(step)
    text = programs.sources(features, wave.tree.layout, wave.lanes, queued=True)["sort"]
    program = device.build(on, text)
    chunks, kinds = -(-flight.slots // CHUNK), len(features.materials)
    named = {**wave.named, "chunk": CHUNK, "chunks": chunks, "slots": flight.slots}
    give = device.Buffers(on)
    for name, size in zip(QUEUE, (flight.slots, chunks * kinds, kinds, kinds), strict=True):
        named[name] = give.allocate("the sort", 4 * size)
    bound = []
    for name in SORT:
        kernel = program.kernel(name)
        bound.append(kernel.bind(**{a.name: named[a.name] for a in kernel.arguments}))
    steps = list(zip(bound, ((chunks,), (1,), (chunks,)), strict=True))
    expected = np.argsort(flight.kinds, kind="stable")[(flight.kinds < 0).sum() :]
    found = []
    for _ in range(rounds + 1):
        wave.stream.fill(named["queue"], 0xFFFFFFFF, 0, 4 * flight.slots)
        taken = timed(on, lambda: [wave.stream.run(kernel, size) for kernel, size in steps])
        found.append((flight.slots, taken))
    queue = give.download(named["queue"], (flight.slots,), np.uint32)[: len(expected)]
    nbytes = 4 * (words("sort") + len(expected) / flight.slots)
    figure = _figure(flight, copying, "sort", nbytes, found[1:])
    wrong = int((queue != expected).sum())
    return figure.refuse(
        f"{wrong:,} of {len(queue):,} slots are not where they belong" if wrong else ""
    )


def _accumulate(flight: Flight, copying: Copying, rounds: int) -> Figure:
    """The film made into a picture; its items are pixels."""
    wave = flight.wavefront
    size = flight.scene.film.size
    nbytes = 4.0 * (FILM_WORDS * int(wave.lowered.settings["planes"]) + 4)
    found = []
    for _ in range(rounds + 1):
        taken = timed(flight.device, lambda: [wave.stream.run(wave.accumulate, size)])
        found.append((size[0] * size[1], taken))
    return _figure(flight, copying, "accumulate", nbytes, found[1:])
