"""Tone curves: their formulas in float64, what holds for all of them, and the device's."""

import numpy as np
import pytest

from clpt import device, images
from clpt.device import DeviceArray
from clpt.errors import UnknownKindError
from clpt.images import colour
from clpt.render.film.resolve import Resolve, Screen

RNG = np.random.default_rng(7)
CURVES = [name for name in colour.TONES if name != "none"]
COLOURS = (2.0 ** RNG.uniform(-9, 8, (96, 64, 1)) * RNG.dirichlet([1, 1, 1], (96, 64)) * 3).astype(
    np.float32
)


def grey(values):
    return np.repeat(np.asarray(values, np.float32)[:, None], 3, axis=1)


@pytest.mark.parametrize("tone", CURVES)
def test_greys_stay_grey_and_rise_to_white(tone):
    """Over 24 stops; black is black, broken values are finite."""
    ramp = grey(np.concatenate([[0.0], 2.0 ** np.linspace(-12, 12, 200)]))
    made = colour.apply_tone(ramp, tone)
    assert np.ptp(made, axis=1).max() < 2e-6
    assert made[0].max() == pytest.approx(0.0, abs=1e-6) and made[-1].min() > 0.98
    assert (np.diff(made[:, 0]) >= -1e-6).all()
    odd = colour.apply_tone(np.array([[np.nan, -1.0, np.inf], [np.inf] * 3], np.float32), tone)
    assert np.isfinite(odd).all() and odd.min() >= 0.0
    if tone != "reinhard":  # which is of the luminance alone: blue leaves the screen
        assert odd.max() <= 1.0 + 1e-6


def test_the_sigmoid_of_agx_ends_at_black_and_white_and_has_its_slope_at_grey():
    """Sobotka's scales, which the kernel has as numbers; middle grey is 1/2 before the power."""
    below, above = colour.agx_scales()
    assert (below, above) == (pytest.approx(59.507875), pytest.approx(69.862789))
    low, high = colour.AGX_STOPS
    ends = colour.AGX_GREY * 2.0 ** np.array([low, 0.0, high])
    np.testing.assert_allclose(
        colour.apply_tone(grey(ends), "agx")[:, 0] ** (1 / 2.2), [0.0, 0.5, 1.0], atol=2e-3
    )
    step = 2.0 ** np.array([-0.01, 0.01]) * colour.AGX_GREY
    rise = np.diff(colour.apply_tone(grey(step), "agx")[:, 0].astype(np.float64) ** (1 / 2.2))[0]
    assert rise / (0.02 / (high - low)) == pytest.approx(colour.AGX_SLOPE, rel=2e-3)


def test_agx_turns_saturated_light_white():
    red = colour.apply_tone(np.array([[200.0, 0.0, 0.0]], np.float32), "agx")[0]
    assert red.min() > 0.2 and red[0] > red[1]


def test_neutral_shows_base_colours_less_what_a_surface_reflects():
    """Khronos 2024: below .8 a colour is itself less .04; hues stay."""
    c = RNG.uniform(0.08, 0.8, (500, 3)).astype(np.float32)
    np.testing.assert_allclose(colour.apply_tone(c, "neutral"), c - 0.04, atol=1e-6)
    bright = colour.apply_tone(np.array([[4.0, 2.0, 1.0]], np.float32), "neutral")[0]
    hue = (bright[1] - bright[2]) / (bright[0] - bright[2])
    assert hue == pytest.approx((2.0 - 1.0) / (4.0 - 1.0), abs=1e-5) and bright.max() < 1.0


def test_an_unknown_curve_is_told():
    with pytest.raises(UnknownKindError, match=r"tone curve 'filmic'.*agx"):
        colour.apply_tone(COLOURS, "filmic")


@pytest.fixture(scope="module")
def on_device():
    opened = device.choose()
    film = DeviceArray(opened.queue, (*COLOURS.shape[:2], 4), np.float32)
    film.set(np.concatenate([COLOURS, np.full((*COLOURS.shape[:2], 1), 16, np.float32)], axis=2))
    resolve = Resolve(opened, device.Stream(opened.queue))
    return lambda dtype=None, **how: resolve(film, screen=Screen(**how), dtype=dtype).get()[..., :3]


@pytest.mark.parametrize("tone", CURVES)
def test_the_device_has_the_same_curves(on_device, tone):
    want = colour.apply_tone(COLOURS, tone)
    np.testing.assert_allclose(on_device(dtype=np.float32, tone=tone), want, atol=3e-6, rtol=2e-5)
    codes = on_device(tone=tone, exposure=-1.0).astype(int)
    written = images.to_codes(COLOURS, -1.0, tone).astype(int)
    assert np.abs(codes - written).max() <= 1 and (codes != written).mean() < 1e-3
