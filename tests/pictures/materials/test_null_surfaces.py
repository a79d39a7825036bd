"""Light through masks and null boundaries: lights are seen and sampled through them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Integrator, ParticleTracer, Path, Whitted
from clpt.scene.lights import Area, Constant, Point, Spot
from clpt.scene.shapes import Rectangle, Shape, Sphere
from clpt.scene.textures import Checkerboard
from tests.pictures.builders import ALBEDO, BLACK, facing_down
from tests.pictures.support import assert_mean, exposures, layers_of, with_film

GROUND = Rectangle(material=m.Diffuse(reflectance=ALBEDO), to_world=tf.scale(100.0))
HALF = m.Mask(material=BLACK, opacity=0.5)
SCREENS = [  # materials between the ground and the light, and what they let through
    m.Mask(material=BLACK, opacity=0.25),
    m.Null(),
    m.Mask(material=m.Blend(first=BLACK, second=m.Null(), weight=0.5), opacity=0.5),
    m.Blend(first=HALF, second=m.Null(), weight=0.5),
    m.Mask(material=BLACK, opacity=Checkerboard(color0=0.5, color1=0.5)),
]
PASSED = 0.75 * 1.0 * 0.75 * 0.75 * 0.5
LAYOUTS = (
    "brute",
    "wide8",
    *(pytest.param(n, marks=pytest.mark.slow) for n in ("binary", "compact")),
)


def screened(lights: list, emitters: list[Shape], mode: str) -> Scene:
    """The ground under all screens, and black screens beside that nothing passes."""
    above = [
        Rectangle(material=material, to_world=tf.translate([0, 0, 0.2 + 0.1 * i]) @ tf.scale(50.0))
        for i, material in enumerate(SCREENS)
    ]
    return Scene(
        camera=facing_down(),
        shapes=[GROUND, *above, *emitters],
        lights=lights,
        integrator=Path(max_depth=2),  # screens are no depth
        film=Film(width=4, height=4, mode=mode),
    )


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_point_light_through_screens(layout: str) -> None:
    """Only a shadow ray finds it: irradiance I / r^2 times what passes."""
    light = Point(position=(0.3, 0.2, 1.0), intensity=(2.0, 2.0, 2.0))
    r2 = 0.3**2 + 0.2**2 + 1.0
    images = exposures(screened([light], [], "rgb"), 16, 256, layout=layout)
    expected = ALBEDO / np.pi * 2.0 / r2 / np.sqrt(r2) * PASSED
    assert_mean(images, [expected] * 3, 0.02, 2e-4)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_lights_that_both_ways_find(mode: str) -> None:
    """A sphere and the sky, by shadow rays and by paths that pass: together as one alone would."""
    ball = Sphere(
        center=(0, 0, 2), radius=1.0, material=BLACK, emission=Area(radiance=(3.0, 3.0, 3.0))
    )
    images = exposures(screened([Constant(radiance=(1.0, 1.0, 1.0))], [ball], mode), 16, 256)
    covered = 1.0 / 4.0  # share of the cosine-weighted hemisphere: (radius / distance)^2
    expected = ALBEDO * PASSED * (3.0 * covered + 1.0 - covered)
    assert_mean(images, [expected] * 3, 0.02, 2e-3)


@pytest.mark.slow
def test_light_paths_pass_as_well() -> None:
    """The same ground seen by light tracing, through a screen, under two and a spot light."""
    shine = Spot(
        intensity=(100.0, 100.0, 100.0),
        cutoff=10.0,
        beam_width=9.0,
        to_world=tf.look_at([0, 0, 2], [0, 0, 0], [0, 1, 0]),
    )
    scene = Scene(
        camera=Perspective(to_world=tf.look_at([0, 0, 0.5], [0, 0, 0], [0, 1, 0]), fov=20.0),
        shapes=[
            GROUND,
            Rectangle(material=HALF, to_world=tf.translate([0, 0, 0.3]) @ tf.scale(50.0)),
            Rectangle(material=HALF, to_world=tf.translate([0, 0, 0.8]) @ tf.scale(50.0)),
        ],
        lights=[shine],
        integrator=ParticleTracer(max_depth=4),
        film=Film(width=4, height=4, mode="rgb"),
    )
    images = exposures(scene, 16, 1024)
    rim = (np.arange(4) + 0.5 - 2.0) / 2.0 * 0.5 * np.tan(np.radians(10.0))
    d2 = rim[:, None] ** 2 + rim[None] ** 2 + 4.0
    passed = 0.5 * 0.5 * 0.5
    expected = float((ALBEDO / np.pi * 100.0 / d2 * 2.0 / np.sqrt(d2)).mean()) * passed
    assert_mean(images, [expected] * 3, 0.02, 5e-3)


def carded(integrator: Integrator, cards: int) -> Scene:
    """A lit wall behind cards of which nothing is left."""
    hole = m.Mask(material=BLACK, opacity=0.0)
    white = m.Diffuse(reflectance=0.8)
    return Scene(
        camera=facing_down(),
        shapes=[
            Rectangle(material=white, to_world=tf.scale(9.0)),
            *(
                Rectangle(material=hole, to_world=tf.translate([0, 0, 1e-4 * i]) @ tf.scale(3.0))
                for i in range(1, 1 + cards)
            ),
        ],
        lights=[Point(position=(0.0, 0.0, 2.0), intensity=(4.0, 4.0, 4.0))],
        integrator=integrator,
        film=Film(width=4, height=4, mode="rgb"),
    )


DEPTHS = [  # integrators, and the least depth at which they see a lit wall
    Path(max_depth=2),
    Whitted(max_depth=1, ambient=0.0),
    ParticleTracer(max_depth=2),
]


@pytest.mark.parametrize(
    "integrator",
    [DEPTHS[0], *(pytest.param(i, marks=pytest.mark.slow) for i in DEPTHS[1:])],
    ids=lambda i: i.kind,
)
def test_holes_are_no_depth(integrator: Integrator) -> None:
    """A hundred holes cost no `max_depth`, and no light: a wall at 2 m, whatever is before it."""
    scene = carded(integrator, 100)
    if isinstance(integrator, ParticleTracer):  # it needs a camera of one point, and many paths
        view = tf.look_at([0, 0, 0.05], [0, 0, 0], [0, 1, 0])
        spot = Spot(intensity=(4.0,) * 3, cutoff=0.5, beam_width=0.49)
        spot = dataclasses.replace(
            spot, to_world=tf.translate([0, 0, 2]) @ tf.rotate([1, 0, 0], 180)
        )
        camera = Perspective(to_world=view, fov=20.0)
        scene = dataclasses.replace(scene, camera=camera, lights=[spot])
    images = exposures(scene, 8, 64)
    assert_mean(images, [0.8 / np.pi * 4.0 / 2.0**2] * 3, 0.05, 2e-3)


def test_a_stack_of_more_than_a_path_crosses_is_black() -> None:
    """A path crosses 1024 null surfaces, and then ends."""
    assert exposures(carded(Path(max_depth=2), 1100), 2, 1).max() == 0.0


@pytest.mark.slow
def test_what_lies_behind_a_hole_is_the_first_surface() -> None:
    """Depth of the wall from the near plane at 1 mm, not of the nearest card."""
    scene = with_film(carded(Path(max_depth=1, light_paths=0), 20), layers="depth")
    np.testing.assert_allclose(layers_of(scene, 4)["depth"], 0.049, rtol=1e-5)


def test_the_camera_s_end_and_hidden_lights_hold_behind_holes() -> None:
    """A wall beyond `far` is not seen through holes either, nor a sky that is hidden."""
    scene = carded(Path(max_depth=2), 3)
    ends = dataclasses.replace(scene.camera, far=0.03)
    sky = [Constant(radiance=(1.0, 1.0, 1.0))]
    scene = dataclasses.replace(scene, camera=ends, lights=sky)
    np.testing.assert_allclose(exposures(scene, 2, 4), 1.0, rtol=1e-6)
    scene = dataclasses.replace(scene, integrator=Path(max_depth=2, hide_lights=True))
    assert exposures(scene, 2, 4).max() == 0.0
