"""Adaptive sampling: no bias, true counts, and what it refuses.

The floor under a lamp in a glass bulb: light reaches it only by paths that find the lamp by chance,
so that few samples often see none of it. A rule that stops by a pixel's own samples is off by 31 %
here, 7.4 standard errors of the first test's mean.
"""

from __future__ import annotations

import dataclasses
import pathlib

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.device import Device, choose
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.render.records import Features, TransportFeatures
from clpt.render.wavefront.adaptive import LEAST, LightRounds, _partners, checked
from clpt.render.wavefront.path_buffers import FOREVER, SIDE, inside, pixels, work_table
from clpt.scene import Film, Scene, materials
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import PIXELWISE, Box, Mitchell, ParticleTracer, Path, Vcm
from clpt.scene.lights import Area, Constant
from clpt.scene.shapes import Rectangle, Sphere

ROOT = pathlib.Path(__file__).resolve().parents[3]
RENDERS, MOST, NOISE, SMALL = 100, 512, 2.0, 0.02
FEW_SEE, TINY = 400, 0.005  # renders and radius, with light paths
SIGNIFICANCE = 4.5  # standard deviations: by chance once in 150,000


def bulb(radius=0.1, **changes) -> Scene:
    floor = tf.rotate([1, 0, 0], -90) @ tf.scale(2.0)
    view = tf.look_at([0, 0.6, 1.2], [0, 0, 0], [0, 1, 0])
    lamp = {"center": (0, 1, 0), "radius": radius, "emission": Area(radiance=[0.5 / radius**2] * 3)}
    scene = Scene(
        camera=Perspective(to_world=view, fov=40.0),
        shapes=[
            Rectangle(to_world=floor, material=materials.Diffuse()),
            Sphere(material=materials.Diffuse(reflectance=0.0), **lamp),
            Sphere(center=(0, 1, 0), radius=1.5 * radius, material=materials.Dielectric()),
        ],
        integrator=Path(max_depth=5, light_paths=0),
        film=Film(width=16, height=16, mode="rgb"),
    )
    return dataclasses.replace(scene, **changes)


@pytest.fixture(scope="module")
def renderer():
    with clpt.Renderer(bulb()) as made:
        yield made


def again(renderer, seed: int, **changes) -> None:
    renderer.update(scene=bulb(seed=seed, **changes))


def test_no_bias(renderer):
    again(renderer, 1000, radius=SMALL)
    renderer.run(10_000)
    converged = renderer.image().mean()
    means, counts = [], []
    for seed in range(RENDERS):
        again(renderer, seed, radius=SMALL)
        renderer.run(MOST, noise=NOISE)
        means.append(renderer.image().mean())
        counts.append(renderer.film.get()[..., 3].mean())
    assert min(counts) < MOST / 8 and max(counts) > MOST / 2  # so that a bias could show
    error = np.std(means, ddof=1) / np.sqrt(RENDERS)
    assert abs(np.mean(means) - converged) < SIGNIFICANCE * error


def test_numbers_of_samples(renderer):
    again(renderer, 1)
    seen = []
    assert renderer.run(64, lambda p: seen.append(p) or True, noise=0.5)
    first = renderer.film.get()
    assert renderer.samples == 64 and first[..., 3].min() >= 2 * LEAST
    assert first[..., 3].max() <= 64 and all(0.0 <= p.active <= 1.0 for p in seen)
    renderer.run(64, noise=0.5)
    second = renderer.film.get()
    assert (second[..., 3] >= first[..., 3]).all()
    finished = first[..., 3] < 64
    if finished.any():
        np.testing.assert_array_equal(second[finished], first[finished])
    renderer.run(8)
    assert (renderer.film.get()[..., 3] == second[..., 3] + 8).all()
    renderer.run(16, noise=1e-6)  # nobody is as calm
    assert renderer.active == 1.0


def test_the_noise_so_far(renderer):
    """It is told once it is measured, and falls as the root of the samples."""
    again(renderer, 1)
    seen = []
    renderer.run(1024, lambda p: seen.append(p) or True, noise=1e-6)
    assert seen[0].noise is None
    levels = [(p.samples, p.noise) for p in seen if p.noise]
    (few, first), (many, last) = levels[0], levels[-1]
    assert many > 4 * few and 0.5 < first / last / np.sqrt(many / few) < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("sampler", PIXELWISE)
def test_the_noise_is_the_true_error(sampler):
    """Root of the mean square over 48 pictures, of their errors and of what is told of them."""
    scene = clpt.load(ROOT / "scenes/cornell_box/scene.json")
    film = dataclasses.replace(scene.film, width=48, height=48, mode="rgb", filter=Box())
    changes = {"sampler": sampler(), "film": film, "integrator": Path(max_depth=6, light_paths=0)}
    scene = dataclasses.replace(scene, **changes)
    told, pictures = [], []
    with clpt.Renderer(scene) as made:
        for seed in range(48):
            made.update(scene=dataclasses.replace(scene, seed=seed))
            seen = []
            made.run(17, lambda p, seen=seen: seen.append(p.noise) or True, noise=1e-6)
            told.append(seen[-1] * np.sqrt(17 / 16))
            pictures.append(made.image() @ [0.2126, 0.7152, 0.0722])
    mean, variance = np.mean(pictures, axis=0), np.var(pictures, axis=0, ddof=1)
    around = mean.reshape(12, 4, 12, 4).mean(axis=(1, 3)).repeat(4, 0).repeat(4, 1)
    true = np.mean(variance / (around + 0.01 * mean.mean()) ** 2)
    assert np.sqrt(np.mean(np.square(told)) / true) == pytest.approx(1.0, abs=0.15)


def test_pieces_are_the_whole(renderer):
    """Several runs up to a number of samples, or one: the same picture."""
    pictures = []
    for pieces in ((96,), (5, 20, 7, 64)):
        again(renderer, 2)
        for samples in pieces:
            renderer.run(samples, noise=0.5)
        pictures.append(renderer.film.get())
    np.testing.assert_array_equal(pictures[0], pictures[1])


def test_full_samples_are_an_ordinary_picture(renderer):
    """Where no pixel is calm the samples are those of a render without noise."""
    again(renderer, 3)
    renderer.run(48, noise=1e-6)
    adaptive = renderer.film.get()
    again(renderer, 3)
    renderer.run(48)
    np.testing.assert_array_equal(adaptive, renderer.film.get())


def test_steps_between(renderer):
    """What was enqueued counts: no sample is taken twice, and decided cells stay decided."""
    again(renderer, 3)
    renderer.run(16, noise=1e-6)
    renderer.step(8)
    renderer.run(24, noise=1e-6)
    adaptive = renderer.film.get()
    again(renderer, 3)
    renderer.run(48)
    np.testing.assert_array_equal(adaptive, renderer.film.get())


@pytest.mark.slow
def test_other_films():
    """A crop, sides that are no multiples of four, bands, a filter with negative weights."""
    film = Film(
        width=60, height=40, crop=(5, 3, 37, 21), mode="spectral", bands=4, filter=Mitchell(),
        filtering="importance",
    )  # fmt: skip
    with clpt.Renderer(bulb(film=film)) as made:
        made.run(40, noise=1e-6)
        adaptive, bands = made.film.get(), made.image()
        made.reset()
        made.run(40)
        np.testing.assert_array_equal(adaptive, made.film.get())
        np.testing.assert_array_equal(bands, made.image())
        made.reset()
        made.run(64, noise=1.0)
        assert (made.image().sum(axis=2) > 0).any()
        assert made._wavefront.counts.samples >= made.film.get()[..., 3].sum()


def test_cancel(renderer):
    again(renderer, 4)
    assert not renderer.run(4096, lambda p: p.samples < 16, noise=1e-6)
    assert np.isfinite(renderer.image()).all() and renderer.samples == 4096
    again(renderer, 3)
    assert renderer.run(16)  # the work list is whole again
    assert (renderer.film.get()[..., 3] == 16).all()


def lit(seed: int = 0, radius: float = 0.1, **changes) -> Scene:
    """The bulb with light paths beside the camera's."""
    return bulb(radius, seed=seed, integrator=Path(max_depth=5, light_paths=1), **changes)


@pytest.fixture(scope="module")
def lit_renderer():
    with clpt.Renderer(lit(), narrow()) as made:
        yield made


def narrow() -> Device:
    """A device one lane wide: its kernels compile soonest."""
    device = choose()
    device.lanes = 1
    return device


def test_light_paths_meet_the_limit_with_fewer_samples(lit_renderer, renderer):
    """The noise of eight pictures, which have 200 pixels or more each: the bounds are wide."""
    limit, luminance, pictures = 0.3, np.array([0.2126, 0.7152, 0.0722]), []
    lit_renderer.reset(seed=99)
    lit_renderer.run(4096)
    converged = lit_renderer.image() @ luminance
    for seed in range(8):
        lit_renderer.reset(seed=seed)
        assert lit_renderer.run(4096, noise=limit) and lit_renderer.active == 0.0
        assert lit_renderer.film_state().samples.max() < 128
        pictures.append(lit_renderer.image() @ luminance)
    floor = converged > 0.0
    error = np.sqrt(np.mean((np.array(pictures)[:, floor] / converged[floor] - 1.0) ** 2))
    assert 0.5 * limit < error < 1.3 * limit
    again(renderer, 1)
    renderer.run(4096, noise=limit)
    assert renderer.film_state().samples.min() > 256


@pytest.mark.slow
def test_no_bias_with_light_paths():
    """A small part of the floor, which few light paths reach. To stop by these themselves, rather
    than by guides, is off by 33 %, 6 standard errors."""
    at = tf.look_at([0, 0.6, 1.2], [0, 0, 0], [0, 1, 0])
    wide, small = (Perspective(to_world=at, fov=fov) for fov in (8.0, 1.5))
    with clpt.Renderer(lit(radius=TINY, camera=wide), narrow()) as made:
        made.run(4096)
        converged = made.image().mean()  # the floor is as bright everywhere, but for 0.5 %
        made.update(camera=small)
        means, paths = [], []
        for seed in range(FEW_SEE):
            made.reset(seed=seed)
            made.run(MOST // 2, noise=4.0)
            means.append(made.image().mean())
            paths.append(made.film_state().words[0, -1, 0, 0])
    assert max(paths) > 2 * min(paths)  # so that a bias could show
    error = np.std(means, ddof=1) / np.sqrt(FEW_SEE)
    assert abs(np.mean(means) - converged) < SIGNIFICANCE * error


def test_light_paths_in_pieces(lit_renderer):
    """Several runs, or one, or a film that is merged: the same picture."""
    pictures = []
    for pieces in ((96,), (5, 20, 7, 64)):
        lit_renderer.reset(seed=2)
        for samples in pieces:
            lit_renderer.run(samples, noise=0.5)
        pictures.append(lit_renderer.film.get())
    np.testing.assert_array_equal(pictures[0], pictures[1])
    state = lit_renderer.film_state()
    lit_renderer.reset(seed=2)
    lit_renderer.merge(state)
    np.testing.assert_array_equal(pictures[0], lit_renderer.film.get())


def test_full_light_paths_are_an_ordinary_picture(lit_renderer):
    """Guides leave nothing behind, in no half of the film; nor do steps between."""
    for runs in ((48,), (16, None, 24)):
        lit_renderer.reset(seed=3)
        for samples in runs:
            if samples is None:
                lit_renderer.step(8)
            else:
                lit_renderer.run(samples, noise=1e-6)
        assert lit_renderer.active == 1.0
        adaptive = lit_renderer.film_state()
        lit_renderer.reset(seed=3)
        lit_renderer.run(48)
        np.testing.assert_array_equal(adaptive.words, lit_renderer.film_state().words)


def test_light_paths_go_on_for_all(lit_renderer):
    """The camera's samples end early, light paths when all of the picture is calm."""
    lit_renderer.reset(seed=1)
    lit_renderer.run(16, noise=0.2)
    assert lit_renderer.active == 1.0
    first = lit_renderer.film.get()
    lit_renderer.run(1024, noise=0.2)
    second = lit_renderer.film.get()
    words = lit_renderer.film_state().words[0]
    assert second[..., 3].max() < 64 < words[-1].min() and np.ptp(words[-1]) == 0
    assert not np.array_equal(first[..., :3], second[..., :3])
    lit_renderer.run(8)
    assert (lit_renderer.film.get()[..., 3] == second[..., 3] + 8).all()


def test_a_stop_leaves_no_guides(lit_renderer, monkeypatch):
    """Stopped while guides are traced: the film is that of the samples before."""
    measure = LightRounds.measure
    monkeypatch.setattr(
        LightRounds, "measure", lambda self, *_: measure(self, LEAST, lambda _: False)
    )
    lit_renderer.reset(seed=4)
    assert not lit_renderer.run(4096, noise=1e-6)
    stopped, image = lit_renderer.film_state().words, lit_renderer.image()
    lit_renderer.reset(seed=4)
    lit_renderer.run(LEAST)
    np.testing.assert_array_equal(stopped, lit_renderer.film_state().words)
    np.testing.assert_array_equal(image, lit_renderer.image())


@pytest.mark.slow
def test_other_films_with_light_paths():
    """A crop, sides that are no multiples of four, bands, a wide filter, halves."""
    film = Film(
        width=60, height=40, crop=(5, 3, 37, 21), mode="spectral", bands=4, filter=Mitchell(),
        filtering="importance",
    )  # fmt: skip
    with clpt.Renderer(lit(film=film), halves=True) as made:
        made.run(40, noise=1e-6)
        adaptive = made.film_state()
        made.reset()
        made.run(40)
        ordinary = made.film_state()
        np.testing.assert_array_equal(adaptive.words, ordinary.words)
        np.testing.assert_array_equal(adaptive.bands, ordinary.bands)


@pytest.mark.parametrize("noise", [0.0, -1.0, float("nan"), float("inf"), True, "low"])
def test_no_noise(renderer, noise):
    with pytest.raises(SceneError, match="noise"):
        renderer.run(1, noise=noise)


@pytest.mark.parametrize("integrator", [ParticleTracer(), Vcm()])
def test_refused(integrator):
    features = lower(bulb(integrator=integrator)).features
    with pytest.raises(SceneError, match=f"noise: .*{integrator.kind}"):
        checked(0.1, features)


def test_refused_where_pixels_share_points():
    features = Features(transport=TransportFeatures(sampler="zsobol"))
    with pytest.raises(SceneError, match="zsobol"):
        checked(0.1, features)


def test_work_list():
    """Every pixel of the picture is dealt once, and the padding to nobody."""
    settings = {"width": 10, "height": 7, "margin": 0, "tiles_x": 3, "padded_pixels": 96}
    settings["per_plane"] = 32
    order = inside(settings)
    x, y = pixels(settings)
    assert {*zip(x[order], y[order], strict=True)} == {(i, j) for i in range(10) for j in range(7)}
    work_list = work_table(settings, order, order + 1000)
    dealt = []
    for slot in range(32):
        pixel = work_list[2 * 96 + slot]
        while pixel < 96:
            dealt.append(pixel)
            pixel = work_list[pixel]
    assert sorted(dealt) == list(order)
    assert (work_list[96:192][order] == order + 1000).all()
    assert (work_table(settings, order)[96:192] == FOREVER).all()


@pytest.mark.parametrize("side", [1, 2, 15, 16, 17, 33])
def test_every_size(side):
    """A corner of one pixel is decided by the square beside it, and gets as many samples."""
    view = tf.look_at([0, 0.6, 1.2], [0, 0, 0], [0, 1, 0])
    scene = Scene(
        camera=Perspective(to_world=view),
        shapes=[Rectangle(to_world=tf.scale(0.3))],
        lights=[Constant(radiance=(1.0, 1.0, 1.0))],
        film=Film(width=side, height=side, mode="rgb"),
    )
    with clpt.Renderer(scene) as made:
        assert made.run(256, noise=0.05)
        counts = made.film_state().samples
        assert made.active == 0.0 or counts.max() == 256
        assert counts.min() >= LEAST and np.isfinite(made.image()).all()
        if side % 16 == 1 and side > 1:  # the floor and the sky beside it are as calm
            assert counts[-1, -1] in counts[:-1, :-1]


def test_partners():
    """Of the other colour, with pixels, for every cell with pixels; two cells may share one."""
    for side in range(2, 40):
        across = -(-side // SIDE)
        y, x = np.mgrid[:side, :side]
        cell = 2 * (y // SIDE * across + x // SIDE) + (x + y) % 2
        own = np.bincount(cell.ravel(), minlength=2 * across * across)
        partner = _partners(own, across)
        cells = np.flatnonzero(own)
        assert (own[partner[cells]] > 0).all() and ((partner[cells] ^ cells) & 1).all()
