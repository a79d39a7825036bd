"""Saved films: what a renderer refuses to go on from, and what is told of those before.

That a film goes on to the bit is proved in tests/cluster/test_film_algebra.py.
"""

from __future__ import annotations

import dataclasses
import logging
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.render.film import film_file
from clpt.scene import Scene, lights, shapes
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Independent, Zsobol
from clpt.scene.materials import Null
from clpt.scene.media import Homogeneous
from clpt.scene.phases import Blend, HenyeyGreenstein, Isotropic
from tests.pictures.support import with_film

SKY = lights.Constant()


def sky(radiance: tuple = (0.25, 0.5, 1.0), **changes: object) -> Scene:
    given = {"camera": Perspective(fov=40.0), "lights": [lights.Constant(radiance=radiance)]}
    return with_film(Scene(**{**given, **changes}), width=5, height=4, mode="rgb")


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"camera": Perspective(fov=45.0)}, "camera.fov: 40.0 -> 45.0"),
        ({"seed": 1}, "seed: 0 -> 1"),
        ({"radiance": (0.25, 0.5, 0.9)}, r"lights\[0\].radiance.b: 1.0 -> 0.9"),
        ({"sampler": Independent()}, "sampler.type: sobol -> independent"),
    ],
)
def test_another_scene_is_refused_by_what_differs(tmp_path: Path, changes, told):
    path = tmp_path / "a.film"
    with clpt.Renderer(sky()) as renderer:
        renderer.run(2)
        renderer.save_state(path)
    with clpt.Renderer(sky(**changes)) as renderer:
        renderer.run(1)
        before = renderer.image()
        with pytest.raises(SceneError, match=rf"a\.film: the film is of something else: {told}"):
            renderer.load_state(path)
        with pytest.raises(SceneError, match=told):
            film_file.read(path).merged(renderer.saved_film())
        assert renderer.samples == 1
        np.testing.assert_array_equal(renderer.image(), before)


@pytest.mark.parametrize(
    "phase",
    [
        pytest.param(Isotropic(), marks=pytest.mark.slow),
        pytest.param(HenyeyGreenstein(), marks=pytest.mark.slow),
        Blend(second=HenyeyGreenstein()),  # of both
    ],
    ids=lambda p: p.kind,
)
def test_a_film_of_a_medium_is_saved(phase, scenes: Path, tmp_path: Path):
    """A phase function is a part of the kernels, as materials are."""
    fog = shapes.Sphere(material=Null(), interior=Homogeneous(sigma_t=1.0, phase=phase))
    scene = with_film(clpt.load(scenes / "cornell.xml"), mode="rgb", width=26, height=18)
    scene = dataclasses.replace(scene, shapes=[fog], lights=[SKY])
    with clpt.Renderer(scene) as renderer:
        renderer.save_state(tmp_path / "a.film")
        kernels = renderer._origin().kernels
    assert film_file.read(tmp_path / "a.film").origin.kernels == kernels


def test_other_settings_and_kernels_are_refused(tmp_path: Path):
    path = tmp_path / "a.film"
    with clpt.Renderer(sky(sampler=Zsobol(), spp=16)) as renderer:
        renderer.run(2)
        saved = renderer.saved_film()
    film_file.write(path, saved)
    check_refused(path, r"halves: False -> True", spp=12, halves=True)
    check_refused(path, r"sampler\.points: 16 -> 32", spp=17)
    origin = dataclasses.replace(saved.origin, kernels="0", clpt="0.0.1")
    film_file.write(path, dataclasses.replace(saved, origin=origin))
    check_refused(path, r"kernels: of clpt 0\.0\.1 -> others", spp=16)


@pytest.mark.parametrize(
    "taken", [((-5, -2),), ((0, 2**31),), ((4, 2),), ((2, 2),), ((0, 2), (1, 3)), ((4, 6), (0, 2))]
)
def test_ranges_that_no_render_takes_are_refused(taken, tmp_path: Path):
    path = tmp_path / "a.film"
    with clpt.Renderer(sky()) as renderer:
        renderer.run(2)
        saved = renderer.saved_film()
        film_file.write(path, saved)
        assert film_file.read(path).film.taken == ((0, 2),)
        film = dataclasses.replace(saved.film, taken=taken)
        film_file.write(path, dataclasses.replace(saved, film=film))
        with pytest.raises(SceneError, match="ranges of samples must ascend"):
            renderer.load_state(path)
        with pytest.raises(SceneError, match="ranges of samples must ascend"):
            film_file.read_header(path)


def check_refused(path: Path, told: str, spp: int, **options: bool) -> None:
    scene = sky(sampler=Zsobol(), spp=spp)
    with clpt.Renderer(scene, **options) as renderer, pytest.raises(SceneError, match=told):
        renderer.load_state(path)


def test_another_class_of_device_is_told(tmp_path: Path, caplog):
    with clpt.Renderer(sky()) as renderer:
        renderer.run(2)
        saved = renderer.saved_film()
        (session,) = saved.sessions
        other = dataclasses.replace(session, device={**session.device, "lanes": 4, "device": "X"})
        with caplog.at_level(logging.WARNING, "clpt"):
            renderer._restore(dataclasses.replace(saved, sessions=(other, session)))
        assert "device: X -> " in renderer.warnings[-1] and "lanes: 4 -> " in caplog.text
        renderer.run(1)
        sessions = renderer.saved_film().sessions
        assert len(sessions) == 3 and sessions[0].device["device"] == "X"


def test_what_cannot_be_written_is_told(tmp_path: Path):
    with clpt.Renderer(sky()) as renderer, pytest.raises(SceneError, match="cannot be written"):
        renderer.save_state(tmp_path / "no_folder" / "a.film")


def test_what_begins_anew_has_no_history():
    with clpt.Renderer(sky()) as renderer:
        with pytest.raises(SceneError, match="no film is held"):
            renderer.saved_film(held=True)
        renderer.run(2)
        renderer._restore(renderer.saved_film())
        assert len(renderer.saved_film().sessions) == 2
        renderer.reset(seed=3, first_sample=7)
        saved = renderer.saved_film()
        assert renderer.samples == 7 and not saved.film.words.any()
        assert len(saved.sessions) == 1 and saved.seconds == 0.0 and not saved.film.taken
        assert saved.origin.scene.values["seed"] == 3


def image_scene(path: Path) -> Scene:
    return with_film(
        Scene(camera=Perspective(), lights=[lights.Envmap(image=path)]),
        width=4, height=3, mode="rgb",
    )  # fmt: skip


@pytest.mark.parametrize("suffix", [".npy", ".hdr", ".pfm", ".exr"])
def test_a_film_is_of_the_image_that_was_read(tmp_path: Path, suffix: str) -> None:
    """The file of an image changes while it is rendered: the film goes on with the old one alone"""
    path, film = tmp_path / f"sky{suffix}", tmp_path / "a.film"
    clpt.write_image(path, np.ones((4, 8, 3), np.float32))
    before = path.read_bytes()
    with clpt.Renderer(image_scene(path)) as renderer:
        renderer.run(1)
        clpt.write_image(path, np.full((4, 8, 3), 9.0, np.float32))
        renderer.run(1)
        renderer.save_state(film)
        with clpt.Renderer(image_scene(path)) as other:
            with pytest.raises(SceneError, match=r"lights\[0\].image: its content differs"):
                other.load_state(film)
            assert other.image().mean() != renderer.image().mean()
        path.write_bytes(before)
        with clpt.Renderer(image_scene(path)) as other:
            other.load_state(film)
            np.testing.assert_array_equal(other.image(), renderer.image())


def test_an_update_reads_an_image_anew(tmp_path: Path) -> None:
    path, film = tmp_path / "sky.npy", tmp_path / "a.film"
    clpt.write_image(path, np.ones((4, 8, 3), np.float32))
    scene = image_scene(path)
    with clpt.Renderer(scene) as renderer:
        renderer.run(1)
        renderer.save_state(film)
        clpt.write_image(path, np.full((4, 8, 3), 9.0, np.float32))
        renderer.update(scene=scene)
        renderer.run(1)
        with pytest.raises(SceneError, match=r"lights\[0\].image: its content differs"):
            renderer.load_state(film)
