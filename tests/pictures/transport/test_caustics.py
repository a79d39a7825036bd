"""Caustics beside formulas of geometrical optics, by every way in which clpt finds them.

Each test gives one number many times, from independent pictures. Their mean must lie within a bound
of the formula, and the bound is wider than chance: see `assert_formula`. z is up. Kernels are one
lane wide, which compiles soonest; all scenes of a mode have the same programs.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy import optimize, stats

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Integrator, ParticleTracer, Path, Vcm
from clpt.scene.lights import Directional, Light, Point, Projector
from clpt.scene.shapes import Cube, Disk, Mesh, Rectangle, Shape, Sphere
from clpt.spectra import Tabulated, illuminant
from tests.pictures.builders import BLACK
from tests.pictures.support import (
    SIGNIFICANCE,
    Values,
    blocks,
    exposures,
    quick,
    with_film,
)
from tests.pictures.transport.test_hybrid import narrow
from tests.pictures.transport.test_light_tracing import assert_bows, rays
from tests.pictures.transport.test_vcm import flat_pool_irradiance, transmitted

ROOT = FilePath(__file__).parents[3]
ALBEDO = 0.5
DULL = m.Diffuse(reflectance=ALBEDO)
MIRROR = m.Conductor()
DOWN = tf.rotate([1, 0, 0], 180)  # turns +z to -z
EVEN = Tabulated((300.0, 900.0), (1.0, 1.0))
PATHS = 16  # from lights, for each sample of the camera
COUNT = 32  # pictures

WAYS: dict[str, Integrator] = {
    "path": Path(light_paths=PATHS),
    "merging": Vcm(light_paths=PATHS, light_tracing=False),
    "particle_tracer": ParticleTracer(),
    "vcm": Vcm(light_paths=PATHS),
}
UNAIMED = 6  # times as many light paths in particle_tracer, which aims none
SLOW = ("particle_tracer", "vcm")
every_way = pytest.mark.parametrize(
    "way", [pytest.param(w, marks=pytest.mark.slow if w in SLOW else ()) for w in WAYS]
)
with_path_and_photons = pytest.mark.parametrize(
    "way", ["path", pytest.param("merging", marks=pytest.mark.slow)]
)


def assert_formula(found: ArrayLike, expected: float, within: float) -> None:
    """Fail where the mean of independent numbers (k,) is off by more than `within`.

    Chance takes less than that at the significance of tests/pictures/support.py (Student's t).
    """
    numbers = np.asarray(found, np.float64)
    spread = numbers.std(ddof=1) / np.sqrt(len(numbers))
    chance = stats.t.isf(SIGNIFICANCE / 2.0, len(numbers) - 1) * spread
    assert chance < within, f"chance takes {chance:.3g}; {numbers.mean():.5g}"
    assert abs(numbers.mean() - expected) < within, f"{numbers.mean():.5g}, not {expected:.5g}"


def looking(
    at: ArrayLike, back: ArrayLike, half: float, up: ArrayLike = (0.0, 1.0, 0.0)
) -> Perspective:
    """A camera at `at` - `back` that sees 2 `half` of the plane through `at` across `back` [m].

    Columns run along `back` x `up`, rows against `up`.
    """
    at, back = np.asarray(at, float), np.asarray(back, float)
    angle = 2.0 * np.degrees(np.arctan(half / np.linalg.norm(back)))
    return Perspective(to_world=tf.look_at(at - back, at, up), fov=angle, near=1e-4)


def bench(
    camera: Perspective, shapes: list[Shape], light: Light, width: int, height: int, **film: Any
) -> Scene:
    """A scene for light paths, with all that others here have: so its programs are theirs.

    What it does not need is a tenth of a millimetre large, or dark.
    """
    low = min(float(np.min(s.to_world[2, 3])) for s in shapes)
    spare = {"to_world": tf.translate([0.01, 0.02, low - 0.02]) @ tf.scale(1e-4)}
    spares: list[Shape] = [
        Rectangle(material=MIRROR, **spare),
        Disk(material=DULL, **spare),
        Sphere(material=m.Dielectric(), **spare),
    ]
    other: Light = Projector(irradiance=0.0)
    if film.get("mode") != "spectral":
        other = Point(position=(0.0, 0.0, 1.0), intensity=0.0)
    dark: list[Light] = [Directional(irradiance=0.0), other]
    return Scene(
        camera=camera,
        shapes=[*shapes, *spares],
        lights=[light, *(one for one in dark if one.kind != light.kind)],
        film=Film(width=width, height=height, **{"mode": "rgb", **film}),
    )


def irradiance(
    scene: Scene, way: str, paths: float, depth: int, radius: float = 0.01, **changes: Any
) -> Values:
    """Of what the camera sees, dull: pictures (COUNT, h, w) of so many light paths each.

    Of the first colour or band. depth: of the longest path, which leaves out what formulas do.
    radius: of photons in the first pass [m]; changes: of the integrator.
    """
    changes |= {"radius": radius} if isinstance(WAYS[way], Vcm) else {}
    integrator: Any = dataclasses.replace(WAYS[way], max_depth=depth, rr_depth=depth, **changes)
    number = scene.film.width * scene.film.height * (integrator.light_paths or 1)
    lit = dataclasses.replace(scene, integrator=integrator)
    spp = max(1, round(paths / number)) * (UNAIMED if way == "particle_tracer" else 1)
    made = exposures(lit, COUNT, spp, device=narrow(), layout="wide8")
    return made[..., 0] * np.pi / ALBEDO


# ---- Mirrors

ARC, FACETS = 0.25, 400  # of the ring the part that is there, to either side [rad]
LOW, HIGH = 0.2, 0.6  # its edges [m]
SLOPE = 0.4  # of light from afar, over its way along the floor
LAMP = 1.0  # height of the lamp over the floor [m]
HALF = 0.4  # of the axis that is seen [m]
AXIS = (np.arange(32) + 0.5) / 32 * 2.0 * HALF - HALF  # middles of two pixels each [m]


def ring(light: Light) -> Scene:
    """A part of a mirror ring of radius 1, about the x axis, in flat facets that face the middle.

    On the floor the camera sees the x axis.
    """
    turn = np.linspace(-ARC, ARC, FACETS + 1)
    corners = [(np.cos(turn), np.sin(turn), np.full_like(turn, z)) for z in (LOW, HIGH)]
    vertices = np.concatenate([np.transpose(row) for row in corners]).astype(np.float32)
    i = np.arange(FACETS)
    j, above, over = i + 1, i + FACETS + 1, i + FACETS + 2
    faces = np.concatenate([np.transpose((i, over, j)), np.transpose((i, above, over))])
    mirror = Mesh(vertices=vertices, faces=faces.astype(np.uint32), material=MIRROR)
    return bench(looking([0, 0, 0], [0, 0, -5], HALF), [Disk(material=DULL), mirror], light, 64, 4)


def nephroid() -> tuple[Scene, float, Callable[[Values], Values]]:
    """Light from afar along (1, 0, -SLOPE).

    In the plan, light that comes at the angle t to the wall's normal goes on at the same angle. A
    mirror bent with radius 1 has the focal length cos t / 2 there, so that after a way s the light
    is |1 - 2 s / cos t| as wide as before. On the axis t = 0 and s = 1 - x: the irradiance is
    E sin e / (1 - 2 x), e being the light's angle to the floor. So the caustic, a nephroid, has its
    cusp 1/2 from the middle. Behind it two more rays come to the axis. Direct light is E sin e.
    """
    along = np.array([1.0, 0.0, -SLOPE]) / np.hypot(1.0, SLOPE)
    scene = ring(Directional(direction=tuple(along), irradiance=(1.0, 1.0, 1.0)))
    return scene, 1.0 / 2.0, lambda found: -along[2] / (found + along[2])


def cardioid() -> tuple[Scene, float, Callable[[Values], Values]]:
    """A lamp over the ring at (-1, 0).

    In the plan, light goes u = 2 cos t to the wall. There it turns to where 1/u + 1/v = 2 / cos t:
    after a way s a radian of it is u |1 - s / v| wide. On the axis that is 2 |1 - 3 (1 - x) / 2| =
    |1 - 3 x|. So the caustic, a cardioid, has its cusp 1/3 from the middle. After 3 - x in the plan
    light comes at an angle e to the floor; its part de of a radian has the power I cos e de, and
    covers LAMP / sin^2 e de of that width. Direct light is I sin^3 e / LAMP^2.
    """
    scene = ring(Point(position=(-1.0, 0.0, LAMP), intensity=(1.0, 1.0, 1.0)))
    angle, straight = np.arctan(LAMP / (3.0 - AXIS)), np.arctan(LAMP / (1.0 + AXIS))
    direct = np.sin(straight) ** 3 / LAMP**2
    power = np.cos(angle) * np.sin(angle) ** 2 / LAMP
    return scene, 1.0 / 3.0, lambda found: power / (found - direct)


@pytest.mark.slow
@with_path_and_photons
@pytest.mark.parametrize(("curve", "paths"), [(nephroid, 2e5), (cardioid, 5e5)])
def test_a_ring_has_its_cusp_where_light_has_no_width(way: str, curve: Any, paths: float) -> None:
    """The width of light along the axis is a line from 1 in the middle to 0 at the cusp.

    The cusp within 1/2 % of the radius, from what lies a tenth of it and more before it: there the
    light a pixel off the axis is 1 % less at most.
    """
    scene, cusp, width = curve()
    paths *= 1 if way == "path" else 4
    found = irradiance(scene, way, paths, 3)[:, 1:3].reshape(COUNT, 2, 32, 2).mean(axis=(1, 3))
    before = cusp - AXIS > 0.1
    wide = width(found)[:, before]
    lines = [np.polyfit(AXIS[before], one, 1, w=1.0 / wide.std(axis=0)) for one in wide]
    slopes, middles = np.transpose(lines)
    assert_formula(-middles / slopes, cusp, 0.005)
    assert_formula(middles, 1.0, 0.02)


FOCUS, RIM = 0.5, 0.5  # of the parabolic mirror: focal length, radius [m]
SIDES, RINGS = 96, 24


def paraboloid() -> Mesh:
    """z = r^2 / (4 FOCUS) up to r = RIM, facing up, in flat triangles."""
    r = np.linspace(0.0, RIM, RINGS + 1)[1:, None]
    turn = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    corners = np.stack(
        np.broadcast_arrays(r * np.cos(turn), r * np.sin(turn), r**2 / (4.0 * FOCUS)), axis=-1
    ).reshape(-1, 3)
    i = np.arange(SIDES)
    j = (i + 1) % SIDES
    faces = [np.stack([np.full(SIDES, len(corners)), i, j], axis=1)]
    for inner in range(0, len(corners) - SIDES, SIDES):
        a, b, c, d = inner + i, inner + j, inner + SIDES + i, inner + SIDES + j
        faces += [np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)]
    vertices = np.vstack([corners, np.zeros((1, 3))]).astype(np.float32)
    return Mesh(vertices=vertices, faces=np.vstack(faces).astype(np.uint32), material=MIRROR)


def burning_mirror(shield: float, pixels: int = 16) -> Scene:
    """The mirror in light from above, and a disk at its focus, seen by a camera before the mirror.

    The camera sees 1/4 more than the disk's radius, `shield`.
    """
    disk = Disk(to_world=tf.translate([0, 0, FOCUS]) @ DOWN @ tf.scale(shield), material=DULL)
    view = looking([0, 0, FOCUS], [0, 0, FOCUS / 2.0], 1.25 * shield)
    sun = Directional(irradiance=(1.0, 1.0, 1.0))
    return bench(view, [paraboloid(), disk], sun, pixels, pixels)


@pytest.mark.slow
@every_way
def test_a_parabolic_mirror_gathers_all_light(way: str) -> None:
    """In a disk at the focus, which faces the mirror: E pi a^2 less the disk's shadow, .3 %.

    The mirror's rim is a polygon.
    """
    shield = 0.05
    polygon = SIDES / 2.0 * RIM**2 * np.sin(2.0 * np.pi / SIDES)
    found = irradiance(burning_mirror(shield), way, 5e4, 3, 0.02)
    power = found.mean(axis=(1, 2)) * (2.5 * shield) ** 2
    assert_formula(power / (polygon - np.pi * shield**2), 1.0, 0.003)


# ---- Glass

BEHIND, WINDOW = 0.3, 0.04  # of the focus, a screen; half of what is seen of it [m]


def focus(index: float) -> float:
    """Of a ball of radius 1, behind its back."""
    return (2.0 - index) / (2.0 * (index - 1.0))


def behind_a_ball(index: float, far: float) -> float:
    """The mean irradiance of a small square, `far` behind a ball of radius 1 in a beam of 1.

    Light b off the axis comes to the ball at the angle i, sin i = b, is refracted to r, and leaves
    it turned by 2 (i - r). It meets the axis b / sin 2 (i - r) from the middle, near the axis at
    n / (2 (n - 1)), and outer light sooner. So each point behind that has light from one b alone,
    and a ring of light keeps its power, but for what is reflected.
    """
    b = np.linspace(1e-4, 0.7, 8001)
    turn = 2.0 * (np.arcsin(b) - np.arcsin(b / index))
    rho = (1.0 + far - b / np.sin(turn)) * np.tan(turn)
    power = transmitted(np.arcsin(b), index) ** 2 * b / (rho * np.gradient(rho, b))
    at = (np.arange(64) + 0.5) / 64 * WINDOW
    return float(np.interp(np.hypot(at[:, None], at), rho, power).mean())


def ball_focus(way: str, glass: Any, index: float, far: float, **film: Any) -> Values:
    """Where a ball of radius 1 has its focus, by the light of a beam on a screen `far` behind it.

    The index is sought with which the formula gives as much.
    """
    screen = Rectangle(to_world=tf.translate([0, 0, -1.0 - far]) @ tf.scale(0.5), material=DULL)
    ball = Sphere(material=m.Dielectric(int_ior=glass, ext_ior=1.0))
    view = looking([0, 0, -1.0 - far], [0, 0, -far / 2.0], WINDOW)
    beam = Directional(irradiance=EVEN if film else (1.0, 1.0, 1.0))
    scene = bench(view, [screen, ball], beam, 16, 16, **film)
    found = irradiance(scene, way, 5e4, 4, WINDOW / 4.0).mean(axis=(1, 2))

    def fitted(seen: float) -> float:
        def off(trial: float) -> float:
            return behind_a_ball(trial, far) / seen - 1.0

        return focus(optimize.brentq(off, 1.05 * (index - 1.0) + 1.0, 0.9 * (index - 1.0) + 1.0))

    return np.array([fitted(one) for one in found])


@pytest.mark.parametrize("way", quick(WAYS, "path"))
def test_a_ball_of_glass_has_its_focus_behind_it(way: str) -> None:
    """R (2 - n) / (2 (n - 1)) behind its back, within 1 % of R: of what a screen behind it sees."""
    assert_formula(ball_focus(way, 1.5, 1.5, focus(1.5) + BEHIND), focus(1.5), 0.01)


@pytest.mark.slow
@pytest.mark.parametrize("way", ["path", "merging"])
def test_colours_have_their_own_focus(way: str) -> None:
    """Blue and red hydrogen light (486 and 656 nm) in flint glass: 2.4 % of R apart, to .5 %."""
    lines = np.array([486.1, 656.3])
    indices = spectra.glass("sf11").sample(lines)
    far = focus(indices[1]) + BEHIND
    found = [
        ball_focus(way, "sf11", n, far, mode="spectral", bands=1, lambda_min=nm - 1.0,
                   lambda_max=nm + 1.0)
        for nm, n in zip(lines, indices, strict=True)
    ]  # fmt: skip
    for one, n in zip(found, indices, strict=True):
        assert_formula(one, focus(n), 0.01)
    assert_formula(found[1] - found[0], focus(indices[1]) - focus(indices[0]), 0.005)


@every_way
def test_a_pane_passes_what_is_reflected_in_it_too(way: str) -> None:
    """T + T R^2 + ... = (1 - R) / (1 + R) of a beam, R = ((n - 1) / (n + 1))^2: .9231, to .3 %."""
    pane = Cube(
        to_world=tf.scale([0.15, 0.15, 0.01]), material=m.Dielectric(int_ior=1.5, ext_ior=1)
    )
    floor = Rectangle(to_world=tf.translate([0, 0, -1]) @ tf.scale(0.14), material=DULL)
    scene = bench(
        looking([0, 0, -1], [0, 0, -0.5], 0.11),
        [pane, floor],
        Directional(irradiance=(1.0, 1.0, 1.0)),
        16,
        16,
    )
    found = irradiance(scene, way, 1e5, 20, 0.02).mean(axis=(1, 2))
    reflected = (0.5 / 2.5) ** 2
    assert_formula(found, (1.0 - reflected) / (1.0 + reflected), 0.003)


@with_path_and_photons
def test_the_floor_of_a_pool(way: str) -> None:
    """Under flat water in the light of a point, seen by a camera in the water: 1 %, in blocks.

    tests/pictures/transport/test_vcm.py sees it from the air, and has the formula.
    """
    water = m.Dielectric(int_ior=1.33, ext_ior=1.0)
    surface = tf.translate([0.45, 0, 0]) @ tf.scale(0.4)
    floor = tf.translate([0.35, 0, -1]) @ tf.scale(0.4)
    half, lamp = 0.3, Point(position=(0.6, 0.0, 1.0), intensity=(10.0, 10.0, 10.0))
    shapes: list[Shape] = [
        Rectangle(to_world=surface, material=water),
        Rectangle(to_world=floor, material=DULL),
    ]
    scene = bench(looking([0.35, 0, -1], [0, 0, -0.9], half), shapes, lamp, 16, 16)
    at = ((np.arange(32) + 0.5) / 16 - 1.0) * half
    x, y = np.meshgrid(at + 0.35, at)
    exact = blocks(flat_pool_irradiance(x, y)[0][..., None], 16)[..., 0]
    found = blocks(irradiance(scene, way, 1e6 if way == "merging" else 2e5, 3, 0.03)[..., None], 8)[
        ..., 0
    ]
    for i, j in np.ndindex(2, 2):
        assert_formula(found[:, i, j] / exact[i, j], 1.0, 0.01)


# ---- A prism

APEX, GLASS = np.radians(60.0), "sf11"
DISTANCE = 1.0  # from the projector to the glass [m]
SIZE = 0.1  # from the prism's edge to where light enters [m]


def direction(angle: ArrayLike) -> Values:
    """(2,) or (2, n): of the plane of x and z, from +x to +z."""
    return np.stack([np.cos(angle), np.sin(angle)])


def deviation(index: ArrayLike, incidence: float) -> Values:
    """Of light through the prism [rad]: i + e - A, sin e = n sin (A - r), sin i = n sin r."""
    n = np.asarray(index, np.float64)
    return incidence + np.arcsin(n * np.sin(APEX - np.arcsin(np.sin(incidence) / n))) - APEX


def leaves(index: ArrayLike, incidence: float) -> Values:
    """(2, n): where light leaves the prism [m]."""
    start = -SIZE * np.array([np.sin(APEX / 2), np.cos(APEX / 2)])
    inside = direction(np.arcsin(np.sin(incidence) / np.asarray(index, np.float64)) - APEX / 2)
    face = np.array([np.sin(APEX / 2), -np.cos(APEX / 2)])
    outward = np.array([face[1], -face[0]])
    return start[:, None] + inside * (-(outward @ start) / (outward @ inside))


def prism() -> Mesh:
    """Its edge is the y axis; light goes in along +x."""
    down = 4.0 * SIZE * np.array([np.sin(APEX / 2), np.cos(APEX / 2)])
    section = [(0.0, 0.0), (-down[0], -down[1]), (down[0], -down[1])]
    vertices = [(x, y, z) for y in (-0.3, 0.3) for x, z in section]
    faces = [(0, 1, 2), (3, 5, 4), (0, 4, 1), (0, 3, 4), (0, 2, 5), (0, 5, 3), (1, 4, 5), (1, 5, 2)]
    glass = m.Dielectric(int_ior=GLASS, ext_ior=1.0)
    return Mesh(
        vertices=np.array(vertices, np.float32), faces=np.array(faces, np.uint32), material=glass
    )


def in_space(point: ArrayLike, y: float = 0.0) -> Values:
    """(3,) of a point of the plane of x and z."""
    x, z = np.asarray(point, np.float64)
    return np.array([x, y, z])


def slit(incidence: float, fov: float, aspect: float = 1.0) -> Projector:
    """A projector that shines on the prism from DISTANCE; fov, aspect: of its light."""
    target = -SIZE * np.array([np.sin(APEX / 2), np.cos(APEX / 2)])
    origin = target - DISTANCE * direction(incidence - APEX / 2)
    place = tf.look_at(in_space(origin), in_space(target), [0, 1, 0])
    return Projector(to_world=place, irradiance=EVEN, fov=fov, aspect=aspect)


def screen(middle: ArrayLike, heading: float, half: float) -> Rectangle:
    """A dull square across light of that heading."""
    place = tf.look_at(in_space(middle), in_space(middle - direction(heading)), [0, 1, 0])
    return Rectangle(to_world=place @ tf.scale(half), material=DULL)


@pytest.mark.slow
@pytest.mark.parametrize("way", ["path", "merging"])
@pytest.mark.parametrize("nm", [450.0, 550.0, 650.0])
def test_a_prism_turns_light(way: str, nm: float) -> None:
    """By 2 asin(n sin(A / 2)) - A at least, where light goes through it evenly: to .1 degree.

    Found as the middle of what a narrow projector throws on a screen.
    """
    n = float(spectra.glass(GLASS).sample(nm))
    incidence = float(np.arcsin(n * np.sin(APEX / 2)))
    least = 2.0 * incidence - APEX
    heading = incidence - APEX / 2 - least
    middle = leaves([n], incidence)[:, 0] + DISTANCE * direction(heading)
    half = 0.02
    view = looking(in_space(middle), in_space(0.5 * direction(heading)), half)
    scene = bench(
        view, [prism(), screen(middle, heading, 0.3)], slit(incidence, 0.4), 16, 16,
        mode="spectral", bands=1, lambda_min=nm - 1.0, lambda_max=nm + 1.0,
    )  # fmt: skip
    found = irradiance(scene, way, 1e4, 4, 0.003).sum(axis=1)
    at = ((np.arange(16) + 0.5) / 8 - 1.0) * half
    middles = found @ at / found.sum(axis=1) / DISTANCE
    assert_formula(np.degrees(least - middles), np.degrees(least), 0.1)


FAN = (440.0, 660.0)  # [nm]
FAR = 2.0  # from the prism to the screen [m]


@pytest.mark.slow
def test_a_spectrum_in_a_mirror(tmp_path: FilePath) -> None:
    """A prism's spectrum on a screen that the camera sees in a mirror: photons alone find it.

    Each column of pixels has the mean wavelength that refraction sends there, to 2 nm after 64
    passes. A pass has few wavelengths, but no lines are seen: where columns are brighter or darker
    than smooth light, that is not so above and below alike.
    """
    nm = np.linspace(*FAN, 881)
    indices = spectra.glass(GLASS).sample(nm)
    incidence = float(np.arcsin(spectra.glass(GLASS).sample(550.0) * np.sin(APEX / 2)))
    heading = incidence - APEX / 2 - deviation(indices, incidence)
    ahead = float(heading[440])  # of 550 nm
    along, across = direction(ahead), direction(ahead + np.pi / 2)
    start = leaves(indices, incidence)
    middle = start[:, 440] + FAR * along
    way = direction(heading)
    met = start + way * ((middle[:, None] - start).T @ along / (along @ way))
    u = across @ (met - middle[:, None])  # where each wavelength meets the screen [m]
    # The mirror stands above the light, a metre before the screen; the camera between them.
    half, y, back, aside = 0.12, 0.6, 1.6, -0.045
    mirror = tf.look_at(in_space(middle - along, 0.4), in_space(middle, 0.4), [0, 1, 0]) @ tf.scale(
        [0.3, 0.2, 1.0]
    )
    eye = in_space(middle - (2.0 - back) * along + aside * across, y)
    target = in_space(middle - 2.0 * along + aside * across)
    fov = 2.0 * np.degrees(np.arctan(half / np.hypot(y, back)))
    columns, rows = 48, 24
    scene = bench(
        Perspective(to_world=tf.look_at(eye, target, [0, 1, 0]), fov=fov),
        [
            prism(),
            screen(middle, ahead, 0.4),
            Rectangle(to_world=mirror, material=MIRROR),
        ],
        slit(incidence, 0.1, 0.1),
        columns,
        rows,
        mode="spectral",
        bands=220,
        lambda_min=FAN[0],
        lambda_max=FAN[1],
    )
    lit = dataclasses.replace(scene, integrator=Vcm(light_paths=PATHS, max_depth=6))
    renderer = clpt.Renderer(lit, narrow(), layout="wide8")
    renderer.run(64)
    image = renderer.image().astype(np.float64)  # (rows, columns, bands)
    seen = image.sum(axis=0)
    centres = scene.film.band_centres
    found = seen @ centres / seen.sum(axis=1)
    at = aside - ((np.arange(columns) + 0.5) * 2.0 / columns - 1.0) * half  # mirrored
    inside = (at > u.min() + 0.02) & (at < u.max() - 0.02)
    assert inside.sum() > 30
    order = np.argsort(u)
    expected = np.interp(at, u[order], nm[order])
    assert np.abs(found - expected)[inside].max() < 2.0
    light = image[:, inside].sum(axis=2) / np.abs(np.gradient(expected, at))[inside]
    parts = [half.sum(axis=0) for half in np.split(light, 2)]
    x = np.arange(inside.sum())
    uneven = [part / np.polyval(np.polyfit(x, part, 2), x) - 1.0 for part in parts]
    assert np.corrcoef(*uneven)[0, 1] < 0.6


@pytest.mark.slow
@pytest.mark.parametrize("mirrored", [False, True], ids=["direct", "in_a_mirror"])
def test_a_rainbow(mirrored: bool) -> None:
    """Of scenes/rainbow in the light of the sun: the flask is seen, and the bow in a mirror.

    A stop leaves the ring of light that the scene has as a beam. A black plate keeps from
    the mirror what the flask sends there.
    """
    scene = clpt.load(ROOT / "scenes/rainbow")
    kept = [s for s in scene.shapes if s.name not in ("beam", "stand")]
    stop = Disk(to_world=tf.translate([0, 0, -0.05]) @ DOWN @ tf.scale(0.0304), material=BLACK)
    scene = dataclasses.replace(
        with_film(scene, width=120, height=76),
        shapes=[*kept, stop],
        lights=[Directional(direction=(0.0, 0.0, 1.0), irradiance=illuminant("E", 6000.0))],
        integrator=Vcm(max_depth=8, light_paths=16, radius=0.012, wavelength_groups=2),
    )
    plane = 2.4
    if mirrored:
        place = tf.translate([0.0, 0.42, plane]) @ DOWN @ tf.scale([0.35, 0.25, 1.0])
        shade = tf.translate([0.0, 0.06, 1.2]) @ tf.scale([0.13, 0.11, 1.0])
        to_world = tf.look_at([0.0, 0.3, 1.7], [0.0, 0.6, 2.0 * plane], [0, 1, 0])
        scene = dataclasses.replace(
            scene,
            camera=Perspective(to_world=to_world, fov=44),
            shapes=[
                *scene.shapes,
                Rectangle(to_world=place, material=MIRROR),
                Rectangle(to_world=shade, material=BLACK),
            ],
        )
    image = clpt.render(scene, 48)
    origin, d = np.asarray(scene.camera.to_world)[:3, 3], rays(scene)
    if mirrored:
        origin, d = origin * [1, 1, -1] + [0, 0, 2.0 * plane], d * [1, 1, -1]
        assert_bows(image, origin, d)
        return
    assert_bows(image, origin, d)
    to = np.array([0.0, 0.0, 1.0]) - origin
    away = np.linalg.norm(np.cross(d, to), axis=-1) / np.linalg.norm(d, axis=-1)
    assert (image[away < 0.035].max(axis=1) > 0.0).any(), "the bow is seen in the flask"


# ---- Merging


def spot_of_light(way: str, radius: float, passes: int) -> Values:
    """Mean squares (COUNT,) of the distance from the focus of a parabolic mirror [m^2].

    Of light on a disk of twice that radius; way: merging with it in the first pass, or path.
    """
    shield, pixels = max(2.0 * radius, 0.04), 48
    paths = passes * pixels**2
    seen = irradiance(burning_mirror(shield, pixels), way, paths, 3, radius, light_paths=1)
    side = 2.5 * shield / pixels
    at = (np.arange(pixels) + 0.5 - pixels / 2) * side
    square = at[:, None] ** 2 + at**2 - side**2 / 6.0  # Sheppard's, for what a pixel gathers
    return (seen * square).sum(axis=(1, 2)) / seen.sum(axis=(1, 2)).mean()


@pytest.mark.slow
def test_the_blur_of_merging_falls_with_the_square_of_the_radius() -> None:
    """A disk of radius r for each photon adds r^2 / 2 to the mean square of a spot's width: 2 %.

    So half the radius makes a quarter of it. Of later passes the radius is the eighth root of their
    number smaller.
    """
    sharp = spot_of_light("path", 0.0, 16).mean()
    for radius, passes in ((0.06, 1), (0.03, 1), (0.015, 1), (0.06, 4)):
        blur = spot_of_light("merging", radius, passes) - sharp
        shrunk = (np.arange(1, passes + 1) ** -0.25).mean()
        assert_formula(blur / (radius**2 / 2.0 * shrunk), 1.0, 0.02)
