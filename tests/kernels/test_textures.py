"""Textures: look-ups against a reference in numpy and against Mitsuba, in every role."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from PIL import Image

from clpt import images, spectra
from clpt.errors import SceneError
from clpt.images.spectral_exr import SpectralImage
from clpt.render.materials.encoder import Encoder
from clpt.render.records import TextureFeatures
from clpt.render.textures.bitmaps import NODES, pack
from clpt.render.textures.cases import dispatch_text
from clpt.render.textures.texels import texels
from clpt.scene import textures as scene
from clpt.scene.roles import EMISSION, NAMED, REAL, REFLECTANCE, Param
from clpt.scene.values import folded
from clpt.spectra import cie
from clpt.spectra.spectrum import d65
from clpt.spectra.upsampling import evaluate
from tests.kernels.scene_harness import SceneProbe

FILE = "generated/textures.cl"
LAMBDAS = [420.0, 500.5, 577.25, 690.0]
PLAIN = np.eye(3)
TURNED = np.array([[1.5, -0.4, 0.3], [0.7, 2.0, -1.2], [0.0, 0.0, 1.0]])
COLOURS = np.random.default_rng(1).random((5, 7, 3)).astype(np.float32)


@cache
def _dispatch(roles, graphs=()):
    stochastic = any(role == "reflectance" for _, role in roles)
    return dispatch_text(TextureFeatures(roles, depth=4, graphs=graphs), stochastic=stochastic)


def _body(role, mode):
    """Text that looks row x[0] up at (x[1], x[2]), and how many numbers it sets.

    role: "texel" for a texel of a reflectance, which x[3] and x[4] choose.
    """
    components = "xyzw" if mode == "spectral" else "xyz"
    lines = [
        "integer row = to_integer(x[0]);",
        "TexturePoint point = texture_point_nowhere();",
        "point.uv.x = x[1]; point.uv.y = x[2];",
        "Wavelengths lambdas;",
    ]
    lines += [f"lambdas.{c} = {v}f;" for c, v in zip(components, LAMBDAS, strict=False)]
    lines += ["point.u.x = x[3]; point.u.y = x[4];"] if role == "texel" else []
    if role == "real":
        return " ".join([*lines, "r[0] = texture_real(scene, row, point, lambdas);"]), 1
    lines.append(f"Spectrum s = texture_{role}(scene, row, point, lambdas);")
    lines += [f"r[{i}] = s.{c};" for i, c in enumerate(components)]
    return " ".join(lines), len(components)


def look_up(made, role, uv, mode="rgb", lanes=8, rows=None, u=()):
    """Values (n, 3 or 4) or (n,) of textures in a role; rows: which of them each uv reads.

    u: (n, 2), which choose texels for the role "texel", see `_body`.
    """
    encoder, given = Encoder(mode), NAMED["reflectance" if role == "texel" else role]
    words = np.array([encoder.param_words(t, Param(given))[0][-1] - 1 for t in made])
    encoder.textures.finish()
    which = words[np.zeros(len(uv), int) if rows is None else rows]
    body, components = _body(role, mode)
    probe = SceneProbe(
        body,
        3 + 2 * (role == "texel"),
        components,
        files=(FILE,),
        mode=mode,
        lanes=lanes,
        virtual={FILE: _dispatch(frozenset(encoder.textures.roles), (*encoder.textures.graphs,))},
        defines={
            "SPECTRA_SIZE": encoder.spectra.samples,
            "STOCHASTIC_FILTERING": int(role == "texel"),
        },
        tables=encoder.store.arrays(),
        settings={"lambda_min": 360.0, "lambda_max": 830.0},
    )
    columns = [*np.asarray(uv, np.float32).T, *np.asarray(u, np.float32).T]
    out = probe(which, *columns).T
    return out[:, 0] if role == "real" else out


def _wrapped(i, size, wrap):
    if wrap == "clamp":
        return np.clip(i, 0, size - 1)
    if wrap == "repeat":
        return i % size
    i = i % (2 * size)
    return np.where(i < size, i, 2 * size - 1 - i)


def reference(image, uv, to_uv=PLAIN, filter="bilinear", wrap="repeat"):
    """A bitmap's values (n, c) in float64; v = 0 is the bottom of the image."""
    place = np.column_stack([uv, np.ones(len(uv))]).astype(np.float64) @ np.asarray(to_uv)[:2].T
    if wrap == "zero":
        image, wrap = np.pad(image, ((1, 1), (1, 1), (0, 0))), "clamp"
        inner = np.array(image.shape[1::-1]) - 2
        place = (place * inner + 1) / (inner + 2)
    h, w, _ = image.shape
    x, y = place[:, 0] * w, (1.0 - place[:, 1]) * h
    if filter == "nearest":
        return image[
            _wrapped(np.floor(y).astype(int), h, wrap), _wrapped(np.floor(x).astype(int), w, wrap)
        ]
    x, y = x - 0.5, y - 0.5
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    total = np.zeros((len(uv), image.shape[2]))
    for dj in (0, 1):
        for di in (0, 1):
            weight = np.abs(1 - di - (x - i)) * np.abs(1 - dj - (y - j))
            texel = image[_wrapped(j + dj, h, wrap), _wrapped(i + di, w, wrap)]
            total += weight[:, None] * texel
    return total


def _uvs(n=400, seed=2):
    uv = np.random.default_rng(seed).uniform(-2.5, 3.5, (n, 2)).astype(np.float32)
    uv[:5] = [[0, 0], [1, 1], [0.5, 0.5], [-1, 2], [0.999999, 1e-7]]
    return uv


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror", "zero"])
@pytest.mark.parametrize("filter", ["bilinear", "nearest"])
@pytest.mark.parametrize("to_uv", [PLAIN, TURNED], ids=["plain", "turned"])
def test_bitmap(wrap, filter, to_uv):
    bitmap = scene.Bitmap(image=COLOURS, wrap=wrap, filter=filter, to_uv=to_uv)
    uv = _uvs()
    expected = reference(COLOURS, uv, to_uv, filter, wrap)
    found = look_up([bitmap], "reflectance", uv)
    off = np.abs(found - expected).max(axis=1) > 2e-5
    if filter == "bilinear":
        assert not off.any()
    else:  # at the border of two texels rounding may choose either
        assert off.mean() < 0.01


GRID = 64  # uniform numbers an axis
IMAGES = {
    "floats": COLOURS,
    "bytes": (255 * COLOURS).astype(np.uint8),
    "bands": SpectralImage(
        np.random.default_rng(3).random((4, 6, 9)), np.linspace(400, 720, 9), False
    ),
}


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("image", IMAGES)
def test_random_texels_have_the_filtered_mean(image, mode):
    """Numbers in the middle of the cells of a grid: the chance of a texel is off by half a cell an
    axis at most, so the mean of values in [0, 1] by one cell."""
    uv, wraps = _uvs(24), ["repeat", "clamp", "mirror", "zero"]
    made = [scene.Bitmap(image=IMAGES[image], wrap=wrap, to_uv=TURNED) for wrap in wraps]
    made.append(scene.Bitmap(image=IMAGES[image], filter="nearest"))
    rows = np.arange(len(uv)) % len(made)
    filtered = look_up(made, "reflectance", uv, mode=mode, rows=rows)
    middles = (np.arange(GRID) + 0.5) / GRID
    u = np.tile(np.stack(np.meshgrid(middles, middles), -1).reshape(-1, 2), (len(uv), 1))
    often, which = (np.repeat(a, GRID**2, axis=0) for a in (uv, rows))
    found = look_up(made, "texel", often, mode=mode, rows=which, u=u)
    found = found.reshape(len(uv), GRID**2, -1)
    np.testing.assert_allclose(found.mean(axis=1), filtered, atol=1.0 / GRID + 1e-4)
    chosen = [len(np.unique(one.round(5), axis=0)) for one in found]
    assert max(chosen) == 4, "one of four texels is chosen"
    assert {n for n, row in zip(chosen, rows, strict=True) if row == len(wraps)} == {1}


def test_what_combines_textures_is_filtered():
    """A product of two random texels would not have the product of the means."""
    first, second = scene.Bitmap(image=COLOURS), scene.Bitmap(image=COLOURS[:2, :3])
    made, uv = [scene.Product(first=first, second=second)], _uvs(64)
    u = np.random.default_rng(7).random((64, 2))
    found = look_up(made, "texel", uv, u=u)
    np.testing.assert_array_equal(found, look_up(made, "reflectance", uv))


def test_v_runs_up():
    image = np.array([[[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]])  # red above blue
    found = look_up([scene.Bitmap(image=image)], "reflectance", [[0.5, 0.25], [0.5, 0.75]])
    np.testing.assert_allclose(found, [[0, 0, 1], [1, 0, 0]], atol=1e-6)


def test_real_is_the_luminance_of_a_colour():
    alpha = np.dstack([COLOURS, np.full(COLOURS.shape[:2], 9.0, np.float32)])
    uv = _uvs()
    grey = spectra.luminance(COLOURS)
    expected = reference(grey[..., None], uv)[:, 0]
    for image in (COLOURS, alpha, grey):
        found = look_up([scene.Bitmap(image=image)], "real", uv)
        np.testing.assert_allclose(found, expected, atol=1e-5)


@pytest.mark.parametrize("channel", ["luminance", "r", "g", "b", "a"])
def test_channels(channel, tmp_path):
    """Of four, three and one channel; alpha is never decoded, and 1 where there is none."""
    stored = np.random.default_rng(4).integers(0, 256, (3, 4, 4), np.uint8)
    path = tmp_path / "rgba.png"
    Image.fromarray(stored).save(path)
    linear = images.read(path)
    made = [path, linear[..., :3], linear[..., :1]]
    number = 3 if channel == "a" else "rgb".find(channel)
    grey = spectra.luminance(linear[..., :3])
    one = np.ones(grey.shape)
    expected = [
        grey if number < 0 else linear[..., number],
        grey if number < 0 else one if number == 3 else linear[..., number],
        one if number == 3 else linear[..., 0],
    ]
    uv = _uvs(30)
    bitmaps = [scene.Bitmap(image=image, channel=channel) for image in made]
    rows = np.arange(30) % 3
    found = look_up(bitmaps, "real", uv, rows=rows)
    each = [reference(e[..., None], uv)[:, 0] for e in expected]
    np.testing.assert_allclose(found, np.choose(rows, each), atol=1e-5)


def test_wraps_of_either_axis():
    bitmap = scene.Bitmap(image=COLOURS, wrap="clamp", wrap_v="repeat")
    uv = _uvs()
    inside = np.abs(uv[:, 0] - 0.5) < 0.4  # 7 texels: where repeating and clamping are the same
    found = look_up([bitmap], "reflectance", uv)
    np.testing.assert_allclose(found[inside], reference(COLOURS, uv)[inside], atol=2e-5)
    far = [[-3.0, 0.3], [5.0, 0.3]]
    expected = reference(COLOURS, np.array(far), wrap="clamp")
    np.testing.assert_allclose(look_up([bitmap], "reflectance", far), expected, atol=2e-5)


def _nested(a, b, t):
    """Composites of two colours and a number: what to render, and the same in float64."""
    made = [
        scene.Product(first=a[0], second=b[0]),
        scene.Mix(
            first=scene.Product(first=(0.5, 1.5, 0.7), second=a[0]),
            second=scene.Mix(first=b[0], second=0.25, amount=0.3),
            amount=scene.Product(first=t[0], second=scene.Mix(first=t[0], amount=t[0])),
        ),
        scene.Product(first=scene.Product(first=2.0, second=3.0), second=a[0]),
    ]
    amount = t[1] * (t[1] + (1.0 - t[1]) * t[1])
    low, high = a[1] * [0.5, 1.5, 0.7], 0.7 * b[1] + 0.3 * 0.25
    return made, [a[1] * b[1], low + (high - low) * amount, 6.0 * a[1]]


def test_composites_nest():
    rng = np.random.default_rng(5)
    arrays = [rng.random(shape).astype(np.float32) for shape in ((4, 6, 3), (3, 5, 3), (4, 4, 1))]
    uv = _uvs(192)
    pairs = [(scene.Bitmap(image=image), reference(image, uv)) for image in arrays]
    made, expected = _nested(*pairs)
    same = np.equal(*((uv % 1.0) > 0.5).T)[:, None]
    made.append(scene.Checkerboard(color0=pairs[0][0], color1=scene.Checkerboard()))
    expected.append(np.where(same, pairs[0][1], 0.2))
    rows = np.arange(len(uv)) % len(made)
    wanted = np.choose(rows[:, None], np.clip(expected, 0.0, 1.0))
    found = [look_up(made, "reflectance", uv, rows=rows, lanes=lanes) for lanes in (1, 8, 16)]
    off = np.abs(found[0] - wanted).max(axis=1) > 2e-6
    assert off.mean() < 0.01  # at a border of the checkerboard rounding may choose either colour
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_indices_are_not_bounded(mode):
    """Metals whose eta or k are images, and mixtures of two of them."""
    image, uv = 4.0 * COLOURS, _uvs(60)
    between = scene.Mix(first=(3.0, 0.2, 1.0), second=2.5, amount=scene.Checkerboard(color0=0.25))
    made, rows = [scene.Bitmap(image=image), between], np.arange(60) % 2
    if mode == "rgb":
        values, first = image, np.array([3.0, 0.2, 1.0])
    else:
        scale, coefficients = spectra.unbounded(image)
        values = scale[..., None] * evaluate(coefficients, LAMBDAS)
        first = spectra.RGBUnbounded(3.0, 0.2, 1.0).sample(LAMBDAS)
    same = np.equal(*((uv % 1.0) > 0.5).T)
    amount = np.where(same, 0.25, 0.2)[:, None]
    expected = np.choose(rows[:, None], [reference(values, uv), first + (2.5 - first) * amount])
    found = look_up(made, "index", uv, mode=mode, rows=rows)
    off = np.abs(found - expected).max(axis=1) > (2e-2 if mode == "spectral" else 2e-5)
    assert off.mean() < 0.04  # at a border of the checkerboard rounding may choose either


def test_composites_of_numbers_and_of_light():
    uv = _uvs(48)
    lamp, mask = np.float32(40.0) * COLOURS, COLOURS[:3, :2, :1]
    colour, grey = scene.Bitmap(image=lamp), scene.Bitmap(image=mask)
    product = scene.Product(first=3.0, second=scene.Product(first=colour, second=grey))
    numbers = 3.0 * reference(spectra.luminance(lamp)[..., None], uv) * reference(mask, uv)
    np.testing.assert_allclose(look_up([product], "real", uv), numbers[:, 0], rtol=1e-5)
    scale, coefficients = spectra.unbounded(lamp)
    light = scale[..., None] * evaluate(coefficients, LAMBDAS) * d65().sample(LAMBDAS)
    factor = evaluate(spectra.uplift(np.repeat(mask, 3, axis=2)), LAMBDAS)
    found = look_up([product], "emission", uv, mode="spectral")
    wanted = 3.0 * reference(light, uv) * reference(factor, uv)
    np.testing.assert_allclose(found, wanted, rtol=2e-3, atol=2e-4 * wanted.max())


@pytest.mark.parametrize(
    ("texture", "role", "expected"),
    [
        (scene.Product(first=0.5, second=scene.Mix(first=0.2, second=0.4)), "reflectance", 0.15),
        (scene.Product(first=(0.2, 0.4, 0.9), second=2.0), "real", 2 * 0.39349),
        (scene.Mix(first=0.3, second=scene.Bitmap(image=COLOURS), amount=0.0), "reflectance", 0.3),
    ],
)
def test_constants_are_folded(texture, role, expected):
    assert folded(texture, NAMED[role]).value == pytest.approx(expected, rel=1e-3)


def test_folding_takes_away_what_changes_nothing():
    bitmap = scene.Bitmap(image=COLOURS)
    assert folded(scene.Product(first=1.0, second=bitmap), EMISSION) is bitmap
    assert folded(scene.Mix(first=bitmap, second=0.4, amount=0.0), REFLECTANCE) is bitmap


def test_reflectance_is_clipped_and_emission_is_not():
    image = np.array([[[3.0, -1.0, 0.5]]])
    bitmap, uv = scene.Bitmap(image=image), [[0.3, 0.3]]
    np.testing.assert_allclose(look_up([bitmap], "reflectance", uv), [[1, 0, 0.5]], atol=1e-6)
    np.testing.assert_allclose(look_up([bitmap], "emission", uv), [[3, 0, 0.5]], atol=1e-6)


@pytest.mark.parametrize("role", ["reflectance", "emission"])
def test_spectral_bitmap_interpolates_values(role):
    """Not coefficients: between two texels lies the mean of their spectra."""
    image = COLOURS * (1.0 if role == "reflectance" else 40.0)
    uv = _uvs()
    if role == "reflectance":
        values = evaluate(spectra.uplift(image), LAMBDAS)
    else:
        scale, coefficients = spectra.unbounded(image)
        values = scale[..., None] * evaluate(coefficients, LAMBDAS) * d65().sample(LAMBDAS)
    found = look_up([scene.Bitmap(image=image)], role, uv, mode="spectral")
    np.testing.assert_allclose(found, reference(values, uv), rtol=2e-3, atol=2e-4 * values.max())


BYTES = np.random.default_rng(6).integers(0, 256, (6, 5, 4), np.uint8)


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("raw", [False, True])
def test_bytes_mean_what_floats_mean(mode, raw):
    """Packed colours: in RGB mode exactly, as spectra of 21 bits a node to 1/200."""
    linear = images.Stored(BYTES, encoded=not raw).decoded()
    uv = _uvs(100)
    made = [scene.Bitmap(image=BYTES, raw=raw), scene.Bitmap(image=linear)]
    exact = [look_up([b], "reflectance", uv, mode=mode) for b in made]
    np.testing.assert_allclose(*exact, atol=0.0 if mode == "rgb" else 5e-3)
    assert np.abs(exact[0] - exact[1]).mean() < 1e-4
    for channel in ("luminance", "g", "a"):
        pair = [scene.Bitmap(image=b.image, raw=b.raw, channel=channel) for b in made]
        numbers = [look_up([b], "real", uv, mode=mode) for b in pair]
        np.testing.assert_allclose(*numbers, atol=1e-6)


def test_packed_spectra_show_the_same_colours():
    """Colours under D65 differ by less than 0.02 of CIE 2000, which no eye sees."""
    colour = pytest.importorskip("colour")
    rng = np.random.default_rng(8)
    rgb = np.concatenate([rng.integers(0, 256, (3000, 3)), rng.choice([0, 1, 128, 255], (500, 3))])
    coefficients = spectra.uplift(images.srgb_to_linear((rgb / 255.0).astype(np.float32)))
    p, q = pack(coefficients).T
    upper = np.uint32(0xFFFFF800)
    third = (p & np.uint32(0x7FF)) << np.uint32(21) | (q & np.uint32(0x3FF)) << np.uint32(11)
    nodes = [w.astype(np.uint32).view(np.float32) for w in (p & upper, q & upper, third)]
    lambdas = np.arange(360.0, 831.0, 5.0)
    basis = np.linalg.solve(np.vander(NODES).T, np.vander(lambdas, 3).T)
    x = np.stack(nodes, axis=1).astype(np.float64) @ basis
    weights = cie.cie_xyz(lambdas) * d65().sample(lambdas)[:, None]
    weights /= weights[:, 1].sum()
    white = colour.XYZ_to_xy(weights.sum(axis=0))
    seen = (0.5 + 0.5 * x / np.sqrt(1.0 + x**2), evaluate(coefficients, lambdas))
    labs = [colour.XYZ_to_Lab(values @ weights, white) for values in seen]
    assert colour.delta_E(*labs, method="CIE 2000").max() < 0.02


def test_a_budget_halves_the_largest():
    """Means of linear light, odd edges repeated; each image that shrinks is told of."""
    large, small = BYTES[:, :, :3], COLOURS[:2, :2]
    encoder = Encoder("rgb", texture_budget=100)
    for image in (large, small):
        encoder.textures.row(scene.Bitmap(image=image), REFLECTANCE)
    notes = encoder.textures.finish()
    assert len(notes) == 1
    assert "5 x 6 texels made 3 x 3" in notes[0]
    decoded = np.pad(images.Stored(large, True).decoded(), ((0, 0), (0, 1), (0, 0)), "edge")
    means = decoded.reshape(3, 2, 3, 2, 3).mean(axis=(1, 3))
    words = encoder.store.arrays()["images"][4 + 256 :][:9].reshape(3, 3)
    shown = np.stack([words & 255, words >> 8 & 255, words >> 16 & 255], axis=2)
    np.testing.assert_allclose(shown, images.linear_to_srgb(means) * 255.0, atol=0.51)


def test_eight_bit_images_share_their_colours():
    """The short cut for images of few levels gives what uplifting every texel gives."""
    levels = np.round(np.random.default_rng(3).random((40, 50, 3)) * 255) / 255
    made = texels(levels.astype(np.float32), REFLECTANCE, True)
    np.testing.assert_array_equal(
        made[:, :3], spectra.uplift(levels.astype(np.float32).reshape(-1, 3))
    )
    np.testing.assert_array_equal(made[:, 3], 1.0)


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_checkerboard(mode):
    tabulated = spectra.Tabulated((360.0, 830.0), (0.1, 0.8))
    board = scene.Checkerboard(color0=(0.2, 0.5, 0.7), color1=tabulated, to_uv=TURNED)
    uv = _uvs()
    place = np.column_stack([uv, np.ones(len(uv))]) @ TURNED[:2].T
    same = np.equal(*((place % 1.0) > 0.5).T)
    if mode == "rgb":
        colours = [[0.2, 0.5, 0.7], tabulated.to_rgb()]
    else:
        colours = [spectra.RGB(0.2, 0.5, 0.7).sample(LAMBDAS), tabulated.sample(LAMBDAS)]
    expected = np.where(same[:, None], *np.asarray(colours))
    found = look_up([board], "reflectance", uv, mode=mode)
    off = np.abs(found - expected).max(axis=1) > (2e-3 if mode == "spectral" else 1e-6)
    assert off.mean() < 0.01  # at a border rounding may choose either colour


def test_checkerboard_real_and_emission():
    board = scene.Checkerboard(color0=0.25, color1=(0.2, 0.4, 0.9))
    uv = [[0.2, 0.2], [0.7, 0.2], [0.7, 0.7], [-0.2, 0.2]]
    numbers = [0.25, spectra.luminance([0.2, 0.4, 0.9])] * 2
    np.testing.assert_allclose(look_up([board], "real", uv), numbers, atol=1e-6)
    found = look_up([board], "emission", uv, mode="spectral")
    lamp = spectra.RGBIlluminant(0.2, 0.4, 0.9).sample(LAMBDAS)
    np.testing.assert_allclose(found[1], lamp, rtol=2e-3)
    np.testing.assert_allclose(found[0], 0.25, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_neighbouring_lanes_read_different_textures(mode):
    made = [
        scene.Bitmap(image=COLOURS),
        scene.Checkerboard(),
        scene.Bitmap(image=COLOURS[:2, :3], wrap="mirror", filter="nearest"),
    ]
    uv = _uvs(96)
    rows = np.arange(len(uv)) * 7 % 3
    mixed = look_up(made, "reflectance", uv, mode=mode, rows=rows)
    single = look_up(made, "reflectance", uv, mode=mode, rows=rows, lanes=1)
    np.testing.assert_allclose(mixed, single, atol=1e-6)
    for i, texture in enumerate(made):
        alone = look_up([texture], "reflectance", uv[rows == i], mode=mode)
        np.testing.assert_allclose(mixed[rows == i], alone, atol=1e-6)
    wide = look_up(made, "reflectance", uv, mode=mode, rows=rows, lanes=16)
    np.testing.assert_allclose(wide, mixed, atol=1e-6)


def test_wild_coordinates_stay_inside_the_image():
    """Texels around the image hold 1000: none of it may come out, whatever uv is."""
    hot = np.full((4, 4, 1), 1000.0, np.float32)
    wild = [
        np.nan,
        np.inf,
        -np.inf,
        3e38,
        -3e38,
        1e10,
        -1e10,
        2**31,
        -(2**31),
        16777217.5,
        1e-45,
        -1e-9,
    ]
    uv = np.stack(np.meshgrid(wild, wild), axis=-1).reshape(-1, 2)
    for wrap in ("repeat", "clamp", "mirror"):
        for filter in ("bilinear", "nearest"):
            made = [
                scene.Bitmap(image=hot),
                scene.Bitmap(image=COLOURS.mean(axis=2), wrap=wrap, filter=filter),
                scene.Bitmap(image=hot.copy()),
            ]
            found = look_up(made, "real", uv, rows=np.ones(len(uv), int))
            assert (found >= 0.0).all()
            assert (found <= 1.0).all()


LOADERS = """
    integer word = to_integer(x[0]);
    TexturePoint point = texture_point_nowhere();
    point.uv.x = x[1]; point.uv.y = x[2];
    Wavelengths lambdas = spectrum_of(0.0f);
    integer colour = gather_i(scene.materials, word + 4);
    integer number = gather_i(scene.materials, word + 6);
    Spectrum s = spectrum_texture_reflectance(scene, colour, point, lambdas);
    r[0] = s.x; r[1] = s.y; r[2] = s.z;
    r[3] = real_texture_real(scene, number, point, lambdas);
"""


def test_parameters_that_are_textures():
    """As the generated loaders read them; lanes without a texture read something unused."""
    encoder, uv = Encoder("rgb"), _uvs(32)
    colour = scene.Bitmap(image=COLOURS)
    words = [
        *encoder.param_words(spectra.Constant(0.5), Param(REFLECTANCE))[0],
        *encoder.param_words(0.5, Param(REAL))[0],
        *encoder.param_words(colour, Param(REFLECTANCE))[0],
        *encoder.param_words(colour, Param(REAL))[0],
    ]
    encoder.store.append("materials", words)
    encoder.textures.finish()
    probe = SceneProbe(
        LOADERS,
        3,
        4,
        files=(FILE,),
        virtual={FILE: _dispatch(frozenset(encoder.textures.roles))},
        tables=encoder.store.arrays(),
    )
    textured = np.arange(len(uv)) % 2 == 1
    found = probe(np.where(textured, 7, 0), *uv.T).T[textured]
    np.testing.assert_allclose(found[:, :3], reference(COLOURS, uv)[textured], atol=1e-5)
    np.testing.assert_allclose(found[:, 3], spectra.luminance(found[:, :3]), atol=1e-5)


def test_a_texture_is_put_in_once(tmp_path):
    path = tmp_path / "a.png"
    Image.fromarray(np.zeros((3, 4, 3), np.uint8)).save(path)
    encoder = Encoder("rgb")
    board, file = scene.Checkerboard(), scene.Bitmap(image=path)
    first = [encoder.textures.row(t, REFLECTANCE) for t in (board, file)]
    sizes = encoder.store.size("textures")
    again = [encoder.textures.row(t, REFLECTANCE) for t in (board, scene.Bitmap(image=str(path)))]
    assert first == again
    assert sizes == encoder.store.size("textures")
    assert encoder.textures.row(file, REAL) not in first
    encoder.textures.finish()
    assert encoder.textures.roles == {
        ("checkerboard", "reflectance"),
        ("packed_bitmap", "reflectance"),
        ("bitmap", "real"),
    }


def test_no_textures_no_text():
    assert dispatch_text(TextureFeatures()).strip() == ""


@pytest.mark.parametrize(
    ("texture", "part"),
    [
        (scene.Bitmap(), "path or an array"),
        (scene.Bitmap(image="no/such.png"), "no/such.png"),
        (scene.Bitmap(image=np.zeros((2, 2, 3), np.int16)), "floats"),
        (scene.Bitmap(image=np.zeros((2, 2, 2))), r"\(2, 2, 2\)"),
        (scene.Bitmap(image=np.zeros((0, 2, 3))), "not empty"),
    ],
)
def test_unusable_textures(texture, part):
    with pytest.raises(SceneError, match=part):
        encoder = Encoder("rgb")
        encoder.textures.row(texture, REFLECTANCE)
        encoder.textures.finish()


def test_texels_that_are_not_finite_are_black():
    image = np.array([[[np.nan, 0.5, 0.5]]])
    found = look_up([scene.Bitmap(image=image)], "emission", [[0.5, 0.5]])
    np.testing.assert_allclose(found, [[0.0, 0.5, 0.5]], atol=1e-6)


@pytest.mark.peers
@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
@pytest.mark.parametrize("filter", ["bilinear", "nearest"])
@pytest.mark.parametrize("raw", [False, True])
def test_same_bitmap_as_mitsuba(wrap, filter, raw, tmp_path):
    """Its v = 0 is the top row, so the rows are given to it in the other order."""
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
    mi.set_variant("scalar_rgb")
    stored = (COLOURS * 255).astype(np.uint8)
    for name, rows in (("ours", stored), ("theirs", stored[::-1])):
        Image.fromarray(rows).save(tmp_path / f"{name}.png")
    common = {"raw": raw, "wrap_mode": wrap, "filter_type": filter}
    theirs = mi.load_dict(
        {
            "type": "bitmap",
            "filename": str(tmp_path / "theirs.png"),
            "to_uv": mi.ScalarTransform3f(TURNED),
            **common,
        }
    )
    ours = scene.Bitmap(
        image=tmp_path / "ours.png", raw=raw, wrap=wrap, filter=filter, to_uv=TURNED
    )
    uv = _uvs(200)
    found = look_up([ours], "reflectance", uv)
    si = mi.SurfaceInteraction3f()
    expected = []
    for u, v in uv:
        si.uv = mi.Point2f(float(u), float(v))
        expected.append([*theirs.eval(si)])
    # it keeps texels in half precision; at the border of two texels rounding may choose either
    off = np.abs(found - expected).max(axis=1) > (5e-3 if filter == "bilinear" else 1e-3)
    assert off.mean() <= (0.0 if filter == "bilinear" else 0.02)


@pytest.mark.peers
def test_same_checkerboard_as_mitsuba():
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
    mi.set_variant("scalar_rgb")
    theirs = mi.load_dict({"type": "checkerboard", "to_uv": mi.ScalarTransform3f(TURNED)})
    uv, si, expected = _uvs(200), mi.SurfaceInteraction3f(), []
    for u, v in uv:
        si.uv = mi.Point2f(float(u), float(v))
        expected.append([*theirs.eval(si)])
    found = look_up([scene.Checkerboard(to_uv=TURNED)], "reflectance", uv)
    assert (np.abs(found - expected).max(axis=1) > 1e-5).mean() < 0.01
