"""Queues of slots by the kind of their material: in the loop, with blocks, and appending."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

import clpt
from bench.warps import ray_keys
from clpt import device
from clpt.device import Source
from clpt.records import HIT, PATH, RAY_ORDER, SETTINGS, SHADOW, SLABS
from clpt.records.layout import SLAB_BLOCK, Record
from clpt.render.flow import programs
from clpt.render.flow.blocks import blocks_text, members, unused
from clpt.render.flow.flags import scene_text, slab_words_text
from clpt.render.flow.scene_to_tables import lower
from clpt.render.wavefront.path_buffers import queue_sizes, queue_steps
from clpt.scene import Scene, integrators
from clpt.scene.cameras import Perspective

ROOT = Path(__file__).resolve().parents[3]
SCENES = [
    "tests/scenes/instances.xml",
    "tests/scenes/light_tracing.xml",
    "tests/scenes/textures.xml",
    "tests/scenes/glass_metal.xml",
    "scenes/oil_film/scene.json",
    "scenes/fluorescent_paint/scene.json",
    "scenes/rainbow/scene.json",
]
CALL = re.compile(r"\b(load|store)_(path|hit|shadow)_(\w+)\((?!Slab )")
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
ALIVE = 0x1000
KINDS = 5
VIRTUAL = {
    "generated/scene.cl": scene_text(),
    "generated/spectrum.cl": '#include "spectra/rgb.cl"\n',
    "generated/spectrum_read.cl": '#include "spectra/rgb.cl#read"\n',
    "generated/slab_words.cl": slab_words_text(),
    "generated/block.cl": blocks_text([lower(Scene(camera=Perspective())).features]),
    "sorting.cl": """
#include "core/base.cl"
#include "transport/queue.cl"
kernel void probe(SLAB_ARGS, global uint *queue, global uint *queue_starts, uint begin, uint end)
{
    SLABS
    uint starts[BSDF_COUNT + 1];
    queue_sort(path, hit, queue, starts, begin, end);
    for (int k = 0; k <= BSDF_COUNT; k++) queue_starts[k] = starts[k];
}
""",
    "blocks.cl": """
#include "core/base.cl"
#include "transport/queue.cl"
kernel void probe(SLAB_ARGS, global const uint *queue, uint entry, uint end, uint block)
{
    SLABS
    queue_take(path, hit, shadow, BLOCK_WORDS(0), queue, entry, end, block);
    mask all = mask_of(1);
    store_path_state(path, block, all, load_path_sample(path, block) + load_hit_prim(hit, block));
    store_path_pdf(path, block, all, load_path_pdf(path, block) * 2.0f);
    store_shadow_t(shadow, block, all, load_shadow_t(shadow, block) * 2.0f);
    store_hit_t(hit, block, all, (real)(-1.0f));
    constant BlockWords *own = BLOCK_WORDS(0);
    queue_return(path, shadow, own, own->shadow_words, own->shadow, queue, entry, end, block);
}
""",
}


def laid(record: Record, words: np.ndarray, lanes: int) -> np.ndarray:
    """Words (words, slots) as they lie in a slab: blocks (blocks, step, SLAB_BLOCK), or as is."""
    if lanes > 1:
        return words
    filled = np.zeros((record.step, words.shape[1]), words.dtype)
    filled[: record.words] = words
    return np.ascontiguousarray(filled.reshape(record.step, -1, SLAB_BLOCK).swapaxes(0, 1))


def taken(record: Record, slab: np.ndarray, lanes: int) -> np.ndarray:
    """The same back, (words, slots)."""
    if lanes > 1:
        return slab
    return slab.swapaxes(0, 1).reshape(record.step, -1)[: record.words]


def stride_of(slots: int) -> int:
    """Slots that a slab has room for."""
    return (slots // SLAB_BLOCK + 1) * SLAB_BLOCK


def slab_words(record: Record, slots: int, lanes: int, **members: np.ndarray) -> np.ndarray:
    """A slab with these members set."""
    words = np.zeros((record.words, stride_of(slots)), np.uint32)
    for member in record.members:
        if member.name in members:
            words[member.word, : len(members[member.name])] = members[member.name].astype(np.uint32)
    return laid(record, words, lanes)


def assembled(name: str, lanes: int = 1) -> Source:
    block = SLAB_BLOCK if lanes == 1 else 0
    defines = {"LANES": lanes, "QUEUED": 0, "BSDF_COUNT": KINDS, "SLAB_BLOCK": block}
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


def some(slots: int, lanes: int = 1) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Slabs, the slots that wait, and the kind of each."""
    rng = np.random.default_rng(slots)
    kind = rng.integers(0, KINDS, slots)
    kind[kind == 3] = 2  # a kind that nobody waits for
    alive, hit = rng.random(slots) < 0.8, rng.random(slots) < 0.9
    state = np.where(alive, ALIVE | 7, 7)
    prim = np.where(hit, 5, -1)
    material = kind << 24 | rng.integers(0, 1 << 24, slots)
    waits = np.flatnonzero(alive & hit)
    return slabs(slots, lanes, state, prim, material), waits, kind[waits]


def slabs(slots: int, lanes: int, *members: np.ndarray) -> dict[str, np.ndarray]:
    state, prim, material = members
    return {
        "path_words": slab_words(PATH, slots, lanes, state=state),
        "hit_words": slab_words(HIT, slots, lanes, prim=prim, material=material),
        "shadow_words": np.zeros(1, np.uint32),
    }


@pytest.mark.parametrize("lanes", [1, 16])
@pytest.mark.parametrize(("slots", "begin", "end"), [(64, 0, 64), (1024, 64, 784), (4096, 0, 4096)])
def test_sorting_against_numpy(slots: int, begin: int, end: int, lanes: int) -> None:
    """Of its own slots alone, and nothing is written beyond its own entries."""
    host, waits, kind = some(slots, lanes)
    host |= {"queue": np.full(slots, 0xDEAD, np.uint32), "queue_starts": np.zeros(6, np.uint32)}
    numbers = {"stride": stride_of(slots), "begin": begin, "end": end}
    made = on_device(assembled("sorting.cl", lanes), (("probe", 1, None),), host, **numbers)
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
    host |= {n: np.full(k, 0xDEAD, np.uint32) for n, k in queue_sizes(slots, KINDS, True).items()}
    numbers = {"stride": stride_of(slots), "slots": slots}
    made = on_device(
        assembled("stage/append.cl"), tuple(queue_steps(slots, KINDS)), host, **numbers
    )
    counts = made["queue_counts"]
    assert np.array_equal(counts, np.bincount(kind, minlength=KINDS))
    assert np.array_equal(made["queue_starts"], slots * np.arange(KINDS))
    for number, own in enumerate(made["queue"].reshape(KINDS, slots)):
        assert np.array_equal(np.sort(own[: counts[number]]), waits[kind == number])
        assert (own[counts[number] :] == 0xDEAD).all()


@pytest.mark.parametrize("kernel", ["append_ended", "append_shadows"])
@pytest.mark.parametrize("slots", [64, 1000, 4096])
def test_stages_get_the_slots_with_work(kernel: str, slots: int) -> None:
    """Each slot is once in queue 0; its group need not be a number of slots."""
    rng = np.random.default_rng(slots)
    host, waits, _ = some(slots)
    far = np.where(rng.random(slots) < 0.4, 2.5, 0.0).astype(np.float32)
    host["shadow_words"] = slab_words(SHADOW, slots, 1, t=far.view(np.uint32))
    expected = np.flatnonzero(far) if kernel == "append_shadows" else np.delete(range(slots), waits)
    host |= {n: np.full(k, 0xDEAD, np.uint32) for n, k in queue_sizes(slots, KINDS, True).items()}
    numbers = {"stride": stride_of(slots), "slots": slots}
    host["queue_counts"][0] = 0
    steps = tuple(queue_steps(slots, 1, kernel))[1:]
    words = on_device(assembled("stage/append_some.cl"), steps, host, **numbers)
    count = words["queue_counts"][0]
    np.testing.assert_array_equal(np.sort(words["queue"][:count]), expected)
    assert (words["queue"][count:] == 0xDEAD).all()


@pytest.mark.parametrize("slots", [64, 1088, RAY_ORDER["window"] + 320])
def test_rays_are_sorted_by_octant_and_cell(slots: int) -> None:
    """In each window; each slot is there once, those without a ray at the end of a window."""
    rng = np.random.default_rng(slots)
    settings = np.zeros(1, SETTINGS.dtype)
    settings["center"], settings["scene_radius"] = [1.0, -2.0, 3.0], 2.5
    rays = rng.normal(0, 2, (slots, 8)).astype(np.float32)
    keys = ray_keys(rays, settings[0])
    alive = rng.random(slots) < 0.9
    keys[~alive] = RAY_ORDER["keys"] - 1
    path = np.zeros((PATH.words, stride_of(slots)), np.uint32)
    word = {member.name: member.word for member in PATH.members}
    path[word["state"], :slots] = np.where(alive, ALIVE | 7, 7)
    for name, rows in (("o", rays[:, :3]), ("d", rays[:, 4:7])):
        path[word[name] : word[name] + 3, :slots] = rows.T.view(np.uint32)
    host = {name: np.zeros(1, np.uint32) for name in ("hit_words", "shadow_words")}
    host |= {"path_words": laid(PATH, path, 1), "settings": settings.view(np.uint32)}
    host |= {n: np.full(k, 0xDEAD, np.uint32) for n, k in queue_sizes(slots, 1, True).items()}
    steps, numbers = queue_steps(slots, 1, "rays_place"), {"stride": stride_of(slots)}
    made = on_device(assembled("stage/sort_rays.cl"), tuple(steps), host, slots=slots, **numbers)
    assert made["queue_counts"][0] == slots
    window = np.arange(slots) // RAY_ORDER["window"]
    queue = made["queue"].astype(int)
    assert np.array_equal(np.sort(queue), np.arange(slots))
    assert np.array_equal(window[queue], window)
    assert np.array_equal(keys[queue], keys[np.lexsort((keys, window))])


def test_nothing_waits() -> None:
    host = slabs(100, 1, *np.zeros((3, 100)))
    host |= {n: np.full(k, 0xDEAD, np.uint32) for n, k in queue_sizes(100, KINDS, True).items()}
    steps = tuple(queue_steps(100, KINDS))
    made = on_device(assembled("stage/append.cl"), steps, host, stride=128, slots=100)
    assert not made["queue_counts"].any()


@pytest.mark.parametrize("lanes", [1, 8, 16])
def test_blocks_bring_paths_and_take_them_back(lanes: int) -> None:
    """What is shaded there is changed in the slots of the queue alone, but for what a hit was."""
    slots, entry = 64, 3
    end, block = entry + max(lanes - 3, 1), slots
    rng = np.random.default_rng(lanes)
    names = [f"{record.name.lower()}_words" for record in SLABS]
    host = {
        name: rng.integers(1, 1 << 20, (record.words, stride_of(slots))).astype(np.uint32)
        for name, record in zip(names, SLABS, strict=True)
    }
    word = {m.name: m.word for record in (SHADOW, HIT, PATH) for m in record.members}
    shadow_t = next(m.word for m in SHADOW.members if m.name == "t")
    host["shadow_words"][shadow_t] = np.float32(1.5).view(np.uint32)
    host["path_words"][word["pdf"]] = np.float32(0.25).view(np.uint32)
    before = {name: words[:, :slots].copy() for name, words in host.items()}
    queue = rng.permutation(slots).astype(np.uint32)
    numbers = {"stride": stride_of(slots), "entry": entry, "end": end, "block": block}
    source = assembled("blocks.cl", lanes)
    slabs = {
        name: laid(record, host[name], lanes) for name, record in zip(names, SLABS, strict=True)
    }
    made = on_device(source, (("probe", 1, None),), {**slabs, "queue": queue}, **numbers)
    made = {
        name: taken(record, made[name], lanes) for name, record in zip(names, SLABS, strict=True)
    }
    own, path = queue[entry:end], before["path_words"]
    path[word["state"], own] = path[word["sample"], own] + before["hit_words"][word["prim"], own]
    path[word["pdf"], own] = np.float32(0.5).view(np.uint32)
    assert np.array_equal(made["path_words"][:, :slots], path)
    others = np.setdiff1d(np.arange(slots), own)
    shadow = made["shadow_words"][:, :slots]
    assert (shadow[shadow_t, own] == np.float32(3.0).view(np.uint32)).all()
    assert np.array_equal(shadow[:, others], before["shadow_words"][:, others])


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("name", SCENES)
def test_blocks_hold_what_shading_uses(name: str, mode: str) -> None:
    """What a text of shading loads is brought, what it stores is returned."""
    scene = clpt.load(ROOT / name)
    film = dataclasses.replace(scene.film, mode=mode, bands=0)
    for integrator in (integrators.Path(), integrators.ParticleTracer()):
        changed = dataclasses.replace(scene, film=film, integrator=integrator)
        try:
            features = lower(changed).features
        except clpt.SceneError:  # not every integrator takes every scene
            assert type(integrator) is not type(scene.integrator)
            continue
        kept = members(features)
        kept |= {"load path": kept["path"], "store path": kept["changed"]}
        texts = programs.sources(features, "wide8", 8, queued=False)
        for program in (name for name in texts if name.startswith("shade_")):
            calls = set(CALL.findall(COMMENT.sub("", texts[program].text)))
            assert len(calls) > 10
            for verb, slab, member in calls:
                own = [*kept.get(f"{verb} {slab}", kept[slab]), *unused(features)]
                assert member in own, f"{program}: {verb}_{slab}_{member}"
