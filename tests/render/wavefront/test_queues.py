"""Queues of slots by the kind of their material: sorting in the loop, and appending; and blocks."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
import pytest

from clpt import device
from clpt.device import Source
from clpt.records import HIT, PATH, SHADOW, SLABS
from clpt.render.codegen.signatures import scene_text
from clpt.render.wavefront import queues

ALIVE = 0x1000
KINDS = 5
VIRTUAL = {
    "generated/scene.cl": scene_text(),
    "generated/spectrum.cl": '#include "spectrum/rgb.cl"\n',
    "generated/spectrum_read.cl": '#include "spectrum/rgb_read.cl"\n',
    "generated/stage_args.cl": "",
    "sorting.cl": """
#define PART loop_sort
#include "stage/sort.cl"
kernel void probe(SLAB_ARGS, global uint *queue, global uint *queue_starts, uint begin, uint end)
{
    uint starts[BSDF_COUNT + 1];
    loop_sort(path_words, hit_words, shadow_words, stride, queue, starts, end, begin);
    for (int k = 0; k <= BSDF_COUNT; k++) queue_starts[k] = starts[k];
}
""",
    "blocks.cl": """
#include "core/base.cl"
#include "path/block.cl"
kernel void probe(
    SLAB_ARGS, global const uint *queue, global uint *where, uint entry, uint end, uint block)
{
    SLABS
    uint at = block_take(path, hit, shadow, queue, entry, end, block);
    where[0] = at;
    mask active = LANE_INDEX + (integer)((int)entry) < (int)end;
    store_path_sample(path, at, active, load_path_sample(path, at) + load_hit_prim(hit, at));
    store_shadow_t(shadow, at, active, load_shadow_t(shadow, at) * 2.0f);
    store_hit_t(hit, at, active, (real)(-1.0f));
    block_return(path, shadow, queue, entry, end, block);
}
""",
}


def slab_words(record: type, stride: int, **members: np.ndarray) -> np.ndarray:
    """A slab with these members set, (words, stride) uint32."""
    words = np.zeros((record.words, stride), np.uint32)
    for member in record.members:
        if member.name in members:
            words[member.word, : len(members[member.name])] = members[member.name].astype(np.uint32)
    return words


def assembled(name: str, lanes: int = 1) -> Source:
    defines = {"LANES": lanes, "QUEUED": 0, "BSDF_COUNT": KINDS}
    return device.assemble(name, VIRTUAL, defines)


def on_device(
    source: Source, steps: tuple, host: dict[str, np.ndarray], **numbers: int
) -> dict[str, np.ndarray]:
    """Run the kernels of a program on arrays; return what these then hold."""
    on = device.choose()
    program = device.build(on, source)
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    named = {name: cl.Buffer(on.context, flags, hostbuf=a) for name, a in host.items()}
    for name, size, group in steps:
        kernel = program.kernel(name)
        values = {**named, **numbers}
        bound = kernel.bind(**{a.name: values[a.name] for a in kernel.arguments})
        bound.enqueue(on.queue, (size,), group and (group,))
    for name, array in host.items():
        cl.enqueue_copy(on.queue, array, named[name])
    return host


def some(slots: int) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Slabs, the slots that wait, and the kind of each."""
    rng = np.random.default_rng(slots)
    kind = rng.integers(0, KINDS, slots)
    kind[kind == 3] = 2  # a kind that nobody waits for
    alive, hit = rng.random(slots) < 0.8, rng.random(slots) < 0.9
    state = np.where(alive, ALIVE | 7, 7)
    prim = np.where(hit, 5, -1)
    material = kind << 24 | rng.integers(0, 1 << 24, slots)
    waits = np.flatnonzero(alive & hit)
    return slabs(slots, state, prim, material), waits, kind[waits]


def slabs(slots: int, *members: np.ndarray) -> dict[str, np.ndarray]:
    state, prim, material = members
    return {
        "path_words": slab_words(PATH, slots + 80, state=state),
        "hit_words": slab_words(HIT, slots + 80, prim=prim, material=material),
        "shadow_words": np.zeros(1, np.uint32),
    }


@pytest.mark.parametrize(("slots", "begin", "end"), [(64, 0, 64), (1000, 64, 777), (4096, 0, 4096)])
def test_sorting_against_numpy(slots: int, begin: int, end: int) -> None:
    """Of its own slots alone, and nothing is written beyond its own entries."""
    host, waits, kind = some(slots)
    host |= {"queue": np.full(slots, 0xDEAD, np.uint32), "queue_starts": np.zeros(6, np.uint32)}
    numbers = {"stride": slots + 80, "begin": begin, "end": end}
    made = on_device(assembled("sorting.cl"), (("probe", 1, None),), host, **numbers)
    own = (waits >= begin) & (waits < end)
    waits, kind = waits[own], kind[own]
    counts = np.bincount(kind, minlength=KINDS)
    assert np.array_equal(made["queue_starts"], begin + np.cumsum([0, *counts]))
    expected = np.full(slots, 0xDEAD)
    expected[begin : begin + len(waits)] = waits[np.argsort(kind, kind="stable")]
    assert np.array_equal(made["queue"], expected)


@pytest.mark.parametrize("slots", [64, 1000, 4096])
def test_appending_gathers_the_same(slots: int) -> None:
    """Every slot that waits is once in the queue of its kind; what is behind is left alone."""
    host, waits, kind = some(slots)
    host |= {n: np.full(k, 0xDEAD, np.uint32) for n, k in queues.sizes(slots, KINDS).items()}
    numbers = {"stride": slots + 80, "slots": slots}
    made = on_device(
        assembled("stage/append.cl"), tuple(queues.steps(slots, KINDS)), host, **numbers
    )
    counts = made["queue_counts"]
    assert np.array_equal(counts, np.bincount(kind, minlength=KINDS))
    assert np.array_equal(made["queue_starts"], slots * np.arange(KINDS))
    for number, own in enumerate(made["queue"].reshape(KINDS, slots)):
        assert np.array_equal(np.sort(own[: counts[number]]), waits[kind == number])
        assert (own[counts[number] :] == 0xDEAD).all()


def test_nothing_waits() -> None:
    host = slabs(100, *np.zeros((3, 100)))
    host |= {n: np.full(k, 0xDEAD, np.uint32) for n, k in queues.sizes(100, KINDS).items()}
    steps = tuple(queues.steps(100, KINDS))
    made = on_device(assembled("stage/append.cl"), steps, host, stride=180, slots=100)
    assert not made["queue_counts"].any()


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_blocks_bring_paths_and_take_them_back(lanes: int) -> None:
    """What is shaded there is changed in the slots of the queue alone, but for what a hit was."""
    slots, entry = 64, 3
    end, block = entry + max(lanes - 3, 1), slots
    rng = np.random.default_rng(lanes)
    names = [f"{record.name.lower()}_words" for record in SLABS]
    host = {
        name: rng.integers(1, 1 << 20, (record.words, slots + 80)).astype(np.uint32)
        for name, record in zip(names, SLABS, strict=True)
    }
    word = {m.name: m.word for m in (*PATH.members, *SHADOW.members) if m.name in ("sample", "t")}
    prim = next(m.word for m in HIT.members if m.name == "prim")
    host["shadow_words"][word["t"]] = np.float32(1.5).view(np.uint32)
    before = {name: words[:, :slots].copy() for name, words in host.items()}
    queue = rng.permutation(slots).astype(np.uint32)
    arguments = {**host, "queue": queue, "where": np.zeros(1, np.uint32)}
    numbers = {"stride": slots + 80, "entry": entry, "end": end, "block": block}
    made = on_device(assembled("blocks.cl", lanes), (("probe", 1, None),), arguments, **numbers)
    own = queue[entry:end]
    assert made["where"][0] == (block if lanes > 1 else own[0])
    before["path_words"][word["sample"], own] += before["hit_words"][prim, own]
    before["shadow_words"][word["t"], own] = np.float32(3.0).view(np.uint32)
    for name in ("path_words", "shadow_words"):
        assert np.array_equal(made[name][:, :slots], before[name])
