"""clpt.render.film.colour: the matrix from a film's sums to its picture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clpt import spectra
from clpt.errors import SceneError
from clpt.render.film.colour import BRIGHTEST, DIMMEST, film_scale, output_matrix
from clpt.scene import Film
from clpt.spectra import Sensor, cie, spaces

CURVES = tuple(spectra.Tabulated(cie.GRID, row) for row in cie.cie_xyz(cie.GRID, "1964").T)
SENSORS = ("cie1931", "cie1964", Sensor(CURVES))


def responses(film: Film, light: spectra.Spectrum) -> np.ndarray:
    """What the film gathers of a light, by its definition."""
    curves = SENSORS[SENSORS.index(film.sensor)]
    if isinstance(curves, str):
        year = curves.removeprefix("cie")
        values = cie.cie_xyz(cie.GRID, year)
        return light.sample(cie.GRID) @ values / values[:, 1].sum()
    return light.sample(cie.GRID) @ curves.sample(cie.GRID) / spectra.CIE_Y_INTEGRAL


@pytest.mark.parametrize("mode", ["spectral", "rgb"])
def test_nothing_asked_is_linear_rec709(mode: str) -> None:
    """To the bit: in RGB mode the identity."""
    expected = np.eye(3) if mode == "rgb" else spectra.XYZ_TO_REC709
    found = output_matrix(Film(mode=mode), mode).astype(np.float32)
    assert np.array_equal(found, expected.astype(np.float32))


@pytest.mark.parametrize("space", spaces.SPACES)
@pytest.mark.parametrize("sensor", SENSORS, ids=["1931", "1964", "camera"])
@pytest.mark.parametrize("name", ["A", "D65", "F11"])
def test_illuminants_become_white(space: str, sensor: Any, name: str) -> None:
    film = Film(sensor=sensor, white_balance=name, output_space=space)
    found = output_matrix(film, "spectral") @ responses(film, spectra.illuminant(name))
    white = spaces.from_xyz(space) @ spaces.white(space)
    np.testing.assert_allclose(found / found[1], white / white[1], rtol=1e-6)


@pytest.mark.parametrize("balance", [2700.0, 3999.0, 6504.0, (0.36, 0.38)])
@pytest.mark.parametrize("mode", ["spectral", "rgb"])
def test_chromaticities_become_white(balance: Any, mode: str) -> None:
    xy = balance if isinstance(balance, tuple) else spaces.xy_of_temperature(balance)
    film = Film(white_balance=balance, output_space="acescg", mode=mode)
    seen = spaces.xyz_of(xy)
    gathered = seen if mode == "spectral" else spectra.XYZ_TO_REC709 @ seen
    found = output_matrix(film, mode) @ gathered
    np.testing.assert_allclose(found / found[1], 1.0, rtol=1e-9)


def test_the_same_colour_in_every_space() -> None:
    """Without a balance each space tells the same XYZ."""
    xyz = [
        spaces.to_xyz(space) @ output_matrix(Film(output_space=space), "spectral")
        for space in spaces.SPACES
    ]
    np.testing.assert_allclose(xyz, np.broadcast_to(np.eye(3), (len(xyz), 3, 3)), atol=1e-9)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"sensor": "nikon"}, r"film\.sensor.*cie1931.*Sensor"),
        ({"sensor": 3}, r"film\.sensor"),
        ({"sensor": ["cie1931"]}, r"film\.sensor"),
        ({"bands": -1}, r"film\.bands"),
        ({"bands": 1.5}, r"film\.bands"),
        ({"bands": 5000}, r"film\.bands"),
        ({"bands": True}, r"film\.bands"),
        ({"white_balance": "D66"}, r"film\.white_balance.*D66"),
        ({"white_balance": 10.0}, r"film\.white_balance.*1000 to 25000 K"),
        ({"white_balance": float("nan")}, r"film\.white_balance"),
        ({"white_balance": (0.5, 0.0)}, r"film\.white_balance"),
        ({"white_balance": (0.3, 0.3, 0.3)}, r"film\.white_balance"),
        ({"white_balance": None}, r"film\.white_balance"),
        ({"output_space": "srgb"}, r"film\.output_space.*rec709"),
    ],
)
def test_what_makes_no_sense_is_refused(given: dict, words: str) -> None:
    with pytest.raises(SceneError, match=words):
        Film(**given)


def test_what_cannot_become_white_is_refused() -> None:
    """Chromaticities beyond what eyes tell apart, and light that the sensor does not see."""
    for given in ({"white_balance": (0.05, 0.9)}, {"white_balance": "A", "lambda_max": 361.0}):
        blind = Sensor((CURVES[0],) * 3, np.zeros((3, 3)))
        with pytest.raises(SceneError, match=r"film\.white_balance.*white"):
            output_matrix(Film(sensor=blind, **given), "spectral")


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_exposure_is_a_factor_on_the_picture(mode):
    plain, bright = output_matrix(Film(), mode), output_matrix(Film(exposure=2.5), mode)
    assert bright == pytest.approx(2.5 * plain, rel=1e-12)


def test_a_films_scale_follows_its_exposure() -> None:
    """As far as ordinary light goes, and where nothing is known of the light."""
    for level in (0.0, 1e-5, 1.0, 1e9):
        assert film_scale(Film(), level) == 1.0
        assert film_scale(Film(exposure=3.0), level) == 4.0
    assert film_scale(Film(exposure=0.0), 1.0) == 1.0


@pytest.mark.parametrize("exponent", [-120, -60, -21, 33, 60, 120])
def test_a_films_scale_brings_light_to_what_is_ordinary(exponent: int) -> None:
    end = DIMMEST if exponent < 0 else BRIGHTEST
    assert film_scale(Film(), 2.0 ** (exponent - 1)) == 2.0 ** (end - exponent)
    own = 2.0 ** -(exponent // 2)  # an exposure that leaves it half as far
    half = exponent - exponent // 2
    assert film_scale(Film(exposure=own), 2.0 ** (exponent - 1)) == own * 2.0 ** (
        min(max(half, DIMMEST), BRIGHTEST) - half
    )
