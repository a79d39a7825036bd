"""Lights know their bounds and power, cameras their extent, textures and materials their parts."""

from __future__ import annotations

import dataclasses
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import transforms
from clpt.render.spectra.find import Look
from clpt.scene import Film, Scene, lights, materials, shapes, textures
from clpt.scene.cameras import KINDS, Perspective
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.params import factor, host, params, real
from clpt.scene.roles import REAL, Role
from clpt.scene.values import Attributes, Operation, Texture, Use, brightness_at
from clpt.spectra import Constant
from clpt.view import probe
from tests.kernels import strangers
from tests.kernels.kind_contract import LAMPS, check_bounds, check_number, check_power
from tests.kernels.test_textures import look_up

ROOT = Path(__file__).resolve().parents[2]
each = pytest.mark.parametrize("cls", LAMPS, ids=lambda cls: cls.kind)


@each
def test_samples_lie_within_the_bounds(cls: type[lights.Light]) -> None:
    check_bounds(cls)


@each
def test_the_power_is_that_of_the_extent(cls: type[lights.Light]) -> None:
    check_power(cls)


@pytest.mark.parametrize("number", [40, pytest.param(10_000, marks=pytest.mark.slow)])
@each
def test_many_light_as_one_does(cls: type[lights.Light], number: int) -> None:
    check_number(cls, number)


def test_a_light_that_does_not_know_its_bounds_is_everywhere() -> None:
    assert lights.Light.bounds(lights.Constant()) is None


def test_lights_of_the_tests_own(tmp_path: Path) -> None:
    """A wire that does not know its bounds and a tube that does, in a copy of the package."""
    for folder in ("clpt", "kernels"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("*.pyc"))
    file = tmp_path / "clpt/scene/lights.py"
    before, after = file.read_text("utf-8").split("\nON_SHAPES = ")
    after = after.replace("*ON_SHAPES, Point,", "*ON_SHAPES, Point, Wire, Tube,", 1)
    file.write_text(f"{before}\n{strangers.PYTHON}\nON_SHAPES = {after}", "utf-8")
    for name in strangers.POINTS:
        text = strangers.sampling(name) + strangers.emitting(name)
        (tmp_path / f"kernels/lights/kinds/{name.lower()}.cl").write_text(text, "utf-8")
    command = [sys.executable, "-m", "tests.kernels.kind_contract", *strangers.POINTS]
    paths = os.pathsep.join([str(tmp_path), str(ROOT)])
    environment = {**os.environ, "PYTHONPATH": paths}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    expected = ["Wire keeps its contract False", "Tube keeps its contract True"]
    assert done.stdout.splitlines() == expected


# ---- cameras


@dataclass(frozen=True, kw_only=True, eq=False)
class Anamorphic(Perspective):
    """A pinhole whose pixels see `squeeze` times as wide as high."""

    kind = Perspective.kind

    squeeze: float = real(2.0, "width of a pixel's view over its height", low=1e-3)

    def extent(self, width: float, height: float) -> tuple[float, float]:
        x, y = super().extent(width, height)
        along_x = self.fov_axis == "x"
        return (x, y / self.squeeze) if along_x else (x * self.squeeze, y)


WALL = shapes.Rectangle(to_world=transforms.scale(100.0), material=materials.Diffuse())
PINHOLES = [cls for cls in KINDS if issubclass(cls, Perspective)]
WIDTH, HEIGHT, AWAY = 24, 16, 3.0


def wall(camera: Perspective) -> Scene:
    film = Film(width=WIDTH, height=HEIGHT, mode="rgb", layers=("position",))
    return Scene(camera=camera, film=film, shapes=[WALL], integrator=PathIntegrator(max_depth=1))


def positions(scene: Scene, spp: int = 64) -> np.ndarray:
    with clpt.Renderer(scene) as renderer:
        renderer.run(spp)
        return np.asarray(renderer.layers()["position"], float)


@pytest.mark.parametrize("cls", [*PINHOLES, Anamorphic])
@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_extent_is_what_rays_span(cls: type[Perspective], axis: str) -> None:
    """Centres of opposite corner pixels lie an extent less a pixel apart on a wall."""
    small = {"aperture_radius": 0.0} if "thin" in cls.kind else {}
    place = transforms.look_at([0, 0, AWAY], [0, 0, 0], [0, 1, 0])
    camera = cls(to_world=place, fov=50.0, fov_axis=axis, **small)
    seen = positions(wall(camera))
    extent = np.array(camera.extent(WIDTH, HEIGHT))
    pixels = np.array([WIDTH, HEIGHT])
    span = np.abs(seen[0, 0] - seen[-1, -1])[:2] / (pixels - 1) * pixels / AWAY
    np.testing.assert_allclose(span, extent, rtol=0.02)
    assert 2.0 * camera.half_height(WIDTH / HEIGHT) == pytest.approx(extent[1])


@pytest.mark.parametrize("cls", [*PINHOLES, Anamorphic])
@pytest.mark.parametrize("axis", ["x", "y"])
def test_the_inspector_sees_the_pixel(cls: type[Perspective], axis: str) -> None:
    """Numbers that the kind declares are not their defaults."""
    plain = {"near", "far", "focus_distance", "focal_length"}
    numbers = {name for name, p in params(cls).items() if p.role is REAL} - plain
    values = {name: 1.2 * getattr(cls(), name) or 0.2 for name in numbers}
    values |= {"aperture_radius": 0.0} if "thin" in cls.kind else {}
    place = transforms.look_at([1, 2, AWAY], [0, 0, 0], [0, 1, 0])
    scene = wall(cls(to_world=place, fov_axis=axis, **values))
    whole = positions(scene)
    for x, y in ((0, 0), (20, 3), (11, 15)):
        centre = positions(probe.surfaces_of(scene, x, y), 1)[0, 0]
        around = np.abs(whole[y, x] - whole[min(y + 1, 15) - (y == 15), x - 1]).max()
        assert np.abs(centre - whole[y, x]).max() < 0.3 * around + 0.02


def test_a_camera_whose_pixel_it_cannot_narrow_is_cropped() -> None:
    """A film that a field of view cannot give: the pixel is cut from the whole film."""

    @dataclass(frozen=True, kw_only=True, eq=False)
    class Stretched(Perspective):
        kind = Perspective.kind

        def extent(self, width: float, height: float) -> tuple[float, float]:
            x, y = super().extent(width, height)
            return x + 0.1, y

    scene = wall(Stretched(to_world=transforms.look_at([0, 0, AWAY], [0, 0, 0], [0, 1, 0])))
    assert scene.camera.pixel_camera(WIDTH, HEIGHT, 3, 4) is None
    pixel = probe.pixel_of(scene, 3, 4, 0, PathIntegrator(max_depth=1))
    assert pixel.film.crop == (3, 4, 1, 1) and pixel.camera is scene.camera
    assert dataclasses.replace(pixel.film, crop=None).width == WIDTH


# ---- textures

# Of a constant beside a texture: lights are weighed by it as by equal energy, which is 2.1 %
# brighter than the D65 that kernels take.
ROUGH = 0.022
LOOK = Look(spectral=False, lo=360.0, hi=830.0)
TEXELS = np.random.default_rng(3).random((8, 8, 3)).astype(np.float32)
MOVED = np.array([[1.5, -0.4, 0.3], [0.7, 2.0, -1.2], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, kw_only=True, eq=False)
class Screen(Texture):
    """A texture of the tests' own: 1 - (1 - first) (1 - second), as of two projectors."""

    first: object = factor(0.0, "a colour")
    second: object = real(0.5, "a number", textured=True)

    @property
    def combines(self) -> bool:
        return True

    def operation(self, use: Use, role: Role) -> Operation | None:
        return "mix", ((self.first, use), (Constant(1.0), use), (self.second, "real"))

    def brightness_at(
        self, look: object, uv: np.ndarray, area: np.ndarray, attributes: Attributes
    ) -> np.ndarray:
        first, second = (
            brightness_at(part, LOOK, uv, area, attributes) for part in (self.first, self.second)
        )
        return 1.0 - (1.0 - first) * (1.0 - second)


def bitmap(**more: object) -> textures.Bitmap:
    return textures.Bitmap(image=TEXELS, filter="nearest", **more)


def board(**more: object) -> textures.Checkerboard:
    return textures.Checkerboard(color0=(0.9, 0.2, 0.1), color1=0.3, **more)


GREY = textures.Bitmap(image=TEXELS.mean(axis=2), filter="nearest")
GRAPH = {
    "fine": {"type": "multiply", "in1": "texcoord", "in2": (5.0, 3.0)},
    "noise": {"type": "noise2d", "texcoord": "fine", "amplitude": 2.0, "pivot": 0.5},
    "image": {"type": "texture", "channels": 4},
    "color": {"type": "convert", "in": "image"},
    "board": {"type": "texture", "texture": 1},
    "node": {"type": "mix", "fg": "color", "bg": "board", "mix": "noise"},
}
KNOWN = {
    "bitmap": bitmap(),
    "moved bitmap": bitmap(to_uv=MOVED, wrap="mirror", wrap_v="clamp"),
    "zero around": bitmap(to_uv=MOVED, wrap="zero"),
    "board": board(to_uv=MOVED),
    "board of images": textures.Checkerboard(color0=bitmap(), color1=GREY),
    "product": textures.Product(first=bitmap(), second=2.0),
    "mix": textures.Mix(first=bitmap(), second=0.25, amount=GREY),
    "screen": Screen(first=GREY, second=GREY),
    "graph": textures.Graph(nodes=GRAPH, textures=[bitmap(to_uv=MOVED), board()]),
}


@pytest.mark.parametrize("texture", KNOWN.values(), ids=KNOWN)
def test_a_texture_knows_its_brightness(texture: Texture) -> None:
    """Off the borders of texels it is the mean of the channels that kernels look up."""
    uv = (np.random.default_rng(4).integers(0, 64, (500, 2)) + 0.5) / 64.0
    expected = look_up([texture], "emission", uv).mean(axis=1)
    area = np.zeros(1)
    found = texture.brightness_at(LOOK, uv[None], area, {})[0]
    np.testing.assert_allclose(found, expected, rtol=ROUGH, atol=1e-6)


@pytest.mark.parametrize("name", ["bitmap", "product", "mix", "graph"])
def test_a_mean_is_that_of_all_points(name: str) -> None:
    texture = {**KNOWN, "mix": textures.Mix(first=bitmap(), second=0.25, amount=0.3)}[name]
    axis = (np.arange(64) + 0.5) / 64.0
    uv = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    expected = look_up([texture], "emission", uv).mean(dtype=np.float64)
    assert texture.mean(LOOK) == pytest.approx(expected, rel=ROUGH)


# ---- materials


@dataclass(frozen=True, kw_only=True, eq=False)
class Dusted(materials.Material):
    """A composite of the tests' own: dust, a dull grey, on a share of another material."""

    is_composite = True

    material: materials.Material = host(materials.Diffuse(), "below the dust", form="material")
    dust: materials.Material = host(materials.Diffuse(reflectance=0.4), "dust", form="material")
    share: float = real(0.5, "of the surface that has dust", "", 0.0, 1.0)

    @property
    def mixture(self) -> tuple[object, materials.Material, materials.Material]:
        return self.share, self.material, self.dust


def test_a_composite_of_the_tests_own() -> None:
    """It shades as a blend of the same materials, to the bit."""
    below, dust = materials.Diffuse(reflectance=(0.9, 0.3, 0.1)), materials.Diffuse(reflectance=0.4)
    blended = materials.Blend(first=below, second=dust, weight=0.25)
    pictures = []
    for material in (Dusted(material=below, dust=dust, share=0.25), blended):
        wall_ = dataclasses.replace(WALL, material=material)
        camera = Perspective(to_world=transforms.look_at([0, 0, AWAY], [0, 0, 0], [0, 1, 0]))
        film = Film(width=8, height=8, mode="rgb")
        scene = Scene(camera=camera, film=film, shapes=[wall_], lights=[lights.Constant()])
        pictures.append(np.asarray(clpt.render(scene, spp=4)))
    np.testing.assert_array_equal(*pictures)
    assert 0.1 < pictures[0][..., 2].mean() < 0.4
