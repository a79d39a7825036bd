"""Subsurface scattering of `openpbr` in a body, beside what its surface alone scatters."""

from __future__ import annotations

from typing import Any

import numpy as np

import clpt
from clpt import transforms
from clpt.scene import Film, Scene, cameras, integrators, lights, shapes
from clpt.scene.materials import Openpbr
from clpt.scene.media import Homogeneous

COLOR = (0.8, 0.5, 0.2)


def _middle(inside: Homogeneous | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean (3,) of a ball's middle in an even sky, and its standard error."""
    body = {"subsurface_weight": 1.0, "subsurface_color": COLOR}
    skin = Openpbr(**body, subsurface_inside=inside is not None)
    place: Any = transforms.look_at([0, 0, 6], [0, 0, 0], [0, 1, 0])
    scene = Scene(
        camera=cameras.Perspective(to_world=place, fov=8.0),
        shapes=[shapes.Sphere(material=skin, interior=inside)],
        lights=[lights.Constant(radiance=1.0)],
        film=Film(width=16, height=16, mode="rgb"),
        integrator=integrators.Path(max_depth=2000),
        seed=3,
    )
    pixels = np.asarray(clpt.render(scene, spp=64))[..., :3].reshape(-1, 3)
    return pixels.mean(axis=0), pixels.std(axis=0) / np.sqrt(len(pixels))


def test_a_dense_body_has_the_color_that_is_asked_for() -> None:
    """Within 0.012, with four standard errors of both means: a chance of 4e-4 for all three."""
    plain, error = _middle(None)
    walked, more = _middle(Homogeneous.from_albedo(COLOR, (0.01,) * 3))
    allowed = 0.012 + 4.0 * np.hypot(error, more)
    assert np.all(np.abs(walked - plain) < allowed), (walked, plain)
    assert allowed.max() < 0.03
