"""Lights: choice, sampling against pdf, irradiance against formulas, images against Mitsuba."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.stats import chi2

from clpt import transforms as T
from clpt.errors import SceneError
from clpt.geometry import triangles
from clpt.render.lights import encode as lights
from clpt.render.lights import images as image_lights
from clpt.render.lights.check import check_light
from clpt.render.lights.find import environment_of, is_whole
from clpt.render.lights.images import face_coordinates, face_directions
from clpt.render.records import lights as light_records
from clpt.scene.lights import (
    KINDS,
    Area,
    Constant,
    CubeMap,
    Directional,
    Envmap,
    Goniometric,
    Point,
    Projector,
    Sky,
    Spot,
)
from clpt.scene.shapes import Cube, Cylinder, Disk, Mesh, Rectangle, Sphere
from clpt.scene.textures import Bitmap, Checkerboard
from clpt.spectra import Constant as Even
from clpt.spectra import RGBIlluminant
from tests.kernels.light_probe import LAMBDAS, lit

SIGMAS = 4.5  # of the Monte Carlo estimates: a chance of 7e-6 each
TURNED = T.rotate([1, 2, 3], 50.0)
ABOVE = T.look_at([0.2, 0.4, 1.5], [0.1, 0, 0], [0, 1, 0])
SHINES = (0.3, -0.4, 0.5)  # where some light of every kind comes by default
PICTURE = Bitmap(image=np.random.default_rng(4).random((3, 4, 3)))
NAMES = {"rgb": "xyz", "spectral": "xyzw"}

SAMPLE = """
    vec2 u = {x[4], x[5]};
    Receiver both = {v3(0.0f, 0.0f, 0.0f)};
    LightSample s = light_sample(scene, v3(x[0], x[1], x[2]), both, x[3], u, lambdas);
    r[0] = s.wi.x; r[1] = s.wi.y; r[2] = s.wi.z; r[3] = s.t; r[4] = s.pdf;
    r[5] = s.radiance.x; r[6] = s.radiance.y; r[7] = s.radiance.z;
"""
INFINITE = """
    Spectrum s;
    real pdf;
    Receiver both = {v3(0.0f, 0.0f, 0.0f)};
    infinite_light(scene, 0, both.hemisphere, both, v3(x[0], x[1], x[2]), lambdas, &s, &pdf);
    r[0] = s.x; r[1] = s.y; r[2] = s.z; r[3] = pdf;
"""
PDF = """
    Receiver both = {v3(0.0f, 0.0f, 0.0f)};
    r[0] = light_pdf(scene, to_integer(x[0]), v3(x[1], x[2], x[3]), both,
                     v3(x[4], x[5], x[6]), x[7], v3(x[8], x[9], x[10]));
"""


SIDED = """
    vec2 u = {x[3], x[4]};
    Receiver side = {v3(x[0], x[1], x[2])};
    LightSample s = light_sample(scene, v3(0.0f, 0.0f, 0.0f), side, 0.0f, u, lambdas);
    Spectrum le;
    infinite_light(scene, 0, v3(0.0f, 0.0f, 0.0f), side, s.wi, lambdas, &le, r + 8);
    r[0] = s.wi.x; r[1] = s.wi.y; r[2] = s.wi.z; r[3] = s.pdf;
    r[4] = s.radiance.x; r[5] = s.radiance.y; r[6] = s.radiance.z; r[7] = le.x;
"""


def samples(scene, p, n: int, seed: int = 1, lanes: int = 8) -> np.ndarray:
    u = np.random.default_rng(seed).random((3, n))
    return scene(SAMPLE, np.vstack([np.tile(np.array(p)[:, None], n), u]), 8, lanes).astype(float)


def directions(n: int, seed: int) -> np.ndarray:
    d = np.random.default_rng(seed).normal(size=(3, n))
    return d / np.linalg.norm(d, axis=0)


def irradiance(scene, p, n=(0.0, 0.0, 1.0), count: int = 1 << 16, seed: int = 1):
    """Estimate (3,) of the irradiance at p with normal n, and its standard error."""
    r = samples(scene, p, count, seed)
    cos = np.maximum(np.array(n) @ r[:3], 0.0)
    pdf = np.where(r[4] < 0.0, 1.0, r[4])
    value = np.where(pdf > 0.0, r[5:8] * cos / np.where(pdf > 0.0, pdf, 1.0), 0.0)
    return value.mean(axis=1), value.std(axis=1) / np.sqrt(count)


def glows(cls, place=None, radiance=(1.0, 2.0, 3.0), **more):
    place = np.eye(4) if place is None else place
    return cls(to_world=place, emission=Area(radiance=radiance), **more)


def facing_down(height: float) -> np.ndarray:
    return T.translate([0, 0, height]) @ T.rotate([1, 0, 0], 180.0)


def polygon_irradiance(corners: np.ndarray, p, n) -> float:
    """Of a polygon of radiance 1, seen whole (Lambert; Arvo 1995 eq. 3.6)."""
    v = corners - p
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    total = 0.0
    for a, b in zip(v, np.roll(v, -1, axis=0), strict=True):
        edge = np.cross(a, b)
        total += np.arccos(np.clip(a @ b, -1, 1)) * (edge @ n) / np.linalg.norm(edge)
    return abs(total) / 2.0


# ---- irradiance


TILTED = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
TRIANGLE = np.array([[0.5, 0.2, 1.0], [-0.8, 0.9, 1.6], [0.1, -0.7, 1.2]])
PLATE = T.translate([0.2, 0.1, 1.4]) @ T.rotate([1, 1, 0], 170.0) @ T.scale([0.5, 0.8, 1.0])
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])

FORMULAS = {
    "disk": (glows(Disk, facing_down(1.5) @ T.scale(0.7)), np.pi * 0.49 / (0.49 + 2.25)),
    "sphere": (glows(Sphere, center=(0.0, 0.0, 2.0), radius=0.5), np.pi * 0.25 / 4.0),
    "inside": (glows(Sphere, radius=3.0, flip_normals=True), np.pi),
    "rectangle": (glows(Rectangle, PLATE), None),
    "triangle": (
        glows(Mesh, vertices=TRIANGLE.astype(np.float32), faces=np.array([[0, 2, 1]])),
        polygon_irradiance(TRIANGLE, np.zeros(3), np.array([0.0, 0.0, 1.0])),
    ),
    "tube": (
        glows(Cylinder, p0=(0, 0, -200.0), p1=(0, 0, 200.0), radius=2.0, flip_normals=True),
        np.pi,
    ),
}
FORMULAS["rectangle"] = (
    FORMULAS["rectangle"][0],
    polygon_irradiance(T.transform_points(PLATE, SQUARE), np.zeros(3), np.array([0.0, 0.0, 1.0])),
)


@pytest.mark.parametrize("name", FORMULAS)
def test_irradiance_of_shapes(name):
    """Radiance (1, 2, 3) through light_sample against the closed form, within SIGMAS."""
    shape, unit = FORMULAS[name]
    count = 1 << (20 if name == "tube" else 16)
    mean, error = irradiance(lit(emitters=[shape]), (0.0, 0.0, 0.0), count=count)
    expected = unit * np.array([1.0, 2.0, 3.0])
    assert (np.abs(mean - expected) < SIGMAS * error + 2e-4 * expected).all()
    assert (error < 0.05 * expected).all()


def test_a_front_that_faces_away_is_dark():
    above = T.translate([0, 0, 1.5])
    for cls in (Disk, Rectangle, Cube):
        scene = lit(emitters=[glows(cls, above @ T.scale(0.3))])
        back = samples(scene, (0.0, 0.0, 0.0), 2000)
        if cls is not Cube:
            assert (back[4] == 0.0).all() and (back[5:] == 0.0).all()
        else:
            assert (back[4] == 0.0).any() and (back[5:, back[4] == 0.0] == 0.0).all()


def test_lamps_follow_their_formulas():
    p, n = np.array([0.3, -0.2, 0.1]), TILTED
    at = np.array([1.0, 2.0, 3.0])
    to = at - p
    cos = to @ n / np.linalg.norm(to)
    cases = [
        (Point(position=at, intensity=(2.0, 4.0, 6.0)), 2.0 * cos / (to @ to)),
        (Point(position=at, intensity=(2.0, 4.0, 6.0), falloff=False), 2.0 * cos),
        (Directional(direction=-2.0 * to, irradiance=(2.0, 4.0, 6.0)), 2.0 * cos),
        (Constant(radiance=(2.0, 4.0, 6.0)), 2.0 * np.pi),
        (Envmap(image=np.tile(np.float32([2, 4, 6]), (4, 8, 1)), to_world=TURNED), 2.0 * np.pi),
        (CubeMap(image=np.tile(np.float32([2, 4, 6]), (6, 3, 3, 1))), 2.0 * np.pi),
    ]
    for lamp, first in cases:
        mean, error = irradiance(lit([lamp]), p, n)
        expected = first * np.array([1.0, 2.0, 3.0])
        assert (np.abs(mean - expected) < SIGMAS * error + 1e-5 * expected).all(), lamp.kind


def test_all_lights_together_are_their_sum():
    """The choice among all kinds of rows: every pmf counts once."""
    p, n = np.array(SHINES), TILTED
    lamps = [
        Point(position=(1.0, 2.0, 3.0), intensity=(3.0, 1.0, 2.0)),
        Spot(to_world=T.look_at([0, 1, 3], [0, 0, 0], [0, 1, 0]), intensity=(1.0, 5.0, 2.0)),
        Constant(radiance=(0.3, 0.2, 0.1)),
        Directional(direction=(0.1, 0.2, -1.0), irradiance=(0.5, 0.4, 1.0)),
        Spot(to_world=ABOVE, intensity=(2.0, 1.0, 3.0), cutoff=40.0, image=PICTURE),
        Projector(to_world=ABOVE, image=PICTURE, irradiance=3.0),
        Goniometric(to_world=ABOVE, image=PICTURE, intensity=(1.0, 2.0, 3.0)),
        Envmap(image=np.random.default_rng(1).random((5, 6, 3)), to_world=TURNED, scale=0.3),
        CubeMap(image=np.random.default_rng(2).random((6, 4, 4, 3)), scale=0.2),
        Sky(sun_azimuth=20.0),
    ]
    others = set(KINDS) - {type(lamp) for lamp in lamps}
    lamps += [cls() for cls in KINDS if cls in others and cls.reach != "surface"]
    glowing = [FORMULAS[k][0] for k in ("disk", "sphere", "rectangle", "triangle")]
    glowing += [glows(Cube, T.translate([2.0, 0.3, 1.0]) @ T.scale(0.4))]
    glowing += [glows(Cylinder, T.translate([-1.0, 2.0, 1.0]), radius=0.3)]
    alone = [lit([lamp]) for lamp in lamps] + [lit(emitters=[shape]) for shape in glowing]
    parts = [irradiance(scene, p, n, seed=i) for i, scene in enumerate(alone)]
    together = lit(lamps, glowing, radius=3.0)
    other_mode = {
        "spectral_envmap",
        "spectral_sky",
        "emissive_brick",
        "emissive_body",
    }  # and of media
    assert set(together.rows.kinds) == set(light_records.KINDS) - other_mode
    mean, error = irradiance(together, p, n, count=1 << 18, seed=77)
    expected = np.sum([m for m, _ in parts], axis=0)
    spread = np.sqrt(error**2 + np.sum([e**2 for _, e in parts], axis=0))
    assert (np.abs(mean - expected) < SIGMAS * spread + 1e-4 * expected).all()
    assert (spread < 0.02 * expected).all()


def test_a_goniometric_light_follows_its_image():
    """Against a bilinear look-up in float64; an image above 1 keeps its values."""
    image = np.random.default_rng(8).random((4, 6, 3)).astype(np.float32) * 5.0
    place = T.translate([0.5, -0.2, 0.3]) @ TURNED
    scene = lit([Goniometric(to_world=place, image=Bitmap(image=image), intensity=(1.0, 2.0, 3.0))])
    d = directions(400, 3)
    p = place[:3, 3:] + 2.0 * d
    found = scene(SAMPLE, np.vstack([p, np.zeros((3, 400))]), 8)
    x, y, z = TURNED[:3, :3].T @ d
    column = (np.arctan2(x, -z) / (2.0 * np.pi) % 1.0) * 6 - 0.5
    row = np.clip(np.arccos(y) / np.pi * 4 - 0.5, 0.0, 3.0)
    i, j = np.floor(column).astype(int), np.minimum(np.floor(row).astype(int), 2)
    a, b = (column - i)[:, None], (row - j)[:, None]
    rows = [image[j + k, i % 6] * (1 - a) + image[j + k, (i + 1) % 6] * a for k in (0, 1)]
    expected = (rows[0] * (1 - b) + rows[1] * b) * [1.0, 2.0, 3.0] / 4.0
    assert (row == 0.0).any() and (row == 3.0).any()  # around both poles
    np.testing.assert_allclose(found[5:].T, expected, rtol=2e-3, atol=1e-4)
    assert (found[4] == -1.0).all() and np.allclose(found[3], 2.0, atol=1e-5)


def test_two_sided_emission():
    """Above a plate and below it there is the same light; a tube is lit inside."""
    plate = T.scale([0.5, 0.8, 1.0])
    for cls, more in ((Rectangle, {}), (Disk, {}), (Cylinder, {"radius": 0.7})):
        emission = Area(radiance=(1.0, 2.0, 3.0), two_sided=True)
        one = cls(to_world=np.eye(4) if more else plate, emission=emission, **more)
        scene = lit(emitters=[one])
        assert scene.rows.features().two_sided
        front = dataclasses.replace(one, emission=Area(radiance=(1.0, 2.0, 3.0)))
        back = dataclasses.replace(front, flip_normals=True)
        for p in ((0.1, 0.2, 1.2), (0.1, 0.2, -0.2)):
            n = np.array([0.3, 0.2, -1.0 if p[2] > 0.0 else 1.0]) / np.sqrt(1.13)
            both, error = irradiance(scene, p, n)
            parts = [irradiance(lit(emitters=[s]), p, n, seed=5) for s in (front, back)]
            spread = np.sqrt(error**2 + sum(e**2 for _, e in parts))
            assert (np.abs(both - parts[0][0] - parts[1][0]) < SIGMAS * spread + 1e-6).all()
            assert both[0] > 0.0


# ---- pdf


def skies(seed: int = 3):
    """Images of strong contrast, black in places, of odd sizes."""
    rng = np.random.default_rng(seed)
    wide, faces = rng.random((6, 9, 3)) ** 6, rng.random((6, 5, 5, 3)) ** 6
    wide[2:4, 3:6], faces[1, :3] = 0.0, 0.0
    wide[1, 8], faces[4, 2, 2] = 40.0, 40.0
    return {
        "constant": Constant(radiance=2.0),
        "envmap": Envmap(image=wide, to_world=TURNED),
        "cube_map": CubeMap(image=faces, to_world=TURNED @ T.scale([-1, 1, 1])),
        "one_row": Envmap(image=wide[:1]),
        "sky": Sky(
            sun_elevation=6.0, sun_azimuth=70.0, altitude=3000.0, sun_scale=0.0, to_world=TURNED
        ),
        **{
            f"default {kind}": cls()
            for kind, cls in light_records.DECLARED.items()
            if cls.reach == "infinite" and cls is not Constant
        },
    }


@pytest.mark.parametrize("kind", light_records.DECLARED)
def test_samples_of_declared_lights(kind):
    """Unit directions, and finite light that is there or not."""
    lamp = light_records.DECLARED[kind]()
    r = samples(lit([lamp]), SHINES, 512)
    shines = r[4] != 0.0
    assert np.isfinite(r).all() and (r[3] > 0.0).all() and (r[5:] >= 0.0).all() and shines.any()
    np.testing.assert_allclose(np.linalg.norm(r[:3], axis=0), 1.0, atol=1e-5)
    if lamp.reach == "infinite":
        assert (r[4] > 0.0).all()


@pytest.mark.parametrize("name", skies())
def test_samples_follow_the_pdf(name):
    """Chi-square at 2.5e-4 each, so 1e-3 for the four; the pdf integrates to 1."""
    scene, n, bins, fine = lit([skies()[name]]), 100_000, (24, 48), 16
    r = samples(scene, (0.0, 0.0, 0.0), n)
    counts = np.histogram2d(
        r[2], np.arctan2(r[1], r[0]), bins=bins, range=[(-1, 1), (-np.pi, np.pi)]
    )[0]
    z = -1.0 + 2.0 * (np.arange(bins[0] * fine) + 0.5) / (bins[0] * fine)
    phi = -np.pi + 2.0 * np.pi * (np.arange(bins[1] * fine) + 0.5) / (bins[1] * fine)
    z, phi = (g.ravel() for g in np.meshgrid(z, phi, indexing="ij"))
    s = np.sqrt(1.0 - z * z)
    density = scene(INFINITE, np.stack([s * np.cos(phi), s * np.sin(phi), z]), 4)[3].astype(float)
    blocks = density.reshape(bins[0], fine, bins[1], fine).sum(axis=(1, 3))
    expected = n * blocks * 4.0 * np.pi / density.size
    assert expected.sum() == pytest.approx(n, rel=3e-3)
    full = expected > 8.0
    rest = expected[~full].sum()
    statistic = ((counts - expected)[full] ** 2 / expected[full]).sum()
    statistic += (counts[~full].sum() - rest) ** 2 / max(rest, 8.0)
    assert chi2.sf(statistic, full.sum()) > 2.5e-4
    # Radiance and pdf of a sample are those of its direction.
    again = scene(INFINITE, r[:3], 4)
    np.testing.assert_allclose(again[3], r[4], rtol=3e-3, atol=1e-4 * r[4].max())
    np.testing.assert_allclose(again[:3], r[5:], rtol=3e-3, atol=1e-4 * r[5:].max())


def test_black_and_even_images():
    """Nothing is not a number; what is even is chosen evenly."""
    looked = directions(64, 3)
    looked = looked[:, np.abs(looked[1]) < 0.95]
    for radiance in (0.0, 1.0):
        scene = lit([Envmap(image=np.full((32, 64, 3), radiance))])
        found = scene(INFINITE, looked, 4)
        r = samples(scene, (0.0, 0.0, 0.0), 200)
        assert np.isfinite(found).all() and np.isfinite(r).all()
        np.testing.assert_allclose(found[:3], radiance, rtol=1e-5)
        np.testing.assert_allclose(r[5:], radiance, rtol=1e-5)
        if radiance:
            np.testing.assert_allclose(found[3], 0.25 / np.pi, rtol=0.01)


@pytest.mark.parametrize("name", ["envmap", "cube_map"])
def test_images_are_chosen_by_what_they_send(name):
    """The estimate of the whole sphere's mean hardly varies: radiance over pdf is nearly even."""
    rng, cls = np.random.default_rng(6), {"envmap": Envmap, "cube_map": CubeMap}[name]
    size = {"envmap": (24, 40, 1), "cube_map": (6, 16, 16, 1)}[name]
    lamp = cls(image=np.repeat(rng.random(size) ** 8, 3, axis=-1), to_world=TURNED)
    scene = lit([lamp])
    r = samples(scene, (0.0, 0.0, 0.0), 50_000)
    value = r[5] / r[4]
    assert (r[4] > 0.0).all()
    assert value.std() < 0.1 * value.mean()
    mean = environment_of(lamp, scene.encoder.look).strength
    assert value.mean() == pytest.approx(4.0 * np.pi * mean, rel=0.02)


@pytest.mark.parametrize("name", ["disk", "sphere", "rectangle", "triangle"])
def test_light_pdf_is_that_of_the_sample(name):
    """What a ray that meets an emissive shape is told, the chance of the choice included."""
    lamps = [Constant(), Point()]
    scene = lit(lamps, [FORMULAS[name][0], FORMULAS["rectangle"][0]])
    row = scene.rows.sources.first[0]
    pmf = scene.rows.rows["pmf"][row]
    assert 0.0 < pmf < 1.0 and scene.rows.sources.infinite == 1
    alone = lit(emitters=[FORMULAS[name][0]])
    r = samples(alone, (0.0, 0.0, 0.0), 500)
    kind = FORMULAS[name][0].kind
    if kind == "sphere":
        n = (r[:3] * r[3] - np.array([[0], [0], [2.0]])) / 0.5
    else:
        flat = TRIANGLE if kind == "mesh" else T.transform_points(
            FORMULAS[name][0].to_world, SQUARE[:3]
        )  # fmt: skip
        normal = np.cross(flat[1] - flat[0], flat[2] - flat[0])
        n = np.tile((normal / np.linalg.norm(normal))[:, None], 500)
    given = np.vstack([np.full(500, row), np.zeros((3, 500)), r[:4], n])
    np.testing.assert_allclose(scene(PDF, given, 1)[0], r[4] * pmf, rtol=2e-3)


def test_a_lamp_beside_a_disk_has_no_density_of_it() -> None:
    """Idle lanes ask for the density of row 0, whose parameters are in another table."""
    scene = lit([Point(position=(0, 0, 2))], [glows(Disk, facing_down(1.5))])
    given = np.tile([[0], [0], [0], [0], [0], [0], [1], [1.5], [0], [0], [-1]], 16).astype(float)
    given[0, ::2] = 1
    densities = scene(PDF, given, 1)[0]
    assert (densities[::2] > 0.0).all()
    np.testing.assert_array_equal(densities[1::2], 0.0)


def test_the_sky_over_a_side_is_sampled_by_the_cosine():
    """Radiance times cosine over pdf is the same everywhere: its irradiance without any noise."""
    side, rng = directions(400, 8), np.random.default_rng(9)
    r = lit([Constant(radiance=(1.0, 2.0, 3.0))])(SIDED, np.vstack([side, rng.random((2, 400))]), 9)
    cos = (side * r[:3]).sum(axis=0)
    assert (cos > -1e-6).all()
    seen = cos > 1e-3
    expected = np.pi * np.array([[1.0], [2.0], [3.0]])
    np.testing.assert_allclose(
        (r[4:7] * cos / r[3])[:, seen], np.tile(expected, seen.sum()), rtol=2e-3
    )
    np.testing.assert_allclose(r[8], r[3], rtol=1e-6)  # what a ray that meets it is told
    np.testing.assert_allclose(r[7], r[4])


@pytest.mark.parametrize(
    "kind", [kind for kind, cls in light_records.DECLARED.items() if cls.reach == "infinite"]
)
def test_a_hemisphere_of_declared_lights(kind):
    """Over a side the pdf is that of the samples: the mean of cosine over pdf is pi."""
    side, n = directions(1, 8), 20_000
    given = np.vstack([np.tile(side, n), np.random.default_rng(9).random((2, n))])
    r = lit([light_records.DECLARED[kind]()])(SIDED, given, 9).astype(float)
    np.testing.assert_allclose(r[8], r[3], rtol=1e-5)  # what a ray that meets it is told
    value = np.maximum((side * r[:3]).sum(axis=0), 0.0) / r[3]
    assert abs(value.mean() - np.pi) < SIGMAS * value.std() / np.sqrt(n) + 1e-3


# ---- images


@pytest.mark.parametrize("size", [(16, 32), (2, 3), (40, 70)], ids=str)
@pytest.mark.parametrize("kind", ["envmap", "cube_map"])
def test_a_hemisphere_of_images(kind, size):
    """With a normal: the same irradiance as without, of less spread; the pdf that a ray is told."""
    rng = np.random.default_rng(7)
    if kind == "envmap":
        image = 0.1 + rng.random((*size, 3)) ** 8 * 40.0
        scene = lit([Envmap(image=image, to_world=TURNED)])
    else:
        faces = 0.1 + rng.random((6, size[0], size[0], 3)) ** 8 * 40.0
        scene = lit([CubeMap(image=faces, to_world=TURNED)])
    n, below, spread = 1 << 15, 0.0, 0.0
    for side in directions(5, 3).T[..., None]:
        found = []
        for told in (side, 0.0 * side):
            given = np.vstack([np.tile(told, n), rng.random((2, n))])
            r = scene(SIDED, given, 9).astype(float)
            # what a ray that meets it is told, but for roundings at poles and edges of blocks
            assert (np.abs(r[8] - r[3]) > 3e-4 * r[3]).mean() < 1e-3
            cosine = (side * r[:3]).sum(axis=0)
            value = np.where(r[3] > 0.0, r[4] * np.maximum(cosine, 0.0) / r[3], 0.0)
            found.append((value.mean(), value.std() / np.sqrt(n), (cosine < 0.0).mean()))
        (ours, error, under), (theirs, other, _) = found
        assert abs(ours - theirs) < SIGMAS * np.hypot(error, other)
        below, spread = below + under / 5, spread + error / other / 5
    assert spread < (0.9 if size[0] > 2 else 1.05)
    assert below < (0.15 if size[0] > 2 else 0.5)


def test_mis_compensation_leaves_the_dull_part_to_materials():
    """Light alone still gives the same irradiance; without a normal nothing changes."""
    image = np.ones((16, 32, 3), np.float32)
    image[3:5, 5:8] = 60.0  # in the direction that `side` faces
    n, random = 1 << 15, np.random.default_rng(9)
    side = image_lights.sphere_directions(32, 0.25, 0.2)[:, None]
    given = np.vstack([np.tile(side, n), random.random((2, n))])
    every = np.vstack([np.zeros((3, n)), given[3:]])
    results, bright = [], []
    for compensated in (False, True):
        scene = lit([Envmap(image=image, mis_compensation=compensated)])
        r = scene(SIDED, given, 9).astype(float)
        assert (r[3] > 0.0).all()
        assert (np.abs(r[8] - r[3]) > 3e-4 * r[3]).mean() < 1e-3
        value = r[4] * np.maximum((side * r[:3]).sum(axis=0), 0.0) / r[3]
        results.append((value.mean(), value.std() / np.sqrt(n), scene(SIDED, every, 9)))
        bright.append((r[4] > 2.0).mean())
    (plain, error, same), (ours, other, equal) = results
    assert abs(ours - plain) < SIGMAS * np.hypot(error, other)
    assert bright[1] > bright[0]
    np.testing.assert_array_equal(same, equal)


@pytest.mark.peers
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_envmap_is_mitsuba_s(mode):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant(f"scalar_{mode}")
    image = 0.02 + np.random.default_rng(5).random((7, 11, 3)).astype(np.float32) ** 3
    if mode == "spectral":  # a grey is the same spectrum whatever the table of the uplift
        image = np.repeat(image[..., :1], 3, axis=2)
    theirs = mi.load_dict(
        {"type": "envmap", "bitmap": mi.Bitmap(image), "to_world": mi.ScalarTransform4f(TURNED)}
    )
    d = directions(300, 8)
    ours = lit([Envmap(image=image, to_world=TURNED)], mode=mode)(INFINITE, d, 4)[:3]
    si = mi.SurfaceInteraction3f()
    if mode == "spectral":
        si.wavelengths = list(LAMBDAS)
    for i in range(d.shape[1]):
        si.wi = (-d[:, i]).tolist()
        expected = np.array(theirs.eval(si)).ravel()[:3]
        np.testing.assert_allclose(ours[:, i], expected, rtol=2e-3, atol=1e-5)


@pytest.mark.parametrize(
    ("edge", "fall"), [("smooth", lambda x: x * x * (3.0 - 2.0 * x)), ("quartic", lambda x: x**4)]
)
def test_a_spot_s_edge_by_its_cosine(edge, fall):
    """pbrt-v4's cubic and pbrt-v3's power: one at the beam's edge, zero at the cone's."""
    place = T.look_at([1, 2, 3], [0.1, 0.2, 0], [0, 1, 0])
    given = {"cutoff": 25.0, "beam_width": 12.0, "edge": edge}
    scene = lit([Spot(to_world=place, intensity=(1.0, 2.0, 3.0), **given)])
    p = np.random.default_rng(4).normal(size=(3, 300)) * [[1.2], [1.2], [0.1]]
    ours = scene(SAMPLE, np.vstack([p, np.zeros((3, 300))]), 8)
    away = p - place[:3, 3:]
    distance = np.linalg.norm(away, axis=0)
    end, full = np.cos(np.radians([25.0, 12.0]))
    x = np.clip((place[:3, 2] @ away / distance - end) / (full - end), 0.0, 1.0)
    wanted = fall(x) / distance**2
    np.testing.assert_allclose(ours[5], wanted, rtol=1e-3, atol=1e-6)
    assert ((x > 0.0) & (x < 1.0)).sum() > 30


@pytest.mark.peers
def test_spot_is_mitsuba_s():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    place = T.look_at([1, 2, 3], [0.1, 0.2, 0], [0, 1, 0])
    theirs = mi.load_dict({
        "type": "spot", "to_world": mi.ScalarTransform4f(place), "cutoff_angle": 25.0,
        "beam_width": 12.0, "intensity": {"type": "rgb", "value": [1.0, 2.0, 3.0]},
    })  # fmt: skip
    scene = lit([Spot(to_world=place, intensity=(1.0, 2.0, 3.0), cutoff=25.0, beam_width=12.0)])
    p = np.random.default_rng(4).normal(size=(3, 300)) * [[1.2], [1.2], [0.1]]
    ours = scene(SAMPLE, np.vstack([p, np.zeros((3, 300))]), 8)
    for i in range(300):
        it = mi.SurfaceInteraction3f()
        it.p = p[:, i].tolist()
        sample, weight = theirs.sample_direction(it, [0.5, 0.5])
        np.testing.assert_allclose(ours[5:, i], np.array(weight).ravel(), rtol=1e-3, atol=1e-6)
        np.testing.assert_allclose(ours[:3, i], np.array(sample.d).ravel(), atol=1e-5)
    assert 50 < (ours[5] > 0.0).sum() < 290


@pytest.mark.peers
@pytest.mark.parametrize(
    ("kind", "mode"), [("projector", "rgb"), ("projector", "spectral"), ("spot", "rgb")]
)
def test_lights_that_throw_an_image_are_mitsuba_s(kind, mode):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant(f"scalar_{mode}")
    image = 0.1 + 0.9 * np.random.default_rng(7).random((3, 5, 3)).astype(np.float32)
    if mode == "spectral":  # as above
        image = np.repeat(image[..., :1], 3, axis=2)
    place = T.look_at([1, 2, 3], [0.1, 0.2, 0], [0, 1, 0])
    picture = {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": mode == "rgb"}
    if kind == "projector":
        given = {"fov": 40.0, "scale": 2.0, "irradiance": picture}
        # In spectral mode Mitsuba does not take an image as a multiple of D65.
        value = Even(2.0 * np.pi) if mode == "spectral" else [2.0 * np.pi] * 3
        ours = Projector(to_world=place, image=Bitmap(image=image), irradiance=value, fov=40.0)
    else:
        upright = Bitmap(image=image[::-1])
        given = {"cutoff_angle": 25.0, "beam_width": 12.0, "texture": picture}
        even = {"intensity": (1.0, 1.0, 1.0), "image": upright}
        ours = Spot(to_world=place, cutoff=25.0, beam_width=12.0, **even)
    theirs = mi.load_dict({"type": kind, "to_world": mi.ScalarTransform4f(place), **given})
    p = np.random.default_rng(4).normal(size=(3, 300)) * [[1.2], [1.2], [0.1]]
    found = lit([ours], mode=mode)(SAMPLE, np.vstack([p, np.zeros((3, 300))]), 8)
    lit_points = 0
    for i in range(300):
        it = mi.SurfaceInteraction3f()
        it.p = p[:, i].tolist()
        if mode == "spectral":
            it.wavelengths = list(LAMBDAS)
        sample, weight = theirs.sample_direction(it, [0.5, 0.5])
        expected = np.array(weight).ravel()[:3] * (sample.pdf > 0.0)
        shone = found[5:, i] * (found[4, i] != 0.0)
        np.testing.assert_allclose(shone, expected, rtol=3e-3, atol=1e-5)
        lit_points += expected[0] > 0.0
    assert 40 < lit_points < 290


def sky_colour(d: np.ndarray) -> np.ndarray:
    """A smooth function of unit directions (..., 3)."""
    return 1.0 + 0.5 * d + 0.3 * d[..., ::-1] * d


def test_cube_map_shows_the_directions_of_its_faces():
    """Faces painted by a function of the direction give that function back, across all seams."""
    n = 64
    at = (np.arange(n) + 0.5) / n * 2.0 - 1.0
    d = face_directions(at[None, :], at[:, None])
    faces = sky_colour(d / np.linalg.norm(d, axis=-1, keepdims=True)).astype(np.float32)
    cross = np.zeros((3 * n, 4 * n, 3), np.float32)
    tall = np.zeros((4 * n, 3 * n, 3), np.float32)
    # +y above, -y below, and -x +z +x -z from left to right; upright, -z hangs below -y
    for i, (row, column) in enumerate([(1, 2), (1, 0), (0, 1), (2, 1), (1, 1), (1, 3)]):
        cross[row * n : row * n + n, column * n : column * n + n] = faces[i]
    for i, (row, column) in enumerate([(1, 2), (1, 0), (0, 1), (2, 1), (1, 1), (3, 1)]):
        tall[row * n : row * n + n, column * n : column * n + n] = (
            faces[5][::-1, ::-1] if i == 5 else faces[i]
        )
    looked = directions(4000, 2)
    expected = sky_colour(looked.T).T
    for image in (faces, list(faces), cross, tall):
        found = lit([CubeMap(image=image)])(INFINITE, looked, 4)[:3]
        assert np.abs(found - expected).max() < 0.02
    # The cross hangs together: a face's edge continues on its neighbour.
    assert np.abs(np.diff(cross[n : 2 * n], axis=1)).max() < 0.06
    assert np.abs(np.diff(cross[:, n : 2 * n], axis=0)).max() < 0.06
    assert np.abs(np.diff(tall[:, n : 2 * n], axis=0)).max() < 0.06


def test_faces_and_directions_are_inverse():
    rng = np.random.default_rng(9)
    a, b = rng.uniform(-0.99, 0.99, (2, 50))
    face, a2, b2 = face_coordinates(face_directions(a, b))
    assert (face == np.arange(6)[:, None]).all()
    np.testing.assert_allclose(a2, np.tile(a, (6, 1)))
    np.testing.assert_allclose(b2, np.tile(b, (6, 1)))


@pytest.mark.slow
@pytest.mark.parametrize("mode", NAMES)
def test_lanes_agree(mode):
    scene = lit(list(skies().values()), [FORMULAS["sphere"][0], FORMULAS["triangle"][0]], mode)
    one, wide = (samples(scene, (0.1, 0.2, 0.0), 500, lanes=k) for k in (1, 16))
    np.testing.assert_allclose(one, wide, rtol=2e-4, atol=1e-4)


def test_spectral_lights_have_their_spectrum():
    scene = lit([Constant(radiance=(0.2, 0.5, 1.5))], mode="spectral")
    expected = RGBIlluminant(0.2, 0.5, 1.5).sample(LAMBDAS)[:3]
    found = scene(INFINITE, directions(16, 1), 4)[:3]
    np.testing.assert_allclose(found, np.tile(expected[:, None], 16), rtol=2e-3)


# ---- rows


def test_alias_table_is_exact():
    weights = np.array([0.0, 5.0, 1e-3, 2.0, 0.5, 0.0, 11.0])
    pmf, keep, alias = lights.alias_table(weights)
    chance = keep.astype(float) / len(keep)
    np.add.at(chance, alias, (1.0 - keep.astype(float)) / len(keep))
    np.testing.assert_allclose(pmf, weights / weights.sum(), rtol=1e-6)
    np.testing.assert_allclose(chance, pmf, atol=1e-7)
    assert keep[0] == keep[5] == 0.0
    one = lights.alias_table([3.0])
    assert [v.tolist() for v in one] == [[1.0], [1.0], [0]]


def test_rows_are_infinite_lights_then_lamps_then_shapes():
    shapes_ = [glows(Cube, radiance=2.0), FORMULAS["disk"][0]]
    scene = lit([Point(), Constant(), Directional()], shapes_)
    rows = scene.rows
    kinds = [light_records.KINDS[k] for k in rows.rows["kind"]]
    assert kinds == ["constant", "point", "directional", *["triangle"] * 12, "disk"]
    assert rows.sources.infinite == 1 and rows.sources.first == (3, 15)
    assert [is_whole(shape) for shape in shapes_] == [False, True]
    pmf = rows.rows["pmf"].astype(float)
    assert pmf.sum() == pytest.approx(1.0) and pmf[0] == pytest.approx(0.5)
    assert pmf[3] == pytest.approx(pmf[14])
    cube, disk = 24.0 * 2.0, np.pi * 0.49 * 2.0
    assert pmf[3:15].sum() / pmf[15] == pytest.approx(cube / disk, rel=0.06)  # 2 is not quite D65


def test_lights_that_send_nothing_may_be_chosen_evenly():
    rows = lit([Point(intensity=0.0), Constant(radiance=0.0)]).rows.rows
    np.testing.assert_allclose(rows["pmf"], 0.5)


def test_uv_on_a_mesh():
    """A light on a triangle is looked up at the mesh's uv, not at the barycentrics."""
    uvs = np.array([[0.1, 0.9], [0.4, 0.2], [0.8, 0.7], [0.3, 0.5]], np.float32)
    vertices = np.array([[0, 0, 2], [0, 1, 2], [1, 0, 2], [1, 1, 2]], np.float32)
    mesh = glows(Mesh, vertices=vertices, faces=np.array([[0, 1, 2], [1, 3, 2]]), uvs=uvs)
    scene = lit(emitters=[FORMULAS["triangle"][0], mesh])
    first = scene.rows.sources.first[1]
    body = """
        ShapeRow shape = shape_row_row(scene.shapes, (integer)(SHAPE_ROW_WORDS));
        vec2 b = {x[1], x[2]};
        vec2 uv = area_triangle_point(scene, shape, to_integer(x[0]), b).uv;
        r[0] = uv.x; r[1] = uv.y;
    """
    given = np.array([[first, first + 1], [0.25, 0.5], [0.125, 0.25]])
    _, faces, _, _ = triangles.triangulate(mesh)
    weights = np.stack([1.0 - given[1] - given[2], given[1], given[2]], axis=1)
    expected = [w @ uvs[f] for w, f in zip(weights, faces, strict=True)]
    np.testing.assert_allclose(scene(body, given, 2).T, expected, atol=1e-6)


def test_brightness_of_a_texture_is_its_mean():
    from clpt.render.spectra.find import Look

    board = Checkerboard(color0=(1.0, 1.0, 1.0), color1=(0.0, 0.5, 1.0))
    assert board.mean(Look(False, 360.0, 830.0)) == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("lamp", "words"),
    [
        (Spot(to_world=np.zeros((4, 4))), "spot.to_world"),
        (Area(), "emission"),
        (Envmap(), "an image is needed"),
        (Envmap(image=np.zeros((0, 4, 3))), "not empty"),
        (Envmap(image=np.full((2, 2, 3), np.inf)), "not finite"),
        (Envmap(image=np.ones((2, 2, 3)), to_world=T.scale([1, 1, 0])), "invertible"),
        (Envmap(image="there_is_no_such_file.exr"), "there_is_no_such_file"),
        (CubeMap(image=np.ones((4, 4, 3))), "cross"),
        (CubeMap(image=[np.ones((4, 4, 3))] * 5), "six faces"),
        (CubeMap(image=[np.ones((4, 5, 3))] * 6), "squares"),
    ],
)
def test_bad_lights_are_named(lamp, words):
    with pytest.raises(SceneError) as caught:
        check_light(lamp)
        lit([lamp])
    assert words in str(caught.value)
