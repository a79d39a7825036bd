"""What is decided about a scene before anything of it is compiled: slots, planes, the loop."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

import pytest

import clpt
from clpt import device
from clpt.device import choosing
from clpt.errors import MemoryBudgetError
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.wavefront.path_buffers import (
    CPU_SLOTS,
    GROUP,
    LOOP_SLOTS,
    Slots,
    divide_film,
)
from clpt.render.wavefront.strategy import Tuning, choose, sorting_pays

MEMORY = 1 << 34


@pytest.fixture(scope="module")
def on() -> device.Device:
    return device.choose()


@pytest.fixture(scope="module")
def cornell(scenes: Path) -> Lowered:
    return lower(clpt.load(scenes / "cornell.xml"))


def divided(on: device.Device, side: int, slots: int | None = None, looped: bool = False) -> Slots:
    return divide_film(on.info, side * side, MEMORY, slots, looped)


def test_queues_are_for_those_who_shade_one_path(on: device.Device, cornell: Lowered) -> None:
    gpu = device.Device(on.context, on.queue, dataclasses.replace(on.info, kind="gpu"))
    queued = [choose(gpu, cornell, Tuning(queued=q)).queued for q in (None, True, False)]
    assert queued == [True, True, False]  # of one kind too: shadow rays and new paths are in queues
    assert choose(on, cornell, Tuning(queued=True)).queued == (on.lanes == 1)


def test_rays_are_sorted_on_gpus_in_trees_if_a_trial_says_so(
    on: device.Device, cornell: Lowered
) -> None:
    gpu = device.Device(on.context, on.queue, dataclasses.replace(on.info, kind="gpu"))

    def chosen(on: device.Device, layout: str, **tuning: bool) -> list[bool | None]:
        wishes = (Tuning(layout, sorted_rays=wish, **tuning) for wish in (None, True, False))
        return [choose(on, cornell, wish).sorted_rays for wish in wishes]

    assert chosen(gpu, "compact") == [None, True, False]
    assert chosen(gpu, "brute") == chosen(gpu, "compact", queued=False) == [False] * 3
    if on.info.is_cpu and on.lanes > 1:
        assert chosen(on, "compact") == [False] * 3


def test_a_trial_takes_turns_and_the_least_time_counts() -> None:
    """The first turn does not count."""
    ticks = iter(itertools.accumulate([0, 9, 0, 0, 0, 3, 0, 2, 0, 1, 0, 5]))
    turns: list[str] = []
    runs = [lambda: turns.append("a"), lambda: turns.append("b")]
    assert choosing.least_seconds(runs, 2, lambda: float(next(ticks))) == [1.0, 2.0]
    assert turns == ["a", "b"] * 3


@pytest.mark.parametrize(("seconds", "pays"), [(0.94, True), (0.96, False), (1.2, False)])
def test_sorting_is_for_a_gain_and_tried_once(
    on: device.Device, monkeypatch: pytest.MonkeyPatch, no_trials: None, seconds: float, pays: bool
) -> None:
    trials: list[object] = []

    def least(runs: object, rounds: int) -> list[float]:
        trials.append(runs)
        return [1.0, seconds]

    monkeypatch.setattr(choosing, "least_seconds", least)
    for name in ("a", "a", "b"):
        assert sorting_pays(on, [name], lambda: None, lambda: None) == pays
    assert len(trials) == 2


@pytest.mark.parametrize("side", [24, 64, 160])
def test_planes_are_those_of_the_stages(on: device.Device, side: int) -> None:
    """Since sums follow from them, and a picture is the same to the bit whoever makes it."""
    if not on.info.is_cpu:
        pytest.skip("only CPUs take fewer slots for the loop")
    stages, loop = (divided(on, side, looped=looped) for looped in (False, True))
    assert loop.planes == stages.planes
    assert stages.total <= CPU_SLOTS
    assert loop.total <= max(GROUP * loop.planes, LOOP_SLOTS * on.info.compute_units)
    assert loop.total % GROUP == 0
    assert divided(on, side, slots=CPU_SLOTS, looped=True) == stages


def test_slots_follow_from_memory(on: device.Device) -> None:
    large = dataclasses.replace(on.info, max_alloc=MEMORY)
    few = divide_film(large, 1 << 20, 1 << 20, None, False)
    assert GROUP <= few.total < divide_film(large, 1 << 20, 1 << 24, None, False).total
    with pytest.raises(MemoryBudgetError, match="the least number of paths"):
        divide_film(large, 1 << 20, 1 << 12, None, False)
