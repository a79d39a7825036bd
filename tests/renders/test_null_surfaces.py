"""Light through masks and null boundaries: lights are seen and sampled through them."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import ParticleTracer, Path
from clpt.scene.lights import Area, Constant, Point, Spot
from clpt.scene.shapes import Rectangle, Shape, Sphere
from clpt.scene.textures import Checkerboard
from tests.renders.builders import ALBEDO, BLACK, facing_down
from tests.renders.support import assert_mean, exposures

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
        integrator=Path(max_depth=12),
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
