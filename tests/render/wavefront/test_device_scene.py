"""What is decided about a scene before anything of it is compiled: slots, planes, the loop."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

import clpt
from clpt import device
from clpt.render.lowering.scene import lower
from clpt.render.wavefront.device_scene import (
    CPU_SLOTS,
    GROUP,
    LOOP_PATHS,
    LOOP_SLOTS,
    DeviceScene,
)


@pytest.fixture(scope="module")
def on() -> device.Device:
    return device.choose()


def resident(on: device.Device, scenes: Path, size: int = 24, **wanted: Any) -> DeviceScene:
    scene = clpt.load(scenes / "cornell.xml")
    film = dataclasses.replace(scene.film, mode="rgb", width=size, height=size)
    return DeviceScene(on, lower(dataclasses.replace(scene, film=film)), **wanted)


def test_the_loop_is_taken_where_it_pays(on: device.Device, scenes: Path) -> None:
    """On a CPU, for many paths, where nothing is to be sorted; or where it is asked for."""
    cpu = on.info.is_cpu
    assert resident(on, scenes, paths=LOOP_PATHS).looped == cpu
    assert not resident(on, scenes, paths=LOOP_PATHS - 1).looped
    assert not resident(on, scenes, paths=LOOP_PATHS, queued=True).looped
    assert not resident(on, scenes, paths=LOOP_PATHS, looped=False).looped
    assert resident(on, scenes, looped=True).looped


@pytest.mark.parametrize("size", [24, 64, 160])
def test_planes_are_those_of_the_stages(on: device.Device, scenes: Path, size: int) -> None:
    """Since sums follow from them, and a picture is the same to the bit whoever makes it."""
    if not on.info.is_cpu:
        pytest.skip("only CPUs take fewer slots for the loop")
    stages = resident(on, scenes, size, looped=False)
    loop = resident(on, scenes, size, looped=True)
    assert loop.lowered.settings["planes"] == stages.lowered.settings["planes"]
    assert stages.slots <= CPU_SLOTS
    least = GROUP * int(loop.lowered.settings["planes"])
    assert loop.slots <= max(least, LOOP_SLOTS * on.info.compute_units)
    assert loop.slots % GROUP == 0 and loop.slots == loop.lowered.settings["slots"]
    assert resident(on, scenes, size, looped=True, slots=CPU_SLOTS).slots == stages.slots
