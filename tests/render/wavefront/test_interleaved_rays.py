"""Rays of a work-item's paths in flight: the same picture, to the bit, as one after another."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import device, transforms
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.render.records import MotionFeatures
from clpt.render.wavefront import strategy
from clpt.render.wavefront.strategy import Tuning
from clpt.scene import Film, Scene, integrators, materials
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Area, Constant
from clpt.scene.shapes import Curves, Disk, Mesh, Sphere, Spheres


def scene(*more) -> Scene:
    """Triangles in a ball around the camera, with gaps to the sky."""
    rng = np.random.default_rng(3)
    around = rng.normal(size=(400, 1, 3))
    around *= 3 / np.linalg.norm(around, axis=-1, keepdims=True)
    corners = around + rng.normal(size=(400, 3, 3)) * 0.4
    mesh = Mesh(
        vertices=corners.reshape(-1, 3).astype(np.float32),
        faces=np.arange(1200, dtype=np.uint32).reshape(-1, 3),
    )
    film = Film(width=16, height=16, mode="rgb")
    return Scene(camera=Perspective(), shapes=[mesh, *more], lights=[Constant()], film=film)


@pytest.fixture
def wide() -> None:
    """The device has several lanes."""
    if device.choose().lanes == 1:
        pytest.skip("a work-item of this device has one ray")


@pytest.mark.usefixtures("wide")
@pytest.mark.parametrize("looped", [pytest.param(False, marks=pytest.mark.slow), True])
def test_the_same_picture(monkeypatch: pytest.MonkeyPatch, looped: bool) -> None:
    monkeypatch.setattr(strategy, "INTERLEAVED_TRIANGLES", 0)
    pictures = []
    for larger in (False, True):
        monkeypatch.setattr(
            "clpt.bvh.outgrows_caches",
            lambda *of, larger=larger: larger,
        )
        with clpt.Renderer(scene(), layout="wide8", looped=looped) as renderer:
            wavefront = renderer._wavefront
            assert wavefront.scene.strategy.interleaved == larger
            renderer.run(16)
            pictures.append(np.array(renderer.image()))
            assert wavefront.counts.closest > 1.2 * wavefront.counts.samples
    assert pictures[0].std() > 0
    np.testing.assert_array_equal(*pictures)


def strands(seed: int, basis: str, opacity: float = 1.0) -> Curves:
    """Forty strands within the ball of triangles."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(40, 1, 4)) + np.cumsum(rng.normal(size=(40, 7, 4)) * 0.3, axis=1)
    points[..., 3] = 0.04
    own = materials.Diffuse(reflectance=0.6)
    own = own if opacity == 1.0 else materials.Mask(opacity=opacity, material=own)
    return Curves(points=points.reshape(-1, 4), lengths=(7,) * 40, basis=basis, material=own)


OTHERS = (
    Sphere(center=(0.5, 0.3, -1.0), radius=0.3, emission=Area(radiance=4.0)),
    Sphere(center=(-0.4, 0.0, -1.5), radius=0.4),
    Disk(to_world=transforms.translate([0.0, -0.5, -2.0]), flip_normals=True),
)


@pytest.mark.usefixtures("wide")
@pytest.mark.parametrize(
    ("integrator", "opacity", "others", "looped"),
    [
        (integrators.Path(max_depth=5), 1.0, (), True),
        pytest.param(integrators.Path(max_depth=5), 0.7, OTHERS, False, marks=pytest.mark.slow),
        pytest.param(integrators.Vcm(max_depth=4), 0.7, OTHERS, True, marks=pytest.mark.slow),
    ],
)
def test_the_same_picture_of_curves(monkeypatch, integrator, opacity, others, looped) -> None:
    """Nearest hits, rays to lights, also through what lets light pass, and to the camera."""
    hair = strands(1, "bspline", opacity), strands(2, "linear", opacity)
    shown = dataclasses.replace(scene(*hair, *others), integrator=integrator)
    pictures = []
    for least in (1 << 30, 100):
        monkeypatch.setattr(strategy, "INTERLEAVED_PIECES", least)
        with clpt.Renderer(shown, layout="wide8", looped=looped) as renderer:
            assert renderer._wavefront.scene.strategy.interleaved == (least == 100)
            renderer.run(16)
            pictures.append(np.array(renderer.image()))
    assert pictures[0].std() > 0.01
    if isinstance(integrator, integrators.Path):
        np.testing.assert_array_equal(*pictures)
    else:  # photons are gathered in the order in which they come
        np.testing.assert_allclose(*pictures, rtol=1e-4, atol=1e-5)


def test_many_curves_and_little_else(monkeypatch: pytest.MonkeyPatch) -> None:
    on, hair = device.choose(), lower(scene(strands(1, "bspline")))
    ball = lower(scene(strands(1, "bspline"), Sphere()))
    balls = lower(scene(strands(1, "bspline"), Spheres(centers=[[0, 0, 0]], radii=1.0)))

    def interleaved(lowered: Lowered, layout: str = "wide8") -> bool:
        return strategy.choose(on, lowered, Tuning(layout=layout)).interleaved

    assert not interleaved(hair)
    monkeypatch.setattr(strategy, "INTERLEAVED_PIECES", len(hair.boxes))
    assert interleaved(hair) == interleaved(ball) == (on.lanes > 1) and not interleaved(balls)
    with monkeypatch.context() as patched:
        patched.setattr(strategy, "FEW_OTHERS", 0)
        assert not interleaved(ball)
    assert not interleaved(hair, "binary")
    for what in ("camera", "shapes", "vertices"):
        moving = dataclasses.replace(hair.features, motion=MotionFeatures(**{what: True}))
        found = interleaved(dataclasses.replace(hair, features=moving))
        assert found == (on.lanes > 1 and what == "camera")


def test_only_large_trees_of_triangles(monkeypatch: pytest.MonkeyPatch) -> None:
    on, plain, ball = device.choose(), lower(scene()), lower(scene(Sphere()))

    def interleaved(lowered: Lowered) -> bool:
        return strategy.choose(on, lowered, Tuning(layout="wide8")).interleaved

    monkeypatch.setattr(strategy, "INTERLEAVED_TRIANGLES", 400)
    monkeypatch.setattr("clpt.bvh.outgrows_caches", lambda *of: False)
    assert not interleaved(plain)
    monkeypatch.setattr("clpt.bvh.outgrows_caches", lambda *of: True)
    assert interleaved(plain) == (on.lanes > 1) and not interleaved(ball)
    monkeypatch.setattr(strategy, "INTERLEAVED_TRIANGLES", 401)
    assert not interleaved(plain)
