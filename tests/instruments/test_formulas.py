"""Fifteen kinds of light, ten random cases of each, against formulas.

An entry's value less the formula, over its standard error, follows Student's t of 15 degrees of
freedom. It lies beyond 3 with a chance of .9 %, beyond 5 of 1.6e-4. So of ten at most one lies
beyond 3 (another has a chance of .4 %), and none beyond 5. The mean of ten has a standard deviation
of .34, and lies beyond 1.4 with a chance of 4e-5.

The last five are the analytic cases of CIE 171:2006, in rooms of random size: clear glass (5.5),
light from a matt floor (5.6), the same behind a screen (5.7), openings of a roof (5.9) and of a
facade (5.11) under an overcast sky. Its 5.8 is the integrating sphere, 5.3 the rectangle.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.formats import ies
from clpt.instruments import measure
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Path
from clpt.spectra import Constant
from clpt.spectra.emission import UNIT_LUMINANCE

RANGE = 470.0  # [nm] of the film
MEASURED = 2e-4  # relative: of receivers a tenth of a millimetre above their points
CASES = 10


def scene(parts=(), lamps=(), depth=2) -> Scene:
    return Scene(
        camera=cameras.Perspective(), shapes=list(parts), lights=list(lamps),
        integrator=Path(max_depth=depth), film=Film(size=(8, 8)),
    )  # fmt: skip


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def turned(rng) -> np.ndarray:
    """Return a random rotation (4, 4)."""
    matrix = np.eye(4)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix[:3, :3] = q * np.linalg.det(q)
    return matrix


def polygon(corners, points, normals):
    """Irradiance at points (n, 3) under a polygon (m, 3) of radiance 1, above all (Lambert 1760).

    Half the sum over its sides of the angle that a side takes, times the cosine of the normal to
    the plane of the side and the point.
    """
    arms = unit(corners[None] - points[:, None])
    following = np.roll(arms, -1, axis=1)
    angles = np.arccos(np.clip((arms * following).sum(-1), -1.0, 1.0))
    axes = unit(np.cross(arms, following))
    return np.abs(0.5 * (angles * (axes * normals[:, None]).sum(-1)).sum(1))


def facing(rng, points, targets, widest):
    """Return normals (n, 3) within `widest` radians of the way from points to targets."""
    toward = unit(targets - points)
    side = unit(np.cross(toward, rng.normal(size=toward.shape)))
    angle = rng.uniform(0.0, widest, (len(points), 1))
    return np.cos(angle) * toward + np.sin(angle) * side


def rectangle(rng):
    half = rng.uniform(0.3, 0.8, 2)
    place = turned(rng) @ tf.translate([0, 0, 2])
    shape = shapes.Rectangle(
        to_world=place @ tf.rotate([1, 0, 0], 180) @ tf.scale([*half, 1]),
        emission=lights.Area(radiance=Constant(2.0)),
    )
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [*half, 0]
    corners = tf.transform_points(place, corners)
    at = tf.transform_points(place, rng.uniform(-1, 1, (CASES, 3)) * [1, 1, 0.3] - [0, 0, 2])
    normals = facing(rng, at, corners.mean(0), 0.4)
    return scene([shape]), "irradiance", at, normals, 2.0 * RANGE * polygon(corners, at, normals)


def disc(rng):
    radius, height, place = *rng.uniform(0.5, 2.0, 2), turned(rng)
    shape = shapes.Disk(
        to_world=place @ tf.translate([0, 0, height]) @ tf.rotate([1, 0, 0], 180)
        @ tf.scale([radius, radius, 1]), emission=lights.Area(radiance=Constant(1.0)),
    )  # fmt: skip
    at = rng.uniform(-2, 2, (CASES, 3)) * [1, 1, 0]
    d2 = (at**2).sum(1)
    total = height**2 + d2 + radius**2
    # Howell's catalogue of configuration factors, B-13
    expected = 1.0 - (height**2 + d2 - radius**2) / np.sqrt(total**2 - 4.0 * radius**2 * d2)
    return (
        scene([shape]), "irradiance", tf.transform_points(place, at),
        np.tile(place[:3, 2], (CASES, 1)), 0.5 * math.pi * RANGE * expected,
    )  # fmt: skip


def sphere(rng):
    center, radius = rng.normal(size=3), rng.uniform(0.2, 0.8)
    ball = shapes.Sphere(
        center=tuple(center), radius=radius, emission=lights.Area(radiance=Constant(1.0))
    )
    distance = rng.uniform(1.3, 3.0, CASES)
    at = center + distance[:, None] * unit(rng.normal(size=(CASES, 3)))
    normals = facing(rng, at, center, 0.6)  # asin(.8 / 1.3) + .6 < pi / 2
    cosine = (unit(center - at) * normals).sum(1)
    return (
        scene([ball]),
        "irradiance",
        at,
        normals,
        math.pi * RANGE * (radius / distance) ** 2 * cosine,
    )


def luminaire(rng):
    vertical = np.linspace(0.0, 90.0, 7)
    table = ies.Photometry(vertical, np.zeros(1), rng.uniform(100.0, 1000.0, (1, 7)))
    place = tf.translate(rng.normal(size=3)) @ turned(rng)
    lamp = lights.Goniometric(to_world=place, **ies.directional_image(table))
    away = rng.uniform(0.5, 3.0, (CASES, 1)) * unit(rng.normal(size=(CASES, 3)))
    away[:, 1] = -np.abs(away[:, 1])
    at, distance = tf.transform_points(place, away), np.linalg.norm(away, axis=1)
    angles = np.degrees(np.arccos(-away[:, 1] / distance))
    normals = facing(rng, at, place[:3, 3], 1.3)
    cosine = (unit(place[:3, 3] - at) * normals).sum(1)
    expected = table.intensity(angles, 0.0) * cosine / distance**2
    return scene(lamps=[lamp]), "illuminance", at, normals, expected


def spot(rng):
    place, cutoff, beam = tf.translate(rng.normal(size=3)) @ turned(rng), 50.0, 10.0
    lamp = lights.Spot(to_world=place, intensity=Constant(3.0), cutoff=cutoff, beam_width=beam)
    away = unit(rng.normal(size=(CASES, 3)) * [0.5, 0.5, 0.3] + [0, 0, 1])
    angles = np.degrees(np.arccos(away[:, 2]))
    at = tf.transform_points(place, 2.0 * away)
    normals = facing(rng, at, place[:3, 3], 1.3)
    cosine = (unit(place[:3, 3] - at) * normals).sum(1)
    share = np.clip((cutoff - angles) / (cutoff - beam), 0.0, 1.0)
    return scene(lamps=[lamp]), "irradiance", at, normals, 3.0 * RANGE * share * cosine / 4.0


def sun(rng):
    direction = unit(rng.normal(size=3))
    lamp = lights.Directional(direction=tuple(direction), irradiance=Constant(1.5))
    at, normals = rng.normal(size=(2, CASES, 3))
    cosine = np.maximum(-(unit(normals) @ direction), 0.0)
    return scene(lamps=[lamp]), "irradiance", at, normals, 1.5 * RANGE * cosine


def even_sky(rng):
    at, normals = rng.normal(size=(2, CASES, 3))
    lamp = lights.Constant(radiance=Constant(1.0))
    return scene(lamps=[lamp]), "irradiance", at, normals, np.full(CASES, math.pi * RANGE)


def overcast_sky(rng):
    """Radiance (1 + 2 sin g) / 3 at an elevation g, of Moon and Spencer 1942; below it is black.

    On a plane that is tilted by b: the integral over bands of 0.1 degrees, by quadrature.
    """
    elevation = math.pi * (0.5 - np.arange(1024) / 1023.0)
    radiance = np.where(elevation >= 0.0, (1.0 + 2.0 * np.sin(elevation)) / 3.0, 0.0)
    image = np.broadcast_to(radiance[:, None, None], (1024, 8, 3)).astype(np.float32)
    at, normals = rng.normal(size=(2, CASES, 3))
    g = (np.arange(900) + 0.5) * math.pi / 1800.0
    azimuth = (np.arange(1440) + 0.5) * math.pi / 720.0
    level, up = np.cos(g)[:, None], np.sin(g)[:, None]
    parts = np.broadcast_arrays(level * np.cos(azimuth), up, level * np.sin(azimuth))
    sky = np.stack(parts, axis=-1)
    weights = (1.0 + 2.0 * np.sin(g)) / 3.0 * np.cos(g) * (math.pi / 1800.0) * (math.pi / 720.0)
    expected = [(np.maximum(sky @ normal, 0.0).sum(1) * weights).sum() for normal in unit(normals)]
    lamp = lights.Envmap(image=image)
    return scene(lamps=[lamp]), "illuminance", at, normals, UNIT_LUMINANCE * np.array(expected)


def integrating_sphere(rng):
    """A lamp in the middle of a matt ball: E = I / R^2 / (1 - rho) everywhere."""
    radius, share = rng.uniform(0.5, 2.0), rng.uniform(0.2, 0.7)
    ball = shapes.Sphere(
        radius=radius, flip_normals=True, material=materials.Diffuse(reflectance=share)
    )
    normals = unit(rng.normal(size=(CASES, 3)))
    lamp = lights.Point(intensity=Constant(1.0))
    expected = np.full(CASES, RANGE / radius**2 / (1.0 - share))
    return (
        scene([ball], [lamp], 48), "irradiance", (radius - 1e-4) * normals, -normals, expected
    )  # fmt: skip


def mirror(rng):
    """A square lamp before a mirror: irradiance of the lamp and of its image."""
    share = rng.uniform(0.3, 0.9)
    lamp = shapes.Rectangle(
        to_world=tf.translate([0, 0, 1]) @ tf.scale([0.4, 0.4, 1.0]),
        emission=lights.Area(radiance=Constant(1.0), two_sided=True),
    )
    wall = shapes.Rectangle(
        to_world=tf.scale([30.0, 30.0, 1.0]),
        material=materials.Conductor(specular_reflectance=share),
    )
    corners = np.array([[-0.4, -0.4, 1], [0.4, -0.4, 1], [0.4, 0.4, 1], [-0.4, 0.4, 1]])
    at = rng.uniform(-1, 1, (CASES, 3)) * [1, 1, 0.3] + [0, 0, 3]
    at[:, 0] += 3.0  # where the lamp does not cover its image
    normals = facing(rng, at, corners.mean(0), 0.3)
    image = corners * [1, 1, -1]
    expected = polygon(corners, at, normals) + share * polygon(image, at, normals)
    return scene([lamp, wall], depth=3), "irradiance", at, normals, RANGE * expected


def clear_glass(rng):
    """Sunlight through a pane: both faces by Fresnel, with light that goes to and fro in it."""
    index, sun_at = (
        rng.uniform(1.4, 1.8),
        unit(rng.uniform(-1, 1, (1, 3)) * [1, 0, 1] - [0, 0.8, 0]),
    )
    pane = shapes.Rectangle(
        to_world=tf.translate([0, 2, 0]) @ tf.rotate([1, 0, 0], -90) @ tf.scale(50.0),
        material=materials.ThinDielectric(int_ior=index),
    )
    lamp = lights.Directional(direction=tuple(sun_at[0]), irradiance=Constant(1.0))
    cosine = -sun_at[0, 1]
    inside = math.sqrt(1.0 - (1.0 - cosine**2) / index**2)
    faces = [
        ((a * cosine - b * inside) / (a * cosine + b * inside)) ** 2
        for a, b in ((1.0, index), (index, 1.0))
    ]
    passed = np.mean([(1.0 - face) / (1.0 + face) for face in faces])
    at = rng.uniform(-1, 1, (CASES, 3))
    normals = facing(rng, at, at - 5.0 * sun_at, 1.2)
    expected = RANGE * passed * -(normals @ sun_at[0])
    return scene([pane], [lamp], 4), "irradiance", at, normals, expected


def lit_floor(rng, *screens):
    """A floor below the sun lights points of a wall: its radiance times its form factor."""
    half, share = rng.uniform(0.5, 2.0, 2), rng.uniform(0.2, 0.8)
    floor = shapes.Rectangle(
        to_world=tf.rotate([1, 0, 0], -90) @ tf.scale([*half, 1.0]),
        material=materials.Diffuse(reflectance=share),
    )
    lamp = lights.Directional(direction=(0.0, -1.0, 0.0), irradiance=Constant(1.0))
    at = np.column_stack([
        rng.uniform(-half[0], half[0], CASES), rng.uniform(0.2, 3.0, CASES),
        np.full(CASES, -half[1] - rng.uniform(0.0, 1.0)),
    ])  # fmt: skip
    normals = np.tile([0.0, 0.0, 1.0], (CASES, 1))
    return scene([floor, *screens], [lamp], 3), at, normals, half, share


def matt_floor(rng):
    lit, at, normals, half, share = lit_floor(rng)
    corners = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]) * [half[0], 1, half[1]]
    expected = RANGE * share / math.pi * polygon(corners, at, normals)
    return lit, "irradiance", at, normals, expected


def screened_floor(rng):
    """A black screen just above the floor covers it beyond z = 0."""
    dark = materials.Diffuse(reflectance=0.0)
    screen = shapes.Rectangle(
        to_world=tf.translate([0, 1e-3, 5]) @ tf.rotate([1, 0, 0], -90) @ tf.scale(5.0),
        material=dark,
    )
    lit, at, normals, half, share = lit_floor(rng, screen)
    corners = np.array([[-1, 0, 0], [1, 0, 0], [1, 0, -1], [-1, 0, -1]]) * [half[0], 1, half[1]]
    expected = RANGE * share / math.pi * polygon(corners, at, normals)
    return lit, "irradiance", at, normals, expected


def black_room(rng, hole):
    """A black room below and around points, with an opening, under an overcast sky.

    hole: the corners (4, 3) of the opening, as a function of the room's size (3,). Expected: the
    sky's radiance and both cosines over the opening, by quadrature.
    """
    size = rng.uniform([3, 2.5, 3], [6, 4, 6])
    corners = hole(size)
    sides = [(axis, side) for axis in range(3) for side in (0.0, 1.0)]
    parts = []
    for axis, side in sides:
        low, high = np.zeros(3), size.copy()
        low[axis] = high[axis] = side * size[axis]
        inside = (np.abs(corners[:, axis] - low[axis]) < 1e-9).all()
        parts += _around(low, high, axis, corners) if inside else [(low, high)]
    dark = materials.Diffuse(reflectance=0.0)
    boxes = [
        shapes.Cube(
            to_world=tf.translate((low + high) / 2) @ tf.scale(np.maximum((high - low) / 2, 1e-6)),
            material=dark,
        )
        for low, high in parts
    ]
    elevation = math.pi * (0.5 - np.arange(1024) / 1023.0)
    radiance = np.where(elevation >= 0.0, (1.0 + 2.0 * np.sin(elevation)) / 3.0, 0.0)
    image = np.broadcast_to(radiance[:, None, None], (1024, 8, 3)).astype(np.float32)
    at = rng.uniform([0.3, 0.0, 0.3], [0.7, 0.3, 0.7], (CASES, 3)) * size
    steps = (np.arange(400) + 0.5) / 400.0
    u, v = np.meshgrid(steps, steps)
    first, second = corners[1] - corners[0], corners[3] - corners[0]
    over = corners[0] + u[..., None] * first + v[..., None] * second
    area = np.cross(first, second) / steps.size**2
    away = over[None] - at[:, None, None]
    distance = np.linalg.norm(away, axis=-1)
    up = away[..., 1] / distance
    light = (1.0 + 2.0 * up) / 3.0 * up * np.abs(away @ area) / distance**3
    expected = UNIT_LUMINANCE * light.sum(axis=(1, 2))
    normals = np.tile([0.0, 1.0, 0.0], (CASES, 1))
    return scene(boxes, [lights.Envmap(image=image)]), "illuminance", at, normals, expected


def _around(low, high, axis, corners):
    """Return four boxes (low, high) of a wall around an opening."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    least, most = corners.min(axis=0), corners.max(axis=0)
    boxes = []
    for along, ends, other in (
        (a, (low[a], least[a]), None), (a, (most[a], high[a]), None),
        (b, (low[b], least[b]), (least[a], most[a])), (b, (most[b], high[b]), (least[a], most[a])),
    ):  # fmt: skip
        first, last = low.copy(), high.copy()
        first[along], last[along] = ends
        if other is not None:
            first[a], last[a] = other
        boxes.append((first, last))
    return boxes


def roof_opening(rng):
    share = rng.uniform(0.15, 0.35, 2)

    def hole(size):
        x, z = share * size[[0, 2]]
        middle = [size[0] / 2, size[1], size[2] / 2]
        return middle + np.array([[-x, 0, -z], [x, 0, -z], [x, 0, z], [-x, 0, z]])

    return black_room(rng, hole)


def facade_opening(rng):
    x, low, high = rng.uniform(0.2, 0.4), rng.uniform(0.35, 0.5), rng.uniform(0.7, 0.9)

    def hole(size):
        parts = [[0.5 - x, low, 0], [0.5 + x, low, 0], [0.5 + x, high, 0], [0.5 - x, high, 0]]
        return np.array(parts) * size

    return black_room(rng, hole)


KINDS = (
    rectangle, disc, sphere, luminaire, spot, sun, even_sky, overcast_sky,
    integrating_sphere, mirror, clear_glass, matt_floor, screened_floor, roof_opening,
    facade_opening,
)  # fmt: skip


@pytest.mark.parametrize("case", KINDS, ids=lambda case: case.__name__)
def test_cases(case):
    lit, quantity, at, normals, expected = case(np.random.default_rng(KINDS.index(case)))
    measured = measure(lit, quantity, at, normals, samples=8192)
    away = (measured.values - expected) / (measured.errors + MEASURED * np.abs(expected).max())
    assert np.abs(away).max() < 5.0 and (np.abs(away) > 3.0).sum() <= 1, (away, measured, expected)
    assert abs(away.mean()) < 1.4, (away, measured, expected)
    assert measured.relative_error < 0.05
