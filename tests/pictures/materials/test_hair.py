"""Hair in pictures: light goes through fibres, and none is lost in them."""

from __future__ import annotations

import numpy as np

import clpt
from clpt.scene import cameras, integrators, lights, materials
from clpt.scene.shapes import Curves


def test_white_furnace():
    """Fibres that absorb nothing are not to be seen in even light: within 4 standard errors."""
    rng = np.random.default_rng(2)
    points = np.zeros((10, 5, 4))
    points[..., 0] = np.linspace(-0.7, 0.7, 10)[:, None] + 0.05 * rng.normal(size=(10, 5))
    points[..., 1], points[..., 2] = np.linspace(-1.5, 1.5, 5), 0.1 * rng.normal(size=(10, 5))
    points[..., 3] = 0.08
    fur = Curves(
        points=points.reshape(-1, 4), lengths=(5,) * 10, material=materials.Hair(sigma_a=0.0)
    )
    scene = clpt.Scene(
        camera=cameras.Perspective(
            fov=30.0, to_world=clpt.transforms.look_at((0, 0, 3), (0, 0, 0), (0, 1, 0))
        ),
        film=integrators.Film(width=24, height=24),
        integrator=integrators.Path(max_depth=200),
        shapes=[fur],
        lights=[lights.Constant(radiance=(1.0, 1.0, 1.0))],
    )
    image = clpt.render(scene, spp=64)
    assert image.std() > 1e-4  # they are there
    error = image.mean(axis=2).std() / 24.0
    assert abs(image.mean() - 1.0) < 4.0 * error and error < 3e-3
