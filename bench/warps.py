"""What a GPU's groups of work-items would move: queues of real paths, replayed on a CPU.

    python -m bench.warps [--json FILE] SCENE ...

Paths are in flight as in a render, without order of time. For each stage the table has the share of
slots with work, the share of work-items with work in groups of 32 and of 64 that have any, and the
bytes of sectors of 32 bytes that a group of 32 touches, over the bytes that its program needs:

- `streams`: a word of all slots side by side;
- `blocks`, as on GPUs: of blocks of 32 slots;
- `fours`: in blocks, four words of a slot side by side;
- `sorted`: the same, with words that the same stages need as neighbours;
- `slots`: all words of a slot side by side.

Rows of rays have the work of groups of 32 and 64 in traversal, of `wide8` on a CPU: the mean number
of nodes and leaves over the largest in the group, by the order of the rays.

`--check` compares bounds by the table with an H100's rates in bench/results.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from bench.hour_steps import Row
from bench.upward import visits
from clpt import bvh
from clpt import device as dev
from clpt.bench import opened
from clpt.bench.launches import Flight
from clpt.bench.rays import world
from clpt.bench.stages import members_moved, words_of_members
from clpt.records import PATH, RAY_ORDER, SHADOW, SLABS
from clpt.records.layout import Record
from clpt.render.flow import programs

SCENES = (
    *("cornell", "atrium", "spheres", "glass", "mist"),
    *("scenes/bulb", "scenes/pool", "scenes/breakfast", "scenes/table_glasses", "scenes/cloud"),
)
SECTOR = 8  # words
BLOCK = 32  # slots
WARM, BOUNCES = 4, 4
H100 = Path(__file__).parent / "results" / "2026-11-26-nvidia-h100.jsonl"
COPY = 2.0e12  # bytes a second that it copies

Slots = NDArray[np.int64]


@dataclass(frozen=True)
class Launch:
    """A launch of a stage: the slots that have work, in the order of the work-items.

    among: the number of work-items; items: their numbers that have work.
    """

    stage: str
    slots: Slots
    items: Slots
    among: int


def launches(flight: Flight, rays: dict[str, NDArray[np.float32]]) -> Iterator[Launch]:
    """Yield the launches of some bounces; materials have queues.

    rays: gets the last rays of each kind, a row for each slot, NaN without a ray.
    """
    every = np.arange(flight.slots)
    for number in range(WARM + BOUNCES):
        for step in flight.wavefront.stages:
            kernel, name = step.bound.kernel.name, step.name
            if number < WARM:
                pass
            elif kernel == "shade":
                kind = flight.wavefront.features.materials.kinds.index(name.removeprefix("shade_"))
                queue = np.nonzero(flight.kinds == kind)[0]
                yield Launch(name, queue, np.arange(len(queue)), len(queue))
            elif kernel in ("generate", "intersect", "shadow"):
                masks = {"generate": "waiting", "intersect": "alive", "shadow": "shadowed"}
                slots = every[getattr(flight, masks[kernel])]
                if kernel != "generate":
                    rays[kernel] = _rays(flight, slots, PATH if kernel == "intersect" else SHADOW)
                yield Launch(name, slots, slots, flight.slots)
            flight.stage(step)


def _rays(flight: Flight, slots: Slots, record: Record) -> NDArray[np.float32]:
    o, d = (flight.read(record, member)[slots] for member in ("o", "d"))
    far = flight.read(SHADOW, "t")[slots] if record is SHADOW else np.full(len(slots), 1e30)
    rays = np.full((flight.slots, 8), np.nan, np.float32)
    rays[slots] = np.concatenate([o, np.zeros((len(o), 1)), d, far[:, None]], 1)
    return rays


def addresses(layout: str, slots: Slots, word: int, step: int, count: int) -> Slots:
    """Return the places of a word of slots [words]; step: words of a slot; count: of all slots."""
    within = slots % BLOCK
    block = slots // BLOCK * BLOCK * step
    if layout == "streams":
        return word * count + slots
    if layout == "blocks":
        return block + word * BLOCK + within
    if layout in ("fours", "sorted"):
        return block + word // 4 * 4 * BLOCK + 4 * within + word % 4
    return slots * step + word


LAYOUTS = ("streams", "blocks", "fours", "sorted", "slots")


Words = dict[str, list[int]]  # by the name of a record


def neighbours(stages: Sequence[Words]) -> dict[str, dict[int, int]]:
    """Return new numbers of words, by record: words that the same stages need come together."""
    numbers: dict[str, dict[int, int]] = {}
    for record in SLABS:
        name = record.name.lower()
        users = {
            word: tuple(word in words.get(name, ()) for words in stages)
            for word in sorted({word for words in stages for word in words.get(name, ())})
        }
        ordered = sorted(users, key=lambda word: users[word], reverse=True)
        numbers[name] = {word: number for number, word in enumerate(ordered)}
    return numbers


def sectors(
    launch: Launch, words: Words, layout: str, count: int, numbers: dict[str, dict[int, int]]
) -> int:
    """Return the sectors that groups of 32 touch, each group for itself."""
    group = launch.items // 32
    touched = 0
    for record in SLABS:
        places = words.get(record.name.lower(), [])
        if layout == "sorted":
            places = [numbers[record.name.lower()][word] for word in places]
        step = -(-record.step // 4) * 4
        keys = [
            group * (step * count) + addresses(layout, launch.slots, word, step, count) // SECTOR
            for word in places
        ]
        touched += len(np.unique(np.concatenate(keys))) if keys else 0
    return touched


def lanes(items: Slots, size: int) -> float:
    """Return the share of work-items with work, in groups that have any."""
    return len(items) / max(1, size * len(np.unique(items // size)))


def rows(on: dev.Device, scene: str, slots: int) -> Iterator[Row]:
    """Yield a row for each stage of a scene, and for each set of rays and their order."""
    flight = Flight(on, opened(scene), slots)
    features = flight.wavefront.features
    sizes = words_of_members(features)
    texts = programs.sources(features, "wide8", 1, queued=True)
    by_stage: dict[str, list[Launch]] = {}
    rays: dict[str, NDArray[np.float32]] = {}
    for launch in launches(flight, rays):
        if len(launch.slots):
            by_stage.setdefault(launch.stage, []).append(launch)
    words = {
        stage: [_words(members, sizes) for members in members_moved(texts[stage].text, sizes)]
        for stage in by_stage
    }
    numbers = neighbours([part for parts in words.values() for part in parts])
    totals = dict.fromkeys(("bytes", *LAYOUTS), 0.0)
    for stage, several in by_stage.items():
        items = sum(len(launch.slots) for launch in several)
        useful = 4 * sum(len(places) for part in words[stage] for places in part.values())
        row: Row = {"bench": "warps", "scene": Path(scene).stem, "stage": stage, "bytes": useful}
        row["share"] = items / (BOUNCES * flight.slots)
        for size in (32, 64):
            row[f"lanes{size}"] = float(np.mean([lanes(each.items, size) for each in several]))
        totals["bytes"] += items * useful
        for layout in LAYOUTS:
            touched = sum(
                sectors(each, part, layout, flight.slots, numbers)
                for each in several
                for part in words[stage]
            )
            row[layout] = 4 * SECTOR * touched / (items * useful)
            totals[layout] += 4 * SECTOR * touched
        yield row
    whole = {layout: totals[layout] / totals["bytes"] for layout in LAYOUTS}
    yield {"bench": "warps", "scene": Path(scene).stem, "stage": "all stages", **whole}
    vertices, faces = world(flight.wavefront.scene.lowered)
    if len(faces) > 96:  # fewer have no tree
        tree = bvh.build(on, vertices, faces, layout="wide8")
        for stage, several_rays in rays.items():
            settings = flight.wavefront.scene.lowered.settings
            for order, share in _traversal(on, tree, several_rays, settings).items():
                row = {"bench": "warps", "scene": Path(scene).stem}
                yield {**row, "stage": f"{stage} rays, {order}", **share}


def _words(members: set[str], sizes: dict[str, int]) -> Words:
    """Return the words of members, by record."""
    words: Words = {}
    for record in SLABS:
        for member in record.members:
            name = f"{record.name.lower()}_{member.name}"
            if name in members:
                several = range(member.word, member.word + sizes[name])
                words.setdefault(record.name.lower(), []).extend(several)
    return words


def ray_keys(rays: NDArray[np.float32], settings: NDArray[np.void]) -> Slots:
    """Return the keys of rays as of kernels/stage/sort_rays.cl; rays: rows of o, 0, d, t."""
    scale = np.sqrt(3.0) / float(settings["scene_radius"])
    cells = ((rays[:, :3] - settings["center"]) * scale + 1.0) * RAY_ORDER["cells"] / 2
    x, y, z = np.clip(np.floor(cells), 0, RAY_ORDER["cells"] - 1).astype(np.int64).T
    octants = (rays[:, 4:7] > 0.0) @ [4, 2, 1]
    return ((octants * RAY_ORDER["cells"] + x) * RAY_ORDER["cells"] + y) * RAY_ORDER["cells"] + z


def _traversal(
    on: dev.Device, tree: bvh.Bvh, rays: NDArray[np.float32], settings: NDArray[np.void]
) -> dict[str, dict[str, float]]:
    """Return the work of groups in traversal, by the order of rays, a row for each slot."""
    some = np.isfinite(rays).all(1)
    if np.count_nonzero(some) < 64:
        return {}
    work = np.zeros(len(rays))
    work[some] = visits(on, tree, np.nan_to_num(rays, nan=0.0)).sum(1)[some]
    windows = np.flatnonzero(some) // RAY_ORDER["window"]
    order = np.lexsort((ray_keys(rays[some], settings), windows))
    orders = {"in their slots": work, "in a queue": work[some], "sorted": work[some][order]}
    sizes = (32, 64)
    return {
        order: {f"lanes{size}": _evenness(values, size) for size in sizes}
        for order, values in orders.items()
    }


def _evenness(work: NDArray[np.float64], size: int) -> float:
    """Return the mean work of a work-item over the most in its group."""
    groups = work[: len(work) // size * size].reshape(-1, size)
    return float(groups.sum() / max(1.0, groups.max(1).sum() * size))


def check(rates: list[Row]) -> None:
    """Print bounds of an H100 by this table, and its rates before."""
    print("\nstage                  bound   measured  share of the bound")
    measured = {}
    for line in H100.read_text("utf-8").splitlines():
        row = json.loads(line)
        if row["bench"] == "stages" and row["scene"] == "atrium" and row["value"]:
            measured[row["figure"]] = row["value"]
    for row in rates:
        stage = str(row["stage"])
        if row["scene"] == "atrium" and stage in measured and "bytes" in row:
            bound = COPY / (float(str(row["bytes"])) * float(str(row["streams"]))) * 1e-6
            print(f"{stage:22}{bound:8,.0f}{measured[stage]:10,.0f}{measured[stage] / bound:10.2f}")


def _text(row: Row, name: str) -> str:
    return f"{row[name]:6.2f}" if name in row else " " * 6


@click.command(help=__doc__)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
@click.option("--slots", default=1 << 15, show_default=True)
@click.option("--check", "checks", is_flag=True)
@click.argument("scenes", nargs=-1)
def main(json_file: str | None, slots: int, checks: bool, scenes: tuple[str, ...]) -> None:
    on, kept = dev.choose(), []
    print(
        "scene         stage                             share  lanes 32, 64  " + "  ".join(LAYOUTS)
    )
    for scene in scenes or SCENES:
        for row in rows(on, scene, slots):
            kept.append(row)
            moved = [f"{row[name]:7.2f}" for name in LAYOUTS if name in row]
            share, few, many = (_text(row, name) for name in ("share", "lanes32", "lanes64"))
            print(
                f"{row['scene']:14}{row['stage']:34}{share} {few}{many}  {' '.join(moved)}",
                flush=True,
            )
    if json_file:
        with open(json_file, "a") as file:
            file.writelines(json.dumps(row) + "\n" for row in kept)
    if checks:
        check(kept)


if __name__ == "__main__":
    main()
