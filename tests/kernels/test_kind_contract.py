"""Lights know their bounds and power, cameras their extent; kinds of the tests' own too."""

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
from clpt.scene import Film, Scene, lights, materials, shapes
from clpt.scene.cameras import KINDS, Perspective
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.params import real
from clpt.view import probe
from tests.kernels import kind_contract, strangers
from tests.kernels.kind_contract import LAMPS, check_bounds, check_number, check_power

ROOT = Path(__file__).resolve().parents[2]
each = pytest.mark.parametrize("cls", LAMPS, ids=lambda cls: cls.kind)


@each
def test_samples_lie_within_the_bounds(cls: type[lights.Light]) -> None:
    check_bounds(cls)


@each
def test_the_power_is_that_of_the_extent(cls: type[lights.Light]) -> None:
    check_power(cls)


@pytest.mark.parametrize("number", kind_contract.NUMBERS[1:])
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
    small = {"aperture_radius": 0.0} if "thin" in cls.kind else {}
    place = transforms.look_at([1, 2, AWAY], [0, 0, 0], [0, 1, 0])
    scene = wall(cls(to_world=place, fov=50.0, fov_axis=axis, **small))
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
