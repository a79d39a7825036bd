"""Glare, luminaires seen from afar, and pictures of numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from PIL import Image

from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.formats import ies
from clpt.instruments import (
    glare,
    goniophotometer,
    measure,
    write_false_color,
    write_photometry,
)
from clpt.instruments.glare_rating import position_index, rated
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Path
from clpt.spectra import Constant
from clpt.spectra.emission import UNIT_LUMINANCE

DARK = materials.Diffuse(reflectance=0.0)


def scene(parts=(), lamps=(), depth=1) -> Scene:
    return Scene(
        camera=cameras.Perspective(), shapes=list(parts), lights=list(lamps),
        integrator=Path(max_depth=depth), film=Film(size=(8, 8)),
    )  # fmt: skip


def toward(height: float, side: float) -> np.ndarray:
    """A direction at H / R up and T / R to the side."""
    return np.array([side, height, 1.0]) / np.linalg.norm([side, height, 1.0])


def test_position_indices_are_those_of_the_table():
    """CIE 117:1995, table 4.1, T / R = 0: the formula's fit lies within 4 % of it."""
    table = {0.0: 1.0, 0.1: 1.26, 0.2: 1.53, 0.3: 1.90, 0.4: 2.35, 0.5: 2.86, 0.7: 4.2, 1.0: 7.0}
    for height, expected in table.items():
        assert position_index(toward(height, 0.0)) == pytest.approx(expected, rel=0.04), height
    assert position_index(toward(-0.5, 0.0)) == pytest.approx(1.4)
    assert position_index(toward(-1.0, 0.0)) == pytest.approx(2.2)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_ugr_and_dgp_of_a_ball_before_an_even_sky(seed):
    """8 lg(.25 L^2 w / (Lb P^2)), with E = pi Lb + L w cos at the eye."""
    rng = np.random.default_rng(seed)
    at = toward(rng.uniform(0.1, 0.5), rng.uniform(-0.4, 0.4))
    place = np.eye(4)
    place[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    place[:3, :3] *= np.linalg.det(place[:3, :3])
    eye, strength, sky = rng.normal(size=3), rng.uniform(20.0, 60.0), 0.3
    ball = shapes.Sphere(
        center=tuple(eye + 10.0 * (place[:3, :3] @ at)), radius=0.7, material=DARK,
        emission=lights.Area(radiance=Constant(strength)),
    )  # fmt: skip
    lit = scene([ball], [lights.Constant(radiance=Constant(sky))])
    view = tf.translate(eye) @ place
    seen = glare(lit, view, height=200, samples=128)
    angle = 2.0 * math.pi * (1.0 - math.sqrt(1.0 - 0.07**2))
    high, low = strength * UNIT_LUMINANCE, sky * UNIT_LUMINANCE
    index = float(position_index(at))
    back = low * (1.0 - angle * at[2] / math.pi)
    expected = 8.0 * math.log10(0.25 / back * high**2 * angle / index**2)
    assert seen.ugr == pytest.approx(
        expected, abs=4.5 * seen.ugr_error + 0.03
    )  # directions of whole pixels
    assert seen.background == pytest.approx(back, rel=0.01)
    light = math.pi * back + high * angle * at[2]
    assert seen.illuminance == pytest.approx(light, rel=0.01)
    dgp = (
        5.87e-5 * light
        + 9.18e-2 * math.log10(1.0 + high**2 * angle / light**1.87 / index**2)
        + 0.16
    )
    assert seen.dgp == pytest.approx(dgp, rel=0.01)
    assert 0.0 < seen.ugr_error < 0.2 and 0.0 < seen.dgp_error < 0.05 * dgp


def test_an_even_sky_does_not_glare():
    seen = glare(scene((), [lights.Constant()]), np.eye(4), height=32, samples=64)
    assert seen.ugr == -math.inf and not seen.sources.any()


def test_bad_views():
    for arguments in ({"height": 1}, {"samples": 2}):
        with pytest.raises(SceneError, match="glare"):
            glare(scene(), np.eye(4), **arguments)
    with pytest.raises(SceneError, match="pictures"):
        rated(np.ones((2, 4, 4)))


def panel(two_sided: bool = False) -> Scene:
    """A luminaire: .6 m by .3 m, L = 1, down."""
    matrix = tf.rotate([1, 0, 0], 90) @ tf.scale([0.3, 0.15, 1.0])
    lamp = lights.Area(radiance=Constant(1.0), two_sided=two_sided)
    return scene([shapes.Rectangle(to_world=matrix, emission=lamp, material=DARK)], depth=2)


def test_a_panel_has_lamberts_distribution():
    """I = L A cos below, nothing above; flux pi L A."""
    vertical = np.arange(0.0, 181.0, 15.0)
    d = goniophotometer(panel(), vertical, [0.0, 90.0, 180.0, 270.0, 360.0], rays=400)
    axial = UNIT_LUMINANCE * 0.18
    expected = axial * np.maximum(np.cos(np.radians(vertical)), 0.0)
    away = np.abs(d.candela - expected) / (d.errors + 1e-3 * axial)
    assert away.max() < 4.5, away  # 65 values; of one, by the normal law, a chance of 7e-6
    assert d.errors.max() < 0.1 * axial
    fine = goniophotometer(panel(), np.arange(0.0, 181.0, 2.5), [0.0], rays=400)
    assert fine.lumens == pytest.approx(math.pi * axial, rel=0.02)


def test_the_axes_of_horizontal_angles():
    """A panel that looks along +x shines at 90 degrees, from +z to +x."""
    matrix = tf.rotate([0, 1, 0], 90) @ tf.scale([0.3, 0.3, 1.0])
    lamp = lights.Area(radiance=Constant(1.0))
    lit = scene([shapes.Rectangle(to_world=matrix, emission=lamp, material=DARK)])
    d = goniophotometer(lit, [90.0], [0.0, 90.0, 180.0, 270.0], samples=16)
    assert d.candela.argmax() == 1 and d.candela[1, 0] > 100.0 * d.candela[3, 0]


@pytest.mark.parametrize("suffix", ["ies", "ldt"])
def test_files_that_light_as_the_luminaire_does(tmp_path, suffix):
    """Lux 5 m below and beside, under the file's lamp and under the panel, within 3 %."""
    d = goniophotometer(panel(), np.arange(0.0, 181.0, 5.0), np.arange(0.0, 361.0, 45.0), rays=400)
    path = tmp_path / f"panel.{suffix}"
    write_photometry(path, d, "a panel")
    lamp = scene(lamps=[lights.Goniometric(**ies.parameters(path))], depth=2)
    at = [[0.0, -5.0, 0.0], [2.0, -5.0, 1.0], [-3.0, -4.0, 0.0]]
    by_file = measure(lamp, "illuminance", at)
    by_panel = measure(panel(), "illuminance", at, samples=16384)
    np.testing.assert_allclose(by_file.values, by_panel.values, rtol=0.03)


def test_luminaires_that_cannot_be_measured(tmp_path):
    with pytest.raises(SceneError, match="no shapes"):
        goniophotometer(scene((), [lights.Point()]))
    d = goniophotometer(panel(), [0.0, 10.0, 30.0], [0.0], rays=4, samples=16)
    with pytest.raises(SceneError, match="even steps"):
        write_photometry(tmp_path / "a.ldt", d)
    with pytest.raises(SceneError, match=r"\.ies or \.ldt"):
        write_photometry(tmp_path / "a.txt", d)


def test_false_colors(tmp_path):
    """Blue is low, red is high; a scale stands on the right."""
    pytest.importorskip("matplotlib", reason="clpt[plot]")
    values = np.tile(np.linspace(1.0, 1000.0, 64), (32, 1))
    write_false_color(tmp_path / "a.png", values, "lx", contours=[200.0, 500.0])
    image = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    row = image[image.shape[0] // 2]
    colored = np.flatnonzero(np.ptp(row, axis=1) > 60)
    left, right = row[colored[3]], row[colored[int(0.7 * len(colored))]]
    assert left[2] > left[0] and right[0] > right[2]
    write_false_color(tmp_path / "b.png", values, logarithmic=True, low=1.0, high=1e4)
    assert (tmp_path / "b.png").read_bytes() != (tmp_path / "a.png").read_bytes()
    for bad, words in ((np.ones(3), "values"), (np.full((2, 2), np.nan), "values")):
        with pytest.raises(SceneError, match=words):
            write_false_color(tmp_path / "c.png", bad)
    with pytest.raises(SceneError, match="positive"):
        write_false_color(tmp_path / "c.png", np.zeros((2, 2)), logarithmic=True)
