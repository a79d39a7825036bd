"""Levels of images in pictures: a wall seen perpendicular, in a light that makes no noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import clpt
from clpt.scene import Film, Scene, integrators
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Constant
from clpt.scene.shapes import Rectangle
from clpt.scene.textures import Bitmap
from clpt.transforms import look_at, scale
from tests.kernels.test_mip_levels import chain
from tests.kernels.test_textures import reference

SIZE = 256  # texels
NOISE = np.random.default_rng(5).random((SIZE, SIZE, 1)).astype(np.float32)


def wall(width: int, filter: str) -> Scene:
    """A wall that fills the picture; in even light of 1 its radiance is its reflectance."""
    image = Bitmap(image=NOISE, filter=filter, wrap="clamp")
    return Scene(
        camera=Perspective(to_world=look_at((0, 0, 4), (0, 0, 0), (0, 1, 0)), fov=90),
        shapes=[Rectangle(to_world=scale(4), material=m.Diffuse(reflectance=image))],
        lights=[Constant(radiance=1.0)],
        integrator=integrators.Path(max_depth=2),
        film=Film(width=width, height=width, mode="rgb", filter=integrators.Box()),
    )


def test_a_scene_file_keeps_the_filter(tmp_path: Path) -> None:
    clpt.save(wall(8, "trilinear"), tmp_path)
    (shape,) = clpt.load(tmp_path).shapes
    assert shape.material.reflectance.filter == "trilinear"


def picture(scene: Scene, spp: int) -> np.ndarray:
    with clpt.Renderer(scene) as renderer:
        renderer.run(spp)
        return renderer.image()[..., 1].astype(np.float64)


def middle(values: np.ndarray) -> np.ndarray:
    """Where the pixel's angle is that of the axis, but for 6 %."""
    n = len(values)
    return values[3 * n // 8 : 5 * n // 8, 3 * n // 8 : 5 * n // 8]


def test_variance_falls_by_four_a_level_and_the_mean_stays() -> None:
    """A texel of level 2 for each pixel is the mean of 16 that are independent. A variance is that
    of 256 pixels, so their ratio is known by 12 %."""
    plain, mips = (picture(wall(SIZE // 4, filter), 1) for filter in ("bilinear", "trilinear"))
    assert abs(plain.mean() - NOISE.mean()) < 4 * 0.29 / 64
    assert abs(mips.mean() - NOISE.mean()) < 4 * 0.29 / 64 / 4 + 1e-3
    ratio = middle(mips).var() / middle(plain).var()
    assert 0.7 / 16 < ratio < 1.4 / 16


def test_a_scene_may_come_to_have_levels() -> None:
    """As of a new renderer; the programs are those of the tests before."""
    with clpt.Renderer(wall(SIZE // 4, "bilinear")) as renderer:
        renderer.run(1)
        renderer.update(scene=wall(SIZE // 4, "trilinear")).wait()
        renderer.run(1)
        found = renderer.image()[..., 1].astype(np.float64)
    np.testing.assert_array_equal(found, picture(wall(SIZE // 4, "trilinear"), 1))


def test_the_level_follows_the_formula() -> None:
    """Pixels of a width between two levels, against the mean of both over each pixel."""
    width = 48
    found = middle(picture(wall(width, "trilinear"), 1024))
    levels, n = chain(NOISE), 8
    at = (np.arange(width * n) + 0.5) / (width * n)
    uv = np.stack(np.meshgrid(at, 1.0 - at), -1).reshape(-1, 2)

    def expected(detail: float) -> np.ndarray:
        below = int(detail)
        fine, coarse = (
            middle(
                reference(levels[below + i], uv, wrap="clamp")
                .reshape(width, n, width, n)
                .mean(axis=(1, 3))
            )
            for i in (0, 1)
        )
        return fine + (detail - below) * (coarse - fine)

    detail = np.log2(SIZE / width)
    off = {shift: np.abs(found - expected(detail + shift)).mean() for shift in (-0.4, 0.0, 0.4)}
    assert off[0.0] < 0.005
    assert off[0.0] < 0.6 * min(off[-0.4], off[0.4]), off
