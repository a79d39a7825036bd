"""The sky's tables beside walks of light, published figures, and what a device makes of them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.render.lights import images
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Sky
from clpt.sky import dome, skylight
from clpt.spectra import air, cie
from clpt.spectra.air import EARTH, LAMBDAS, SUNLIGHT, Atmosphere, densities
from tests.kernels.light_probe import lit
from tests.kernels.test_lights import SIGMAS, TURNED, irradiance
from tests.sky import sky_walk

CLEAR = Atmosphere(aerosol=0.1, exponent=1.3, aerosol_albedo=0.95, asymmetry=0.76, ozone=300.0)
LUMENS = 683.002
HIGH = 30.0  # of the sun, as in other tests of skies


@cache
def image(elevation: float, **more: float) -> tuple[np.ndarray, np.ndarray]:
    """The dome and the disc, of the cache folder where they are there: they take seconds."""
    return dome.images(images.kept_sky, *dome.numbers(Sky(sun_elevation=elevation, **more)))


def xyz(spectra: np.ndarray) -> np.ndarray:
    """CIE 1931 values of (..., n) at LAMBDAS, Y in lumens per watt's unit."""
    rows = np.stack([np.interp(LAMBDAS, cie.GRID, bar) for bar in cie_bars()])
    return LUMENS * 10.0 * spectra @ rows.T


@cache
def cie_bars() -> np.ndarray:
    from clpt.spectra.data import table

    rows = table("cie1931.csv")
    return np.stack([np.interp(cie.GRID, rows[:, 0], rows[:, i]) for i in (1, 2, 3)])


def flux(elevation: float) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance of level ground by the sky and by the sun, (n,) [W m^-2 nm^-1]."""
    around, disc = image(elevation)
    at = dome.horizon(0.0)
    row = (np.arange(dome.ROWS * 8) + 0.5) / (dome.ROWS * 8)
    angles = dome.elevations(at, row)
    step = 2.0 * (1.0 - row) * (0.5 * np.pi - at) / len(row)
    mean = 0.5 * (around[0, :, 1:] + around[0, :, :-1]).mean(axis=1)
    low = np.clip((row * dome.ROWS).astype(int), 0, dome.ROWS - 1)
    x = (row * dome.ROWS - low)[:, None]
    radiance = mean[low] * (1.0 - x) + mean[low + 1] * x
    weight = np.maximum(np.sin(angles), 0.0) * np.cos(angles) * step * 2.0 * np.pi
    b = np.linspace(-1.0, 1.0, 201)
    a, b = np.meshgrid(b, b)
    inside = np.maximum(1.0 - a * a - b * b, 0.0)
    on = inside > 0.0
    seen = disc[
        np.rint((0.5 + 0.5 * b[on]) * (dome.SUN_ROWS - 1)).astype(int),
        np.rint(np.sqrt(inside[on]) * (dome.SUN_COLUMNS - 1)).astype(int),
    ].mean(axis=0)
    sun = seen * np.pi * np.sin(dome.SUN_RADIUS) ** 2 * max(np.sin(np.radians(elevation)), 0.0)
    return weight @ radiance, sun


def test_columns_are_those_of_a_fine_sum():
    """Straight up, slanting, along the ground, from above: within 1e-3."""
    for radius, mu in ((EARTH, 1.0), (EARTH, 0.3), (EARTH, 0.0), (EARTH + 20.0, 0.05)):
        t = np.linspace(0.0, skylight.to_top(np.array(radius), np.array(mu)), 200_001)
        height = np.sqrt(radius**2 + t**2 + 2.0 * radius * mu * t) - EARTH
        dense = densities(height)
        fine = ((dense[:, 1:] + dense[:, :-1]) * 0.5 * np.diff(t)).sum(axis=1)
        np.testing.assert_allclose(skylight.columns(radius, mu), fine, rtol=1e-3, atol=1e-9)


def test_air_masses_and_depths_are_the_published_ones():
    """Kasten and Young 1989 down to 5 degrees; Bodhaine 1999, table 3; ozone's Chappuis band."""
    for height in (60.0, 30.0, 15.0, 5.0):
        published = 1.0 / (np.sin(np.radians(height)) + 0.50572 * (height + 6.07995) ** -1.6364)
        assert skylight.columns(EARTH, np.sin(np.radians(height)))[0] == pytest.approx(
            published, rel=0.02
        )
    assert air.depth([400.0, 550.0, 700.0]) == pytest.approx([0.3600, 0.0970, 0.0364], rel=0.01)
    assert CLEAR.depths([600.0])[2] == pytest.approx(0.040, rel=0.08)


@pytest.mark.slow
def test_illuminance_is_that_of_days_and_dusks():
    """On level ground, clear: Seidelmann's table (Explanatory Supplement 1992) within 25 %;
    a high sun gives about 100 klx, of which a tenth to a fourth is the sky's."""
    sky_, sun = (xyz(part)[1] for part in flux(60.0))
    assert 85e3 < sky_ + sun < 120e3 and 0.08 < sky_ / (sky_ + sun) < 0.25
    for elevation, lux in ((0.0, 758.0), (-4.0, 29.9), (-6.0, 3.4)):
        assert 0.75 < xyz(sum(flux(elevation)))[1] / lux < 1.25, elevation
    # clear evenings by the glossary of the American Meteorological Society
    for elevation, low, high in ((-0.833, 410.0, 585.0), (-6.0, 2.0, 3.5)):
        assert low < xyz(sum(flux(elevation)))[1] < high


@pytest.mark.slow
def test_colours_of_the_hours():
    """Blue above at noon, red at a sunset's horizon, and blue above at dusk, by ozone."""
    x, y, z = xyz(image(50.0)[0][0, 0, 0])
    n = (x / (x + y + z) - 0.3320) / (0.1858 - y / (x + y + z))
    cct = 449.0 * n**3 + 3525.0 * n**2 + 6823.3 * n + 5520.33  # McCamy 1992
    assert cct > 9000.0
    noon, sunset = (cie.xyz_to_rgb(xyz(image(e)[0][0])) for e in (50.0, 0.0))
    assert (np.diff(noon[0, 0]) > 0.0).all() and (np.diff(sunset[-4, 0]) < 0.0).all()
    with_, without = (xyz(image(-4.0, ozone=o)[0][0, 0, 0]) for o in (300.0, 0.0))
    blue = [v[2] / v[1] for v in (with_, without)]
    assert blue[0] > 1.25 * blue[1]


def test_the_sun_is_as_bright_as_above_the_air_without_air():
    """Limb darkening moves light over the disc: its sum stays, within the table's 1 %."""
    none = Sky(sun_elevation=90.0, aerosol=0.0, ozone=0.0, altitude=60000.0, ground=0.0)
    disc = dome.sky_image(none)[1].mean(axis=0)  # (columns, n), even in all rows
    mu = np.linspace(0.0, 1.0, dome.SUN_COLUMNS)
    fine = np.linspace(0.0, 1.0, 2001)
    values = np.stack([np.interp(fine, mu, band) for band in disc.T], axis=1)
    area = np.pi * np.sin(dome.SUN_RADIUS) ** 2
    mean = (values * (2.0 * fine)[:, None]).mean(axis=0) * area
    np.testing.assert_allclose(mean, SUNLIGHT, rtol=0.01)


VIEWS = ((90.0, 0.0), (30.0, 0.0), (30.0, 180.0), (6.0, 90.0), (-20.0, 90.0))
WALKS = [
    (30.0, 40_000, 0.07),
    pytest.param(3.0, 60_000, 0.10, marks=pytest.mark.slow),
    pytest.param(-4.0, 60_000, 0.20, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("elevation", "count", "limit"), WALKS)
def test_tables_agree_with_walks(elevation, count, limit):
    """Radiance at 450 and 600 nm in five directions within `limit` and SIGMAS of the walks."""
    zenith, up, around = np.radians(90.0 - elevation), *np.radians(VIEWS).T
    mu, turn = np.sin(up), np.cos(around)
    albedo = np.full(len(LAMBDAS), 0.2)
    found = skylight.radiance(CLEAR, albedo, zenith, 1e-3, mu, turn)
    views = slice(None) if elevation < 10.0 else slice(1, 4, 2)
    for i in np.arange(len(mu))[views]:
        for nm in (450.0, 600.0):
            mean, error = sky_walk.radiance(
                CLEAR, 0.2, zenith, 1e-3, mu[i], turn[i], nm, count, seed=int(i)
            )
            ours = found[i, np.flatnonzero(nm == LAMBDAS)[0]]
            assert abs(ours - mean) < limit * mean + SIGMAS * error, (VIEWS[i], nm)


def test_sampling_finds_all_the_light():
    """Irradiance of tilted and level ground by samples, of the disc and of the rest."""
    up = TURNED[:3, 1]
    lamp = Sky(sun_elevation=HIGH, sun_azimuth=40.0, to_world=TURNED)
    mean, error = irradiance(lit([lamp]), np.zeros(3), up, count=1 << 17)
    expected = cie.xyz_to_rgb(xyz(sum(flux(HIGH)))) / LUMENS
    scale = mean[1] / expected[1]
    np.testing.assert_allclose(mean / scale, expected, rtol=0.02)
    normalise = cie.xyz_to_rgb(cie.spectrum_to_xyz(np.ones(len(cie.GRID))))
    even = cie.xyz_to_rgb(xyz(np.ones(len(LAMBDAS)))) / LUMENS
    np.testing.assert_allclose(scale, (normalise / even)[1], rtol=0.02 + SIGMAS * error[1])


def scene(mode: str, sun_scale: float = 1.0) -> Scene:
    film = Film(width=24, height=16, mode=mode)
    sky = Sky(sun_elevation=8.0, sun_scale=sun_scale)
    return Scene(camera=Perspective(fov=100), lights=[sky], film=film)


@pytest.mark.slow
def test_colours_agree_in_both_modes_and_splits_give_the_same_bits():
    """Colours without the sun's disc, which few samples meet, each at another place."""
    means = [
        np.asarray(clpt.render(scene(mode, 0.0), 64))[..., :3].mean(axis=(0, 1))
        for mode in ("rgb", "spectral")
    ]
    np.testing.assert_allclose(means[1], means[0], rtol=0.01)
    spectral = np.asarray(clpt.render(scene("spectral"), 64))[..., :3]
    with clpt.Renderer(scene("spectral")) as renderer:
        for count in (5, 11, 48):
            renderer.run(count)
        again = np.asarray(renderer.image())[..., :3]
    assert (again == spectral).all()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"sun_elevation": -40.0}, "sky.sun_elevation"),
        ({"aerosol": -1.0}, "sky.aerosol"),
        ({"ground": 1.5}, "sky.ground"),
        ({"to_world": clpt.transforms.scale([1, 0, 1])}, "sky.to_world"),
    ],
)
def test_bad_skies_are_named(given, words):
    with pytest.raises(SceneError, match=words):
        lit([Sky(**given)])
