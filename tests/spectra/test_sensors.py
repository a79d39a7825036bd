"""clpt.spectra.sensors: observers, cameras and the fitted matrix."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError, UnknownKindError
from clpt.spectra import Sensor, Tabulated, cie, illuminant, observer, read_sensor
from clpt.spectra.sensors import fitted

ONES = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


def bell(centre: float, width: float) -> Tabulated:
    lambdas = np.arange(380.0, 781.0, 5.0)
    return Tabulated(lambdas, np.exp(-0.5 * ((lambdas - centre) / width) ** 2))


CAMERA = (bell(600.0, 35.0), bell(535.0, 40.0), bell(455.0, 25.0))


@pytest.mark.parametrize(("name", "theirs"), [("cie1931", "2"), ("cie1964", "10")])
@pytest.mark.parametrize("light", ["A", "D65", "F2"])
def test_observers_agree_with_colour_science(name: str, theirs: str, light: str) -> None:
    colour = pytest.importorskip("colour")
    year = name.removeprefix("cie")
    cmfs = colour.MSDS_CMFS[f"CIE {year} {theirs} Degree Standard Observer"]
    values = illuminant(light).sample(cmfs.wavelengths)
    power = colour.SpectralDistribution(values, cmfs.wavelengths)
    expected = colour.sd_to_XYZ(power, cmfs, k=1.0 / cmfs.values[:, 1].sum(), method="Integration")
    np.testing.assert_allclose(observer(name).xyz(illuminant(light)), expected, rtol=1e-6)


def test_the_1931_observer_is_the_renderers_own() -> None:
    np.testing.assert_array_equal(observer("cie1931").sample(cie.GRID), cie.cie_xyz(cie.GRID))
    with pytest.raises(UnknownKindError, match="cie1964"):
        observer("cie1976")


@pytest.mark.parametrize("scale", [1.0, 1e-4, 250.0])
def test_fit_recovers_a_linear_camera(scale: float) -> None:
    """A camera whose curves are mixtures of the observer's has an exact matrix."""
    mix = np.array([(0.9, 0.3, 0.05), (0.2, 1.1, 0.1), (0.02, 0.1, 0.8)]) * scale
    curves = tuple(Tabulated(cie.GRID, row @ cie.cie_xyz(cie.GRID).T) for row in mix)
    np.testing.assert_allclose(Sensor(curves).to_xyz @ mix, np.eye(3), atol=1e-9)


def test_fit_keeps_white_and_is_close() -> None:
    """D65 is exact, and under another light white is not far off."""
    camera = Sensor(CAMERA)
    white = observer("cie1931").xyz(illuminant("D65"))
    np.testing.assert_allclose(camera.xyz(illuminant("D65")), white, rtol=1e-9)
    assert (
        np.abs(camera.xyz(illuminant("A")) - observer("cie1931").xyz(illuminant("A"))).max() < 0.2
    )
    assert np.linalg.det(camera.to_xyz) > 0.0


def test_a_given_matrix_is_taken() -> None:
    assert np.array_equal(Sensor(CAMERA, ONES).to_xyz, np.eye(3))
    assert Sensor(CAMERA, ONES) == Sensor(CAMERA, np.eye(3)) != Sensor(CAMERA)


def test_read_sensor(tmp_path) -> None:
    path = tmp_path / "camera.csv"
    path.write_text("# a camera\nnm, red, green, blue\n400, 0, 0.1, 1\n550; 0.2 1 0\n700 1 0 0\n")
    sensor = read_sensor(path)
    np.testing.assert_allclose(sensor.sample([400.0, 475.0, 710.0])[1], [0.1, 0.55, 0.5])
    assert not sensor.sample([399.0, 701.0]).any()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no wavelengths"),
        ("nm r g b\nnm r g b\n", ":2: expected a wavelength"),
        ("400 1 1\n", ":1: expected a wavelength in nm and 3 values"),
        ("400 1 nan 1\n", "finite"),
        ("400 1 1 1\n390 1 1 1\n", "ascend"),
        ("400 1 1 1\n700 1 1 1\n", "differ"),
        ("900 1 0 0\n910 0 1 0\n920 0 0 1\n", "visible"),
    ],
)
def test_bad_files_tell_what_is_wrong(tmp_path, text: str, words: str) -> None:
    path = tmp_path / "camera.csv"
    path.write_text(text)
    with pytest.raises(SceneError, match=words) as caught:
        fitted(read_sensor(path))
    assert words == "differ" or "camera.csv" in str(caught.value)


def test_bad_sensors_are_refused() -> None:
    with pytest.raises(SceneError, match="three curves"):
        Sensor(CAMERA[:2])
    with pytest.raises(SceneError, match="three rows"):
        Sensor(CAMERA, ((1, 0), (0, 1)))
    with pytest.raises(SceneError, match="cannot be read"):
        read_sensor("no.csv")
