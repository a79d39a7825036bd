"""What instruments measure, against formulas of lamps over points."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.choices import QUANTITIES as NAMES
from clpt.errors import SceneError, UnknownKindError
from clpt.instruments import QUANTITIES, measure, photometer
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, cameras, lights, materials, media, shapes
from clpt.scene.integrators import Box, Path
from clpt.spectra import Blackbody, Constant, Tabulated
from clpt.spectra.emission import LIGHT, PLANCK, UNIT_LUMINANCE

DOWN = tf.rotate([1, 0, 0], 90)
EVEN = Constant(1.0)  # W m^-2 sr^-1 nm^-1 at each wavelength
RANGE = 470.0  # nm, of a film
WIDEST = 4.5  # standard errors; by 15 degrees of freedom a chance of 4e-4 a value


def scene(*parts: shapes.Shape, lamps: tuple[lights.Light, ...] = (), depth: int = 2) -> Scene:
    return Scene(
        camera=cameras.Perspective(), shapes=list(parts), lights=list(lamps),
        integrator=Path(max_depth=depth), film=Film(size=(8, 8)),
    )  # fmt: skip


def square(radiance: float = 1.0) -> shapes.Rectangle:
    """A lamp of 1 m a side, at 1 m, facing down."""
    matrix = tf.translate([0, 1, 0]) @ DOWN @ tf.scale([0.5, 0.5, 1.0])
    return shapes.Rectangle(to_world=matrix, emission=lights.Area(radiance=Constant(radiance)))


def below_corner(a: float, b: float) -> float:
    """Irradiance below a corner of a rectangle (a, b) at 1 m, radiance 1 (Hottel and Sarofim)."""
    ra, rb = math.hypot(1.0, a), math.hypot(1.0, b)
    return 0.5 * (a / ra * math.atan(b / ra) + b / rb * math.atan(a / rb))


def agrees(measured: clpt.Measurement, expected: np.ndarray | float) -> None:
    away = np.abs(measured.values - expected) / (measured.errors + 2e-4 * np.abs(expected))
    assert away.max() < WIDEST, (measured, expected)
    assert measured.relative_error < 0.05


def test_names_are_the_tables():
    assert tuple(QUANTITIES) == NAMES


def test_irradiance_below_a_square():
    at = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.5], [-0.5, 0.0, 0.5]]
    expected = np.array([4.0 * below_corner(0.5, 0.5), *[below_corner(1.0, 1.0)] * 2])
    agrees(measure(scene(square()), "irradiance", at), RANGE * expected)


def test_illuminance_is_683_lumens_a_watt():
    expected = 4.0 * below_corner(0.5, 0.5) * UNIT_LUMINANCE
    agrees(measure(scene(square()), "illuminance", [0.0, 0.0, 0.0]), expected)


def test_bands():
    measured = measure(scene(square(2.0)), "spectral_irradiance", np.zeros((2, 1, 3)), bands=5)
    assert measured.values.shape == (2, 1, 5) == measured.errors.shape
    assert measured.wavelengths is not None and measured.wavelengths[0] == 360.0 + 47.0
    agrees(measured, 8.0 * below_corner(0.5, 0.5))


@pytest.mark.parametrize("seed", [1, 2])
def test_points_of_any_orientation_under_a_point_lamp(seed):
    """E = I cos / r^2, and the scalar irradiance is I / r^2."""
    rng = np.random.default_rng(seed)
    lamp = np.array([0.3, 1.4, -0.2])
    at, normals = rng.uniform(-1.0, 1.0, (6, 3)), rng.normal(size=(6, 3))
    lit = scene(lamps=(lights.Point(position=tuple(lamp), intensity=EVEN),))
    away = lamp - at
    square_distance = (away**2).sum(axis=1)
    unit = normals / np.linalg.norm(normals, axis=1)[:, None]
    cosine = np.maximum((away * unit).sum(axis=1) / np.sqrt(square_distance), 0.0)
    measured = measure(lit, "irradiance", at, normals, samples=256)
    np.testing.assert_allclose(
        measured.values, RANGE * cosine / square_distance, rtol=4e-3, atol=RANGE * 1e-3
    )
    agrees(measure(lit, "scalar_irradiance", at), RANGE / square_distance)


def test_photons_of_an_even_spectrum():
    """E lambda / (h c N) over 400 to 700 nm, in umol."""
    lit = scene(lamps=(lights.Point(position=(0, 1, 0), intensity=EVEN),))
    lambdas = np.linspace(400.5, 699.5, 300) * 1e-9
    expected = 1e6 * (lambdas / (6.62607015e-34 * 299792458.0 * 6.02214076e23)).sum()
    agrees(measure(lit, "photon_flux_density", [0, 0, 0], samples=1024), expected)


def test_infrared_of_satellites():
    """Sentinel-2's band 12: a black body over a leaf whose table ends at 2500 nm."""
    low, high, kelvin = 2100.0, 2280.0, 2856.0
    leaf = materials.Diffuse(reflectance=Tabulated((400.0, 2000.0, 2500.0), (0.05, 0.4, 0.1)))
    floor = shapes.Rectangle(to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(50.0), material=leaf)
    sky = lights.Constant(radiance=Blackbody(kelvin, scale=1e-3))
    lit = dataclasses.replace(
        scene(floor, lamps=(sky,)), film=Film(size=(8, 8), lambda_min=low, lambda_max=high)
    )
    lambdas = np.linspace(low, high, 1801) * 1e-9
    planck = 2.0 * PLANCK * LIGHT**2 / lambdas**5 * 1e-9
    planck /= np.expm1(PLANCK * LIGHT / (lambdas * 1.380649e-23 * kelvin))
    share = np.interp(lambdas * 1e9, [2000.0, 2500.0], [0.4, 0.1])
    measured = measure(lit, "radiance", [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], samples=4096)
    agrees(measured, 1e-3 * (planck * share).mean() * (high - low))


@pytest.mark.parametrize(
    ("radiance", "end", "warned"),
    [
        (1.0, 2300.0, "830 nm"),  # D65
        (1.0, 830.0, ""),
        (Blackbody(2856.0), 2300.0, ""),
        (Tabulated((400.0, 1000.0), (1.0, 1.0)), 2300.0, "1000 nm"),
        (Tabulated((400.0, 900.0, 1000.0), (1.0, 1.0, 0.0)), 2300.0, ""),
    ],
)
def test_lamps_whose_data_end_within_the_film_are_warned_of(radiance, end, warned):
    lit = scene(lamps=(lights.Constant(radiance=radiance),))
    lit = dataclasses.replace(lit, film=Film(size=(8, 8), lambda_max=end))
    found = [text for text in lower(lit).warnings if "spectrum ends" in text]
    assert len(found) == bool(warned) and all(warned in text for text in found)


def test_rays():
    """Radiance of a lamp, of what is beside it, and through fog; luminance by 683 lm/W."""
    lit = scene(square(3.0), depth=1)
    at, toward = [[0, 0, 0], [2, 0, 0]], [0, 1, 0]
    measured = measure(lit, "radiance", at, toward, samples=64)
    np.testing.assert_allclose(measured.values, [3.0 * RANGE, 0.0], rtol=1e-5)
    measured = measure(lit, "luminance", at, [[0, 5, 0], [-2, 1, 0]], samples=64)
    np.testing.assert_allclose(measured.values, 3.0 * UNIT_LUMINANCE, rtol=1e-3)
    fog = media.Homogeneous(sigma_t=0.7, albedo=0.0)
    foggy = dataclasses.replace(lit, camera=cameras.Perspective(medium=fog))
    assert foggy.camera.medium is fog


def test_a_matt_room_of_white_light():
    """In a closed room whose walls emit 1 and reflect a half, radiance is 1 / (1 - 1/2)."""
    wall = materials.Diffuse(reflectance=0.5)
    sides = [
        shapes.Rectangle(
            material=wall, emission=lights.Area(radiance=EVEN),
            to_world=turn @ tf.translate([0, 0, -1]),
        )
        for axis, angles in (([0, 1, 0], (0, 90, 180, 270)), ([1, 0, 0], (90, 270)))
        for turn in (tf.rotate(axis, angle) for angle in angles)
    ]  # fmt: skip
    room = scene(*sides, depth=32)
    at = np.array([[0.2, 0.1, 0.3], [-0.5, 0.6, 0.0]])
    agrees(measure(room, "irradiance", at, samples=2048), RANGE * 2.0 * math.pi)
    agrees(measure(room, "scalar_irradiance", at, samples=2048), RANGE * 8.0 * math.pi)


def test_points_within_surfaces_and_on_them():
    """Inside of a body it is dark; a point of a wall sees what is before the wall."""
    body = shapes.Cube(to_world=tf.scale(0.2), material=materials.Diffuse(reflectance=0.0))
    at = [[0.0, 0.0, 0.0], [0.0, 0.2, 0.0], [0.2, 0.0, 0.0]]
    normals = [[0, 1, 0], [0, 1, 0], [-1, 0, 0]]
    measured = measure(scene(square(), body), "irradiance", at, normals)
    top = 4.0 * below_corner(0.5 / 0.8, 0.5 / 0.8)
    assert not measured.values[[0, 2]].any()
    agrees(measure(scene(square(), body), "irradiance", at[1:2]), RANGE * top)
    assert not measure(scene(square(), body), "scalar_irradiance", at[:1]).values.any()


def test_an_error_that_is_asked_for_ends_it():
    lit = scene(square())
    at = [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0]]
    rough = measure(lit, "irradiance", at, error=0.05)
    fine = measure(lit, "irradiance", at, error=0.002, samples=1 << 17)
    assert rough.relative_error <= 0.05 and fine.relative_error <= 0.002
    assert rough.samples < fine.samples < 1 << 17


def test_an_instrument_is_a_scene_whose_films_split(tmp_path):
    """Samples 0 to 4 and 4 to 8 add to the film of 8, to the bit; a file keeps it."""
    lit = photometer(
        scene(square()), QUANTITIES["irradiance"], np.zeros((3, 3)), np.array([[0, 1, 0]] * 3)
    )
    whole, half, other = (clpt.Renderer(lit, first_sample=first) for first in (0, 0, 4))
    whole.run(8), half.run(4), other.run(4)
    half.merge(other.film_state())
    np.testing.assert_array_equal(half.image(), whole.image())
    clpt.save(lit, tmp_path / "scene.json")
    again = clpt.render(tmp_path / "scene.json", spp=8)
    np.testing.assert_array_equal(again, whole.image())
    for renderer in (whole, half, other):
        renderer.close()


@pytest.mark.parametrize(
    ("what", "error", "words"),
    [
        ({"quantity": "brightness"}, UnknownKindError, "brightness"),
        ({"at": [[0, 0]]}, SceneError, "at: must be rows of x, y and z"),
        ({"at": []}, SceneError, "at"),
        ({"at": [[0, 0, 0], [0, math.nan, 0]]}, SceneError, "row 1 is not finite"),
        ({"directions": [0, 0, 0]}, SceneError, "row 0 is 0, 0, 0"),
        ({"error": 0.0}, SceneError, "above 0"),
    ],
)
def test_bad_input(what, error, words):
    arguments = {"quantity": "irradiance", "at": [[0, 0, 0]], **what}
    with pytest.raises(error, match=words):
        measure(scene(square()), **arguments)


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ({"origins": [[0, 0]]}, "rays.origins"),
        ({"directions": [[0, 0, 0]]}, "row 0 is 0, 0, 0"),
        ({"directions": [[0, 0, 1]] * 3}, "3 rows for 1 origins"),
        ({"weights": [1.0, 2.0]}, "rays.weights"),
    ],
)
def test_bad_rays(what, words):
    bad = dataclasses.replace(scene(square()), camera=cameras.Rays(**what))
    with pytest.raises(SceneError, match=words):
        clpt.render(bad, spp=1)


def test_pixels_are_entries_again_and_again():
    """Each pixel of a film of 5 x 3 is its own ray of a list of 5, whatever the mode."""
    levels = np.linspace(1.0, 5.0, 5)
    for mode in ("rgb", "spectral"):
        lit = dataclasses.replace(
            scene(square(), depth=1),
            camera=cameras.Rays(origins=np.zeros((5, 3)), directions=[[0, 1, 0]], weights=levels),
            film=Film(size=(5, 3), mode=mode, filter=Box(radius=0.25), bands=0),
        )
        image = clpt.render(lit, spp=4)[..., 1]
        np.testing.assert_allclose(image / image[0, 0], np.tile(levels, (3, 1)), rtol=0.04)


def test_the_command_writes_a_table(tmp_path):
    from click.testing import CliRunner

    from clpt.cli.measure import measure as command

    clpt.save(scene(square()), tmp_path / "lamp.json")
    points = tmp_path / "points.csv"
    points.write_text("# a desk\nx, y, z, nx, ny, nz\n0, 0, 0, 0, 1, 0\n0, 0, 0, 0, -1, 0\n")
    output = tmp_path / "lux.csv"
    arguments = [tmp_path / "lamp.json", "--at", points, "--samples", 256, "-o", output]
    told = CliRunner().invoke(command, [str(word) for word in arguments])
    assert told.exit_code == 0, told.output
    titles, lit, dark = output.read_text().splitlines()
    assert titles == "x,y,z,illuminance [lx],standard error of illuminance [lx]"
    expected = 4.0 * below_corner(0.5, 0.5) * UNIT_LUMINANCE
    assert float(lit.split(",")[3]) == pytest.approx(expected, rel=0.02)
    assert float(dark.split(",")[3]) == 0.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1, 2\n", "line 1: 2 numbers, not 3 or 6"),
        ("x,y,z\n1,2,3\n1,2,3,4,5,6\n", "line 3: 6 numbers, not 3"),
        ("1,2,three\n", "line 1"),
        ("# nothing\n", "no points"),
    ],
)
def test_tables_that_cannot_be_read(tmp_path, text, words):
    from clpt.instruments.tables import read_points

    (tmp_path / "points.csv").write_text(text)
    with pytest.raises(SceneError, match=words):
        read_points(tmp_path / "points.csv")
