"""Rays of a work-item's paths in flight: the same picture, to the bit, as one after another."""

from __future__ import annotations

import numpy as np
import pytest

import clpt
from clpt import device
from clpt.render.lowering.scene import Lowered, lower
from clpt.render.wavefront import strategy
from clpt.render.wavefront.strategy import Tuning
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Constant
from clpt.scene.shapes import Mesh, Sphere


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
            wavefront = renderer.wavefronts[0]
            assert wavefront.scene.strategy.interleaved == larger
            renderer.run(16)
            pictures.append(np.array(renderer.image()))
            assert wavefront.counts.closest > 1.2 * wavefront.counts.samples
    assert pictures[0].std() > 0
    np.testing.assert_array_equal(*pictures)


def test_only_large_trees_of_triangles(monkeypatch: pytest.MonkeyPatch) -> None:
    on, plain, ball = device.choose(), lower(scene()), lower(scene(Sphere()))

    def interleaved(lowered: Lowered) -> bool:
        return strategy.choose(on, lowered, Tuning(layout="wide8")).interleaved

    monkeypatch.setattr(strategy, "INTERLEAVED_TRIANGLES", 400)
    assert not interleaved(plain)
    monkeypatch.setattr("clpt.bvh.outgrows_caches", lambda *of: True)
    assert interleaved(plain) and not interleaved(ball)
    monkeypatch.setattr(strategy, "INTERLEAVED_TRIANGLES", 401)
    assert not interleaved(plain)
