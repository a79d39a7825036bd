"""A host program: its queue, and a small scene of which it wants pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

import clpt
from clpt.device import choose
from tests.pictures.support import with_film

SLOTS = 1024


@pytest.fixture(scope="session")
def queue() -> cl.CommandQueue:
    """A host's queue, in a context of its own."""
    return cl.CommandQueue(cl.Context([choose().info.cl_device]))


@pytest.fixture(scope="session")
def scene(scenes: Path) -> clpt.Scene:
    return with_film(clpt.load(scenes / "cornell.xml"), mode="rgb", width=24, height=20)


@pytest.fixture(scope="session")
def picture(scene: clpt.Scene, queue: cl.CommandQueue) -> np.ndarray:
    """Four samples per pixel."""
    with clpt.Renderer(scene, queue=queue, slots=SLOTS) as renderer:
        renderer.step(4)
        return renderer.image()
