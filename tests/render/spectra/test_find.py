"""clpt.render.spectra.find: which density a scene gets, and where it lies."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import spectra
from clpt.render.flow.scene_to_tables import lower
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra import find as wavelengths
from clpt.render.spectra.find import Density
from clpt.scene import Film, Scene, lights
from clpt.scene.cameras import Perspective
from clpt.scene.materials import Fluorescent, TwoSided
from clpt.scene.shapes import Sphere
from clpt.spectra import Sensor, Tabulated
from clpt.spectra.reradiation import Fluorophore

LINE = Tabulated((588.0, 589.0, 590.0), (0.0, 1.0, 0.0))


def scene(*emitted: object, **film: object) -> Scene:
    """A scene with lights that emit these."""
    made = [lights.Constant(radiance=value) for value in emitted]
    return Scene(camera=Perspective(), lights=made, film=Film(width=4, height=4, **film))


def density(scene: Scene) -> Density:
    return wavelengths.density(SceneIndex.of(scene))


@pytest.mark.parametrize("light", ["A", "D50", "D65", "E", "F2"])
def test_smooth_lights_need_no_table(light: str) -> None:
    found = density(scene(spectra.illuminant(light)))
    assert found == Density(360.0, 830.0)


@pytest.mark.parametrize("light", ["F11", LINE])
def test_lines_get_a_table(light: object) -> None:
    """Also on a shape."""
    emission = spectra.illuminant(light) if isinstance(light, str) else light
    assert density(scene(emission)).values is not None
    lamp = Scene(camera=Perspective(), shapes=[Sphere(emission=lights.Area(radiance=emission))])
    assert density(lamp).values is not None


def test_one_line_among_smooth_lights_is_enough() -> None:
    assert density(scene(1.0, spectra.illuminant("A"), LINE)).values is not None


def test_a_line_gets_half_of_the_samples() -> None:
    found = density(scene(LINE))
    fine = np.linspace(588.0, 590.0, 2001)
    assert found.pdf(fine).mean() * 2.0 == pytest.approx(0.5, abs=0.02)
    whole = np.linspace(360.0, 830.0, 470_001)
    assert found.pdf(whole).mean() * 470.0 == pytest.approx(1.0, abs=1e-4)
    assert found.pdf([359.9, 830.1]).max() == 0.0
    assert found.pdf(whole).min() > 1e-5  # nothing is left out


def test_only_where_the_sensor_responds() -> None:
    """A wide film wastes no wavelength; a spectral film records its whole range."""
    wide = {"lambda_min": 300.0, "lambda_max": 1000.0}
    assert (density(scene(1.0, **wide)).lo, density(scene(1.0, **wide)).hi) == (359.0, 831.0)
    banded = density(scene(1.0, bands=7, **wide))
    assert (banded.lo, banded.hi) == (300.0, 1000.0) and banded.values is not None
    narrow = density(scene(1.0, lambda_min=450.0, lambda_max=620.5))
    assert (narrow.lo, narrow.hi) == (450.0, 620.5)


def test_an_infrared_camera_gets_a_table() -> None:
    """The eye's importance says nothing there."""
    curves = [Tabulated((low, low + 60.0, low + 120.0), (0, 1, 0)) for low in (720, 800, 880)]
    camera = Sensor(tuple(curves), np.eye(3))
    found = density(scene("E", sensor=camera, lambda_max=1100.0))
    assert found.values is not None and (found.lo, found.hi) == (720.0, 1000.0)


def test_a_blind_sensor_is_no_crash() -> None:
    camera = Sensor((LINE, LINE, LINE), np.eye(3))
    found = density(scene(1.0, sensor=camera, lambda_max=500.0))
    assert np.isfinite(found.pdf([400.0, 499.0])).all()


def test_what_glows_is_looked_for() -> None:
    """Of a paint under ultraviolet light, what it gives out, not what is left of the lamp."""
    lamp, green = spectra.LED(365.0, 15.0), spectra.LED(530.0, 20.0)
    paint = Fluorescent(reradiation=Fluorophore(spectra.LED(370.0, 40.0), green, 0.4))
    wide = {"lambda_min": 300.0, "wavelengths": "scene"}
    bare, painted = scene(lamp, **wide), scene(lamp, **wide)
    painted.shapes = [Sphere(material=TwoSided(front=paint))]
    fine = np.linspace(500.0, 560.0, 601)
    assert density(bare).pdf(fine).mean() * 60.0 < 0.25
    assert density(painted).pdf(fine).mean() * 60.0 > 0.5


@pytest.mark.parametrize(("asked", "table"), [("visible", False), ("scene", True)])
def test_a_film_may_ask(asked: str, table: bool) -> None:
    assert (density(scene(1.0, wavelengths=asked)).values is not None) == table
    assert (density(scene(LINE, wavelengths=asked)).values is not None) == table


def test_features_follow() -> None:
    """Only a table changes the kernels' text, and only a spectral film has bands."""
    plain, lines = lower(scene(1.0)).features, lower(scene(LINE)).features
    assert (plain.spectra.tabulated_density, plain.film.bands) == (False, False)
    assert (lines.spectra.tabulated_density, lines.film.bands) == (True, False)
    assert lower(scene(1.0, bands=3)).features.film.bands
    assert not lower(scene(LINE, mode="rgb")).features.spectra.tabulated_density
