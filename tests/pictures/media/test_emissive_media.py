"""Media that give out light: slabs in closed form, furnaces, grids against quadrature.

Significance as in tests/pictures/support.py. All quick tests in a mode share their kernels.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.geometry.triangles import triangulate
from clpt.render.lights import bodies as body_lights
from clpt.render.lights.bodies import BrickLights
from clpt.scene import Film, Scene, media
from clpt.scene.cameras import Orthographic, Perspective
from clpt.scene.integrators import Box, Direct, Whitted
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.lights import Constant, Point
from clpt.scene.materials import Dielectric, Diffuse, Null, TwoSided
from clpt.scene.shapes import Cube, Mesh, Rectangle, Sphere
from clpt.spectra import cie
from clpt.spectra.emission import planck
from tests.pictures.support import assert_agree, assert_mean, exposures

LONG = PathIntegrator(max_depth=-1, rr_depth=1000, light_paths=0)
CHROMATIC = np.array([0.5, 2.0, 3.0])  # [1/m]
COLOUR = np.array([0.2, 0.6, 0.9])
LAMBDAS = np.arange(380.0, 741.0, 5.0)
ABSORBS = spectra.Tabulated(LAMBDAS, 0.2 + 1e-5 * (LAMBDAS - 400.0) ** 2, "hold")
GLOWS = spectra.Blackbody(2500.0)
WITHIN = 0.02
SLOWLY = ("bytes", "temperature")


def slab(medium: media.Medium, light: Any = 0.0, **film: Any) -> Scene:
    """A cube of 2 m that parallel rays go through, under the same light from everywhere."""
    return Scene(
        camera=Orthographic(
            to_world=tf.look_at([0.1, 0.2, 5], [0.1, 0.2, 0], [0, 1, 0]) @ tf.scale(1e-3)
        ),
        shapes=[Cube(material=Null(), interior=medium)],
        lights=[Constant(radiance=light)],
        film=Film(**{"width": 8, "height": 8, "filter": Box(), "mode": "rgb", **film}),
        integrator=LONG,
    )


def test_slab() -> None:
    """It shows L (1 - exp(-sigma_a d)), exactly: also a thin one."""
    for scale in (1.0, 1e-3):
        medium = media.Homogeneous(sigma_a=CHROMATIC, scale=scale, emission=COLOUR)
        got = exposures(slab(medium), 1, 4).mean(axis=(0, 1, 2))
        np.testing.assert_allclose(got, -COLOUR * np.expm1(-2.0 * scale * CHROMATIC), rtol=2e-5)


@pytest.mark.slow
def test_slab_at_each_wavelength() -> None:
    medium = media.Homogeneous(sigma_a=ABSORBS, emission=GLOWS)
    got = exposures(slab(medium, mode="spectral", bands=6), 8, 64)
    fine = np.linspace(360.0, 830.0, 60001)[:-1]
    wanted = -GLOWS.sample(fine) * np.expm1(-2.0 * ABSORBS.sample(fine))
    assert_mean(got, wanted.reshape(6, -1).mean(axis=1), 0.05)


@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_furnace(mode: str) -> None:
    """What emits as much as its surroundings cannot be seen before them, whatever it scatters."""
    medium = media.Homogeneous(sigma_a=0.3 * CHROMATIC, sigma_s=CHROMATIC, emission=1.0)
    assert_mean(exposures(slab(medium, 1.0, mode=mode), 8, 64), 1.0, WITHIN)


RANDOM = np.random.default_rng(7).random((19, 7, 12)) ** 2
RANDOM[8:] *= RANDOM[8:] > 0.4
HEAT = 1500.0 + 1000.0 * np.random.default_rng(8).random((19, 7, 12))
BOX = tf.translate([0.1, -0.1, 0.05]) @ tf.rotate([1, 2, 3], 30) @ tf.scale([1.9, 1.1, 1.3])
BOX = BOX @ tf.translate([-0.5, -0.5, -0.5])


def on_line(medium: media.Grid, numbers: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Numbers of a grid at points (n, 3), trilinear; 0 outside of its box."""
    inverse = np.linalg.inv(medium.to_world)
    unit = points @ inverse[:3, :3].T + inverse[:3, 3]
    inside = ((unit >= 0.0) & (unit <= 1.0)).all(axis=1)
    size = np.array(numbers.shape)
    at = np.clip(unit * size - 0.5, 0.0, size - 1.0)
    low = np.minimum(at.astype(int), np.maximum(size - 2, 0))
    share, sums = at - low, np.zeros(len(at))
    for corner in np.ndindex(2, 2, 2):
        weight = np.where(corner, share, 1.0 - share).prod(axis=1)
        sums += weight * numbers[tuple(np.minimum(low + corner, size - 1).T)]
    return sums * inside


def seen(medium: media.Grid, source, absorbs: np.ndarray, extinction: np.ndarray) -> np.ndarray:
    """The integral along the picture's ray, in float64; source(points) is (n, k) like the rest."""
    steps = 20_000
    t = (np.arange(steps) + 0.5) * (4.0 / steps)
    points = np.stack([0.1 + 0.0 * t, 0.2 + 0.0 * t, 2.0 - t], axis=1)
    density = on_line(medium, medium.density, points)[:, None]
    depth = (np.cumsum(density, axis=0) - 0.5 * density) * (4.0 / steps) * extinction
    return (np.exp(-depth) * density * absorbs * source(points)).sum(axis=0) * (4.0 / steps)


@pytest.mark.slow
@pytest.mark.parametrize("albedo", [0.0, 0.7])
def test_constant_grid_is_homogeneous(albedo: float) -> None:
    """Half a density and twice the coefficients; what is scattered again is left out."""
    given = {"sigma_t": CHROMATIC, "albedo": albedo, "emission": COLOUR, "scale": 2.0}
    box = tf.translate([-1.0] * 3) @ tf.scale(2.0)
    grid = media.Grid(density=np.full((11, 9, 2), 0.5), to_world=box, **given)
    scene = slab(grid)
    scene.integrator = PathIntegrator(max_depth=1, light_paths=0)
    wanted = -COLOUR * (1.0 - albedo) * np.expm1(-2.0 * CHROMATIC)
    assert_mean(exposures(scene, 8, 64), wanted, WITHIN)


@pytest.mark.parametrize(
    "given", ["number", *(pytest.param(n, marks=pytest.mark.slow) for n in (*SLOWLY, "normalised"))]
)
def test_grid(given: str) -> None:
    """Numbers on a grid that light is multiplied by, and black bodies."""
    own = {"emission": COLOUR, "emission_grid": HEAT / 1000.0}
    if given == "bytes":
        own["bits"] = 8
    elif given != "number":
        own = {"temperature": HEAT, "brightness": 1e-3, "normalised": given == "normalised"}
    medium = media.Grid(
        density=3.0 * RANDOM, to_world=BOX, sigma_t=CHROMATIC, albedo=(0.5, 0.2, 0.0), **own
    )
    scene = slab(medium)
    scene.integrator = PathIntegrator(max_depth=1, light_paths=0)

    def source(points: np.ndarray) -> np.ndarray:
        heat = on_line(medium, HEAT, points)
        if given in ("number", "bytes"):
            return COLOUR * heat[:, None] / 1000.0
        kelvin = np.maximum(heat, 1.0)[::20, None]
        values = 1e-3 * planck(cie.GRID, kelvin)
        if given == "normalised":
            peak = planck(2.897771955e6 / kelvin, kelvin)
            values = values / peak
        rgb = cie.spectrum_to_xyz(values) @ cie.XYZ_TO_REC709.T
        return np.repeat(np.maximum(rgb, 0.0), 20, axis=0)

    wanted = seen(medium, source, CHROMATIC * (0.5, 0.8, 1.0), CHROMATIC)
    assert_mean(exposures(scene, 8, 128), wanted, WITHIN)


@pytest.mark.slow
def test_albedo_on_a_grid() -> None:
    """Every point of one albedo is what the medium's own would be; points absorb the rest."""
    given = {"density": 2.0 * RANDOM, "to_world": BOX, "sigma_t": CHROMATIC}
    albedo = np.broadcast_to(np.array([0.9, 0.5, 0.7]), (*RANDOM.shape, 3))
    tinted = media.Grid(**given, albedo=1.0, albedo_grid=albedo)
    plain = media.Grid(**given, albedo=(0.9, 0.5, 0.7))
    pictures = [
        exposures(slab(one, 1.0), 6, 32).mean(axis=(1, 2), keepdims=True) for one in (tinted, plain)
    ]
    assert_agree(*pictures, "the albedo on a grid and the medium's own", 2e-4)


def test_a_glowing_ball_that_moves() -> None:
    """The light goes with it: the picture is that of a scene that has it there."""
    scene, there = (under_a_ball(300.0, 0.3, at) for at in (0.8, 1.1))
    moved = {0: there.shapes[0].to_world}
    with clpt.Renderer(scene) as renderer:
        renderer.update(transforms=moved)
        renderer.run(2)
        got = renderer.image()
    with clpt.Renderer(there) as renderer:
        renderer.run(2)
        assert got.mean() > 0.0
        np.testing.assert_array_equal(got, renderer.image())


AWAY = 1.2  # of the floor that is seen from below the ball [m]


def under_a_ball(scale: float, radius: float, height: float) -> Scene:
    """A floor that a glowing ball lights, and nothing else, seen from above."""
    strength = 1.0 / scale if scale < 1.0 else 1.0
    glowing = media.Homogeneous(sigma_a=CHROMATIC, scale=scale, emission=strength * COLOUR)
    scene = slab(glowing)
    place = tf.translate([0.1, 0.2, height]) @ tf.scale(radius)
    ball = Sphere(to_world=place, material=Null(), interior=glowing)
    scene.shapes = [ball, Rectangle(to_world=tf.scale(9.0), material=Diffuse(reflectance=0.5))]
    eye = tf.look_at([0.1 + AWAY, 0.2, 5], [0.1 + AWAY, 0.2, 0], [0, 1, 0])
    scene.camera = Orthographic(to_world=eye @ tf.scale(1e-3))
    scene.lights, scene.integrator = [], PathIntegrator(max_depth=2, light_paths=0)
    return scene


@pytest.mark.parametrize("scale", [1e-4, 300.0])
def test_floor_under_a_glowing_ball(scale: float) -> None:
    """A thin ball shines as a point in its middle would (Newton's shells), a thick one as a lamp.

    With a camera that looks straight down, the floor shows rho / pi times j V z / d^3 [z the ball's
    height, d its distance, j what a metre emits], or rho L (r / d)^2 z / d.
    """
    radius, height, reflects = 0.3, 0.8, 0.5
    scene = under_a_ball(scale, radius, height)
    distance = np.hypot(height, AWAY)
    if scale < 1.0:
        sent = CHROMATIC * COLOUR * 4.0 / 3.0 * np.pi * radius**3
        wanted = reflects / np.pi * sent * height / distance**3
    else:
        wanted = reflects * COLOUR * (radius / distance) ** 2 * height / distance
    assert_mean(exposures(scene, 6, 64), wanted, WITHIN)


def test_two_sided_walls_of_a_room_of_haze() -> None:
    """Light that they send inwards goes through it, whoever says that it is there."""
    haze = media.Homogeneous(sigma_a=0.35)
    scene = slab(haze)
    room = Cube(material=TwoSided(front=Diffuse(reflectance=0.6)), to_world=tf.scale(2.0))
    scene.camera = Perspective(fov=70.0, to_world=tf.look_at([0.5, 0, 1.8], [0, -1, 0], [0, 1, 0]))
    scene.lights, scene.integrator = [Point(position=(0.0, 1.5, 0.0))], Direct()
    scene.shapes = [dataclasses.replace(room, interior=haze)]
    got = exposures(scene, 2, 16)
    scene.shapes = [room, Cube(material=Null(), interior=haze, to_world=tf.scale(9.0))]
    assert got.mean() > 0.0
    np.testing.assert_allclose(got, exposures(scene, 2, 16), rtol=1e-4)


def test_whitted_sees_lights_through_media() -> None:
    """As `direct` does: haze dims a lamp, and a body does not shine where its box is empty."""
    haze = media.Homogeneous(sigma_a=0.3)
    body = media.Homogeneous(sigma_a=0.5, emission=COLOUR)
    corners = np.float32([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * np.float32(0.5)
    sides = {"material": Null(), "interior": body, "exterior": haze}
    floor = tf.translate([0, 0, -1]) @ tf.scale(4.0)
    scene = slab(haze)
    scene.shapes = [
        Mesh(vertices=corners, faces=[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], **sides),
        Rectangle(material=Diffuse(), interior=haze, exterior=haze, to_world=floor),
        Cube(material=Null(), interior=haze, to_world=tf.scale(10.0)),
    ]
    scene.camera = Perspective(fov=20.0, to_world=tf.look_at([0, -6, 1], [0, -1, -1], [0, 0, 1]))
    scene.lights = [Point(position=(0.0, 1.0, 2.0), intensity=1.0)]
    pictures = []
    for integrator in (Direct(), Whitted(ambient=0.0)):
        scene.integrator = integrator
        pictures.append(exposures(scene, 8, 64).mean(axis=(1, 2), keepdims=True))
    assert_agree(*pictures, "direct and whitted")


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_bodies_as_lights(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bodies in a room of haze: chosen as lights, or met by chance alone, they light the same."""
    haze = media.Homogeneous(sigma_s=0.3, sigma_a=0.05)
    one, two = (
        media.Homogeneous(sigma_a=scale * CHROMATIC, sigma_s=0.5, emission=COLOUR)
        for scale in (1.0, 5.0)
    )
    sides = {"material": Null(), "exterior": haze}
    vertices, faces = triangulate(Cube(to_world=tf.rotate([1, 1, 0], 40) @ tf.scale(0.2)))[:2]
    bodies = [
        Cube(**sides, interior=one, to_world=tf.rotate([1, 2, 3], 30) @ tf.scale([0.9, 0.1, 0.2])),
        Mesh(**sides, interior=two, vertices=vertices + np.float32([0, 1, 0]), faces=faces),
        Sphere(center=(0.02, 0.01, 0.0), radius=0.05, material=Diffuse()),  # in the first
    ]
    scene = slab(haze, mode=mode)
    dull = TwoSided(front=Diffuse(reflectance=0.6))
    walls = Cube(material=dull, interior=haze, to_world=tf.scale(2.0))
    scene.shapes = [*bodies, walls]
    scene.camera = Perspective(fov=70.0, to_world=tf.look_at([0.5, 0, 1.8], [0, -1, 0], [0, 1, 0]))
    scene.integrator = PathIntegrator(max_depth=3, light_paths=0)
    scene.lights = []
    pictures = [exposures(scene, 12, 128).mean(axis=(1, 2), keepdims=True)]
    monkeypatch.setattr(body_lights, "_body", lambda *_: None)
    pictures.append(exposures(scene, 12, 512).mean(axis=(1, 2), keepdims=True))
    assert_agree(*pictures, "bodies as lights and bodies that are met", 2e-4)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_bricks_as_lights(mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A flame in a room of haze: chosen as a light, or met by chance alone, it lights the same."""
    flame = media.Soot(
        density=RANDOM, to_world=tf.scale(0.5) @ BOX, share=3e-7, temperature=HEAT, brightness=0.1
    )
    haze = media.Homogeneous(sigma_s=0.3, sigma_a=0.05)
    scene = slab(flame, mode=mode)
    box = Cube(material=Null(), interior=flame, exterior=haze, to_world=tf.scale(0.6))
    dull = TwoSided(front=Diffuse(reflectance=0.6))
    walls = Cube(material=dull, interior=haze, to_world=tf.scale(2.0))
    scene.shapes = [box, walls]
    scene.camera = Perspective(fov=70.0, to_world=tf.look_at([0.5, 0, 1.8], [0, -1, 0], [0, 1, 0]))
    scene.integrator = PathIntegrator(max_depth=3, light_paths=0)
    scene.lights = []
    pictures = [exposures(scene, 12, 128).mean(axis=(1, 2), keepdims=True)]
    monkeypatch.setattr(BrickLights, "brightest", nothing)
    pictures.append(exposures(scene, 12, 256).mean(axis=(1, 2), keepdims=True))
    assert_agree(*pictures, "a flame as lights and a flame that is met", 2e-4)


def nothing(glow: BrickLights) -> BrickLights:
    """No brick of those that emit."""
    none = (values[:0] for values in (glow.numbers, glow.power, glow.corners, glow.edges))
    return BrickLights(*none, glow.emitting)


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_a_black_body_within_glass_is_as_bright_as_outside(mode: str) -> None:
    """Radiance in glass is n^2 of that outside: an opaque body shows 1 - F of Planck's."""
    hot = media.Grid(
        density=np.ones((2, 2, 2), np.float32),
        sigma_a=200.0,
        temperature=np.full((2, 2, 2), 3000.0, np.float32),
        brightness=1e-6,
    )
    means = []
    for material in (Null(), Dielectric(int_ior=1.5, ext_ior=1.0)):
        body = Cube(material=material, interior=hot, to_world=tf.scale(0.5))
        scene = Scene(
            camera=Orthographic(
                to_world=tf.look_at([0, 0, 3], [0, 0, 0], [0, 1, 0]) @ tf.scale([0.2, 0.2, 1])
            ),
            shapes=[body],
            film=Film(width=4, height=4, mode=mode),
            integrator=PathIntegrator(max_depth=16, light_paths=0),
        )
        means.append(np.asarray(clpt.render(scene, 256)).mean())
    assert means[1] / means[0] == pytest.approx(0.96, abs=0.01)
