"""Clear air as a medium, beside the tabulated sky of the same air."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.lowering.lights.atmosphere import LAMBDAS, SUNLIGHT
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.air import clear_air
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Box, Path
from clpt.scene.lights import Directional, Sky
from clpt.scene.shapes import Cube
from clpt.spectra import Tabulated

WIDTH, HEIGHT = 600e3, 60e3  # [m]
ELEVATION = 40.0  # of the sun [degrees]
WITHIN = 0.05  # noise of some 1 %; a flat earth and depolarisation, which is left out, are 1 %


def mean(spp: int, elevation: float, **parts: Any) -> np.ndarray:
    """The mean colour of a piece of the sky, away from the sun."""
    up, level = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
    eye, toward = np.array([0.0, 10.0, 0.0]), np.array([0.6 * level, up, -0.8 * level])
    scene = Scene(
        camera=Perspective(fov=8.0, to_world=tf.look_at(eye, eye + toward, [1, 0, 0])),
        film=Film(width=8, height=8, filter=Box(), mode="spectral"),
        integrator=Path(max_depth=16),
        **parts,
    )
    with clpt.Renderer(scene) as renderer:
        renderer.run(spp)
        return np.asarray(renderer.image(), float)[..., :3].mean(axis=(0, 1))


@pytest.mark.slow
def test_the_sky_by_the_medium() -> None:
    """In the same air, with black ground and no ozone, sun at 40 degrees: at two heights."""
    sun = np.radians(ELEVATION)
    down = [0.0, -np.sin(sun), -np.cos(sun)]
    irradiance = Tabulated(LAMBDAS, SUNLIGHT, "hold")
    box = tf.translate([0, HEIGHT / 2, 0]) @ tf.scale([WIDTH / 2, HEIGHT / 2, WIDTH / 2])
    medium: dict[str, Any] = {
        "shapes": [Cube(to_world=box, material=m.Null(), interior=clear_air(WIDTH, HEIGHT))],
        "lights": [Directional(direction=down, irradiance=irradiance)],
    }
    table = {
        "lights": [Sky(sun_elevation=ELEVATION, aerosol=0.0, ozone=0.0, ground=0.0, sun_scale=0.0)]
    }
    for height in (80.0, 25.0):
        ours, theirs = mean(320, height, **medium), mean(16, height, **table)
        np.testing.assert_allclose(ours, theirs, rtol=WITHIN, err_msg=f"at {height} degrees")


def test_bad_input() -> None:
    with pytest.raises(SceneError, match=r"clear_air\.width: must be above 0"):
        clear_air(0.0)
