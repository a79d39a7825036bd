"""A device that says it is a GPU gets the forms for GPUs: the picture is the same."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import device as dev
from clpt.render.wavefront.path_buffers import MOST_SLOTS, UNIT_SLOTS, default_slots
from tests.renders.support import with_film


@pytest.fixture(scope="module")
def gpu() -> dev.Device:
    """The device of all tests in disguise: with two compute units, and enough memory."""
    on = dev.choose()
    changes = {"kind": "gpu", "compute_units": 2}
    return dev.Device(on.context, on.queue, dataclasses.replace(on.info, **changes))


def test_forms(gpu: dev.Device, scenes: Path) -> None:
    """One lane, queues that are appended to, compressed nodes; in all but a few pixels the same."""
    scene = with_film(clpt.load(scenes / "instances.xml"), mode="rgb")
    renderer = clpt.Renderer(scene, gpu, queued=True)  # one kind: it would not be asked for
    front = renderer.wavefronts[0]
    slots, strategy = front.paths.slots, front.scene.strategy
    assert (front.lanes, strategy.layout, strategy.queued) == (1, "compact", True)
    assert UNIT_SLOTS < slots <= 2 * UNIT_SLOTS  # whole pictures
    renderer.run(2)
    image, plain = renderer.image(), clpt.render(scene, 2, slots=slots)
    off = np.abs(image - plain).max(axis=2) > 1e-3 * (1e-2 + np.abs(plain).max(axis=2))
    assert off.mean() < 0.005
    np.testing.assert_allclose(image.mean(), plain.mean(), rtol=2e-3)


def test_slots_grow_with_the_device(gpu: dev.Device) -> None:
    units = [dataclasses.replace(gpu.info, compute_units=n) for n in (1, 20, 10_000)]
    assert [*map(default_slots, units)] == [UNIT_SLOTS, 20 * UNIT_SLOTS, MOST_SLOTS]
