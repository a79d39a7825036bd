"""`path` with light paths makes the picture of `path` alone, whatever finds the light.

Means over blocks of pixels are compared by the spread of independent exposures; see
tests/pictures/support.py for the significance. Kernels are one lane wide, which compiles soonest;
test_lanes has another width.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import device as dev
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow import find as analyse
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Orthographic, Perspective, ThinLens
from clpt.scene.integrators import Box, Direct, Filter, Gaussian, Path
from clpt.scene.lights import Area, Constant, Directional, Light, Point
from clpt.scene.shapes import Cube, Disk, Group, Instance, Rectangle, Shape, Sphere
from clpt.scene.textures import Bitmap
from tests.pictures.support import (
    assert_agree,
    assert_bands_are_the_colour,
    assert_bands_keep_their_bits,
    assert_mean,
    blocks,
    exposures,
    quick,
    with_film,
)
from tests.pictures.transport.test_light_tracing import (
    BLACK,
    DOWN,
    LIGHTS,
    UP,
    VIEW,
    ball,
    lamps,
    lit_shapes,
    still_life,
)

FLAT = tf.rotate([1, 0, 0], -90)
QUICK = ("sphere",)


def narrow() -> dev.Device:
    device = dev.choose()
    device.lanes = 1
    return device


def with_light_paths(scene: Scene, number: float = 1, **changes: Any) -> Scene:
    return dataclasses.replace(scene, integrator=Path(light_paths=number, **changes))


def both(scene: Scene, spp: int, what: str, *, number: float = 1, **integrator: Any) -> None:
    """Compare `path` with and without light paths on a scene."""
    alone = with_light_paths(scene, 0, **integrator)
    beside = with_light_paths(scene, number, **integrator)
    reference = blocks(exposures(alone, 12, spp, device=narrow()))
    ours = blocks(exposures(beside, 12, spp, first_seed=101, device=narrow()))
    assert_agree(ours, reference, what)


def corner(on: dict[str, float], *more: Shape, **film: Any) -> Scene:
    """A floor and a wall in the light of those `on`; with `more` shapes."""
    shapes = [
        Rectangle(to_world=FLAT @ tf.scale(1.5), material=m.Diffuse()),
        Rectangle(
            to_world=tf.translate([0, 0.8, -1.0]) @ tf.scale([1.5, 0.8, 1.0]),
            material=m.Diffuse(reflectance=(0.8, 0.5, 0.3)),
        ),
        *(shape for shape in lit_shapes(on) if on.get(str(shape.name))),
    ]
    lights = [light for light in lamps(on) if on.get(light.kind)]
    return Scene(
        camera=Perspective(to_world=VIEW, fov=50, fov_axis="y", offset_x=0.05),
        shapes=[*shapes, *more],
        lights=lights,
        film=Film(width=16, height=12, **{"mode": "rgb", **film}),
    )


def lamp(radius: float = 0.5, radiance: float = 10.0) -> Disk:
    """A disk above the middle of the floor."""
    place = tf.translate([0.1, 1.9, 0.0]) @ DOWN @ tf.scale(radius)
    return Disk(to_world=place, material=BLACK, emission=Area(radiance=radiance))


@pytest.mark.parametrize("kind", quick(LIGHTS, *QUICK))
def test_every_light(kind: str) -> None:
    both(corner({kind: LIGHTS[kind]}), 256, kind, max_depth=4)


def leave_aims_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no light path aim."""
    monkeypatch.setattr(analyse, "aims", lambda *_: np.zeros((0, 5), np.float32))


def smooth(mode: str) -> Sphere:
    """A small ball of glass that light paths aim at, not so smooth that `path` finds no lamp."""
    index: Any = {"rgb": 1.5, "spectral": "sf11"}[mode]
    glass = m.RoughDielectric(int_ior=index, alpha_u=0.19, alpha_v=0.19)
    return Sphere(center=(0.2, 0.35, 0.2), radius=0.2, material=glass)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("kind", LIGHTS)
def test_every_light_aims(kind: str, mode: str) -> None:
    scene = corner({kind: LIGHTS[kind]}, smooth(mode), mode=mode)
    assert lower(with_light_paths(scene)).features.transport.aimed
    both(scene, 512, kind, max_depth=5)


@pytest.mark.slow
def test_many_lights_aim_at_many_things(monkeypatch: pytest.MonkeyPatch) -> None:
    """From both sides of a plate, and a point light from the inside of glass.

    Beside light paths without aims: `path` finds what comes out of the glass as rare bright pixels.
    """
    some = ("sphere", "mesh", "point", "directional", "constant", "envmap")
    plate = tf.translate([-0.7, 0.9, 0.5]) @ tf.rotate([0, 1, 0], 70) @ tf.scale(0.25)
    shines = Area(radiance=(5.0, 4.0, 3.0), two_sided=True)
    metal = m.RoughConductor(alpha_u=0.15, alpha_v=0.15)
    things: list[Shape] = [
        smooth("rgb"),
        Rectangle(to_world=plate, material=BLACK, emission=shines),
        dataclasses.replace(smooth("rgb"), center=(0.5, 1.7, 0.9), radius=0.1),
        Cube(to_world=tf.translate([-0.5, 0.2, 0.4]) @ tf.scale(0.15), material=metal),
    ]
    scene = corner({kind: LIGHTS[kind] for kind in some}, *things)
    scene = with_light_paths(scene, max_depth=5)
    assert lower(scene).settings["aim_count"] == 3
    ours = blocks(exposures(scene, 12, 512, first_seed=101, device=narrow()))
    leave_aims_out(monkeypatch)
    assert_agree(ours, blocks(exposures(scene, 12, 512, device=narrow())), "many")


@pytest.mark.slow
def test_several_lights_at_once() -> None:
    some = ("sphere", "mesh", "point", "directional", "constant", "envmap")
    both(corner({kind: LIGHTS[kind] for kind in some}), 256, "several", max_depth=4)


@pytest.mark.slow
def test_lights_chosen_by_a_tree() -> None:
    rng = np.random.default_rng(5)
    balls = [
        Sphere(center=tuple(at), radius=0.05, material=BLACK, emission=Area(radiance=strength))
        for at, strength in zip(
            rng.uniform([-1, 0.5, -0.5], [1, 1.5, 0.9], (20, 3)), range(20, 40), strict=True
        )
    ]
    scene = corner({"constant": 0.2}, *balls)
    assert lower(scene).features.lights.tree
    both(scene, 256, "tree", max_depth=3)


@pytest.mark.slow
def test_lights_that_shine_from_both_sides() -> None:
    plate = tf.translate([-0.7, 0.9, 0.5]) @ tf.rotate([0, 1, 0], 70) @ tf.scale(0.25)
    shines = Area(radiance=(5.0, 4.0, 3.0), two_sided=True)
    both(corner({}, Rectangle(to_world=plate, material=BLACK, emission=shines)), 256, "two sides")


MATERIALS = {
    "mirror": m.Conductor(),
    "rough_conductor": m.RoughConductor(alpha_u=0.3, alpha_v=0.3),
    "dielectric": m.Dielectric(int_ior=1.5),
    "rough_dielectric": m.RoughDielectric(int_ior=1.5, alpha_u=0.3, alpha_v=0.3),
    "plastic": m.Plastic(),
    "rough_plastic": m.RoughPlastic(alpha=0.3),
    "absorbs": m.Dielectric(int_ior=1.5, absorption=1.0),
    "two_sided": m.TwoSided(front=m.RoughConductor(alpha_u=0.3, alpha_v=0.3)),
    "masked": m.Mask(material=m.Diffuse(), opacity=0.5),
    "blend": m.Blend(first=m.Diffuse(), second=m.Conductor(), weight=0.5),
}
SHARP = ("rough_dielectric",)


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind", [pytest.param(k, marks=() if k in SHARP else pytest.mark.slow) for k in MATERIALS]
)
def test_every_material(kind: str) -> None:
    """A ball of it on the floor, under a lamp that paths from the camera find as well."""
    ball = Sphere(center=(0.1, 0.45, 0.2), radius=0.4, material=MATERIALS[kind])
    both(corner({}, lamp(), ball), 512, kind, max_depth=6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["dielectric", "rough_dielectric", "rough_conductor"])
def test_materials_in_the_spectral_mode(kind: str) -> None:
    glass: dict[str, Any] = {
        "dielectric": m.Dielectric(int_ior="sf11"),
        "rough_dielectric": m.RoughDielectric(int_ior="sf11", alpha_u=0.4, alpha_v=0.4),
        "rough_conductor": MATERIALS["rough_conductor"],
    }
    ball = Sphere(center=(0.1, 0.45, 0.2), radius=0.4, material=glass[kind])
    both(corner({}, lamp(), ball, mode="spectral"), 512, kind, max_depth=6)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_smooth_normals_and_kinds_that_end_light_paths(mode: str) -> None:
    """A grating is one; what is behind it is left to the camera's paths."""
    scene = still_life(mode, {"sphere": 30.0})
    plate = tf.translate([0.1, 0.3, 0.9]) @ tf.rotate([0, 1, 0], 20) @ tf.scale([0.3, 0.3, 1.0])
    grating = Rectangle(to_world=plate, material=m.TwoSided(front=m.Grating()))
    shapes = [*scene.shapes, grating] if mode == "spectral" else scene.shapes
    both(dataclasses.replace(scene, shapes=shapes), 256, mode, max_depth=4)


@pytest.mark.slow
def test_normal_maps_are_left_to_the_camera() -> None:
    """A bent normal is turned to the viewer, wherever light comes from."""
    image = np.random.default_rng(2).random((16, 16, 3)) * 0.4 + np.array([0.3, 0.3, 0.6])
    bent = m.NormalMap(
        material=m.Diffuse(reflectance=0.8), map=Bitmap(image=image.astype(np.float32), raw=True)
    )
    scene = corner({}, lamp())
    shapes = [dataclasses.replace(scene.shapes[0], material=bent), *scene.shapes[1:]]
    both(dataclasses.replace(scene, shapes=shapes), 512, "normal map", max_depth=4)


@pytest.mark.slow
def test_instances() -> None:
    glass = m.RoughDielectric(int_ior=1.5, alpha_u=0.2, alpha_v=0.2)
    group = Group(shapes=[ball(0.3, (0, 0, 0), glass)])
    placed = [
        Instance(group=group, to_world=tf.translate([x, 0.4, 0.2]) @ tf.scale([1.0, 0.8, 1.2]))
        for x in (-0.6, 0.6)
    ]
    both(corner({}, lamp(), *placed), 256, "instances", max_depth=5)


@pytest.mark.slow
@pytest.mark.parametrize("depth", [1, 2, 3, 6])
def test_depths(depth: int) -> None:
    both(corner({"sphere": 30.0, "spot": 8.0}), 256, f"depth {depth}", max_depth=depth)


@pytest.mark.slow
@pytest.mark.parametrize("number", [3, 0.3])
def test_another_number_of_light_paths(number: float) -> None:
    scene = corner({"sphere": 30.0, "spot": 8.0})
    both(scene, 128, f"{number} a sample", number=number, max_depth=3)


@pytest.mark.slow
def test_thin_lens() -> None:
    camera = ThinLens(to_world=VIEW, fov=50, aperture_radius=0.2, focus_distance=2.0, near=0.5)
    scene = dataclasses.replace(corner({"spot": 8.0, "sphere": 30.0}), camera=camera)
    both(scene, 512, "thin lens", max_depth=3)


@pytest.mark.slow
@pytest.mark.parametrize("filtering", ["splatting", "importance"])
@pytest.mark.parametrize("chosen", [Gaussian(), Box(radius=1.2)], ids=lambda f: f.kind)
def test_wide_filters(chosen: Filter, filtering: str) -> None:
    scene = corner({"sphere": 30.0}, filter=chosen, filtering=filtering)
    both(scene, 512, f"{chosen.kind}, {filtering}", max_depth=3)


@pytest.mark.slow
def test_crop_and_alpha() -> None:
    film = {"filter": Gaussian(), "crop": (5, 3, 8, 8), "alpha": True}
    both(corner({"sphere": 30.0, "constant": 0.3}, **film), 512, "crop", max_depth=3)


@pytest.mark.slow
def test_hidden_lights() -> None:
    """What is seen through a hidden light is left to the camera's paths."""
    place = tf.translate([0.0, 0.6, 0.8]) @ tf.scale(0.3)
    plate = Rectangle(to_world=place, emission=Area(radiance=5.0), material=m.Diffuse())
    both(corner({"sphere": 30.0}, plate), 512, "hidden", max_depth=3, hide_lights=True)


@pytest.mark.slow
@pytest.mark.parametrize("material", [m.Diffuse(reflectance=1.0), m.Dielectric(int_ior=1.5)])
def test_furnace(material: m.Material) -> None:
    """What absorbs nothing is as bright as the sky around it."""
    ball: list[Shape] = [Sphere(radius=0.5, material=material)]
    ball += [Cube(to_world=tf.translate([0.8, 0, 0]) @ tf.scale(0.2), material=material)]
    scene = Scene(
        camera=Perspective(to_world=tf.look_at([0, 0, 3], [0, 0, 0], UP), fov=50),
        shapes=ball,
        lights=[Constant(radiance=(1.0, 1.0, 1.0))],
        film=Film(width=8, height=8, mode="rgb"),
    )
    made = exposures(with_light_paths(scene, max_depth=-1, rr_depth=20), 12, 256, device=narrow())
    assert_mean(made, (1.0, 1.0, 1.0), 2e-3, 1e-3)


def caustic(**film: Any) -> Scene:
    """A small lamp over a ball of glass on a floor."""
    glass = Sphere(center=(0.0, 0.7, 0.0), radius=0.4, material=m.Dielectric(int_ior=1.5))
    floor = Rectangle(to_world=FLAT @ tf.scale(2.0), material=m.Diffuse())
    return Scene(
        camera=Perspective(to_world=tf.look_at([0.0, 1.5, 2.5], [0.0, 0.2, 0.0], UP), fov=45),
        shapes=[floor, glass, lamp(0.05, 1000.0)],
        film=Film(width=16, height=12, **{"mode": "rgb", **film}),
    )


@pytest.mark.slow
def test_caustics_converge() -> None:
    """The spread of pixels of the floor, most of whose light comes through the glass."""
    noise = []
    for scene in (with_light_paths(caustic(), 0), with_light_paths(caustic())):
        made = exposures(scene, 8, 64, device=narrow())
        noise.append(made.std(axis=0)[6:9, 6:10].mean())
    assert noise[1] < 0.2 * noise[0], noise


def wide() -> Scene:
    """The sun over a small ball of glass on a field."""
    field = Rectangle(to_world=FLAT @ tf.scale(10.0), material=m.Diffuse())
    glass = Sphere(center=(0.0, 0.5, 0.0), radius=0.4, material=m.Dielectric(int_ior=1.5))
    return Scene(
        camera=Perspective(to_world=tf.look_at([0.0, 2.5, 3.5], [0.2, 0.2, 0.0], UP), fov=35),
        shapes=[field, glass],
        lights=[Directional(direction=(0.3, -1.0, 0.1), irradiance=3.0)],
        film=Film(width=16, height=12, mode="rgb"),
    )


@pytest.mark.slow
def test_aiming_finds_the_caustic(monkeypatch: pytest.MonkeyPatch) -> None:
    """The spread of pixels, with aiming and without."""
    scene, variance = with_light_paths(wide()), []
    for aimed in (True, False):
        if not aimed:
            leave_aims_out(monkeypatch)
        made = exposures(scene, 8, 64, device=narrow())
        assert bool(lower(scene).features.transport.aimed) == aimed
        variance.append(made.var(axis=0).mean())
    assert variance[0] < 0.1 * variance[1], variance


@pytest.mark.slow
def test_lanes() -> None:
    """The same paths one and eight lanes wide."""
    scene, pictures = with_light_paths(caustic()), []
    for lanes in (1, 8):
        device = dev.choose()
        device.lanes = lanes
        pictures.append(clpt.render(scene, 16, device=device))
    np.testing.assert_allclose(pictures[1], pictures[0], rtol=2e-3, atol=1e-4)


def picture(scene: Scene, *runs: int, **options: Any) -> np.ndarray:
    renderer = clpt.Renderer(scene, narrow(), **options)
    for samples in runs:
        renderer.run(samples)
    return renderer.image()


SPLIT = caustic(filter=Gaussian())


def test_same_bits_however_samples_are_split() -> None:
    """Runs, slots, steps, stages that the host enqueues."""
    scene = with_light_paths(SPLIT)
    whole = picture(scene, 7)
    assert np.array_equal(picture(scene, 3, 4), whole)
    assert np.array_equal(picture(scene, 7, slots=128), whole)
    assert np.array_equal(picture(scene, 7, looped=False), whole)
    renderer = clpt.Renderer(scene, narrow())
    for samples in (5, 2):
        event = renderer.step(samples)
    event.wait()
    assert np.array_equal(renderer.film.get()[..., :3], whole)
    assert np.array_equal(picture(scene, 40), picture(scene, 17, 23)), "turns do not show"


@pytest.mark.parametrize("number", [1, 2, 0.3])
def test_same_bits_after_a_merge(number: float) -> None:
    scene = with_light_paths(SPLIT, number)
    parts = [clpt.Renderer(scene, narrow(), first_sample=first) for first in (0, 3)]
    for renderer, samples in zip(parts, (3, 4), strict=True):
        renderer.run(samples)
    parts[0].merge(parts[1].film_state())
    assert np.array_equal(parts[0].image(), picture(scene, 7))


@pytest.mark.slow
def test_halves_are_the_whole() -> None:
    renderer = clpt.Renderer(with_light_paths(caustic()), narrow(), halves=True)
    renderer.run(6)
    mean = np.mean(renderer.halves(), axis=0)
    np.testing.assert_allclose(mean, renderer.image(), rtol=1e-5, atol=1e-6)


BANDS = caustic(mode="spectral", bands=235, output_space="xyz", filter=Gaussian())


@pytest.mark.slow
@pytest.mark.parametrize("filtering", ["importance", pytest.param("auto", marks=pytest.mark.slow)])
def test_bands_add_up_to_the_colour(filtering: str) -> None:
    """In each pixel that light paths light: what both groups of sums bring is in both."""
    assert_bands_are_the_colour(with_film(with_light_paths(BANDS), filtering=filtering), narrow())


@pytest.mark.slow
def test_bands_keep_their_bits_however_samples_are_split() -> None:
    assert_bands_keep_their_bits(with_film(with_light_paths(BANDS), bands=3), narrow())


@pytest.mark.slow
def test_bands_are_those_of_path() -> None:
    both(corner({"sphere": 30.0}, mode="spectral", bands=3), 512, "bands", max_depth=3)


def test_stopped_early_is_as_bright() -> None:
    """The film is balanced wherever it was left: pixels that have samples, and light paths."""
    scene = with_light_paths(dataclasses.replace(corner({"sphere": 30.0}), seed=3), max_depth=3)
    film = dataclasses.replace(scene.film, width=160, height=120)
    scene = dataclasses.replace(scene, film=film)
    whole = picture(scene, 64).mean()
    renderer = clpt.Renderer(scene, narrow())
    assert not renderer.run(512, lambda progress: progress.samples < 100)
    assert 64 < renderer.film.get()[..., 3].mean() < 400
    assert np.isclose(renderer.image().mean(), whole, rtol=0.03)


def test_update_keeps_both_kinds_of_paths() -> None:
    """Another material, kind, and camera, as in a new renderer."""
    scene = with_light_paths(SPLIT)
    renderer = clpt.Renderer(scene, narrow())
    renderer.run(2)
    shapes = [
        dataclasses.replace(scene.shapes[0], material=m.Plastic()),
        dataclasses.replace(scene.shapes[1], material=m.Conductor()),
        scene.shapes[2],
    ]
    turned = dataclasses.replace(
        scene,
        shapes=shapes,
        camera=Perspective(to_world=tf.look_at([0.5, 1.5, 2.5], [0.0, 0.2, 0.0], UP), fov=50),
    )
    renderer.update(scene=turned)
    renderer.run(3)
    assert np.array_equal(renderer.image(), picture(turned, 3))
    shown, alone = renderer.film, with_light_paths(turned, 0)
    for other in (alone, turned):
        renderer.update(scene=other)
        renderer.run(3)
        assert np.array_equal(renderer.image(), picture(other, 3))
    assert renderer.film is shown


@pytest.mark.slow
def test_update_keeps_aims() -> None:
    """Something sharp moves, and is sharp no more, as in a new renderer."""
    ball = Sphere(center=(0.1, 0.45, 0.2), radius=0.4, material=m.RoughConductor())
    scene = with_light_paths(corner({}, lamp(), ball))
    renderer = clpt.Renderer(scene, narrow())
    renderer.run(1)
    moved = tf.translate([-0.5, 0.2, 0.0])
    rough = m.RoughConductor(alpha_u=0.5, alpha_v=0.5)
    renderer.update(transforms={ball: moved})
    renderer.run(2)
    there = dataclasses.replace(ball, to_world=moved)
    assert np.array_equal(renderer.image(), picture(with_light_paths(corner({}, lamp(), there)), 2))
    renderer.update(materials={ball.material: rough})
    renderer.run(2)
    dull = with_light_paths(corner({}, lamp(), dataclasses.replace(there, material=rough)))
    assert not lower(dull).features.transport.aimed
    assert np.array_equal(renderer.image(), picture(dull, 2))


def test_cameras_that_cannot_be_joined_leave_it_aside() -> None:
    scene = dataclasses.replace(SPLIT, camera=Orthographic(to_world=SPLIT.camera.to_world))
    lowered = lower(with_light_paths(scene))
    assert not lowered.features.transport.weighed
    assert any("light_paths: left aside" in warning for warning in lowered.warnings)
    spectral = ThinLens(to_world=VIEW, glass="sf11")
    lens = with_light_paths(dataclasses.replace(caustic(mode="spectral"), camera=spectral))
    assert any("glass disperses" in warning for warning in lower(lens).warnings)


@pytest.mark.slow
def test_lights_that_cannot_be_weighed_are_left_to_the_camera() -> None:
    lights: list[Light] = [Point(position=(0.5, 1.7, 0.9), falloff=False)]
    scene = dataclasses.replace(corner({}), lights=lights)
    warned = lower(with_light_paths(scene)).warnings
    assert any("none start at lights[0]" in warning for warning in warned)
    both(scene, 16, "without falloff", max_depth=3)


@pytest.mark.parametrize("given", [-1, 65, 0.01, True, "many"])
def test_numbers_that_make_no_sense(given: Any) -> None:
    with pytest.raises(SceneError, match=r"path.light_paths: must be 0, 0.015625 to 64"):
        Path(light_paths=given)


def test_nothing_changes_without() -> None:
    """A scene without light paths has the programs that it would have without the parameter."""
    plain = lower(dataclasses.replace(SPLIT, integrator=Direct())).features
    assert plain.passes == (plain,) and plain.film_words == 13
    assert lower(with_light_paths(SPLIT, 0)).features == plain
