"""Light paths are joined to calibrated cameras: they bring what paths from the camera find.

Means over blocks of pixels are compared by the spread of independent exposures; see
tests/pictures/support.py for the significance.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, cameras, lights
from clpt.scene.conventions import calibrated
from clpt.scene.integrators import ParticleTracer, Path, Vcm
from clpt.scene.materials import Dielectric
from clpt.scene.motion import Keys, Shutter
from clpt.scene.shapes import Sphere
from tests.pictures.camera.test_calibrated import MODELS, SIZE
from tests.pictures.support import assert_agree, blocks, exposures, quick, with_film
from tests.pictures.transport import test_hybrid
from tests.pictures.transport.test_light_tracing import VIEW, both, still_life

FOLDED = ("opencv", [60.0, 60.0, 47.5, 35.5], (-0.4, 0.0, 0.0, 0.0))  # black at its corners
VIEWS = {**MODELS, "folded": FOLDED}
ONE_LAMP = {"rectangle": 10.0, "point": 3.0}


def view(name: str, **changes) -> cameras.Calibrated:
    model, intrinsics, distortion = VIEWS[name]
    return cameras.Calibrated(
        model=model, intrinsics=intrinsics, distortion=distortion, size=SIZE, to_world=VIEW,
        **changes,
    )  # fmt: skip


@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", quick(VIEWS, "brown_conrady", "equidistant", "double_sphere"))
def test_particle_tracer(name: str, mode: str) -> None:
    """Surfaces, lamps in view and a sky."""
    both(still_life(mode, {**ONE_LAMP, "constant": 0.5}, view(name)), 16, name, depth=3)


@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", quick(VIEWS, "kannala_brandt", "folded"))
def test_path_with_light_paths(name: str, mode: str) -> None:
    scene = dataclasses.replace(
        test_hybrid.corner({"sphere": 30.0, "spot": 8.0}, mode=mode), camera=view(name)
    )
    test_hybrid.both(scene, 128, name, max_depth=3)


@pytest.mark.slow
@pytest.mark.parametrize("merging", [False, True])
@pytest.mark.parametrize("name", ["rational", "fov", "ucm", "folded"])
def test_vcm(name: str, merging: bool) -> None:
    scene = test_hybrid.corner({"sphere": 30.0, "spot": 8.0})
    scene = dataclasses.replace(scene, camera=view(name))
    reference = dataclasses.replace(scene, integrator=Path(max_depth=3, light_paths=0))
    ours = dataclasses.replace(scene, integrator=Vcm(max_depth=3, merging=merging))
    assert_agree(
        blocks(exposures(ours, 12, 64, first_seed=101)), blocks(exposures(reference, 12, 256)), name
    )


@pytest.mark.parametrize("name", VIEWS)
def test_a_sky_is_as_bright_in_every_pixel_that_is_seen(name: str) -> None:
    """Joins know the solid angles of pixels; what no direction leads to stays black."""
    scene = Scene(
        camera=view(name), lights=[lights.Constant(radiance=1.0)],
        film=Film(size=(48, 36), mode="rgb"), integrator=ParticleTracer(),
    )  # fmt: skip
    seen = clpt.render(dataclasses.replace(scene, integrator=Path(max_depth=1)), 1)[..., 1] > 0.5
    assert seen.mean() < 0.9 if name == "folded" else seen.all()
    image = np.mean(exposures(scene, 8, 2048), axis=0)[..., 1]
    assert (image[~seen] == 0.0).all()
    # Blocks of 36 pixels scatter by .3 % at most.
    np.testing.assert_allclose(image[seen].mean(), 1.0, atol=2e-3)
    whole = blocks(1.0 * seen[..., None], 6) == 1.0
    np.testing.assert_allclose(blocks(image[..., None], 6)[whole], 1.0, atol=0.02)


@pytest.mark.slow
def test_a_crop() -> None:
    scene = with_film(still_life("rgb", ONE_LAMP, view("kannala_brandt")), width=24, height=20)
    both(with_film(scene, crop=(4, 6, 16, 12)), 16, "crop", depth=3)


@pytest.mark.slow
def test_a_camera_that_moves() -> None:
    ways = Keys([0.0, 1.0], [np.eye(4), tf.translate([0.3, 0.1, 0.0]) @ tf.rotate([0, 1, 0], 8)])
    camera = view("brown_conrady", motion=ways, shutter=Shutter(0.0, 1.0))
    both(still_life("rgb", ONE_LAMP, camera), 32, "moves", depth=3)


@pytest.mark.parametrize("name", VIEWS)
def test_a_caustic_is_brought_by_light_paths(name: str) -> None:
    """`auto` and `vcm` take them for a ball of glass below a small lamp, as with a pinhole."""
    glass = Sphere(center=(0.1, 0.45, 0.2), radius=0.4, material=Dielectric(int_ior=1.5))
    scene = test_hybrid.corner({}, test_hybrid.lamp(0.1), glass)
    for camera in (scene.camera, view(name)):
        own = dataclasses.replace(scene, camera=camera)
        assert lower(own).features.transport.joined
        both_ways = lower(dataclasses.replace(own, integrator=Vcm())).features.transport
        assert both_ways.joined and both_ways.merged


def test_the_view_is_as_wide_as_that_of_the_same_pinhole() -> None:
    pinhole = cameras.Perspective(to_world=VIEW, fov=50.0)
    same, other = pinhole.view_of(64, 48), calibrated(pinhole, 64, 48).view_of(64, 48)
    assert same is not None
    for name in ("origin", "axis", "width", "angle"):
        np.testing.assert_allclose(vars(other)[name], vars(same)[name], atol=1e-6)


def test_rows_have_times_that_light_paths_do_not_know() -> None:
    rolls = view("ucm", shutter=Shutter(0.0, 1.0, readout=0.5))
    scene = still_life("rgb", ONE_LAMP, rolls)
    with pytest.raises(SceneError, match="a shutter without readout"):
        clpt.Renderer(dataclasses.replace(scene, integrator=ParticleTracer()))
    with clpt.Renderer(dataclasses.replace(scene, integrator=Path(light_paths=1))) as renderer:
        assert any("opens row by row" in line for line in renderer.warnings)
