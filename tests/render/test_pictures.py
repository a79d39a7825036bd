"""A renderer's picture in other hands: resolved on the device, as an array, in a notebook."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest
from PIL import Image

import clpt
from clpt import images
from tests.pictures.support import with_film

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = 4


@pytest.fixture(scope="module")
def scene(scenes):
    return with_film(clpt.load(scenes / "cornell.xml"), mode="rgb", width=32, height=24)


@pytest.fixture(scope="module")
def renderer(scene):
    context = cl.Context([clpt.device.choose().info.cl_device])
    mode = cl.command_queue_properties.OUT_OF_ORDER_EXEC_MODE_ENABLE
    made = clpt.Renderer(scene, queue=cl.CommandQueue(context, properties=mode))
    made.step(SAMPLES)
    return made


def test_film_is_the_picture_and_its_samples(renderer):
    film = np.asarray(renderer.film)
    np.testing.assert_array_equal(film[..., :3], renderer.image())
    assert (film[..., 3] == SAMPLES).all()
    np.testing.assert_array_equal(np.from_dlpack(renderer.film, device="cpu"), film)


def test_a_renderer_is_an_array(renderer):
    np.testing.assert_array_equal(np.asarray(renderer), renderer.image())
    assert np.asarray(renderer, np.float64).dtype == np.float64


def test_resolved_is_the_png(renderer, tmp_path):
    images.write(tmp_path / "a.png", renderer.image(), exposure=1.0)
    with Image.open(tmp_path / "a.png") as png:
        written = np.asarray(png)
    np.testing.assert_array_equal(renderer.resolve(exposure=1.0).get()[..., :3], written)


def test_a_notebook_shows_it(renderer):
    with Image.open(io.BytesIO(renderer._repr_png_())) as png:
        np.testing.assert_array_equal(np.asarray(png), images.to_srgb8(renderer.image()))


def test_readers_of_the_film_come_before_the_next_step(renderer):
    """On a queue without order: what was asked for before a step is the picture before it."""
    before = renderer.film.get()
    gate = cl.UserEvent(renderer.film.context)
    early = np.empty_like(before)
    renderer.film.add_event(
        cl.enqueue_copy(
            renderer.film.queue, early, renderer.film.data, wait_for=[gate], is_blocking=False
        )
    )
    renderer.step(SAMPLES)
    late = renderer.resolve(dtype=np.float32)
    gate.set_status(cl.command_execution_status.COMPLETE)
    assert (late.get()[..., :3] != before[..., :3]).any()
    np.testing.assert_array_equal(early, before)
    assert (renderer.film.get()[..., 3] == 2 * SAMPLES).all()
    renderer.reset()
    assert not renderer.film.get().any()


def test_the_page_tells_what_works(renderer):
    """The lines of docs/interop.md, but those that need OpenGL or Jupyter, which begin so."""
    page = (ROOT / "docs" / "interop.md").read_text("utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names = {"renderer": renderer, "queue": renderer.film.queue}
    mine = [block for block in blocks if not block.startswith("# ")]
    assert len(mine) == len(blocks) - 2 > 4
    for block in mine:
        exec(block, names)
    np.testing.assert_array_equal(names["pixels"], names["mine"].get())
    assert names["samples"].min() == names["later"][..., 3].min() + 4
