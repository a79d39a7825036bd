"""Interpolated maps: what is measured, and how well errors describe what is not."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

import clpt
from clpt import instruments
from clpt import transforms as tf
from clpt.cli import cli
from clpt.errors import SceneError
from clpt.instruments.interpolation import Surface, interpolated
from clpt.scene import Film, Scene, cameras, lights, shapes
from clpt.scene.integrators import Path
from clpt.spectra import Constant

DOWN = tf.rotate([1, 0, 0], 90)
HEIGHT, WIDTH = 45, 60
RANGE = 470.0  # nm, of a film


def flat(covered: np.ndarray | None = None) -> Surface:
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    points = np.stack([x, 0.0 * x, y], -1)
    whole = np.ones((HEIGHT, WIDTH), bool) if covered is None else covered
    return Surface(points, np.broadcast_to([0.0, 1.0, 0.0], points.shape), whole)


def of(values: np.ndarray, error: float = 0.0, seed: int = 0):
    """Return a function that measures values, with noise of a standard error."""
    rng = np.random.default_rng(seed)

    def look(rows, columns):
        exact = values[rows, columns].reshape(len(rows), -1)
        noise = rng.normal(0.0, error, exact.shape) if error else 0.0
        return exact + noise, np.full(exact.shape, error)

    return look


def test_bilinear_light_is_exact_with_few_points():
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    exact = np.stack([2.0 + 0.1 * x + 0.05 * y, 1.0 + 0.01 * x * y], -1)
    values, errors, measured = interpolated(flat(), of(exact), 16)
    np.testing.assert_allclose(values, exact, rtol=1e-12)
    assert measured.sum() <= 9 * 7 and errors.max() < 1e-7


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.1])
def test_an_edge_is_measured(angle):
    """Cells at an edge become points; all values are right, but where both sides meet."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    exact = np.where((x - 31.3) * np.cos(angle) + (y - 20.2) * np.sin(angle) > 0.0, 2.0, 1.0)
    values, _, measured = interpolated(flat(), of(exact), 8)
    np.testing.assert_allclose(values[..., 0], exact)
    assert measured.sum() < 0.4 * exact.size
    beside = exact[:, 1:] != exact[:, :-1]
    assert measured[:, 1:][beside].all() and measured[:, :-1][beside].all()


def test_reported_errors_are_those_of_bent_light():
    """The root of the mean square of differences over errors is below 1, and not by far."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    exact = np.exp(-((x - 20.0) ** 2 + (y - 25.0) ** 2) / 900.0)
    for error in (0.0, 0.003):
        values, errors, measured = interpolated(flat(), of(exact, error), 16)
        away = (values[..., 0] - exact)[~measured] / errors[..., 0][~measured]
        assert 0.1 < np.sqrt((away**2).mean()) < 1.0


def test_noise_alone_is_not_refined():
    """A cell has five checks of 3 standard errors: a chance of 1.3 %."""
    exact = np.ones((HEIGHT, WIDTH))
    values, errors, measured = interpolated(flat(), of(exact, 0.05), 8)
    assert measured.sum() < 0.15 * exact.size
    away = (values[..., 0] - 1.0) / errors[..., 0]
    assert 0.5 < np.sqrt((away**2).mean()) < 1.1


def test_holes_and_edges_of_surfaces_are_not_crossed():
    """Points beside a hole are measured; NaN where no point is."""
    covered = np.ones((HEIGHT, WIDTH), bool)
    covered[10:20, 11:31] = covered[:, 50:] = False
    surface = flat(covered)
    surface.points[:, 40:, 1] = 5.0  # another surface, of other light
    exact = np.where(np.arange(WIDTH) >= 40, 3.0, 1.0) * np.ones((HEIGHT, 1))
    values, _, measured = interpolated(surface, of(exact), 8)
    assert np.isnan(values[~covered]).all() and not measured[~covered].any()
    np.testing.assert_allclose(values[covered][:, 0], exact[covered])


@pytest.mark.parametrize("shape", [(1, 1), (1, 17), (2, 2), (3, 40)])
def test_narrow_maps(shape):
    points = np.stack([*np.mgrid[: shape[0], : shape[1]].astype(float), np.zeros(shape)], -1)
    surface = Surface(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape), np.ones(shape, bool))
    exact = 1.0 + points[..., 1] ** 2
    values, _, _ = interpolated(surface, of(exact), 16, tolerance=1e-6)
    np.testing.assert_allclose(values[..., 0], exact, rtol=2e-6)


def lit_floor(*parts: shapes.Shape) -> Scene:
    """A floor from 0 to 2 m below a square lamp."""
    matrix = tf.translate([1, 1, 1]) @ DOWN @ tf.scale([0.5, 0.5, 1.0])
    lamp = shapes.Rectangle(to_world=matrix, emission=lights.Area(radiance=Constant(1.0)))
    floor = shapes.Rectangle(
        to_world=tf.translate([1, 0, 1]) @ tf.rotate([1, 0, 0], -90), name="floor"
    )
    return Scene(
        camera=cameras.Perspective(), shapes=[lamp, floor, *parts], film=Film(size=(8, 8)),
        integrator=Path(max_depth=3),
    )  # fmt: skip


def grid(side: int = 48) -> np.ndarray:
    x, z = np.meshgrid(*[(np.arange(side) + 0.5) * 2.0 / side] * 2)
    return np.stack([x, np.full_like(x, 1e-3), z], -1)


def corner(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Irradiance below a corner of a rectangle (a, b) at 1 m, with signs (Hottel and Sarofim)."""
    h = 1.0 - 1e-3 - 1e-4  # the receiver is .1 mm above its point
    ra, rb = np.hypot(h, a), np.hypot(h, b)
    return 0.5 * (a / ra * np.arctan(b / ra) + b / rb * np.arctan(a / rb))


def test_a_map_below_a_square_lamp():
    """By Hottel and Sarofim's formula; the mean square over 40 independent cells is near 1."""
    at = grid()
    measured = instruments.measure(
        lit_floor(), "irradiance", at, samples=512, interpolate=16, error=0.01
    )
    x, z = at[..., 0] - 1.0, at[..., 2] - 1.0
    exact = RANGE * sum(
        sx * sz * corner(x + sx * 0.5, z + sz * 0.5) for sx in (1, -1) for sz in (1, -1)
    )
    assert measured.measured.sum() < 0.4 * exact.size
    away = (measured.values - exact) / measured.errors
    assert np.sqrt((away**2).mean()) < 1.3
    assert np.abs(measured.values / exact - 1.0).max() < 0.1


def test_a_shadow_is_refined_on_texels():
    """Beside the map of all texels: of 99 % within 4 standard errors of both."""
    disk = shapes.Disk(to_world=tf.translate([1, 0.05, 1]) @ DOWN @ tf.scale(0.3))
    scene = lit_floor(disk)
    whole = instruments.bake(scene, "floor", "irradiance", (40, 40), samples=256)
    few = instruments.bake(scene, "floor", "irradiance", (40, 40), samples=256, interpolate=8)
    assert few.measured.shape == (40, 40) and 0.2 < few.measured.mean() < 0.8
    least = 1e-6 * whole.values.max()  # some texels are all dark
    away = np.abs(few.values - whole.values) / (np.hypot(few.errors, whole.errors) + least)
    assert np.quantile(away, 0.99) < 4.0
    steps = np.abs(np.diff(whole.values, axis=1))
    edge = steps > 0.5 * steps.max()
    assert few.measured[:, 1:][edge].mean() > 0.9


@pytest.mark.parametrize(
    ("quantity", "at", "step", "words"),
    [
        ("irradiance", np.zeros((4, 3)), 8, "a map"),
        ("radiance", np.zeros((4, 4, 3)), 8, "along rays"),
        ("cct", np.zeros((4, 4, 3)), 8, "not linear"),
        ("irradiance", np.zeros((4, 4, 3)), 0, "whole number"),
        ("irradiance", np.zeros((4, 4, 3)), 1.5, "whole number"),
    ],
)
def test_bad_input(quantity, at, step, words):
    with pytest.raises(SceneError, match=words):
        instruments.measure(lit_floor(), quantity, at, interpolate=step)


def test_the_command(tmp_path):
    scene = tmp_path / "floor.json"
    clpt.save(lit_floor(), scene)
    run = ["measure", str(scene), "--samples", "64", "-o", str(tmp_path / "map.npy")]
    done = CliRunner().invoke(cli, [*run, "--texels", "floor", "--interpolate", "8"])
    assert done.exit_code == 0, done.output
    assert np.load(tmp_path / "map.npy").shape[:2] == (64, 64)
    (tmp_path / "at.csv").write_text("x,y,z\n0,0,0\n")
    bad = CliRunner().invoke(cli, [*run, "--at", str(tmp_path / "at.csv"), "--interpolate", "8"])
    assert bad.exit_code == 2 and "--texels" in bad.output
