"""A film that is saved and gone on with is to the bit that of one run, in every mode."""

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
from clpt.scene.integrators import (
    Box,
    Independent,
    Mitchell,
    ParticleTracer,
    Tent,
    Vcm,
    Zsobol,
)
from clpt.scene.integrators import Path as PathTracing
from clpt.scene.materials import Dielectric, Null
from clpt.scene.media import Homogeneous
from clpt.scene.phases import Blend, HenyeyGreenstein, Isotropic
from tests.pictures.support import with_film

SKY = lights.Constant()
SIZE = {"width": 26, "height": 18}
FIRST, SECOND = 5, 8
# Film, what else the scene has, options of the renderer, and the limit of noise.
MODES: dict[str, tuple[dict, dict, dict, float | None]] = {
    "rgb": ({"filter": Box()}, {}, {}, None),
    "spectral": ({"mode": "spectral"}, {}, {}, None),
    "weights_alpha": ({"filter": Mitchell(), "alpha": True}, {}, {}, None),
    "importance": ({"filter": Mitchell(), "filtering": "importance"}, {}, {}, None),
    "independent": ({}, {"sampler": Independent()}, {}, None),
    "zsobol": ({}, {"sampler": Zsobol(), "spp": FIRST + SECOND}, {}, None),
    "bands": ({"mode": "spectral", "bands": 5}, {}, {}, None),
    "halves": ({"filter": Tent()}, {}, {"halves": True}, None),
    "halves_bands": ({"mode": "spectral", "bands": 3}, {}, {"halves": True}, None),
    "light_paths": ({}, {"integrator": PathTracing(light_paths=1)}, {}, None),
    "light_share": ({"filter": Mitchell()}, {"integrator": PathTracing(light_paths=0.3)}, {}, None),
    "vcm": ({}, {"integrator": Vcm()}, {}, None),
    "vcm_bands": ({"mode": "spectral", "bands": 4}, {"integrator": Vcm()}, {"halves": True}, None),
    "particle_tracer": ({"filter": Tent()}, {"integrator": ParticleTracer()}, {}, None),
    "noise": ({"width": 48, "height": 40}, {}, {}, 0.1),
    "noise_lights": (
        {"width": 48, "height": 40}, {"integrator": PathTracing(light_paths=1)}, {}, 0.1
    ),
}  # fmt: skip


def box(scenes: Path, film: dict, changes: dict, noise: float | None) -> Scene:
    """A small Cornell box with a ball of glass."""
    scene = with_film(clpt.load(scenes / "cornell.xml"), **{"mode": "rgb", **SIZE, **film})
    ball = shapes.Sphere(center=(0.3, 0.3, 0.2), radius=0.3, material=Dielectric())
    return dataclasses.replace(
        scene, shapes=[*scene.shapes, ball], noise=noise, **{"integrator": PathTracing(), **changes}
    )


LONG = (
    "zsobol", "independent", "importance", "halves", "vcm", "rgb", "weights_alpha",
    "light_share", "vcm_bands", "bands", "halves_bands",
)  # fmt: skip


@pytest.fixture(
    params=[pytest.param(m, marks=[pytest.mark.slow] if m in LONG else []) for m in MODES]
)
def mode(request, scenes: Path) -> tuple[Scene, dict, float | None]:
    film, changes, options, noise = MODES[request.param]
    return box(scenes, film, changes, noise), options, noise


def check_equal(renderer: clpt.Renderer, whole: clpt.Renderer) -> None:
    one, other = renderer.film_state(), whole.film_state()
    np.testing.assert_array_equal(one.words, other.words)
    np.testing.assert_array_equal(one.bands, other.bands)
    assert one.taken == other.taken
    np.testing.assert_array_equal(renderer.image(), whole.image())
    assert renderer.counts == whole.counts


def test_going_on_is_as_one_run(mode, tmp_path: Path):
    """Saved twice, each time by a renderer that is gone then; the second time with more samples."""
    scene, options, noise = mode
    more = 40 if noise is not None else SECOND
    with clpt.Renderer(scene, **options) as whole:
        whole.run(FIRST + more + 3, noise=noise)
        path = tmp_path / "a.resume.exr"
        with clpt.Renderer(scene, **options) as renderer:
            renderer.run(FIRST, noise=noise)
            renderer.save_state(path)
        for samples in (more, 3):
            with clpt.Renderer(scene, slots=128, **options) as renderer:
                renderer.load_state(path)
                assert renderer.samples == film_file.read(path).film.taken[-1][1]
                renderer.run(samples, noise=noise)
                renderer.save_state(path)
                assert renderer.active == 1.0 or noise is not None
        with clpt.Renderer(scene, **options) as renderer:
            renderer.load_state(path)
            check_equal(renderer, whole)
            assert len(film_file.read(path).sessions) == 3 and not renderer.warnings


def test_the_picture_of_the_device_is_that_of_the_host(mode):
    """To the bit, where the device divides as the host does."""
    scene, options, noise = mode
    with clpt.Renderer(scene, **options) as renderer:
        renderer.run(FIRST + SECOND, noise=noise)
        shown, colours = renderer.film.get(), renderer.colours()
        np.testing.assert_array_equal(renderer.samples_per_pixel(), shown[..., 3])
        if "Portable Computing Language" in renderer.device.queue.device.platform.name:
            np.testing.assert_array_equal(colours, shown[..., :3])
        top = np.abs(colours).max()
        np.testing.assert_allclose(colours, shown[..., :3], rtol=1e-6, atol=1e-6 * top)


def test_a_stopped_run_is_saved_as_it_was_before(mode, tmp_path: Path):
    """`hold` keeps the film of whole runs; what is stopped later leaves no trace in it."""
    scene, options, noise = mode
    with clpt.Renderer(scene, **options) as whole, clpt.Renderer(scene, **options) as cut:
        for renderer in (whole, cut):
            renderer.run(FIRST, noise=noise)
        cut._hold()
        assert not cut.run(2000, lambda progress: False, noise=noise)
        film_file.write(tmp_path / "a.film", cut._saved_film(held=True))
        whole.run(SECOND, noise=noise)
        with clpt.Renderer(scene, **options) as renderer:
            renderer.load_state(tmp_path / "a.film")
            renderer.run(SECOND, noise=noise)
            check_equal(renderer, whole)


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
        assert renderer.samples == 1
        np.testing.assert_array_equal(renderer.image(), before)


@pytest.mark.parametrize("phase", [Isotropic(), HenyeyGreenstein(), Blend()], ids=lambda p: p.kind)
def test_a_film_of_a_medium_is_saved(phase, scenes: Path, tmp_path: Path):
    """A phase function is a part of the kernels, as materials are."""
    fog = shapes.Sphere(material=Null(), interior=Homogeneous(sigma_t=1.0, phase=phase))
    scene = dataclasses.replace(box(scenes, {}, {}, None), shapes=[fog], lights=[SKY])
    with clpt.Renderer(scene) as renderer:
        renderer.save_state(tmp_path / "a.film")
        kernels = renderer._origin().kernels
    assert film_file.read(tmp_path / "a.film").origin.kernels == kernels


def test_other_settings_and_kernels_are_refused(tmp_path: Path):
    path = tmp_path / "a.film"
    with clpt.Renderer(sky(sampler=Zsobol(), spp=16)) as renderer:
        renderer.run(2)
        saved = renderer._saved_film()
    film_file.write(path, saved)
    check_refused(path, r"halves: False -> True", spp=12, halves=True)
    check_refused(path, r"sampler\.points: 16 -> 32", spp=17)
    origin = dataclasses.replace(saved.origin, kernels="0", clpt="0.0.1")
    film_file.write(path, dataclasses.replace(saved, origin=origin))
    check_refused(path, r"kernels: of clpt 0\.0\.1 -> others", spp=16)


def check_refused(path: Path, told: str, spp: int, **options: bool) -> None:
    scene = sky(sampler=Zsobol(), spp=spp)
    with clpt.Renderer(scene, **options) as renderer, pytest.raises(SceneError, match=told):
        renderer.load_state(path)


def test_another_class_of_device_is_told(tmp_path: Path, caplog):
    with clpt.Renderer(sky()) as renderer:
        renderer.run(2)
        saved = renderer._saved_film()
        (session,) = saved.sessions
        other = dataclasses.replace(session, device={**session.device, "lanes": 4, "device": "X"})
        with caplog.at_level(logging.WARNING, "clpt"):
            renderer._restore(dataclasses.replace(saved, sessions=(other, session)))
        assert "device: X -> " in renderer.warnings[-1] and "lanes: 4 -> " in caplog.text
        renderer.run(1)
        sessions = renderer._saved_film().sessions
        assert len(sessions) == 3 and sessions[0].device["device"] == "X"


def test_what_cannot_be_written_is_told(tmp_path: Path):
    with clpt.Renderer(sky()) as renderer, pytest.raises(SceneError, match="cannot be written"):
        renderer.save_state(tmp_path / "no_folder" / "a.film")


def test_what_begins_anew_has_no_history():
    with clpt.Renderer(sky()) as renderer:
        with pytest.raises(SceneError, match="no film is held"):
            renderer._saved_film(held=True)
        renderer.run(2)
        renderer._restore(renderer._saved_film())
        assert len(renderer._saved_film().sessions) == 2
        renderer.reset(seed=3)
        saved = renderer._saved_film()
        assert len(saved.sessions) == 1 and saved.seconds == 0.0 and not saved.film.taken
        assert saved.origin.scene.values["seed"] == 3


def test_saved_films_add(tmp_path: Path):
    """Ranges in files, in any order: the words of one run; the same samples twice are refused."""
    with clpt.Renderer(sky()) as whole:
        whole.run(9)
        films = []
        for first, end in ((6, 9), (0, 4), (4, 6)):
            with clpt.Renderer(sky(), first_sample=first) as renderer:
                renderer.run(end - first)
                renderer.save_state(tmp_path / f"{first}.film")
            films.append(film_file.read(tmp_path / f"{first}.film"))
        total = films[0].merged(films[1]).merged(films[2])
        np.testing.assert_array_equal(total.film.words, whole.film_state().words)
        assert total.film.taken == ((0, 9),) and len(total.sessions) == 3
        assert total.counts["samples"] == whole._wavefront.counts.samples
        with pytest.raises(SceneError, match="samples 4 to 5 would be taken twice"):
            total.merged(films[2])
    with clpt.Renderer(sky(seed=1)) as other, pytest.raises(SceneError, match="seed: 0 -> 1"):
        total.merged(other._saved_film())
