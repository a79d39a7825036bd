"""Light at the texels of a shape, against formulas at the points below them."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner

import clpt
from clpt import images
from clpt import transforms as tf
from clpt.cli.measure import measure as command
from clpt.errors import SceneError
from clpt.instruments import bake, texels
from clpt.scene import Film, Scene, cameras, lights, materials, shapes, textures
from clpt.scene.integrators import Path
from clpt.spectra import Constant

LAMP = np.array([0.4, 1.5, -0.3])
RANGE = 470.0  # nm, of a film
BLACK = materials.Diffuse(reflectance=0.0)
LEVEL = tf.rotate([1, 0, 0], -90) @ tf.scale([1.0, 0.7, 1.0])  # its v grows along -z


def scene(*parts: shapes.Shape) -> Scene:
    lamp = lights.Point(position=tuple(LAMP), intensity=Constant(1.0))
    return Scene(
        camera=cameras.Perspective(), shapes=list(parts), lights=[lamp],
        integrator=Path(max_depth=2), film=Film(size=(8, 8)),
    )  # fmt: skip


def floor(**kind) -> shapes.Rectangle:
    return shapes.Rectangle(to_world=LEVEL, name="floor", **{"material": BLACK, **kind})


def by_formula(points, normals) -> np.ndarray:
    """I cos / r^2 of the lamp."""
    away = LAMP - points
    return RANGE * np.maximum((away * normals).sum(-1), 0.0) / (away**2).sum(-1) ** 1.5


def middles(width: int, height: int) -> np.ndarray:
    """Points (h, w, 3) of the floor below the middles of texels, the top row at the largest v."""
    u, v = (np.arange(width) + 0.5) / width, 1.0 - (np.arange(height) + 0.5) / height
    x, y = np.meshgrid(2.0 * u - 1.0, 2.0 * v - 1.0)
    return tf.transform_points(LEVEL, np.stack([x, y, 0.0 * x], axis=-1))


def test_a_floor_below_a_lamp():
    """The hemisphere counts the cosine, the sphere does not."""
    at = middles(12, 7)
    flat = bake(scene(floor()), "floor", "irradiance", (12, 7), samples=64)
    np.testing.assert_allclose(flat.values, by_formula(at, [0.0, 1.0, 0.0]), rtol=4e-3)
    round_ = bake(scene(floor()), "floor", "scalar_irradiance", (12, 7), samples=8192)
    expected = RANGE / ((LAMP - at) ** 2).sum(-1)
    away = (round_.values - expected) / (round_.errors + 1e-3 * expected)
    assert np.abs(away).max() < 5.0 and np.abs(away.mean()) < 0.6


def test_a_map_is_a_texture_of_its_shape():
    """As the emission of the floor it shows at each point what a lamp brings there."""
    baked = bake(scene(floor()), "floor", "irradiance", (64, 64), samples=16)
    picture = np.repeat(baked.values[:, :, None] / RANGE, 3, axis=2).astype(np.float32)
    glow = lights.Area(radiance=textures.Bitmap(image=picture, raw=True))
    at = np.array([[-0.8, 0.0, 0.5], [0.8, 0.0, -0.5], [0.3, 0.0, 0.6], [0.4, 0.0, -0.3]])
    shown = scene(floor(emission=glow))
    shown.lights = []
    shown.camera = cameras.Rays(origins=at + np.eye(3)[1], directions=[[0, -1, 0]] * 4)
    shown.film = Film(size=(4, 1), mode="rgb")
    seen = clpt.render(shown, spp=4)[0, :, 1]
    np.testing.assert_allclose(seen, by_formula(at, [0.0, 1.0, 0.0]) / RANGE, rtol=0.01)


def test_charts_of_a_mesh():
    """Texels lie on their triangle, with its normals; between charts is nothing."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 0, -1], [0, 1, -1]], np.float32)
    chart = [[0.05, 0.05], [0.45, 0.05], [0.05, 0.85], [0.6, 0.1], [0.95, 0.1], [0.6, 0.9]]
    mesh = shapes.Mesh(
        vertices=corners[[0, 1, 2, 0, 2, 3]], faces=[[0, 1, 2], [3, 4, 5]],
        uvs=np.array(chart, np.float32), name="two", material=BLACK,
    )  # fmt: skip
    at = texels(scene(mesh), "two", (40, 20))
    assert at.covered.sum() == len(at.points) == pytest.approx(800 * (0.16 + 0.14), rel=0.05)
    columns = np.nonzero(at.covered)[1]
    flat = columns < 20
    np.testing.assert_allclose(at.points[flat][:, 1], 0.0, atol=1e-7)
    np.testing.assert_allclose(at.points[~flat][:, 0], 0.0, atol=1e-7)
    np.testing.assert_allclose(at.normals[flat], [[0, 1, 0]] * flat.sum(), atol=1e-6)
    row, column = (index[~flat] for index in np.nonzero(at.covered))
    u, v = (column[:, None] + 0.5) / 40, 1.0 - (row[:, None] + 0.5) / 20
    expected = (u - 0.6) / 0.35 * corners[2] + (v - 0.1) / 0.8 * corners[3]
    np.testing.assert_allclose(at.points[~flat], expected, atol=1e-6)
    values = at.points[:, 0] + 2.0
    grown = at.picture(values, padding=1)
    np.testing.assert_array_equal(grown[at.covered], values)
    assert np.isnan(at.picture(values, padding=0)).sum() == 800 - len(values)
    ring = ~at.covered & np.isfinite(grown)
    assert 40 < ring.sum() < 140 and grown[ring].min() >= 2.0 and grown[ring].max() <= 3.0


def test_normals_of_vertices_count():
    normals = np.array([[0.6, 0.8, 0], [0, 1, 0], [0, 1, 0]], np.float32)
    mesh = shapes.Mesh(
        vertices=np.array([[-1, 0, 1], [1, 0, 1], [-1, 0, -1]], np.float32), faces=[[0, 1, 2]],
        uvs=np.array([[0, 0], [1, 0], [0, 1]], np.float32), normals=normals, name="bent",
        material=BLACK,
    )  # fmt: skip
    at = texels(scene(mesh), "bent", (9, 9))
    measured = bake(scene(mesh), "bent", size=(9, 9), samples=64, padding=0)
    np.testing.assert_allclose(
        measured.values[at.covered], by_formula(at.points, at.normals), rtol=6e-3
    )
    assert at.normals[:, 0].max() > 0.4


def test_texels_of_several_triangles_are_told(caplog):
    square = np.array([[0, 0], [1, 0], [0, 1]], np.float32)
    mesh = shapes.Mesh(
        vertices=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32),
        faces=[[0, 1, 2], [0, 1, 2]], uvs=square, name="twice",
    )  # fmt: skip
    texels(scene(mesh), "twice", (4, 4))
    assert "texels belong to several triangles" in caplog.text


@pytest.mark.parametrize(
    ("part", "what", "words"),
    [
        (floor(), {"name": "wall"}, "no shapes have the name 'wall'; names are: floor"),
        (shapes.Sphere(name="floor"), {}, "a sphere has no uvs"),
        (
            shapes.Mesh(vertices=np.eye(3, dtype=np.float32), faces=[[0, 1, 2]], name="floor"),
            {},
            "has no uvs",
        ),
        (
            shapes.Mesh(
                vertices=np.eye(3, dtype=np.float32), faces=[[0, 1, 2]], name="floor",
                uvs=np.array([[0, 0], [2, 0], [0, 1]], np.float32),
            ),
            {},
            "reach from 0 to 2",
        ),
        (floor(), {"size": (0, 4)}, "size: must be a whole number"),
        (floor(), {"quantity": "luminance"}, "along rays"),
    ],
)  # fmt: skip
def test_bad_texels(part, what, words):
    with pytest.raises(SceneError, match=words):
        bake(scene(part), **{"name": "floor", "samples": 16, **what})


def test_the_command(tmp_path):
    clpt.save(scene(floor()), tmp_path / "room.json")
    words = [tmp_path / "room.json", "--texels", "floor", "--size", "6x4", "--samples", "64"]
    expected = by_formula(middles(6, 4), [0.0, 1.0, 0.0])
    for name in ("map.exr", "map.npy"):
        told = CliRunner().invoke(
            command,
            [str(w) for w in (*words, "--quantity", "irradiance", "-o", tmp_path / name)],
        )
        assert told.exit_code == 0, told.output
        values = images.read(tmp_path / name)[..., 0]
        np.testing.assert_allclose(values, expected, rtol=0.01)
    told = CliRunner().invoke(command, [str(w) for w in (*words, "-o", tmp_path / "map.csv")])
    rows = (tmp_path / "map.csv").read_text().splitlines()
    assert told.exit_code == 0 and len(rows) == 1 + 24 and rows[0].startswith("x,y,z,illuminance")
    told = CliRunner().invoke(command, [str(w) for w in (*words, "-o", tmp_path / "map.bmp")])
    assert told.exit_code != 0 and "unknown image suffix" in str(told.exception or told.output)
    told = CliRunner().invoke(command, [str(tmp_path / "room.json")])
    assert told.exit_code == 2 and "--at FILE.csv or --texels NAME" in told.output
