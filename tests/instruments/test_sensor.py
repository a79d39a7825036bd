"""The sensor's model, against EMVA 1288's formulas."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.instruments import Sensor
from clpt.scene import Film, Scene, cameras, lights
from clpt.spectra import Constant

SHAPE = 300, 400
PIXELS = SHAPE[0] * SHAPE[1]
LINEAR = Sensor(full_well=1e9, bits=16, black_level=100, gain=0.5)


def test_electrons_of_an_even_sky():
    """Photons of a pixel by E = pi L / (4 N^2), of radiance 1e-4 from 400 to 700 nm."""
    film = Film(size=(8, 6), mode="spectral", lambda_min=400.0, lambda_max=700.0, bands=30)
    scene = Scene(
        camera=cameras.Perspective(), lights=[lights.Constant(radiance=Constant(1e-4))], film=film
    )
    sensor = Sensor(efficiency=0.5, f_number=4.0, exposure=0.02, pitch=5e-6)
    electrons = sensor.electrons(clpt.render(scene, spp=256), film.band_centres)
    lambdas = np.linspace(400.5, 699.5, 300) * 1e-9
    photons = (1e-4 * lambdas / (6.62607015e-34 * 299792458.0)).sum()
    expected = 0.5 * photons * np.pi / (4.0 * 16.0) * 25e-12 * 0.02
    assert electrons.shape == (6, 8, 1) and expected > 10.0
    assert electrons.mean() == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("mean", [0.0, 50.0, 5000.0])
def test_noise_is_shot_read_and_dark(mean):
    """The variance in steps is (mean + dark + read^2) / gain^2 + 1/12 (EMVA 1288, 4.0, eq. 15).

    Over 120,000 pixels the mean lies within 4.5 standard errors, the variance too: a chance of
    7e-6 each; the standard error of a variance is sqrt(2 / n) of it, here a little more.
    """
    sensor = dataclasses.replace(LINEAR, dark_current=300.0, exposure=0.1)
    steps = sensor.read(np.full(SHAPE, mean), seed=3).astype(float)
    dark = 300.0 * 0.1
    variance = (mean + dark + sensor.read_noise**2) / 0.5**2 + 1.0 / 12.0
    expected = 100.0 + (mean + dark) / 0.5
    assert abs(steps.mean() - expected) < 4.5 * np.sqrt(variance / PIXELS)
    assert abs(steps.var() / variance - 1.0) < 4.5 * np.sqrt(2.2 / PIXELS)


def test_a_seed_gives_the_same_numbers():
    mean = np.random.default_rng(0).uniform(0.0, 500.0, SHAPE)
    first, again, other = (LINEAR.read(mean, seed=seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert (first != other).mean() > 0.9


def test_full_well_and_converter_clip():
    sensor = Sensor(full_well=1000.0, gain=2.0, bits=12, black_level=10, read_noise=0.0)
    assert (sensor.read(np.full((4, 4), 1e6)) == 510).all()
    assert (dataclasses.replace(sensor, bits=8).read(np.full((4, 4), 1e6)) == 255).all()


@pytest.mark.parametrize(
    ("pattern", "expected"),
    [("rggb", [[0, 1], [1, 2]]), ("bggr", [[2, 1], [1, 0]]), ([[0, 3, 1], [2, 2, 0]], None)],
)
def test_mosaics(pattern, expected):
    """Channel c holds c: a pixel's number is its channel."""
    electrons = np.broadcast_to(np.arange(4.0), (6, 6, 4))
    mosaic = Sensor(pattern=pattern).mosaic(electrons)
    tile = np.array(expected or pattern)
    np.testing.assert_array_equal(mosaic, np.tile(tile, (6 // tile.shape[0], 6 // tile.shape[1])))
    assert Sensor(pattern=pattern).read(electrons).shape == (6, 6)


def test_vignetting_and_fixed_pattern():
    falloff = Sensor(vignetting=(-0.3, 0.1), efficiency=1.0).electrons(
        np.ones((101, 201, 3)), [500.0, 550.0, 600.0]
    )[..., 0]
    middle, corner = falloff[50, 100], falloff[0, 0]
    assert corner / middle == pytest.approx(0.8, abs=0.01)
    sensor = dataclasses.replace(LINEAR, fixed_pattern=0.05, serial=9)
    frames = [sensor.read(np.full(SHAPE, 1e4), seed=seed).astype(float) for seed in range(2)]
    shared = np.cov(frames[0].ravel(), frames[1].ravel())[0, 1]
    assert np.sqrt(shared) / 2e4 == pytest.approx(0.05, rel=0.02)  # sqrt(2 / n): .4 %
    others = dataclasses.replace(sensor, serial=10).read(np.full(SHAPE, 1e4)).astype(float)
    assert abs(np.corrcoef(frames[0].ravel(), others.ravel())[0, 1]) < 4.5 / np.sqrt(PIXELS)


def test_bands_of_a_file(tmp_path):
    """Two bands, as boxes; light of 500 nm goes to the first."""
    path = tmp_path / "bands.csv"
    path.write_text("nm, blue, red\n# of a maker\n400, .5, 0\n550, .5, 0\n551, 0, .4\n700, 0, .4\n")
    sensor = Sensor().with_response(path)
    lambdas = np.linspace(405.0, 695.0, 30)
    image = np.zeros((2, 2, 30))
    image[..., np.argmin(np.abs(lambdas - 500.0))] = 1e-3
    electrons = sensor.electrons(image, lambdas)
    assert electrons.shape == (2, 2, 2) and (electrons[..., 0] > 0.0).all()
    assert (electrons[..., 1] == 0.0).all()
    for text, words in (
        ("400,1\n500,x\n", "line 2"), ("400,1\n", "two rows"), ("500,1\n400,1\n", "must rise")
    ):  # fmt: skip
        path.write_text(text)
        with pytest.raises(SceneError, match=words):
            Sensor().with_response(path)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"gain": 0.0}, "gain: must be above 0"),
        ({"read_noise": -1.0}, "read_noise"),
        ({"bits": 17}, "between 1 and 16"),
        ({"pattern": "rgbw"}, "pattern"),
        ({"efficiency": [0.1, 0.2]}, "efficiency: must end with the 0 wavelengths"),
    ],
)
def test_bad_sensors(arguments, words):
    with pytest.raises(SceneError, match=words):
        Sensor(**arguments)


def test_bad_pictures():
    with pytest.raises(SceneError, match="image"):
        Sensor().electrons(np.ones((2, 2, 3)), [500.0, 600.0])
    with pytest.raises(SceneError, match="pattern"):
        Sensor(pattern="rggb").mosaic(np.ones((4, 4, 1)))
