"""`Renderer.step`: the bounce loop on the device gives the very picture of the host's loop."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

import clpt
from clpt.device import Device, choose
from clpt.errors import DeviceError, SceneError
from clpt.scene import cameras, integrators
from tests.pictures.support import with_film


@pytest.fixture(scope="module")
def queue() -> cl.CommandQueue:
    """A host's queue, in a context of its own."""
    return cl.CommandQueue(cl.Context([choose().info.cl_device]))


def box(scenes: Path, **film: object) -> clpt.Scene:
    """The Cornell box of the tests, small."""
    given = {"mode": "rgb", "width": 24, "height": 20, **film}
    return with_film(clpt.load(scenes / "cornell.xml"), **given)


@pytest.fixture(scope="module")
def renderer(scenes: Path, queue: cl.CommandQueue) -> clpt.Renderer:
    return clpt.Renderer(box(scenes), queue=queue)


def test_steps_are_the_picture_of_run(scenes: Path, renderer: clpt.Renderer) -> None:
    """To the bit, however the samples are divided; and `film` has it with the samples."""
    renderer.reset()
    for samples in (1, 2, 5):
        event = renderer.step(samples)
    event.wait()
    film = renderer.film.get()
    assert np.array_equal(film[:, :, :3], clpt.render(box(scenes), 8))
    assert (film[:, :, 3] == 8).all() and renderer.samples == 8
    assert np.array_equal(renderer.image(), film[:, :, :3])


def test_reset_begins_again(renderer: clpt.Renderer) -> None:
    renderer.reset()
    renderer.step(4)
    first = renderer.image()
    renderer.reset().wait()
    assert not renderer.film.get().any()
    renderer.step(4)
    assert np.array_equal(renderer.image(), first)


def test_a_run_goes_on_after_steps(scenes: Path, renderer: clpt.Renderer) -> None:
    renderer.reset()
    renderer.step(3)
    assert renderer.run(5)
    assert np.array_equal(renderer.image(), clpt.render(box(scenes), 8))


def test_a_camera_moves(scenes: Path, renderer: clpt.Renderer) -> None:
    """The picture is that of a new renderer; a camera of another kind is told."""
    scene = renderer.scene
    moved = dataclasses.replace(scene.camera, fov=25.0)
    renderer.update(camera=moved)
    renderer.step(4)
    assert np.array_equal(
        renderer.image(), clpt.render(dataclasses.replace(box(scenes), camera=moved), 4)
    )
    renderer.update(camera=scene.camera)
    assert renderer.scene.camera is scene.camera


@pytest.mark.parametrize("samples", [0, -1, 1.5, True, "3", None])
def test_a_number_of_samples(renderer: clpt.Renderer, samples: object) -> None:
    before = renderer.samples
    with pytest.raises(SceneError, match="whole number above zero"):
        renderer.step(samples)  # type: ignore[arg-type]
    assert renderer.samples == before


def test_a_device_or_a_queue(scenes: Path, queue: cl.CommandQueue) -> None:
    with pytest.raises(DeviceError, match="a device or a queue"):
        clpt.Renderer(box(scenes), Device.adopt(queue), queue=queue)


def _spectral(scene: clpt.Scene) -> clpt.Scene:
    return with_film(scene, mode="spectral")


def _bands(scene: clpt.Scene) -> clpt.Scene:
    return with_film(scene, mode="spectral", bands=5)


def _light_paths(scene: clpt.Scene) -> clpt.Scene:
    film = dataclasses.replace(scene.film, filter=integrators.Box())
    camera = cameras.Perspective(fov=scene.camera.fov, to_world=scene.camera.to_world)
    integrator = integrators.ParticleTracer()
    return dataclasses.replace(scene, film=film, camera=camera, integrator=integrator)


def _whitted(scene: clpt.Scene) -> clpt.Scene:
    return dataclasses.replace(scene, integrator=integrators.Whitted())


@pytest.mark.slow
@pytest.mark.parametrize("change", [_spectral, _bands, _whitted])
@pytest.mark.parametrize("layout", ["brute", "binary", "wide8"])
def test_every_loop(
    scenes: Path, queue: cl.CommandQueue, change: Callable[[clpt.Scene], clpt.Scene], layout: str
) -> None:
    scene = change(box(scenes))
    stepped = clpt.Renderer(scene, queue=queue, layout=layout)
    stepped.step(3)
    hosted = clpt.Renderer(scene, layout=layout)
    hosted.run(3)
    assert np.array_equal(stepped.image(), hosted.image())


@pytest.mark.slow
def test_light_paths(scenes: Path, queue: cl.CommandQueue) -> None:
    """Their sums are atomic, so only rounding may differ."""
    scene = _light_paths(box(scenes))
    stepped = clpt.Renderer(scene, queue=queue)
    stepped.step(2)
    stepped.step(2)
    np.testing.assert_allclose(stepped.image(), clpt.render(scene, 4), rtol=1e-4, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["glass_metal", "instances", "textures", "plastic", "principled"])
def test_every_stage(scenes: Path, queue: cl.CommandQueue, name: str) -> None:
    """Several kinds, mixtures, instances, analytic shapes."""
    scene = with_film(clpt.load(scenes / f"{name}.xml"), width=24, height=20, mode="rgb")
    stepped = clpt.Renderer(scene, queue=queue)
    stepped.step(3)
    assert np.array_equal(stepped.image(), clpt.render(scene, 3))


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [1, 16])
def test_every_width(scenes: Path, queue: cl.CommandQueue, lanes: int) -> None:
    device = Device.adopt(queue)
    device.lanes = lanes
    stepped = clpt.Renderer(box(scenes), device)
    stepped.step(4)
    assert np.array_equal(stepped.image(), clpt.render(box(scenes), 4))
