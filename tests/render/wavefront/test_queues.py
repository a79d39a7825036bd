"""Queues of slots by the kind of their material: a stable counting sort, and appending."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
import pytest

from clpt import device
from clpt.records import HIT, PATH
from clpt.render.codegen.signatures import scene_text
from clpt.render.wavefront import queues

ALIVE = 0x1000
KINDS = 5


def slab_words(record: type, stride: int, **members: np.ndarray) -> np.ndarray:
    """A slab with these members set, (words, stride) uint32."""
    words = np.zeros((record.words, stride), np.uint32)
    for member in record.members:
        if member.name in members:
            words[member.word, : len(members[member.name])] = members[member.name].astype(np.uint32)
    return words


def sorted_on_device(
    state: np.ndarray, prim: np.ndarray, material: np.ndarray, chunk: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Run the three kernels of sort.cl; return queue, starts and counts."""
    slots = len(state)
    chunks = -(-slots // chunk)
    sizes = {"queue": slots, "counts": chunks * KINDS, "queue_starts": KINDS, "queue_counts": KINDS}
    steps = (("sort_count", chunks, None), ("sort_scan", 1, None), ("sort_place", chunks, None))
    numbers = {"chunk": chunk, "chunks": chunks, "slots": slots}
    return on_device("sort", steps, sizes, numbers, state, prim, material)


def on_device(
    way: str, steps: tuple, sizes: dict, numbers: dict, *members: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Run the kernels of a program; return queue, starts and counts."""
    state, prim, material = members
    on, stride = device.choose(), len(state) + 80
    virtual = {
        "generated/scene.cl": scene_text(),
        "generated/spectrum.cl": '#include "spectrum/rgb.cl"\n',
        "generated/spectrum_read.cl": '#include "spectrum/rgb_read.cl"\n',
    }
    defines = {"LANES": 1, "QUEUED": 0, "BSDF_COUNT": KINDS}
    program = device.build(on, device.assemble(f"stage/{way}.cl", virtual, defines))
    host = {name: np.full(n, 0xDEAD, np.uint32) for name, n in sizes.items()}
    host["path_words"] = slab_words(PATH, stride, state=state)
    host["hit_words"] = slab_words(HIT, stride, prim=prim, material=material)
    host["shadow_words"] = np.zeros(1, np.uint32)
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    named = {name: cl.Buffer(on.context, flags, hostbuf=a) for name, a in host.items()}
    values = {**named, **numbers, "stride": stride}
    for name, size, group in steps:
        kernel = program.kernel(name)
        bound = kernel.bind(**{a.name: values[a.name] for a in kernel.arguments})
        bound.enqueue(on.queue, (size,), group and (group,))
    for name in sizes:
        cl.enqueue_copy(on.queue, host[name], named[name])
    return host["queue"], host["queue_starts"], host["queue_counts"]


def some(slots: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """State, prim and material words; the slots that wait, and the kind of each."""
    rng = np.random.default_rng(slots)
    kind = rng.integers(0, KINDS, slots)
    kind[kind == 3] = 2  # a kind that nobody waits for
    alive, hit = rng.random(slots) < 0.8, rng.random(slots) < 0.9
    state = np.where(alive, ALIVE | 7, 7)
    prim = np.where(hit, 5, -1)
    material = kind << 24 | rng.integers(0, 1 << 24, slots)
    waits = np.flatnonzero(alive & hit)
    return state, prim, material, waits, kind[waits]


@pytest.mark.parametrize(("slots", "chunk"), [(64, 256), (1000, 64), (4096, 256), (777, 10)])
def test_against_numpy(slots: int, chunk: int) -> None:
    *words, waits, kind = some(slots)
    queue, starts, counts = sorted_on_device(*words, chunk)
    expected = waits[np.argsort(kind, kind="stable")]
    assert np.array_equal(queue[: len(expected)], expected)
    assert np.array_equal(counts, np.bincount(kind, minlength=KINDS))
    assert np.array_equal(starts, np.cumsum([0, *counts[:-1]]))


@pytest.mark.parametrize("slots", [64, 1000, 4096])
def test_appending_gathers_the_same(slots: int) -> None:
    """Every slot that waits is once in the queue of its kind; what is behind is left alone."""
    *words, waits, kind = some(slots)
    sizes = queues.sizes("append", slots, KINDS)
    steps = queues.steps("append", slots, KINDS)
    queue, starts, counts = on_device("append", steps, sizes, queues.numbers(slots), *words)
    assert np.array_equal(counts, np.bincount(kind, minlength=KINDS))
    assert np.array_equal(starts, slots * np.arange(KINDS))
    for number, own in enumerate(queue.reshape(KINDS, slots)):
        assert np.array_equal(np.sort(own[: counts[number]]), waits[kind == number])
        assert (own[counts[number] :] == 0xDEAD).all()


def test_nothing_waits() -> None:
    slots = 100
    _, starts, counts = sorted_on_device(np.zeros(slots), np.zeros(slots), np.zeros(slots), 64)
    assert not counts.any() and not starts.any()
