"""Lights of PBRT files as lights of ours."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import images, transforms
from clpt.errors import SceneError
from clpt.formats.pbrt import lights
from clpt.formats.pbrt.lights import area_light, light
from tests.formats.pbrt.directives import params, state
from tests.kernels.light_probe import lit
from tests.kernels.test_lights import INFINITE, SAMPLE

TURNED = transforms.translate([1.0, 2.0, 3.0]) @ transforms.rotate([1.0, 1.0, 0.0], 50.0)
MIRRORED = TURNED @ transforms.scale([-2.0, 2.0, 2.0])


def make(kind, ctm=None, folder=None, **given):
    at = state() if folder is None else state(folder)
    at.ctm = np.eye(4) if ctm is None else ctm
    return light(kind, params(**given), at)


def rgb(spectrum):
    return spectrum.to_rgb("emission")


@pytest.fixture
def folder(tmp_path):
    values = np.random.default_rng(2).random((16, 16, 3)).astype(np.float32)
    images.write(tmp_path / "square.pfm", values)
    images.write(tmp_path / "wide.pfm", values[:4])
    return tmp_path


def test_point_and_power():
    made = make(
        "point", TURNED, I=("rgb", 2, 1, 0.5), scale=("float", 3), **{"from": ("point3", 1, 0, 0)}
    )
    assert made.position == pytest.approx(transforms.transform_points(TURNED, [1.0, 0.0, 0.0]))
    assert rgb(made.intensity) == pytest.approx([6, 3, 1.5])
    powerful = make("point", power=("float", 100))
    assert rgb(powerful.intensity) == pytest.approx(np.full(3, 100 / (4 * np.pi)))


def test_spot():
    given = {"from": ("point3", 0, 1, 0), "to": ("point3", 0, 1, 5)}
    made = make("spot", TURNED, coneangle=("float", 40), conedeltaangle=("float", 10), **given)
    assert made.to_world[:3, 3] == pytest.approx(transforms.transform_points(TURNED, [0, 1, 0]))
    assert made.to_world[:3, 2] == pytest.approx(TURNED[:3, 2])
    assert (made.cutoff, made.beam_width, made.edge) == (40.0, 30.0, "smooth")
    powerful = make(
        "spot", coneangle=("float", 40), conedeltaangle=("float", 10), power=("float", 7)
    )
    cosines = np.linspace(np.cos(np.radians(40)), 1.0, 200001)
    x = np.clip((cosines - cosines[0]) / (np.cos(np.radians(30)) - cosines[0]), 0.0, 1.0)
    sent = 2 * np.pi * np.trapezoid(x * x * (3 - 2 * x), cosines)  # of an intensity of one
    assert rgb(powerful.intensity) * sent == pytest.approx(np.full(3, 7.0), rel=1e-5)


def test_distant():
    given = {"from": ("point3", 1, 2, 3), "to": ("point3", 1, 2, 0)}
    made = make("distant", MIRRORED, illuminance=("float", 12), scale=("float", 0.5), **given)
    assert made.direction == pytest.approx(-MIRRORED[:3, 2] / 2.0)
    assert rgb(made.irradiance) == pytest.approx([6, 6, 6])


def test_even_surroundings():
    assert rgb(
        make("infinite", L=("rgb", 0.5, 1, 2), scale=("float", 2)).radiance
    ) == pytest.approx([1, 2, 4])
    assert rgb(make("infinite", illuminance=("float", 5)).radiance) == pytest.approx(
        np.full(3, 5 / np.pi)
    )


@pytest.mark.parametrize("ctm", [TURNED, MIRRORED], ids=["turned", "mirrored"])
def test_images_around(folder, ctm):
    """The light of each direction is the image's at pbrt's place for it."""
    made = make("infinite", ctm, folder, filename=("string", "square.pfm"), scale=("float", 2))
    image = images.read(folder / "square.pfm")
    assert made.scale == 2.0 and made.image.shape == (16, 32, 3)
    found = np.array([made.image[8, column] for column in range(32)])
    d = [[np.sin(a), np.cos(b), -np.cos(a) * np.sin(b)] for b in [8 * np.pi / 15] for a in [0.1]]
    own = np.linalg.inv(ctm[:3, :3]) @ np.array(d[0])
    u, v = lights.to_square(own / np.linalg.norm(own))
    near = image[
        max(int(v * 16) - 1, 0) : int(v * 16) + 2, max(int(u * 16) - 1, 0) : int(u * 16) + 2
    ]
    assert (near.min(axis=(0, 1)) - 1e-6 <= found[0]).all()
    assert (found[0] <= near.max(axis=(0, 1)) + 1e-6).all()


def test_goniometric(folder):
    made = make(
        "goniometric", TURNED, folder, filename=("string", "square.pfm"), power=("float", 9)
    )
    image = images.read(folder / "square.pfm").mean(axis=2)
    assert rgb(made.intensity) == pytest.approx(np.full(3, 9 / (4 * np.pi * image.mean())))
    assert made.to_world[:3, 3] == pytest.approx(TURNED[:3, 3])
    even = make("goniometric", I=("rgb", 1, 2, 3))
    assert (even.image.image == 1.0).all() and rgb(even.intensity) == pytest.approx([1, 2, 3])


@pytest.mark.parametrize("ctm", [TURNED, MIRRORED], ids=["turned", "mirrored"])
def test_projection(folder, ctm):
    """pbrt's intensity is the image's; x goes right with y up, fov is that of the shorter side."""
    made = make("projection", ctm, folder, filename=("string", "wide.pfm"), fov=("float", 60))
    image = images.read(folder / "wide.pfm")
    right, up = (
        (2 * (5 + 0.5) / 16 - 1) * 4 * np.tan(np.radians(30)),
        (1 - 2 * (1 + 0.5) / 4) * np.tan(np.radians(30)),
    )
    axes = made.to_world[:3, :3] / np.linalg.norm(made.to_world[:3, 2])
    world = ctm[:3, :3] @ np.array([right, up, 1.0]) / 2.0 ** (ctm is MIRRORED)
    x, y, z = axes.T @ world
    half = np.tan(np.radians(made.fov / 2))
    column, row = (0.5 - 0.5 * x / z / half) * 16, (0.5 - 0.5 * y / z / (half / 4)) * 4
    cosine = z / np.linalg.norm(world)
    shown = made.image.image[int(row), int(column)] / cosine**3
    assert shown == pytest.approx(image[1, 5], rel=1e-5)


def test_area_lights(folder):
    def area(size=0.0, **given):
        return area_light("diffuse", params(**given), state(folder), size)

    made = area(L=("rgb", 3, 2, 1), scale=("float", 2), twosided=("bool", True))
    assert made.two_sided and rgb(made.radiance) == pytest.approx([6, 4, 2])
    assert rgb(area(2.0, power=("float", 10)).radiance) == pytest.approx(
        np.full(3, 10 / (2 * np.pi))
    )
    shown = area(filename=("string", "wide.pfm"), scale=("float", 4)).radiance
    assert shown.image == pytest.approx(4 * images.read(folder / "wide.pfm"))


@pytest.mark.parametrize(
    "kind, given, message",
    [
        ("infinite", {"filename": ("string", "wide.pfm")}, "16x4.*square"),
        ("infinite", {"filename": ("string", "square.pfm"), "L": ("rgb", 1, 1, 1)}, "either"),
        ("infinite", {"filename": ("string", "none.pfm")}, "there is no file 'none.pfm'"),
        ("projection", {}, "filename"),
        ("distant", {"to": ("point3", 0, 0, 0)}, "differ"),
        ("spot", {"coneangle": ("float", 3)}, "conedeltaangle"),
        ("point", {"scale": ("float", -1)}, "negative"),
        ("sun", {}, "unknown light"),
    ],
)
def test_what_is_no_light_is_told(folder, kind, given, message):
    with pytest.raises(SceneError, match=message):
        make(kind, None, folder, **given)


def smooth(d):
    """Something of each direction (..., 3), between 0 and 1: (..., 3)."""
    x, y, z = np.moveaxis(d, -1, 0)
    return np.stack([0.5 + 0.4 * x, 0.5 + 0.4 * y, 0.5 + 0.3 * z + 0.1 * x * y], axis=-1)


def around(count=64):
    """Directions (count, 3) over the sphere, none of them along an axis."""
    d = np.random.default_rng(7).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def octahedral_file(folder):
    centres = (np.arange(128) + 0.5) / 128
    image = smooth(lights.to_sphere(np.stack(np.meshgrid(centres, centres), axis=-1)))
    images.write(folder / "smooth.pfm", image)
    return {"filename": ("string", "smooth.pfm"), "scale": ("float", 2)}


def intensities(made, ctm, d):
    """What a light at the origin of `ctm` sends in directions (n, 3) of the world: (n, 3)."""
    points = ctm[:3, 3] + 2.0 * d
    given = np.vstack([points.T, np.zeros((3, len(d)))])
    found = lit([made], radius=10.0)(SAMPLE, given, 8)
    return (np.where(found[4] != 0.0, found[5:], 0.0) * 4.0).T


@pytest.mark.parametrize("ctm", [TURNED, MIRRORED], ids=["turned", "mirrored"])
class TestKernels:
    """What the kernels make of our lights, against pbrt's formulas in its light's own space."""

    def test_infinite(self, tmp_path, ctm):
        made = make("infinite", ctm, tmp_path, **octahedral_file(tmp_path))
        d = around()
        own = d @ np.linalg.inv(ctm[:3, :3]).T
        found = lit([made])(INFINITE, d.T, 4)[:3].T
        wanted = 2.0 * smooth(own / np.linalg.norm(own, axis=1, keepdims=True))
        np.testing.assert_allclose(found, wanted, atol=0.03)

    def test_goniometric(self, tmp_path, ctm):
        made = make("goniometric", ctm, tmp_path, **octahedral_file(tmp_path))
        d = around()
        own = (d @ np.linalg.inv(ctm[:3, :3]).T)[:, [0, 2, 1]]
        wanted = 2.0 * smooth(own / np.linalg.norm(own, axis=1, keepdims=True)).mean(axis=1)
        np.testing.assert_allclose(intensities(made, ctm, d)[:, 1], wanted, atol=0.03)

    def test_projection(self, tmp_path, ctm):
        """An image of 2 to 1 whose red grows to the right and whose green grows downward."""
        v, u = np.meshgrid(
            (np.arange(128) + 0.5) / 128, (np.arange(256) + 0.5) / 256, indexing="ij"
        )
        images.write(tmp_path / "ramp.pfm", np.stack([u, v, 0.5 + 0.0 * u], axis=-1))
        given = {"filename": ("string", "ramp.pfm"), "fov": ("float", 60)}
        made = make("projection", ctm, tmp_path, **given)
        rng = np.random.default_rng(8)
        u, v = rng.uniform(-0.1, 1.1, (2, 200))
        reach = np.tan(np.radians(30.0))
        own = np.stack([(2 * u - 1) * 2 * reach, (1 - 2 * v) * reach, np.ones(200)], axis=-1)
        d = own @ ctm[:3, :3].T
        found = intensities(made, ctm, d / np.linalg.norm(d, axis=1, keepdims=True))
        inside = ((u > 0) & (u < 1) & (v > 0) & (v < 1))[:, None]
        wanted = np.where(inside, np.stack([u, v, np.full(200, 0.5)], axis=-1), 0.0)
        np.testing.assert_allclose(found, wanted, atol=0.01)
