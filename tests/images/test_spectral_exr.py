"""Spectral EXR files: others' are read, ours come back to the bit, broken ones are told."""

from __future__ import annotations

import dataclasses

import numpy as np
import OpenEXR
import pytest

import clpt
from clpt import images
from clpt.errors import SceneError
from clpt.images import spectral_exr
from clpt.images.spectral_exr import SpectralImage
from clpt.spectra import RGB, Tabulated, illuminant

rng = np.random.default_rng(5)
LAMBDAS = [400.0, 433.25, 500.0, 471.0 / 7 * 9, 700.0]


def made(emissive=False, **more) -> SpectralImage:
    values = rng.random((4, 6, len(LAMBDAS))).astype(np.float32)
    return SpectralImage(values, LAMBDAS, emissive, **more)


def store(path, names, header=None, value=1.0):
    """An EXR file with channels of these names, the first one `value`, the next twice that."""
    channels = {name: np.full((3, 5), value * (i + 1), np.float32) for i, name in enumerate(names)}
    OpenEXR.File({"type": OpenEXR.scanlineimage, **(header or {})}, channels).write(str(path))
    return path


@pytest.fixture
def macbeth(assets):
    """A colour chart in the layout, written by its authors."""
    return assets / "spectral" / "spectral-exr" / "Macbeth.exr"


def test_a_file_by_others(macbeth):
    """Its R, G, B were made of the same spectra, under D65."""
    image = clpt.read_spectral(macbeth)
    assert image.values.shape == (400, 600, 36)
    assert image.values.dtype == np.float32
    np.testing.assert_array_equal(image.lambdas, np.arange(380.0, 740.0, 10.0))
    assert not image.emissive
    assert image.exposure == 0.0
    assert image.warnings == ()
    theirs = images.read(macbeth)
    inside = theirs.min(axis=2) > 1e-3  # the cyan patch lies outside of Rec. 709: they cut it off
    assert inside.mean() > 0.7
    np.testing.assert_allclose(image.to_rgb()[inside], theirs[inside], atol=2e-3)
    layers = images.read_layers(macbeth)
    np.testing.assert_array_equal(image.values[..., 17], layers["T.550,000000nm"])


@pytest.mark.parametrize("emissive", [False, True])
def test_round_trip_to_the_bit(tmp_path, emissive):
    curves = Tabulated([380.0, 500.123456789], [0.1, 1e-30]), Tabulated([500.0], [0.5])
    image = made(emissive, exposure=-1.5, response=curves[0], transmission=curves[1])
    clpt.write_spectral(tmp_path / "a.exr", image, metadata={"software": "test"})
    back = clpt.read_spectral(tmp_path / "a.exr")
    np.testing.assert_array_equal(back.values, image.values)
    np.testing.assert_array_equal(back.lambdas, image.lambdas)
    assert (back.emissive, back.exposure) == (emissive, -1.5)
    assert back.units == (spectral_exr.RADIANCE if emissive else "")
    assert (back.response, back.transmission) == curves
    shown = images.read(tmp_path / "a.exr")
    np.testing.assert_allclose(shown, image.to_rgb() * 2.0**-1.5, rtol=1e-6)


def test_names_in_the_file(tmp_path):
    clpt.write_spectral(tmp_path / "a.exr", made(True), half=True)
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        channels, header = dict(file.channels()), dict(file.header())
    assert "S0.433,250000nm" in channels
    assert channels["S0.433,250000nm"].pixels.dtype == np.float16
    assert header["spectralLayoutVersion"] == "1.0"
    assert header["EV"] == 0.0


@pytest.mark.parametrize(
    ("name", "nm"),
    [
        ("T.550nm", 550.0),
        ("T.550,5nm", 550.5),
        ("T.5,5e2nm", 550.0),
        ("T.,55um", 550.0),
        ("T.0,55um", 550.0),
        ("T.5500000E-13m", 550.0),
        ("T.599,584916THz", 500.0),
        ("T.5,5E-4mm", 550.0),
    ],
)
def test_units(tmp_path, name, nm):
    image = spectral_exr.read(store(tmp_path / "a.exr", [name]))
    np.testing.assert_allclose(image.lambdas, [nm], rtol=1e-12)


@pytest.mark.parametrize(
    "name", ["T.550,nm.R", "S4.550nm", "t.550nm", "T.nm", "T.550", "T.55.0nm", "layer.T.550nm"]
)
def test_what_is_no_spectral_channel(tmp_path, name):
    path = store(tmp_path / "a.exr", [name])
    assert not spectral_exr.is_spectral(path)
    with pytest.raises(SceneError, match="not a spectral image"):
        spectral_exr.read(path)


def test_bands_are_sorted_by_wavelength(tmp_path):
    names = ["S0.1000nm", "S0.0,9um", "S0.400nm", "R"]
    image = spectral_exr.read(store(tmp_path / "a.exr", names))
    np.testing.assert_allclose(image.lambdas, [400.0, 900.0, 1000.0])
    np.testing.assert_array_equal(image.values[0, 0], [3.0, 2.0, 1.0])


def test_parts_and_polarisation(tmp_path):
    names = ["S0.500nm", "S1.500nm", "S2.500nm", "S3.500nm", "T.500nm"]
    header = {"EV": "0.5", "emissiveUnits": "W.m^-2.sr^-1"}
    path = store(tmp_path / "a.exr", names, header)
    light = spectral_exr.read(path)
    assert light.emissive
    assert (light.exposure, light.units) == (0.5, "W.m^-2.sr^-1")
    assert [w.split()[1] for w in light.warnings] == ["polarisation", "reflectances"]
    reflected = spectral_exr.read(path, emissive=False)
    assert not reflected.emissive
    assert reflected.values[0, 0, 0] == 5.0
    assert len(reflected.warnings) == 1
    with pytest.raises(SceneError, match=r"holds reflectances \(T\), where light \(S0\)"):
        spectral_exr.read(store(tmp_path / "b.exr", ["T.500nm"]), emissive=True)
    with pytest.raises(SceneError, match=r"holds light \(S0\), where reflectances"):
        spectral_exr.read(store(tmp_path / "c.exr", ["S0.500nm"]), emissive=False)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["R", "G", "B"], "not a spectral image"),
        (["T.500nm", "T.5e2nm"], "T.500nm and T.5e2nm are of the same wavelength"),
        (["T.400nm", "T.400nm.500nm"], "fluorescence"),
        (["S1.500nm"], "where light"),
        (["T.0nm", "T.500nm"], "ascend from above zero"),
        (["T.0Hz"], "wavelength 0 Hz"),
        (["T.1e999m"], "wavelength 1e999 m"),
    ],
)
def test_bad_files_are_told(tmp_path, names, words):
    with pytest.raises(SceneError, match=words) as error:
        spectral_exr.read(store(tmp_path / "a.exr", names), emissive=names[0].startswith("S"))
    assert "a.exr" in str(error.value)


@pytest.mark.parametrize(
    "text",
    ["", "abc", "400nm", "400nm:", "400nm:x;", "400nm:1.2.3;", "400nm:1;0m:2;", "400nm:1e999;"],
)
def test_bad_attributes_are_told_or_left_out(tmp_path, text):
    path = store(tmp_path / "a.exr", ["T.500nm"], {"cameraResponse": text, "EV": "bright"})
    try:
        assert spectral_exr.read(path).exposure == 0.0
    except SceneError as error:
        assert "a.exr" in str(error)


def test_broken_files_are_told(tmp_path):
    """Cut short, or with bytes changed: an image or a SceneError, nothing else."""
    clpt.write_spectral(tmp_path / "a.exr", made(True))
    data = (tmp_path / "a.exr").read_bytes()
    path, chance = tmp_path / "b.exr", np.random.default_rng(1)
    broken = [data[: int(end)] for end in np.linspace(0, len(data) - 1, 25)]
    for _ in range(100):
        changed = bytearray(data)
        for at in chance.integers(0, min(len(data), 700), 3):
            changed[at] = chance.integers(256)
        broken.append(bytes(changed))
    told = 0
    for text in broken:
        path.write_bytes(text)
        assert spectral_exr.is_spectral(path) in (True, False)
        try:
            spectral_exr.read(path)
        except SceneError as error:
            assert "b.exr" in str(error)
            told += 1
    assert told > 30


def test_images_that_make_no_sense():
    for values, lambdas, words in (
        (np.ones((2, 2)), [500.0], "is (h, w, n)"),
        (np.ones((2, 2, 0)), [], "not empty"),
        (np.ones((2, 2, 2)), [500.0], "as many wavelengths"),
        (np.ones((2, 2, 2)), [500.0, 500.0], "ascend"),
        (np.ones((2, 2, 2)), [500.0, np.nan], "ascend"),
    ):
        with pytest.raises(SceneError) as error:
            SpectralImage(values, lambdas)
        assert words in str(error.value)


def test_writing_where_it_cannot_be(tmp_path):
    with pytest.raises(SceneError, match=r"\.exr, not to '\.png'"):
        clpt.write_spectral(tmp_path / "a.png", made())
    with pytest.raises(SceneError, match="cannot be written"):
        clpt.write_spectral(tmp_path / "none" / "a.exr", made())
    with pytest.raises(SceneError, match="the preview is"):
        clpt.write_spectral(tmp_path / "a.exr", made(), preview=np.zeros((2, 2, 3), np.float32))


def test_colours_are_those_of_the_spectra():
    """A pixel has the colour that the same spectrum has as a parameter."""
    nm = np.arange(360.0, 831.0, 5.0)
    for spectrum, emissive in ((RGB(0.2, 0.5, 0.8), False), (illuminant("A"), True)):
        image = SpectralImage(spectrum.sample(nm)[None, None], nm, emissive)
        role = "emission" if emissive else "reflectance"
        np.testing.assert_allclose(image.to_rgb()[0, 0], spectrum.to_rgb(role), rtol=2e-3)
    dark = dataclasses.replace(image, values=image.values * 0.0)
    assert (dark.to_rgb() == 0.0).all()
