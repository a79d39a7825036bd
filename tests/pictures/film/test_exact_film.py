"""The film adds to the bit: over slots, halves and crops; and what it counts.

Splits, merging and saving are proved in tests/cluster/test_film_algebra.py.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import images
from clpt.__main__ import run
from clpt.cli.render.report import refusals
from clpt.errors import SceneError
from clpt.images import exr_files
from clpt.render.film.state import FILM_WORDS, SAMPLES_WORD, SUM_WORDS, FilmState
from clpt.render.wavefront.wavefront import Counts
from clpt.scene import Film, Scene, lights
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import (
    Independent,
    Mitchell,
    ParticleTracer,
    Sobol,
    Tent,
    Zsobol,
)
from clpt.scene.shapes import Mesh, Sphere
from clpt.scene.textures import MeshAttribute
from tests.pictures.support import with_film

SPP = 12
SIZE = {"width": 26, "height": 18}


CLOSE = Perspective(origin=(0, 0, 4), target=(0, 0, 0), fov=40)


def box(scenes: Path, kind: str) -> Scene:
    """A small Cornell box; kind: rgb, splat (samples serve several pixels), bands or light."""
    films = {
        "rgb": {"filter": Mitchell(), "filtering": "importance"},
        "splat": {"filter": Mitchell(), "alpha": True},
        "bands": {"mode": "spectral", "bands": 5},
        "light": {"filter": Tent()},
    }
    scene = with_film(clpt.load(scenes / "cornell.xml"), **{"mode": "rgb", **SIZE, **films[kind]})
    if kind == "light":
        scene = dataclasses.replace(scene, integrator=ParticleTracer())
    return scene


def same(a: FilmState, b: FilmState) -> bool:
    return np.array_equal(a.words, b.words) and np.array_equal(a.bands, b.bands)


@pytest.fixture(scope="module", params=["rgb", "splat", "bands", "light"])
def scene(request, scenes: Path) -> Scene:
    return box(scenes, request.param)


@pytest.fixture(scope="module")
def whole(scene: Scene) -> tuple[FilmState, np.ndarray]:
    """The film and the picture of one run."""
    with clpt.Renderer(scene) as renderer:
        assert renderer.run(SPP)
        assert renderer.samples == SPP and renderer.film_state().taken == ((0, SPP),)
        return renderer.film_state(), renderer.image()


@pytest.mark.parametrize("slots", [64, 448, 1 << 15])
def test_slots_change_no_bit(scene, whole, slots):
    """Few slots have one plane, many several, whose slots add to the same pixels."""
    with clpt.Renderer(scene, slots=slots) as renderer:
        renderer.run(5)
        renderer.run(SPP - 5)
        assert same(renderer.film_state(), whole[0])
        np.testing.assert_array_equal(renderer.image(), whole[1])


def test_halves(scene, whole):
    """Even and odd samples apart: the whole is the same, and each half is a picture."""
    with clpt.Renderer(scene, halves=True) as renderer:
        renderer.run(5)
        renderer.run(SPP - 5)
        state = renderer.film_state()
        words = FILM_WORDS + 2 * SUM_WORDS * scene.film.alpha  # weights, and what is covered
        assert state.words.shape == (2, words, SIZE["height"], SIZE["width"])
        np.testing.assert_array_equal(renderer.image(), whole[1])
        even, odd = renderer.halves()
        assert not np.array_equal(even, odd)
        if not scene.film.bands and not scene.film.alpha:
            np.testing.assert_allclose(0.5 * (even + odd), whole[1], rtol=1e-5, atol=1e-6)
        assert (state.words[:, SAMPLES_WORD].sum(axis=(1, 2)) == SPP / 2 * 26 * 18).all()


def test_halves_of_a_whole_film(scene, whole):
    with clpt.Renderer(scene) as renderer, pytest.raises(SceneError, match="halves=True"):
        renderer.halves()


@pytest.mark.parametrize("sampler", [Sobol(), Zsobol(), Independent()], ids=lambda s: s.kind)
def test_a_crop_is_part_of_the_picture(scenes: Path, sampler):
    scene = dataclasses.replace(box(scenes, "splat"), sampler=sampler, spp=4)
    x, y, width, height = crop = (9, 5, 14, 7)
    with clpt.Renderer(scene) as one, clpt.Renderer(with_film(scene, crop=crop)) as part:
        one.run(4)
        part.run(4)
        np.testing.assert_array_equal(part.image(), one.image()[y : y + height, x : x + width])


@pytest.mark.parametrize("layers", [(), ("depth", "shape_id")], ids=["plain", "layers"])
def test_crops_put_themselves_together(tmp_path: Path, layers: tuple[str, ...]) -> None:
    """An .exr of a crop has its place as the data window, so that readers add tiles up."""
    film = Film(width=12, height=8, mode="rgb", layers=layers)
    scene = Scene(shapes=[Sphere()], lights=[lights.Constant()], film=film, camera=CLOSE, spp=2)
    with clpt.Renderer(scene) as whole:
        whole.run(2)
        whole.save(tmp_path / "whole.exr")
    sum_ = 0.0
    for x, y, width, height in ((0, 0, 5, 8), (5, 0, 7, 3), (5, 3, 7, 5)):
        with clpt.Renderer(with_film(scene, crop=(x, y, width, height))) as part:
            part.run(2)
            part.save(tmp_path / "part.exr")
            part.save_state(tmp_path / "part.film")
        assert run(["merge", str(tmp_path / "part.film"), "-o", str(tmp_path / "again.exr")]) == 0
        for name in ("part.exr", "again.exr"):
            header = exr_files.attributes(tmp_path / name)
            assert exr_files.window(header, "dataWindow") == (x, y, x + width, y + height)
            assert exr_files.window(header, "displayWindow") == (0, 0, 12, 8)
        sum_ = sum_ + images.read(tmp_path / "part.exr")
    np.testing.assert_array_equal(sum_, images.read(tmp_path / "whole.exr"))


def test_light_paths_repeat(scenes: Path):
    """Paths from lights add to any pixel, from any thread, and yet give the same bits."""
    scene = with_film(box(scenes, "light"), width=8, height=8)
    with clpt.Renderer(scene) as renderer:
        films = []
        for _ in range(3):
            renderer.reset()
            renderer.run(200)
            films.append(renderer.film_state())
    assert same(films[0], films[1]) and same(films[0], films[2])


def sky(**film: object) -> Scene:
    given = {"width": 3, "height": 2, "mode": "rgb", **film}
    radiance = lights.Constant(radiance=(0.25, 0.5, 1.0))
    return Scene(camera=Perspective(), lights=[radiance], film=Film(**given))


def test_more_samples_than_a_float_counts():
    """A film of 2^31 - 5 samples, put in: its mean stays, and it counts on, to the limit."""
    with clpt.Renderer(sky(), first_sample=2**31 - 5) as renderer:
        renderer.run(2)
        two = renderer.film_state()
        many = np.zeros_like(two.words)
        total = int(2**48 * 0.5) * (2**31 - 5)
        sums = np.array([total >> 32 * i & 0xFFFFFFFF for i in range(3)], np.uint32)
        for first in (0, 3, 6):
            many[0, first : first + 3] = sums[:, None, None]
        many[0, 9] = 2**31 - 5
        renderer.merge(FilmState(many, two.bands, ((0, 2**31 - 5),)))
        assert renderer.samples == 2**31 - 3
        np.testing.assert_allclose(renderer.image(), 0.5, rtol=1e-6)
        renderer.step(2).wait()
        assert (renderer.film_state().samples == 2**31 - 1).all()
        np.testing.assert_allclose(renderer.image(), 0.5, rtol=1e-6)
        with pytest.raises(SceneError, match="more than 2147483647 samples"):
            renderer.run(1)


def test_numbers_of_a_stopped_run_are_not_used_again():
    with clpt.Renderer(sky(width=40, height=40), slots=64) as renderer:
        assert not renderer.run(4096, lambda progress: progress.samples < 8)
        assert renderer.samples == 4096
        assert renderer.run(3)
        assert renderer.film_state().taken == ((0, 4099),)
        np.testing.assert_allclose(renderer.image(), [[[0.25, 0.5, 1.0]] * 40] * 40, rtol=1e-6)


def test_what_stops_a_run():
    """Only what is false, and `cancel`, also before the run."""
    with clpt.Renderer(sky()) as renderer:
        assert renderer.run(3, lambda progress: None) and renderer.run(3, lambda progress: 1)
        renderer.cancel()
        assert not renderer.run(3) and renderer.samples == 6
        assert renderer.run(3) and renderer.samples == 9


@pytest.mark.parametrize("looped", [None, False])
def test_a_run_that_is_discarded_leaves_nothing(looped):
    """Its paths are left in flight; the next run has the bits of a new renderer's."""
    scene = sky(width=40, height=40)
    with clpt.Renderer(scene, slots=64, looped=looped) as renderer:
        renderer.run(5)

        def discard(_: object) -> None:
            renderer.cancel(discard=True)

        assert not renderer.run(4096, discard) and renderer.samples == 0
        assert not renderer.film.get().any()
        assert renderer.run(3) and renderer.samples == 3
        found = renderer.film.get()
        renderer.cancel(discard=True)  # before a run: nothing is lost
        assert not renderer.run(2) and renderer.samples == 3
    with clpt.Renderer(scene, slots=64, looped=looped) as fresh:
        fresh.run(3)
        np.testing.assert_array_equal(found, fresh.film.get())


def test_a_stop_that_becomes_a_discard():
    """Paths that were to come to their end are left in flight after all."""
    with clpt.Renderer(sky(width=40, height=40), slots=64) as renderer:

        def stop(_: object) -> None:
            renderer.cancel()
            renderer.cancel(discard=True)
            renderer.cancel()  # which does not bring the film back

        assert not renderer.run(4096, stop) and renderer.samples == 0
        assert renderer.run(2) and renderer.samples == 2


def test_a_flag_that_running_kernels_see():
    """Where a device shares words, no bounce begins while `leave` is raised, but for steps."""
    with clpt.Renderer(sky(width=40, height=40), slots=64) as renderer:
        wavefront = renderer._wavefront
        if not (wavefront.looped and renderer.device.info.shares_words):
            pytest.skip("this device's kernels see nothing while they run")
        taken = []

        def look(counts: Counts) -> bool:
            taken.append(counts.samples)
            if len(taken) == 3:
                wavefront.leave.lower()
            return True

        wavefront.leave.raise_()
        assert wavefront.render_samples(0, 2, look)
        assert taken[:3] == [0, 0, 0] and taken[-1] == 2 * 40 * 40
        wavefront.leave.raise_()
        renderer.reset()
        renderer.step(3).wait()
        assert (renderer.film_state().samples == 3).all()
        assert renderer.image().all()


@pytest.mark.parametrize("number", [-1, 0.5, True, "2", 2**31])
def test_no_first_sample(number):
    with pytest.raises(SceneError, match=r"first_sample|samples"):
        clpt.Renderer(sky(), first_sample=number)


def test_sums_near_their_end_are_counted():
    """Light of 2^42 is taken, and counted once a sum is near its end; of 2^45 it is refused.

    It is that of vertices, of which the host does not know how bright they are: the film's unit
    follows light that it knows.
    """

    def painted(red: float) -> Scene:
        corners = np.array([(-9, -9, 5), (-9, 9, 5), (9, 9, 5), (9, -9, 5)], np.float32)
        colours = np.full((4, 3), (red, 0.0, 0.0), np.float32)
        square = Mesh(
            vertices=corners,
            faces=np.array([(0, 1, 2), (0, 2, 3)]),
            attributes={"vertex_color": colours},
            emission=lights.Area(radiance=MeshAttribute()),
        )
        return dataclasses.replace(sky(), lights=[], shapes=[square])

    with clpt.Renderer(painted(2.0**42)) as renderer:
        renderer.run(2)
        np.testing.assert_allclose(renderer.image()[..., 0], np.float32(2.0**42), 1e-6)
        assert renderer._wavefront.counts.full == 0
        renderer.run(20)
        assert renderer._wavefront.counts.full > 0
        (told,) = refusals(renderer)
        assert told == "pixels are too bright for the film: lower film.exposure"
        renderer.update(scene=painted(2.0**45))
        renderer.run(2)
        assert renderer._wavefront.counts.rejected == 12 and not renderer.image().any()
        assert refusals(renderer)[0].startswith(
            "12 samples were not finite, too bright, in a medium"
        )


def test_the_exposure_moves_the_range():
    """Light of 1e20 and of 1e-20 W, seen with an exposure that makes it 1."""
    for light in (1e20, 1e-20):
        scene = dataclasses.replace(
            sky(exposure=1.0 / light), lights=[lights.Constant(radiance=(light, 0.5 * light, 0.0))]
        )
        with clpt.Renderer(scene) as renderer, clpt.Renderer(sky()) as plain:
            renderer.run(3)
            assert renderer._wavefront.counts.rejected == 0
            np.testing.assert_allclose(renderer.image(), [[[1.0, 0.5, 0.0]] * 3] * 2, rtol=1e-5)
            with pytest.raises(SceneError, match="exposure"):
                plain.merge(renderer.film_state())
