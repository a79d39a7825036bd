"""Clear air as a medium, beside the tabulated sky of the same air."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.air import clear_air
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Box, Path
from clpt.scene.lights import Directional, Sky
from clpt.scene.shapes import Cube
from clpt.spectra import Tabulated
from clpt.spectra.air import LAMBDAS, SUNLIGHT, Atmosphere, densities

WIDTH, HEIGHT = 600e3, 60e3  # [m]
ELEVATION = 40.0  # of the sun [degrees]
SPP = 2048
WITHIN = 0.03  # a flat earth, and the tables of the sky, are 1 to 2 % each
HAZY = {"aerosol": 0.2, "exponent": 1.3, "aerosol_albedo": 0.9, "asymmetry": 0.7, "ozone": 500.0}
CLEAR = {"aerosol": 0.0, "ozone": 0.0}


def colours(spp: int, elevation: float, turn: float, **parts: Any) -> np.ndarray:
    """Colours (8, 3) of columns of a piece of the sky; turn: from the sun [degrees]."""
    up, level = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
    side = np.sin(np.radians(turn)), np.cos(np.radians(turn))
    eye, toward = np.array([0.0, 10.0, 0.0]), np.array([side[0] * level, up, side[1] * level])
    scene = Scene(
        camera=Perspective(fov=6.0, to_world=tf.look_at(eye, eye + toward, [side[1], 0, -side[0]])),
        film=Film(width=8, height=8, filter=Box(), mode="spectral"),
        integrator=Path(max_depth=16, rr_depth=8, light_paths=0),
        **parts,
    )
    with clpt.Renderer(scene) as renderer:
        renderer.run(spp)
        return np.asarray(renderer.image(), float)[..., :3].mean(axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("content", [CLEAR, HAZY], ids=["clear", "hazy"])
def test_the_sky_by_the_medium(content: dict[str, float]) -> None:
    """In the same air, with black ground, sun at 40 degrees: in four directions.

    Beside `WITHIN` the difference may be three standard deviations of the noise, as eight columns
    tell it.
    """
    sun = np.radians(ELEVATION)
    down = [0.0, -np.sin(sun), -np.cos(sun)]
    irradiance = Tabulated(LAMBDAS, SUNLIGHT, "hold")
    box = tf.translate([0, HEIGHT / 2, 0]) @ tf.scale([WIDTH / 2, HEIGHT / 2, WIDTH / 2])
    air = clear_air(WIDTH, HEIGHT, **content)
    medium: dict[str, Any] = {
        "shapes": [Cube(to_world=box, material=m.Null(), interior=air)],
        "lights": [Directional(direction=down, irradiance=irradiance)],
    }
    table = {"lights": [Sky(sun_elevation=ELEVATION, ground=0.0, sun_scale=0.0, **content)]}
    for height, turn in ((80.0, 143.0), (25.0, 143.0), (40.0, 30.0), (25.0, 90.0)):
        ours, theirs = colours(SPP, height, turn, **medium), colours(16, height, turn, **table)
        ratio = ours / theirs  # of each column
        noise = ratio.std(axis=0) / np.sqrt(len(ratio))
        assert noise.max() < 0.015
        off = np.abs(ratio.mean(axis=0) - 1.0)
        assert (off < WITHIN + 3.0 * noise).all(), (height, turn, ratio.mean(axis=0), noise)


def test_depths() -> None:
    """Each part straight up, at five wavelengths: the integral of its formula, in float64."""
    lambdas = np.array([400.0, 450.0, 550.0, 600.0, 650.0])
    air = clear_air(WIDTH, HEIGHT, altitude=500.0, **HAZY)
    assert [part.name for part in air.parts] == ["air", "haze", "ozone"]
    km = 0.5 + (np.arange(60_000) + 0.5) / 1000.0
    wanted = Atmosphere(**HAZY).depths(lambdas) * densities(km).sum(axis=1)[:, None] / 1000.0
    for part, depth in zip(air.parts, wanted, strict=True):
        points = part.density.ravel().astype(float)
        column = (points.sum() - 0.5 * (points[0] + points[-1])) * HEIGHT / (len(points) - 1)
        absorbs, scatters = (one.sample(lambdas) for one in part.coefficients(True))
        np.testing.assert_allclose(column * (absorbs + scatters), depth, rtol=5e-3)
    scattered = [part.coefficients(True)[1].sample(550.0) > 0.0 for part in air.parts]
    assert scattered == [True, True, False]
    assert clear_air(WIDTH, **CLEAR).kind == "grid"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"width": 0.0}, r"clear_air\.width: must be above 0"),
        ({"layers": 0}, r"clear_air\.layers: must be above 0"),
        ({"aerosol": -0.1}, r"clear_air\.aerosol: must be 0 to 2"),
        ({"ozone": float("nan")}, r"clear_air\.ozone: must be 0 to 1000"),
    ],
)
def test_bad_input(given: dict[str, float], said: str) -> None:
    with pytest.raises(SceneError, match=said):
        clear_air(**{"width": WIDTH, **given})
