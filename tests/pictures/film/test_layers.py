"""Layers beside the picture: closed forms, through mirrors and glass too, the same bits however a
render is split, and no change of the picture."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import device as dev
from clpt import images
from clpt import transforms as tf
from clpt.__main__ import run
from clpt.errors import SceneError, UnknownKindError
from clpt.render.film.layers import channels_of
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic, Perspective
from clpt.scene.integrators import (
    Auto,
    Box,
    Direct,
    Independent,
    Mitchell,
    ParticleTracer,
    Path,
    Sobol,
    Vcm,
    Whitted,
    Zsobol,
)
from clpt.scene.layers import LAYERS
from clpt.scene.lights import Area, Constant, Point
from clpt.scene.materials import Conductor, Dielectric, Diffuse, Mask, RoughPlastic
from clpt.scene.shapes import Rectangle, Sphere

MEANS = [name for name, layer in LAYERS.items() if layer.form in ("near", "long")]
IDS = tuple(name for name, layer in LAYERS.items() if layer.form == "id")
FIRST = [name for name in MEANS if not LAYERS[name].denoising]
WITHOUT_LIGHT = tuple(name for name, layer in LAYERS.items() if layer.form != "light")
DENOISING = ("denoising_albedo", "denoising_normal")
CAMERA, GROUPS = Path(light_paths=0), "light_groups"
FILTERED = ({"filter": Mitchell()}, {"filter": Mitchell(), "filtering": "importance"})
RED, BLUE = (0.7, 0.2, 0.1), (0.1, 0.2, 0.6)


def room(integrator=None, **film) -> Scene:
    """Balls of glass, metal, plastic and with holes over a floor, under a lamp and a sky."""
    balls = [Dielectric(), Conductor(), RoughPlastic(), Mask(opacity=0.5, material=Diffuse())]
    shapes = [
        Sphere(center=(1.2 * i - 1.8, 0.5, 0.2 * i), radius=0.5, material=material)
        for i, material in enumerate(balls)
    ]
    floor = Rectangle(
        to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(6), material=Diffuse(reflectance=RED)
    )
    lamp = Sphere(center=(0, 3, 0), radius=0.3, emission=Area(radiance=20.0))
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 2, 6], [0, 0.5, 0], [0, 1, 0]), fov=40),
        shapes=[*shapes, floor, lamp],
        lights=[Constant(radiance=0.3), Point(position=(2, 4, 2), intensity=3.0)],
        film=Film(**{"width": 40, "height": 30, "mode": "rgb", **film}),
        integrator=integrator or Path(light_paths=0),
    )


def layers_of(scene: Scene, samples: int = 16, **options) -> dict[str, np.ndarray]:
    with clpt.Renderer(scene, **options) as renderer:
        renderer.run(samples)
        return renderer.layers()


def test_layers_are_what_pixels_see():
    """A ball before a wall, at the pixels' centres in float64; no light is needed. A layer has the
    same bits with a longer path."""
    ball = Sphere(center=(0, 0, 0), radius=1.0, material=Diffuse(reflectance=RED))
    wall = Rectangle(
        to_world=tf.translate([0, 0, -2]) @ tf.scale(9), material=Diffuse(reflectance=BLUE)
    )
    scene = Scene(
        camera=Perspective(to_world=tf.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]), fov=45),
        shapes=[ball, wall],
        film=Film(width=21, height=21, mode="rgb", filter=Box(radius=0.01), layers=(*FIRST, *IDS)),
        integrator=Path(max_depth=1, light_paths=0),
    )
    made = layers_of(scene)
    x = np.tan(np.radians(22.5)) * (np.arange(21) - 10.0) / 10.5
    d = np.stack([*np.meshgrid(x, -x), -np.ones((21, 21))], axis=2)
    d /= np.linalg.norm(d, axis=2, keepdims=True)
    o = np.array([0.0, 0.0, 4.0])
    b = d @ o
    inside = b * b - 15.0
    hit = inside > 0.0
    t = np.where(hit, -b - np.sqrt(np.maximum(inside, 0.0)), -6.0 / d[..., 2])
    p = o + t[..., None] * d
    near = scene.camera.near  # where rays begin
    clear = np.abs(inside) > 0.05  # not at the outline
    normal = np.where(hit[..., None], p, [0.0, 0.0, 1.0])
    colour = np.where(hit[..., None], RED, BLUE)
    expected = {"position": p, "geometric_normal": normal, "shading_normal": normal,
                "depth": (t + near / d[..., 2])[..., None],
                "z": 4.0 - p[..., 2:], "albedo": colour}  # fmt: skip
    for name, values in expected.items():
        np.testing.assert_allclose(made[name][clear], values[clear], atol=3e-3, err_msg=name)
    flat = clear & ~hit
    np.testing.assert_allclose(made["uv"][flat], p[flat][:, :2] / 18.0 + 0.5, atol=1e-3)
    np.testing.assert_array_equal(made["shape_id"][clear, 0], 1 - hit[clear])
    assert not made["primitive_id"][hit & clear].any()


@pytest.mark.slow
def test_a_spectral_albedo_is_the_colour_of_the_paint():
    """To what 64 samples of four wavelengths tell, under light of equal energy in place of D65."""
    spectral = layers_of(room(mode="spectral", layers=("albedo",)), 64)["albedo"]
    rgb = layers_of(room(layers=("albedo",)), 64)["albedo"]
    assert np.abs(spectral - rgb).mean() < 0.01
    np.testing.assert_allclose(spectral[-3:].mean(axis=(0, 1)), RED, atol=0.035)


LONG = [
    pytest.param(how, marks=pytest.mark.slow)
    for how in (Path(light_paths=1), Vcm(), Direct(), Auto())
]


@pytest.mark.slow
@pytest.mark.parametrize("how", [CAMERA, *LONG])
def test_the_picture_has_the_same_bits(how):
    names = tuple(LAYERS) if how == CAMERA else WITHOUT_LIGHT
    with clpt.Renderer(room(how)) as plain, clpt.Renderer(room(how, layers=names)) as layered:
        plain.run(6)
        layered.run(6)
        np.testing.assert_array_equal(layered.image(), plain.image())
        assert plain.layers() == {}
        assert [n for n in layered.layers() if n in LAYERS] == [n for n in names if n != GROUPS]


@pytest.mark.slow
@pytest.mark.parametrize("film", [{}, *FILTERED])
def test_layers_have_the_same_bits_however_they_are_rendered(film):
    splatting = film and "filtering" not in film
    how, names = (Path(light_paths=1), WITHOUT_LIGHT) if splatting else (CAMERA, LAYERS)
    scene = room(how, layers=names, **film)
    once = layers_of(scene, 70)
    with clpt.Renderer(scene, looped=False, slots=128) as other:
        other.run(3)
        other.step(60)
        other.run(7)
        split = other.layers()
    assert once.keys() == split.keys()
    for name, values in once.items():
        np.testing.assert_array_equal(split[name], values)
    np.testing.assert_array_equal(layers_of(scene, 64)["depth"], once["depth"])  # of the first 64


SAMPLERS = [Sobol(), *(pytest.param(s, marks=pytest.mark.slow) for s in (Zsobol(), Independent()))]
SEEDS, TOLD = 24, (24, 64, 128)


@pytest.mark.parametrize("sampler", SAMPLERS, ids=lambda s: s.kind)
def test_variance_is_that_of_pictures(sampler):
    """Told over true, as roots of means over the picture, by pictures of many seeds: within 15 %,
    and 3.3 standard errors, by leaving out a seed after the other (a chance of 1 in 1000 each).

    The square of half the difference of even and odd samples tells 1.9 to 2.0 of Sobol points.
    """
    scene = room(layers=("variance",), width=24, height=16)
    even = {"shapes": scene.shapes[:-1], "lights": [Constant(radiance=0.3)]}  # without caustics
    scene = dataclasses.replace(scene, sampler=sampler, **even)
    pictures = np.empty((SEEDS, len(TOLD), 16, 24, 3))
    told = np.empty_like(pictures)
    with clpt.Renderer(scene) as renderer:
        for seed in range(SEEDS):
            renderer.update(scene=dataclasses.replace(scene, seed=seed))
            for i, samples in enumerate(TOLD):
                renderer.run(samples - renderer.samples)
                pictures[seed, i] = renderer.image()
                told[seed, i] = renderer.layers()["variance"]

    def ratio(kept: np.ndarray) -> np.ndarray:
        over = 1.0 / (pictures.mean(axis=0) + 0.1) ** 2
        true = pictures[kept].var(axis=0, ddof=1) * over
        return np.sqrt((told[kept].mean(axis=0) * over).sum((1, 2, 3)) / true.sum((1, 2, 3)))

    found = ratio(np.arange(SEEDS))
    without = np.array([ratio(np.delete(np.arange(SEEDS), i)) for i in range(SEEDS)])
    error = np.sqrt((SEEDS - 1) * without.var(axis=0))
    assert (np.abs(found - 1.0) < 0.15 + 3.3 * error).all(), (found, error)
    assert (error < 0.05).all(), (found, error)


def test_variance_and_halves():
    """A film keeps octaves apart for one and parity for the other, at once: as each alone."""
    scene, plain = room(layers=("variance",)), room()
    with clpt.Renderer(scene, halves=True, slots=128) as both, clpt.Renderer(plain) as alone:
        both.run(3)
        both.run(8)
        alone.run(11)
        with pytest.raises(SceneError, match="halves=True"):
            alone.halves()
        np.testing.assert_array_equal(both.image(), alone.image())
        assert len(both.film_state().words) == 4
        variance, halves = both.layers()["variance"], both.halves()
    with clpt.Renderer(plain, halves=True) as parity, clpt.Renderer(scene) as octaves:
        parity.run(11)
        octaves.run(11)
        np.testing.assert_array_equal(octaves.layers()["variance"], variance)
        with pytest.raises(SceneError, match="halves=True"):
            octaves.halves()
        for one, other in zip(parity.halves(), halves, strict=True):
            np.testing.assert_array_equal(one, other)


def test_a_mirror_shows_what_denoisers_need():
    """A mirror that takes half of the light, before a blue wall: half of its paint, its normal."""
    mirror = Rectangle(
        to_world=tf.rotate([0, 1, 0], 45), material=Conductor(specular_reflectance=0.5)
    )
    wall = Rectangle(
        to_world=tf.translate([4, 0, 0]) @ tf.rotate([0, 1, 0], -90) @ tf.scale(8),
        material=Diffuse(reflectance=BLUE),
    )
    scene = Scene(
        camera=Orthographic(to_world=tf.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]) @ tf.scale(0.4)),
        shapes=[mirror, wall],
        lights=[Constant(radiance=1.0)],
        film=Film(width=8, height=8, mode="rgb", layers=LAYERS),
        integrator=Path(light_paths=0),
    )
    made = layers_of(scene)
    half = np.broadcast_to(0.5 * np.array(BLUE), (8, 8, 3))
    np.testing.assert_allclose(made["denoising_albedo"], half, atol=1e-5)
    np.testing.assert_allclose(made["denoising_normal"][..., 0], -1.0, atol=1e-5)
    np.testing.assert_allclose(np.abs(made["shading_normal"][..., 0]), np.sqrt(0.5), atol=1e-5)
    np.testing.assert_allclose(made["position"][..., 0], -made["position"][..., 2], atol=1e-5)


def test_glass_lets_all_through():
    """A ball of glass in a white room: what is behind it, of each path one surface, is 1."""
    glass = Sphere(radius=1.0, material=Dielectric())
    walls = Sphere(radius=9.0, material=Diffuse(reflectance=1.0))
    scene = Scene(
        camera=Perspective(to_world=tf.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]), fov=20),
        shapes=[glass, walls],
        lights=[Constant(radiance=1.0)],
        film=Film(width=8, height=8, mode="rgb", layers=DENOISING),
        integrator=Path(light_paths=0, max_depth=200, rr_depth=1000),
    )
    np.testing.assert_allclose(layers_of(scene)["denoising_albedo"], 1.0, atol=1e-4)


def test_nothing_is_seen_in_the_sky():
    made = layers_of(dataclasses.replace(room(layers=LAYERS), shapes=[]), 4)
    for name, values in made.items():
        form = LAYERS[name].form if name in LAYERS else "light"
        if form in ("near", "long", "matte") or name == "indirect":
            assert not values.any()
        if form == "id":
            assert (values == -1.0).all()
    assert (made["samples"] == 4.0).all()


@pytest.mark.parametrize("how", [Whitted(), ParticleTracer()])
def test_integrators_without_layers_are_refused(how):
    with pytest.raises(SceneError, match=r"film.layers: only the integrators auto, path, vcm"):
        clpt.Renderer(room(how, layers="albedo"))


def test_names_and_changes(scenes):
    with pytest.raises(UnknownKindError, match=r"unknown layer 'normal'.*shading_normal"):
        Film(layers=("normal",))
    with clpt.Renderer(room(layers=("depth",))) as renderer:
        with pytest.raises(SceneError, match="other layers need a new Renderer"):
            renderer.update(scene=room(layers=("depth", "uv")))
        renderer.run(2)
        before = renderer.layers()["depth"]
        camera = dataclasses.replace(renderer.scene.camera, fov=20.0)
        renderer.update(camera=camera)
        assert not renderer.layers()["depth"].any()
        renderer.run(2)
        assert (renderer.layers()["depth"] != before).any()


def test_layers_are_saved_merged_and_written(tmp_path):
    """In ranges of samples, by files, and to an .exr without a device: as in one render."""
    scene = room(layers=LAYERS, width=20, height=15)
    wanted = layers_of(scene, 20)
    for first, end in ((0, 8), (8, 20)):
        with clpt.Renderer(scene, first_sample=first) as renderer:
            renderer.run(end - first)
            renderer.save_state(tmp_path / f"{first}.film")
    with clpt.Renderer(scene) as renderer:
        renderer.load_state(tmp_path / "0.film")
        renderer.run(12)
        resumed = renderer.layers()
    films = [str(tmp_path / f"{first}.film") for first in (0, 8)]
    assert run(["merge", *films, "-o", str(tmp_path / "all.exr")]) == 0
    written = images.read_layers(tmp_path / "all.exr")
    for name, values in wanted.items():
        np.testing.assert_array_equal(resumed[name], values)
    for name, values in channels_of(wanted).items():
        if name.startswith("variance"):  # of pictures, which the host makes to an ulp
            np.testing.assert_allclose(written[name], values, rtol=1e-3, atol=1e-9)
        else:
            np.testing.assert_array_equal(written[name], values)


@pytest.mark.slow
def test_several_devices_have_the_layers_of_one():
    devices = [dev.choose(threads=1), dev.choose(threads=1)]
    with clpt.MultiRenderer(room(layers=DENOISING), devices) as renderer:
        renderer.run(12)
        together = renderer.layers()
    alone = layers_of(room(layers=DENOISING), 12, device=dev.choose(threads=1))
    for name in DENOISING:
        np.testing.assert_array_equal(together[name], alone[name])


def test_the_command_line_writes_layers(tmp_path, scenes, capsys):
    path = tmp_path / "a.exr"
    given = ["render", str(scenes / "cornell.xml"), "--size", "16x16", "--spp", "2"]
    assert run([*given, "--layers", "depth,albedo", "-o", str(path)]) == 0
    written = images.read_layers(path)
    assert {"depth.Z", "albedo.R", "albedo.B"} <= written.keys()
    assert 1.0 < np.median(written["depth.Z"]) < 4.0  # metres; a corner may see past the box
    assert run([*given, "--layers", "height", "-o", str(path)]) == 2
    assert "'height' is unknown" in capsys.readouterr().err
