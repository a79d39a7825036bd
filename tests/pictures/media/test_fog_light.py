"""Light paths through media make the picture of `path` alone: in fog, on a grid, behind glass.

Significance as in tests/pictures/support.py.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, media, phases
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Auto, Box, ParticleTracer, Path, Vcm
from clpt.scene.lights import Area, Constant, Directional, Light, Point, Spot
from clpt.scene.shapes import Cube, Group, Instance, Rectangle, Shape, Sphere
from tests.pictures.support import assert_agree, assert_mean, blocks, exposures, pictures_of_parts
from tests.pictures.transport.test_hybrid import both, narrow

CHROMATIC = (0.5, 1.5, 3.0)  # [1/m]
BLACK = m.Diffuse(reflectance=0.0)
GLASS = m.RoughDielectric(int_ior=1.5, alpha_u=0.2, alpha_v=0.2)
FLAT = tf.rotate([1, 0, 0], -90)
FOGS = {
    "grey": media.Homogeneous(sigma_t=1.0, albedo=0.9),
    "chromatic": media.Homogeneous(
        sigma_s=CHROMATIC, sigma_a=0.1, phase=phases.HenyeyGreenstein(g=0.5)
    ),
    "grid": media.Grid(
        density=np.random.default_rng(1).random((9, 9, 9), np.float32),
        to_world=tf.translate([-1, -1, -1]) @ tf.scale(2.0),
        sigma_s=CHROMATIC,
        sigma_a=0.1,
    ),
}
SPOT = Spot(to_world=tf.look_at([0.1, 0.9, 0.1], [0, 0, 0], [0, 0, 1]), intensity=10.0, cutoff=35)
SUN = Directional(direction=(0.2, -1, -0.1), irradiance=3.0)
LAMP = Sphere(
    center=(0.2, 0.7, 0.1), radius=0.15, material=BLACK, emission=Area(radiance=20.0), name="lamp"
)
LIGHTS: dict[str, Light | Shape] = {
    "spot": SPOT, "sun": SUN, "sky": Constant(radiance=1.0), "lamp": LAMP,
}  # fmt: skip


def room(
    medium: media.Medium,
    light: Light | Shape,
    *more: Shape,
    inside: bool = False,
    mode: str = "rgb",
) -> Scene:
    """A cube of a medium over a floor, seen from without or from within."""
    shapes = [
        Cube(material=m.Null(), interior=medium),
        Rectangle(to_world=tf.translate([0, -0.8, 0]) @ FLAT @ tf.scale(0.7), material=m.Diffuse()),
        *more,
    ]
    eye = [0, 0.3, 0.9] if inside else [0, 0.5, 3.5]
    return Scene(
        camera=Perspective(
            to_world=tf.look_at(eye, [0, -0.1, 0], [0, 1, 0]), fov=90 if inside else 40
        ),
        shapes=[*shapes, light] if isinstance(light, Shape) else shapes,
        lights=[] if isinstance(light, Shape) else [light],
        film=Film(width=16, height=16, mode=mode, filter=Box()),  # type: ignore[arg-type]
    )


def test_fog() -> None:
    """Most light of the spot comes to the camera by many collisions, so that both sides count."""
    both(room(FOGS["chromatic"], SPOT), 32, "chromatic fog", max_depth=6)


def test_light_scattered_once() -> None:
    """First collisions of light paths are joined to the camera too, and weighed."""
    both(room(FOGS["chromatic"], SPOT), 32, "scattered once", max_depth=2)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("inside", [False, True], ids=["without", "within"])
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("fog", FOGS)
def test_every_light_in_every_medium(fog: str, light: str, inside: bool, mode: str) -> None:
    scene = room(FOGS[fog], LIGHTS[light], inside=inside, mode=mode)
    both(scene, 128, f"{light} in {fog}", max_depth=6)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_a_ball_of_glass_in_fog(mode: str) -> None:
    """The caustic in the fog, and photons on the floor."""
    fog = FOGS["chromatic"]
    ball = Sphere(radius=0.3, material=GLASS, exterior=fog)
    scene = room(fog, LAMP, ball, mode=mode)
    both(scene, 256, "glass in fog", max_depth=6)
    alone = dataclasses.replace(scene, integrator=Path(max_depth=6, light_paths=0))
    merged = dataclasses.replace(scene, integrator=Vcm(max_depth=6, radius=0.01))
    reference = blocks(exposures(alone, 12, 256, device=narrow()))
    assert_agree(blocks(exposures(merged, 12, 256, 101, device=narrow())), reference, "vcm")


@pytest.mark.slow
@pytest.mark.parametrize(
    "phase", [phases.Rayleigh(), phases.Draine(g=0.3, alpha=2.0), phases.Blend(weight=0.3)]
)
def test_phase_functions(phase: phases.Phase) -> None:
    fog = media.Homogeneous(sigma_s=CHROMATIC, phase=phase)
    both(room(fog, SPOT, mode="spectral"), 128, phase.kind, max_depth=6)


@pytest.mark.slow
def test_particle_tracer() -> None:
    """It sees the lamp too, dimmed by the fog before it."""
    scene = room(FOGS["chromatic"], LAMP)
    ours, theirs = (
        dataclasses.replace(scene, integrator=one)
        for one in (ParticleTracer(max_depth=6), Path(max_depth=6, light_paths=0))
    )
    reference = blocks(exposures(theirs, 12, 512, device=narrow()))
    assert_agree(blocks(exposures(ours, 12, 512, 101, device=narrow())), reference, "from lights")


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_furnace(mode: str) -> None:
    """What scatters all light cannot be seen under the same light from everywhere."""
    ball = Sphere(material=m.Null(), interior=media.Homogeneous(sigma_s=CHROMATIC))
    scene = Scene(
        camera=Perspective(fov=12.0, to_world=tf.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])),
        shapes=[ball],
        lights=[Constant(radiance=1.0)],
        film=Film(width=8, height=8, mode=mode, filter=Box()),  # type: ignore[arg-type]
        integrator=Path(max_depth=-1, rr_depth=1000, light_paths=1),
    )
    assert_mean(exposures(scene, 8, 64), 1.0, 0.02)


@pytest.mark.slow
def test_bodies_and_instances() -> None:
    """Light starts in the body where the lamp is; an instance is a boundary as any other.

    The glass is rough: through smoother glass few of the camera's paths find the spot lamp, and the
    mean of those that do not is no reference.
    """
    milk, fog = media.Homogeneous(sigma_s=4.0), FOGS["grey"]
    rough = m.RoughDielectric(int_ior=1.5, alpha_u=0.6, alpha_v=0.6)
    cup = Sphere(radius=0.3, material=rough, priority=2)
    drop = Sphere(center=(0.2, 0, 0), radius=0.3, material=rough, interior=milk, priority=1)
    both(room(fog, SPOT, cup, drop), 128, "bodies", max_depth=6)
    group = Group(shapes=(Cube(material=m.Null(), interior=fog),))
    placed = [Instance(group=group, to_world=tf.scale(s)) for s in (1.0, 0.01)]
    scene = room(fog, SPOT)
    scene.shapes = [*placed, *scene.shapes[1:]]
    assert lower(dataclasses.replace(scene, integrator=Path(light_paths=1))).features.light_media
    both(scene, 128, "instances", max_depth=6)


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["brute", "binary", "wide8", "compact"])
def test_layouts_and_stages(layout: str) -> None:
    """Each by itself makes the same picture, but for rounding; parts of a render the same bits."""
    scene = room(FOGS["grey"], SPOT)
    scene.integrator = Path(max_depth=5, light_paths=1)
    whole, parts = pictures_of_parts(scene)
    assert np.array_equal(whole, parts)
    for looped in (True, False):
        with clpt.Renderer(scene, layout=layout, looped=looped) as renderer:
            renderer.run(12)
            assert renderer.image().mean() == pytest.approx(whole.mean(), rel=0.05)


def test_where_light_paths_do_not_know_their_medium() -> None:
    """Of a lamp before an open boundary, between two media, or in one without an end."""
    fog = FOGS["grey"]
    wall = Rectangle(material=m.Null(), interior=fog, name="wall")
    half = dataclasses.replace(LAMP, center=(0, 1, 0))
    endless = room(fog, SUN)
    endless.camera = dataclasses.replace(endless.camera, medium=media.Homogeneous(sigma_s=0.1))
    wanted: list[tuple[Scene, str]] = [
        (room(fog, SPOT, wall), "not closed"),
        (room(fog, half), "more than one"),
        (endless, "no end"),
    ]
    for scene, words in wanted:
        for integrator in (Path(light_paths=1), Auto()):
            given: Any = dataclasses.replace(scene, integrator=integrator)
            lowered = lower(given)
            assert lowered.settings["light_paths"] == 0
            assert words in lowered.reason + " ".join(lowered.warnings)
        with pytest.raises(SceneError, match=words):
            lower(dataclasses.replace(scene, integrator=ParticleTracer()))


def test_auto_in_fog() -> None:
    """Light paths serve where a small light is in what scatters, and where glass is in it; not
    through much of it, and in little of it around a spot lamp alone."""
    fog = FOGS["grey"]
    thin, dense = (media.Homogeneous(sigma_t=t, albedo=0.9) for t in (0.05, 5.0))
    bulb = Point(position=(0.2, 0.7, 0.1))
    ball = Sphere(radius=0.3, material=m.Dielectric(), exterior=fog)
    for scene, number in (
        (room(fog, SPOT), 0.5),
        (room(thin, SPOT), 0.5),
        (room(dense, SPOT), 0.0),
        (room(fog, bulb), 0.5),
        (room(thin, bulb), 0.0),
        (room(FOGS["grid"], bulb), 0.5),
        (room(fog, SUN), 0.0),
        (room(fog, SUN, ball), 0.25),
        (room(fog, SUN, dataclasses.replace(ball, interior=fog)), 0.0),
        (room(fog, Constant()), 0.0),
        (room(media.Homogeneous(sigma_a=1.0), SPOT), 0.0),
    ):
        lowered = lower(dataclasses.replace(scene, integrator=Auto()))
        assert lowered.settings["light_paths"] == number, lowered.reason


@pytest.mark.slow
def test_a_lamp_that_moves_is_in_another_medium() -> None:
    scene = room(FOGS["grey"], SPOT)
    scene.integrator = Path(light_paths=1)
    out = dataclasses.replace(SPOT, to_world=tf.translate([0, 3, 0]) @ SPOT.to_world)
    with clpt.Renderer(scene) as renderer:
        first = renderer._wavefront.scene.lowered.tables["media"].copy()
        renderer.update(scene=dataclasses.replace(scene, lights=[out]))
        second = renderer._wavefront.scene.lowered.tables["media"]
        assert first[9] != 0 and second[9] == 0  # behind one aim and its cone, of four words each
