"""A random texel in the place of the filtered value: the picture's mean is the same.

The yardstick is the same image mixed with itself, a program of textures, which is always filtered.
See tests/pictures/support.py for the significance.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clpt.images.spectral_exr import SpectralImage
from clpt.render.flow import programs
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, textures
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Integrator, Path, Whitted
from clpt.scene.lights import Area, Constant
from clpt.scene.materials import LEAVES
from clpt.scene.params import device_params
from clpt.scene.shapes import Rectangle
from clpt.transforms import look_at, rotate, scale, translate
from tests.pictures.support import assert_agree, blocks, exposures

RNG = np.random.default_rng(4)
COLOURS = RNG.random((3, 4, 3)).astype(np.float32)  # few texels: each fills many pixels
IMAGES: dict[str, Any] = {
    "bytes": (255 * COLOURS).astype(np.uint8),
    "floats": COLOURS,
    "bands": SpectralImage(RNG.random((3, 4, 9)), np.linspace(400, 720, 9), False),
}
LINEAR = [(c, n) for c in LEAVES for n, p in device_params(c).items() if p.linear]
CHECKED = {m.Diffuse}  # quickly; others make up many programs
TEXEL = "spectrum_texture_texel("  # what a random texel is read by


def room(material: m.Material, mode: str = "rgb", integrator: Integrator | None = None) -> Scene:
    """A floor and a wall of a material under a lamp, in an even sky."""
    lamp = translate([0.2, 1.8, 0.3]) @ rotate([1, 0, 0], 90) @ scale(0.4)
    return Scene(
        camera=Perspective(to_world=look_at((0.3, 1.0, 2.5), (0, 0.4, 0), (0, 1, 0)), fov=60),
        shapes=[
            Rectangle(to_world=rotate([1, 0, 0], -90) @ scale(1.5), material=material),
            Rectangle(to_world=translate([0, 0.8, -1]), material=material),
            Rectangle(to_world=lamp, material=m.Diffuse(), emission=Area(radiance=6.0)),
        ],
        lights=[Constant(radiance=0.5)],
        integrator=integrator or Path(max_depth=5),
        film=Film(width=24, height=16, mode=mode),
    )


def agree(cls: type[m.Material], name: str, image: Any, mode: str, **options: Any) -> None:
    """Compare pictures with a bitmap in a parameter, and with what is filtered."""
    bitmap = textures.Bitmap(image=image, wrap="clamp")
    filtered = textures.Mix(first=bitmap, second=bitmap, amount=0.5)
    made = []
    for seed, value in ((1, bitmap), (101, filtered)):
        scene = room(cls(**{name: value}), mode, **options)
        made.append(blocks(exposures(scene, 12, 64, first_seed=seed)))
    assert_agree(*made, f"{cls.kind}.{name}")


@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("cls", "name"),
    [pytest.param(*one, marks=() if one[0] in CHECKED else pytest.mark.slow) for one in LINEAR],
)
def test_every_parameter_that_takes_part(cls: type[m.Material], name: str, mode: str) -> None:
    agree(cls, name, IMAGES["bytes"], mode)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("image", ["floats", "bands"])
def test_every_image(image: str, mode: str) -> None:
    agree(m.Diffuse, "reflectance", IMAGES[image], mode)


@pytest.mark.slow
@pytest.mark.parametrize("integrator", [Path(max_depth=4, light_paths=1), Whitted()])
def test_other_integrators(integrator: Integrator) -> None:
    agree(m.Diffuse, "reflectance", IMAGES["bytes"], "rgb", integrator=integrator)


def shading(scene: Scene, kind: str = "diffuse") -> str:
    """The text that shades a kind."""
    return programs.sources(lower(scene).features, "wide8", 1, queued=False)[f"shade_{kind}"].text


def test_only_images_take_part() -> None:
    bitmap, board = textures.Bitmap(image=COLOURS), textures.Checkerboard()
    assert TEXEL in shading(room(m.Diffuse(reflectance=bitmap)))
    for value in (0.3, board):
        assert TEXEL not in shading(room(m.Diffuse(reflectance=value)))
    plastic = room(m.Plastic(diffuse_reflectance=bitmap))
    assert TEXEL not in shading(plastic, "plastic"), "its pdf knows the colour"
