"""What is decided about a scene before anything of it is compiled: slots, planes, the loop."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

import clpt
from clpt import device
from clpt.errors import MemoryBudgetError
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.wavefront.path_buffers import (
    CPU_SLOTS,
    GROUP,
    LOOP_SLOTS,
    Slots,
    divide_film,
)
from clpt.render.wavefront.strategy import Tuning, choose

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
