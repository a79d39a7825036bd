"""The brightness of textures over triangles, against sums over texels; what lights make of it."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.render.lights import encode as lights
from clpt.render.lights import find as sources
from clpt.render.lights.find import LEAST, triangle_means
from clpt.render.materials.encoder import Encoder
from clpt.render.spectra.find import Look
from clpt.scene.lights import Area
from clpt.scene.shapes import Mesh
from clpt.scene.textures import Bitmap, Checkerboard, Mix, Product

SEEN = Look(False, 360.0, 830.0)  # in colours
UVS = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
HALVES = np.array([(0, 1, 2), (0, 2, 3)])


def over_texels(image: np.ndarray) -> list[float]:
    """Means of a square image below its rising diagonal, and above it."""
    fine = np.kron(image, np.ones((9, 9)))[::-1]
    row, column = np.indices(fine.shape)
    return [fine[column > row].mean(), fine[column < row].mean()]


@pytest.mark.parametrize("size", [4, 64, 500])
def test_bitmaps(size):
    image = np.random.default_rng(size).random((size, size)).astype(np.float32) ** 6
    found = triangle_means(Bitmap(image=image), SEEN, UVS, HALVES)
    np.testing.assert_allclose(found, over_texels(image), rtol=0.05)


def test_a_bright_corner_is_found():
    image = np.zeros((256, 256), np.float32)
    image[250, 200] = 1e4  # below the diagonal
    found = triangle_means(Bitmap(image=image), SEEN, UVS, HALVES)
    assert found[0] == pytest.approx(2e4 / image.size, rel=0.3)
    assert found[1] == pytest.approx(LEAST * image.mean())


def test_where_the_uvs_lie():
    image = np.zeros((8, 8), np.float32)
    image[:, 4:] = 1.0
    left = np.array([(0, 0), (0.5, 0), (0, 1)], np.float32)
    corner = np.array([[0, 1, 2]])
    for move, wrap, expected in (
        (0.0, "repeat", 0.0), (0.5, "repeat", 1.0), (3.5, "repeat", 1.0), (1.5, "clamp", 1.0),
        (1.5, "zero", 0.0), (1.0, "mirror", 1.0),
    ):  # fmt: skip
        there = left + np.array([move, 0.0], np.float32)
        found = triangle_means(Bitmap(image=image, wrap=wrap), SEEN, there, corner)
        assert found[0] == pytest.approx(max(expected, LEAST * 0.5)), (move, wrap)
    shifted = Bitmap(image=image, to_uv=np.array([(1, 0, 0.5), (0, 1, 0), (0, 0, 1.0)]))
    assert triangle_means(shifted, SEEN, left, corner)[0] == pytest.approx(1.0)


def test_what_combines_textures():
    image = np.random.default_rng(3).random((16, 16)).astype(np.float32)
    plain, (low, high) = Bitmap(image=image), over_texels(image)
    product = Product(first=(2.0, 2.0, 2.0), second=plain)
    np.testing.assert_allclose(
        triangle_means(product, SEEN, UVS, HALVES), [2 * low, 2 * high], rtol=0.03
    )
    mixed = Mix(first=(1.0, 1.0, 1.0), second=plain, amount=0.25)
    expected = [0.75 + 0.25 * low, 0.75 + 0.25 * high]
    np.testing.assert_allclose(triangle_means(mixed, SEEN, UVS, HALVES), expected, rtol=0.03)
    board = Checkerboard(color0=(1.0, 1.0, 1.0), color1=(0.0, 0.0, 0.0))
    quarter = np.array([(0, 0), (0.5, 0), (0, 0.5)], np.float32)
    assert triangle_means(board, SEEN, quarter, np.array([[0, 1, 2]]))[0] == pytest.approx(1.0)


def test_dark_triangles_are_seldom_chosen():
    """A grid of triangles under an image that is bright in one corner: pmf follows the image."""
    side = np.linspace(0, 1, 9, dtype=np.float32)
    uvs = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()[:, None]
    faces = np.concatenate([corner + np.array(turn) for turn in ((0, 1, 10), (0, 10, 9))])
    image = np.full((64, 64), 0.01, np.float32)
    image[:16, :16] = 1.0
    mesh = Mesh(
        vertices=np.pad(uvs, ((0, 0), (0, 1))), faces=faces, uvs=uvs,
        emission=Area(radiance=Bitmap(image=image)),
    )  # fmt: skip
    emitter = lights.Emitter(mesh, 0, mesh.vertices, faces, uvs)
    encoder = Encoder("rgb")
    found = sources.measured([], [emitter], 1.0, encoder.look)
    pmf = lights.light_rows([], [emitter], encoder, found).rows["pmf"].astype(float)
    middle = uvs[faces].mean(axis=1)
    bright = (middle[:, 0] < 0.25) & (middle[:, 1] > 0.75)
    assert bright.sum() == 8
    assert pmf[bright].sum() == pytest.approx(image[:16, :16].sum() / image.sum(), rel=0.02)
