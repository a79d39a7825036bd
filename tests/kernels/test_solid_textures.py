"""Textures that fill space, and uv that come from places: against float64 references."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from clpt import spectra
from clpt.errors import SceneError
from clpt.render.materials.encoder import Encoder
from clpt.render.textures.cases import dispatch_text
from clpt.render.textures.encode import MARBLE, PERMUTATION
from clpt.scene import textures as scene
from clpt.scene.roles import NAMED, Param
from clpt.scene.volumes import Volume
from clpt.spectra.spectrum import d65
from clpt.spectra.upsampling import evaluate
from tests.kernels.harness import assert_lanes_agree
from tests.kernels.scene_harness import SceneProbe
from tests.kernels.test_textures import FILE, LAMBDAS, reference

MOVED = np.array(
    [[0.8, -0.3, 0.2, 0.4], [0.1, 1.1, 0.5, -2.0], [0.6, 0.2, -0.9, 1.0], [0, 0, 0, 1]]
)
PLACES = np.random.default_rng(3).uniform(-6.0, 6.0, (240, 3)).astype(np.float32)
PLACES[:3] = [[0, 0, 0], [1e7, -3e6, 5], [-255.5, 256.25, 511.75]]
IMAGE = np.random.default_rng(4).random((5, 7, 3)).astype(np.float32)


def look_up(made, role, places=PLACES, mode="rgb", lanes=8):
    """Values of textures, one after the other, at places: (n, 3 or 4) or (n,)."""
    encoder = Encoder(mode)
    words = np.array([encoder.param_words(t, Param(NAMED[role]))[0][-1] - 1 for t in made])
    encoder.textures.finish()
    components = "x" if role == "real" else "xyzw" if mode == "spectral" else "xyz"
    body = "TexturePoint point = texture_point_nowhere(); Wavelengths lambdas;"
    body += "point.p = v3(x[1], x[2], x[3]); point.uv.x = x[1]; point.uv.y = x[2];"
    for c, value in zip("xyzw" if mode == "spectral" else "xyz", LAMBDAS, strict=False):
        body += f"lambdas.{c} = {value}f;"
    kind = "real" if role == "real" else "Spectrum"
    body += f"{kind} s = texture_{role}(scene, to_integer(x[0]), point, lambdas);"
    parts = ["s"] if role == "real" else [f"s.{c}" for c in components]
    body += "".join(f"r[{i}] = {part};" for i, part in enumerate(parts))
    text = dispatch_text(encoder.textures.features())
    probe = SceneProbe(
        body,
        4,
        len(parts),
        files=(FILE,),
        mode=mode,
        lanes=lanes,
        virtual={FILE: text},
        defines={"SPECTRA_SIZE": encoder.spectra.samples},
        tables=encoder.store.arrays(),
        settings={"lambda_min": 360.0, "lambda_max": 830.0},
    )
    which = words[np.arange(len(places)) % len(made)]
    out = probe(which, *places.T).T
    return out[:, 0] if role == "real" else out


def perlin(p):
    """Improving Noise (Perlin 2002) at p (n, 3), in float64."""
    table = np.tile(PERMUTATION.astype(int), 2)
    cell = np.floor(p).astype(int)
    d, (x, y, z) = p - cell, (cell % 256).T
    fade = d**3 * (d * (d * 6 - 15) + 10)
    total = np.zeros(len(p))
    for corner in np.ndindex(2, 2, 2):
        h = table[
            table[table[(x + corner[0]) % 256] + (y + corner[1]) % 256] + (z + corner[2]) % 256
        ]
        h &= 15
        gx, gy, gz = (d - corner).T
        u = np.where((h < 8) | (h == 12) | (h == 13), gx, gy)
        v = np.where((h < 4) | (h == 12) | (h == 13), gy, gz)
        g = np.where(h & 1, -u, u) + np.where(h & 2, -v, v)
        total += g * np.prod(np.where(np.array(corner) == 1, fade, 1 - fade), axis=1)
    return total


def octaves(p, count, roughness, of=lambda n: n):
    return sum(roughness**i * of(perlin(p * 1.99**i)) for i in range(count))


def placed(p=PLACES, matrix=MOVED):
    return p.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def test_patterns_of_noise():
    """All three beside one another in the lanes; far away float32 has no digits left."""
    made = [
        scene.Noise(to_texture=MOVED, octaves=5, roughness=0.6),
        scene.Noise(pattern="wrinkled", to_texture=MOVED, octaves=4),
        scene.Noise(pattern="windy", to_texture=MOVED),
        scene.Checkers(to_texture=MOVED),
    ]
    p = placed()
    wind = np.abs(octaves(0.1 * p, 3, 0.5)) * octaves(p, 6, 0.5)
    each = [octaves(p, 5, 0.6), octaves(p, 4, 0.5, np.abs), wind, np.floor(p).sum(axis=1) % 2]
    expected = np.choose(np.arange(len(p)) % 4, each)
    found = [look_up(made, "real", lanes=lanes) for lanes in (1, 8, 16)]
    np.testing.assert_allclose(found[0][2:], expected[2:], atol=3e-4)
    assert np.isfinite(found[0]).all()
    for other in found[1:]:
        assert_lanes_agree(other, found[0])


def test_marble():
    made = scene.Marble(to_texture=MOVED, scale=1.5, variation=0.7, octaves=4)
    p = placed() * 1.5
    t = 0.5 + 0.5 * np.sin(p[:, 1] + 0.7 * octaves(p, 4, 0.5))
    segment = np.clip(np.floor(t * 6), 0, 5).astype(int)
    x = (t * 6 - segment)[:, None]
    weights = [(1 - x) ** 3, 3 * (1 - x) ** 2 * x, 3 * (1 - x) * x**2, x**3]

    def curve(colours):
        return 1.5 * sum(w * colours[segment + i] for i, w in enumerate(weights))

    expected = curve(MARBLE)
    np.testing.assert_allclose(look_up([made], "reflectance")[2:], expected[2:], atol=2e-3)
    luminance = spectra.luminance(expected)
    np.testing.assert_allclose(look_up([made], "real")[2:], luminance[2:], atol=2e-3)
    lamp = curve(np.array([spectra.RGB(*c).sample(LAMBDAS) for c in MARBLE]))
    found = look_up([made], "emission", mode="spectral")
    np.testing.assert_allclose(found[2:], (lamp * d65().sample(LAMBDAS))[2:], atol=4e-3)


def test_dots():
    uv = PLACES.astype(np.float64)[3:, :2] * 0.7
    i, j = np.floor(uv + 0.5).T
    half = np.full(len(uv), 0.5)
    has = perlin(np.stack([i + 0.5, j + 0.5, half], 1)) > 0.0
    x = i + 0.15 * perlin(np.stack([i + 1.5, j + 2.8, half], 1))
    y = j + 0.15 * perlin(np.stack([i + 4.5, j + 9.8, half], 1))
    inside = has & ((uv[:, 0] - x) ** 2 + (uv[:, 1] - y) ** 2 < 0.35**2)
    found = look_up([scene.Dots(to_uv=np.diag([0.7, 0.7, 1.0]))], "real", PLACES[3:])
    assert 0.05 < inside.mean() < 0.4
    assert (found != inside).mean() < 0.01  # at an edge rounding may choose either


VALUES = np.random.default_rng(5).random((3, 4, 5, 3)).astype(np.float32)


@pytest.mark.parametrize("wrap", scene.WRAPS)
def test_voxels(wrap):
    """Colours and numbers beside one another, against scipy in float64."""
    p = placed(PLACES[3:])
    modes = {"clamp": "nearest", "repeat": "grid-wrap", "mirror": "reflect"}
    mode = modes.get(wrap, "grid-constant")
    points = (p * VALUES.shape[:3] - 0.5).T
    each = [
        map_coordinates(VALUES[..., i].astype(float), points, order=1, mode=mode) for i in range(3)
    ]
    expected = np.stack(each, axis=1)
    made = [
        scene.Voxels(values=VALUES, wrap=wrap, to_texture=MOVED),
        scene.Voxels(values=Volume(VALUES, np.linalg.inv(MOVED)), wrap=wrap),
    ]
    for lanes in (1, 8):
        found = look_up(made, "reflectance", PLACES[3:], lanes=lanes)
        np.testing.assert_allclose(found, expected, atol=2e-5)
    grey = scene.Voxels(values=VALUES[..., 0], wrap=wrap, to_texture=MOVED)
    np.testing.assert_allclose(look_up([grey], "real", PLACES[3:]), expected[:, 0], atol=2e-5)
    numbers = look_up(made, "real", PLACES[3:])
    np.testing.assert_allclose(numbers, spectra.luminance(expected), atol=2e-5)
    lamp = look_up(made, "emission", PLACES[3:])
    np.testing.assert_allclose(lamp, expected, atol=2e-5)


def test_nearest_voxels_of_spectra():
    p = placed(PLACES[3:])
    index = np.clip(np.floor(p * VALUES.shape[:3]).astype(int), 0, np.array(VALUES.shape[:3]) - 1)
    colours = VALUES[tuple(index.T)]
    voxels = scene.Voxels(values=VALUES, filter="nearest", to_texture=MOVED)
    expected = evaluate(spectra.uplift(colours), np.array(LAMBDAS))
    found = look_up([voxels], "reflectance", PLACES[3:], mode="spectral")
    off = np.abs(found - expected).max(axis=1) > 1e-4
    assert off.mean() < 0.01  # at a border rounding may choose either


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
@pytest.mark.parametrize("smoothing", ["trilinear", "nearest"])
def test_same_voxels_as_mitsuba(wrap, smoothing):
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with is not installed")
    mi.set_variant("scalar_rgb")
    entry = {"type": "gridvolume", "grid": mi.VolumeGrid(VALUES.transpose(2, 1, 0, 3).copy())}
    entry |= {"filter_type": smoothing, "wrap_mode": wrap, "raw": True}
    entry |= {"to_world": mi.ScalarTransform4f(np.linalg.inv(MOVED))}
    theirs = mi.load_dict({"type": "volume", "volume": entry})
    si, places = mi.SurfaceInteraction3f(), PLACES[3:]
    expected = np.empty((len(places), 3))
    for i, place in enumerate(places):
        si.p = mi.Point3f(*map(float, place))
        expected[i] = theirs.eval_3(si)
    voxels = scene.Voxels(values=VALUES, filter=smoothing, wrap=wrap, to_texture=MOVED)
    found = look_up([voxels], "reflectance", places)
    off = np.abs(found - expected).max(axis=1) > 1e-4
    assert off.mean() < (0.01 if smoothing == "nearest" else 1e-9)


@pytest.mark.parametrize("lanes", [1, 8])
def test_mappings(lanes):
    """Each beside the others, and beside the surface's own uv."""
    p = placed(PLACES[3:])
    turn = np.arctan2(p[:, 1], p[:, 0]) / (2 * np.pi)
    theta = np.arctan2(np.hypot(p[:, 0], p[:, 1]), p[:, 2]) / np.pi
    uvs = {
        "uv": PLACES[3:, :2].astype(np.float64),
        "planar": p[:, :2],
        "spherical": np.stack([theta, turn % 1.0], 1),
        "cylindrical": np.stack([turn + 0.5, p[:, 2]], 1),
    }
    made = [scene.Bitmap(image=IMAGE, mapping=name, to_texture=MOVED) for name in uvs]
    each = [reference(IMAGE, uv) for uv in uvs.values()]
    expected = np.choose((np.arange(len(p)) % 4)[:, None], each)
    found = look_up(made, "reflectance", PLACES[3:], lanes=lanes)
    np.testing.assert_allclose(found, expected, atol=1e-4)


@pytest.mark.parametrize(
    ("make", "part"),
    [
        (lambda: scene.Noise(octaves=0), "noise.octaves"),
        (lambda: scene.Marble(octaves=99), "marble.octaves"),
        (lambda: scene.Checkers(to_texture=np.eye(3)), "checkers.to_texture"),
        (lambda: scene.Bitmap(mapping="cubic"), "planar"),
        (lambda: scene.Voxels(values=VALUES[..., :2]), "voxels.values: must be an array"),
        (lambda: scene.Voxels(values=VALUES[0, 0]), "voxels.values"),
        (lambda: scene.Voxels(values=-VALUES), "negative"),
    ],
)
def test_unusable(make, part):
    with pytest.raises(SceneError, match=part):
        make()
