"""Levels of images: the copies on the host, look-ups between them, and the cone that chooses."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.images import linear_to_srgb, srgb_to_linear
from clpt.render.materials.encoder import Encoder
from clpt.render.textures.bitmaps import _level_sizes, _levels
from clpt.render.textures.cases import dispatch_text
from clpt.scene.roles import REAL, REFLECTANCE, Param
from clpt.scene.textures import Bitmap
from tests.kernels.scene_harness import SceneProbe
from tests.kernels.test_textures import PLAIN, TURNED, reference

FILE = "generated/textures.cl"
COLOURS = np.random.default_rng(1).random((13, 22, 3)).astype(np.float32)
BYTES = (255 * COLOURS).astype(np.uint8)
LOOK_UP = """
    integer row = to_integer(x[0]), number = to_integer(x[1]);
    TexturePoint point = texture_point_nowhere();
    point.uv.x = x[2]; point.uv.y = x[3];
    point.footprint = x[4];
    point.u.x = x[5]; point.u.y = x[6];
    Wavelengths lambdas = spectrum_of(0.0f);
    Spectrum s = texture_reflectance(scene, row, point, lambdas);
    r[0] = s.x; r[1] = s.y; r[2] = s.z;
    r[3] = texture_real(scene, number, point, lambdas);
    s = texture_texel(scene, row, point, lambdas);
    r[4] = s.x; r[5] = s.y; r[6] = s.z;
"""


class LookUp:
    """Values of textures at (n, 2) uv and (n,) footprints: colours, numbers, random texels."""

    def __init__(self, made: list[Bitmap]):
        encoder = Encoder("rgb")
        self.rows, self.numbers = (
            np.array([encoder.param_words(t, Param(role))[0][-1] - 1 for t in made])
            for role in (REFLECTANCE, REAL)
        )
        encoder.textures.finish()
        self.probe = SceneProbe(
            LOOK_UP, 7, 7, files=(FILE,),
            virtual={FILE: dispatch_text(encoder.textures.features(), stochastic=True)},
            defines={"USES_MIPS": 1, "STOCHASTIC_FILTERING": 1},
            tables=encoder.store.arrays(),
        )  # fmt: skip

    def __call__(self, which, uv, footprint, u=None):
        u = np.zeros_like(uv) if u is None else u
        given = (self.rows[which], self.numbers[which], *uv.T, footprint, *u.T)
        out = self.probe(*np.broadcast_arrays(*given)).T
        return out[:, :3], out[:, 3], out[:, 4:]


def halved(image, height, width):
    """Means over equal parts of an image, each texel by the share of it, in float64."""

    def shares(n, count):
        low = np.arange(count)[:, None] * n / count
        at = np.arange(n)[None]
        return np.clip(np.minimum(at + 1, low + n / count) - np.maximum(at, low), 0, 1) * count / n

    down, along = shares(image.shape[0], height), shares(image.shape[1], width)
    return np.einsum("ij,jkc,lk->ilc", down, image, along)


def chain(image):
    """The levels in float64, without rounding to bytes."""
    made = [np.asarray(image, np.float64)]
    while max(made[-1].shape[:2]) > 1:
        made.append(halved(made[-1], *(max(n // 2, 1) for n in made[-1].shape[:2])))
    return made


@pytest.mark.parametrize("shape", [(1, 1), (2, 8), (5, 7), (13, 22), (1, 9)])
def test_copies_have_the_image_s_mean(shape):
    image = np.random.default_rng(2).random((*shape, 3)).astype(np.float32)
    found = _levels(image, curved=False)
    assert [one.shape[:2] for one in found] == _level_sizes(*shape)
    assert found[-1].shape[:2] == (1, 1)
    for one, expected in zip(found, chain(image), strict=True):
        np.testing.assert_allclose(one, expected, atol=2e-6)
        np.testing.assert_allclose(one.mean(axis=(0, 1)), image.mean(axis=(0, 1)), atol=2e-6)
    stored = _levels((255 * image).astype(np.uint8), curved=True)
    linear = chain(srgb_to_linear((255 * image).astype(np.uint8) / np.float32(255)))
    for one, expected in zip(stored, linear, strict=True):
        assert one.dtype == np.uint8
        np.testing.assert_allclose(one / 255, linear_to_srgb(expected), atol=4e-3)


def test_look_ups_between_levels():
    wraps = ["repeat", "clamp", "mirror", "zero"]
    own = [
        Bitmap(image=COLOURS, filter="trilinear", wrap=w, to_uv=t, channel="g")
        for w in wraps
        for t in (PLAIN, TURNED)
    ]
    bytes_ = Bitmap(image=BYTES, filter="trilinear", channel="g", raw=True)
    plain = [Bitmap(image=i, channel="g", raw=True) for i in (COLOURS, BYTES)]
    seen = LookUp([*own, bytes_, *plain])
    rng = np.random.default_rng(3)
    uv = rng.uniform(-2, 3, (200, 2)).astype(np.float32)
    levels = chain(COLOURS)
    for i, texture in enumerate(own):
        texels = np.sqrt(13 * 22 * abs(np.linalg.det(texture.to_uv[:2, :2])))
        detail = rng.uniform(-1, 5, len(uv))
        below = np.clip(np.floor(detail), 0, 4).astype(int)
        part = np.clip(detail, 0, 4) - below
        values = np.stack(
            [reference(one, uv, texture.to_uv, wrap=texture.wrap) for one in (*levels, levels[-1])]
        )
        at = np.arange(len(uv))
        expected = values[below, at] + part[:, None] * (values[below + 1, at] - values[below, at])
        colours, numbers, _ = seen(i, uv, 2**detail / texels)
        np.testing.assert_allclose(colours, expected, atol=1e-4)
        np.testing.assert_allclose(numbers, expected[:, 1], atol=1e-4)
    # bytes round at each level
    linear = chain(BYTES / 255)
    colours, numbers, _ = seen(len(own), uv, np.full(len(uv), 4 / np.sqrt(13 * 22)))
    expected = reference(linear[2], uv)
    np.testing.assert_allclose(colours, expected, atol=6e-3)
    np.testing.assert_allclose(numbers, expected[:, 1], atol=6e-3)
    # a footprint within a texel: the bits of the bilinear filter, and of its random texels
    u = rng.random(uv.shape)
    for mips, bilinear in ((0, len(own) + 1), (len(own), len(own) + 2)):
        small = seen(mips, uv, np.full(len(uv), 0.9 / np.sqrt(13 * 22)), u)
        for one, other in zip(small, seen(bilinear, uv, np.zeros(len(uv)), u), strict=True):
            np.testing.assert_array_equal(one, other)
    # the mean of random texels is the filtered value: half a cell off per axis, and at the level
    middles = (np.arange(64) + 0.5) / 64
    u = np.stack(np.meshgrid(middles, middles), -1).reshape(-1, 2)
    many, wide = np.repeat(uv[:1], len(u), 0), np.full(len(u), 2**1.3 / np.sqrt(13 * 22))
    colours, _, texels = seen(0, many, wide, u)
    np.testing.assert_allclose(texels.mean(axis=0), colours[0], atol=2 / 64)
    # garbage stays inside
    wild = np.array([np.nan, np.inf, 3e38, 1e-45, -1.0])
    for out in seen(0, uv[:5], wild):
        assert ((out >= 0) & (out <= 1)).all()


CONE = """
    vec3 o = v3(0.0f, 0.0f, 0.0f), d = v3(0.0f, 0.0f, 1.0f);
    Cone c = cone_of_pixel(o, d, o, normalize3(v3(x[0], x[0], 1.0f)));
    c = cone_after(cone_word(c), x[1]);
    vec3 normal = v3(0.0f, sin(x[2]), -cos(x[2]));
    vec3 dpdu = v3(x[3], 0.0f, 0.0f), dpdv = v3(0.0f, x[4] * cos(x[2]), x[4] * sin(x[2]));
    r[0] = cone_footprint(c, d, normal, dpdu, dpdv);
    r[1] = cone_after(cone_scattered(c, x[5], mask_of(0)), x[1]).width;
    r[2] = cone_after(cone_scattered(c, x[5], mask_of(1)), x[1]).width;
"""


def test_the_cone_of_a_pixel():
    """On a plane seen perpendicular: distance times the pixel's angle, over metres per uv."""
    probe = SceneProbe(CONE, 6, 3, files=("textures/cone.cl",), defines={"USES_MIPS": 1})
    rng = np.random.default_rng(4)
    pixel, t, tilt = rng.uniform(1e-4, 1e-2, 64), 10 ** rng.uniform(-2, 3, 64), np.zeros(64)
    tilt[32:] = rng.uniform(0.2, 1.4, 32)
    u, v, pdf = rng.uniform(0.5, 20, 64), rng.uniform(0.5, 20, 64), 10 ** rng.uniform(0, 4, 64)
    footprint, rough, mirror = probe(pixel, t, tilt, u, v, pdf)
    expected = np.log2(pixel * t / np.sqrt(u * v)) - np.log2(np.cos(tilt))
    np.testing.assert_allclose(np.log2(footprint), expected, atol=0.01)
    np.testing.assert_allclose(mirror, 2 * pixel * t, rtol=0.01)
    wider = np.minimum(0.25 / np.sqrt(pdf), 0.4)
    np.testing.assert_allclose(rough, (2 * pixel + wider) * t, rtol=0.01)
