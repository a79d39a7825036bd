"""Films: observers, cameras, bands, white balance and output spaces, rendered.

Expected values are sums over a 0.1 nm grid, made here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Independent
from clpt.scene.lights import Constant
from clpt.spectra import Sensor, Tabulated, cie
from tests.pictures.support import SIGNIFICANCE, agreement, assert_mean, exposures

FINE = np.arange(300.05, 900.0, 0.1)  # [nm]
COLOUR = Tabulated((380.0, 450.0, 520.0, 610.0, 720.0), (0.1, 0.9, 0.2, 1.0, 0.4), "hold")
LINES = Tabulated((404, 405, 406, 545, 546, 547, 588, 589, 590), (0, 3, 0, 0, 2, 0, 0, 5, 0))
CAMERA_TEXT = "nm red green blue\n" + "\n".join(
    f"{nm} {max(0, 1 - abs(nm - 600) / 90):.4f} {max(0, 1 - abs(nm - 540) / 80):.4f} "
    f"{max(0, 1 - abs(nm - 450) / 60):.4f}"
    for nm in range(380, 721, 10)
)


def sky(light: object, *, sampler: Any = None, **film: Any) -> Scene:
    """An even light, seen directly."""
    given = {"width": 8, "height": 8, **film}
    how = {"sampler": sampler} if sampler else {}
    lamp = Constant(radiance=light)
    return Scene(camera=Orthographic(), lights=[lamp], film=Film(**given), **how)


@pytest.mark.parametrize("name", ["cie1931", "cie1964"])
@pytest.mark.parametrize(
    "light", [COLOUR, pytest.param(LINES, marks=pytest.mark.slow)], ids=["smooth", "lines"]
)
def test_observers(name: str, light: Tabulated) -> None:
    """XYZ of a light, by either density of wavelengths."""
    images = exposures(sky(light, sensor=name, output_space="xyz"), 24, 64)
    curves = cie.cie_xyz(FINE, name.removeprefix("cie"))
    expected = light.sample(FINE) @ curves / curves[:, 1].sum()
    assert_mean(images, expected, 0.01, 1e-3)


@pytest.mark.parametrize("mode", ["spectral", "rgb"])
def test_white_balance_makes_white(mode: str) -> None:
    """A light of that colour is (1, 1, 1) (in every space: see test_colour.py)."""
    light = spectra.illuminant("A")
    images = exposures(sky(light, mode=mode, white_balance="A", output_space="acescg"), 24, 64)
    assert_mean(images, np.ones(3), 0.01, 1e-3)


def test_a_camera_from_a_file(tmp_path) -> None:
    """Its responses by its own curves; through the fitted matrix a D65 white is white."""
    path = tmp_path / "camera.csv"
    path.write_text(CAMERA_TEXT)
    camera = spectra.read_sensor(path)
    raw = Sensor(camera.curves, np.eye(3))
    images = exposures(sky(COLOUR, sensor=raw, output_space="xyz"), 24, 64)
    expected = COLOUR.sample(FINE) @ camera.sample(FINE) * 0.1 / spectra.CIE_Y_INTEGRAL
    assert_mean(images, expected, 0.01, 1e-3)
    images = exposures(sky(spectra.illuminant("D65"), sensor=camera), 24, 64)
    assert_mean(images, np.ones(3), 0.01, 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("light", [COLOUR, LINES], ids=["smooth", "lines"])
@pytest.mark.parametrize("drawn", ["auto", "visible"])
def test_bands_are_the_means_of_the_light(light: Tabulated, drawn: str) -> None:
    """Each of 11 bands, t-tests at SIGNIFICANCE over them all; independent samples."""
    ends = {"lambda_min": 370.0, "lambda_max": 810.0}
    made = sky(light, bands=11, wavelengths=drawn, sampler=Independent(), **ends)
    found = exposures(made, 16, 64).mean(axis=(1, 2), keepdims=True)
    within = (FINE > 370.0) & (FINE < 810.0)
    expected = light.sample(FINE[within]).reshape(11, -1).mean(axis=1)
    assert found.shape[-1] == 11
    assert agreement(found, expected.reshape(1, 1, 1, 11), 2e-4) > SIGNIFICANCE


def test_bands_add_up_to_the_colour() -> None:
    """Bands of 2 nm, weighted by the observer, are the colour of the film beside them."""
    renderer = clpt.Renderer(sky(COLOUR, bands=235, output_space="xyz"))
    renderer.run(64)
    image, colours = renderer.image(), renderer.colours()
    assert image.shape == (8, 8, 235) and image.dtype == np.float32
    assert colours.shape == (8, 8, 3)
    middles = np.arange(361.0, 830.0, 2.0)
    summed = image @ cie.cie_xyz(middles) * 2.0 / cie.CIE_Y_INTEGRAL
    np.testing.assert_allclose(summed, colours, rtol=0.01)


@pytest.mark.slow
def test_bands_do_not_depend_on_lanes(monkeypatch: pytest.MonkeyPatch) -> None:
    """To the bit, with the wavelengths of line spectra."""
    device, found = clpt.device.choose(), []
    for lanes in (1, 8, 16):
        monkeypatch.setattr(type(device), "lanes", property(lambda _, lanes=lanes: lanes))
        found.append(clpt.render(sky(LINES, bands=5), 4, device=device))
    assert all(np.array_equal(image, found[0]) for image in found[1:])


def test_bands_do_not_depend_on_passes() -> None:
    """But for rounding, as a sum that is stored and read again; beginning anew, to the bit."""
    made = sky(LINES, bands=5)
    whole, passes = clpt.Renderer(made), clpt.Renderer(made)
    whole.run(12)
    for samples in (1, 4, 7):
        passes.run(samples)
    np.testing.assert_allclose(passes.image(), whole.image(), rtol=1e-6, atol=1e-9)
    passes.reset()
    passes.run(12)
    assert np.array_equal(passes.image(), whole.image())


@pytest.mark.parametrize(
    "film",
    [
        {"lambda_min": 300.0},
        pytest.param({"lambda_min": 300.0, "bands": 4}, marks=pytest.mark.slow),
    ],
)
def test_a_wide_range_changes_no_colour(film: dict) -> None:
    """Also where light that the eye does not see is strong."""
    light = Tabulated((300.0, 355.0, 400.0, 830.0), (50.0, 50.0, 1.0, 1.0))
    narrow = light.sample(FINE) @ cie.cie_xyz(FINE) * 0.1 / spectra.CIE_Y_INTEGRAL
    made = sky(light, output_space="xyz", sampler=Independent(), **film)
    renderer, found = clpt.Renderer(made), []
    for i in range(16):
        renderer.reset(seed=i)
        renderer.run(64)
        found.append(renderer.colours())
    assert_mean(found, narrow, 0.05, 2e-3)


def test_rgb_mode_refuses_what_needs_wavelengths() -> None:
    for given, words in (({"bands": 4}, "film.bands"), ({"sensor": "cie1964"}, "film.sensor")):
        with pytest.raises(clpt.SceneError, match=words):
            clpt.render(sky(1.0, mode="rgb", **given), 1)
