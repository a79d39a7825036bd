"""What `repr` shows of the objects of a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from clpt.scene import cameras, materials, shapes
from clpt.scene.params import reflectance

MOVED = "[[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 2.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]"


@dataclass(frozen=True, kw_only=True, eq=False)
class Paper(materials.Material):
    """A user's own."""

    colour: object = reflectance(0.8, "of it")


@pytest.mark.parametrize(
    ("made", "text"),
    [(cameras.Perspective(origin=(0, 2, 0), target=(0, 2, 1)), f"Perspective(to_world={MOVED})"),
     (cameras.ThinLens(focus_distance=3), "ThinLens(focus_distance=3.0)"),
     (materials.RoughConductor(metal="gold"), "RoughConductor(eta=<Tabulated>, k=<Tabulated>)"),
     (shapes.Sphere(material=materials.Diffuse(reflectance=0.25), radius=2),
      "Sphere(material=Diffuse(reflectance=0.25), radius=2.0)"),
     (shapes.Mesh(vertices=np.zeros((9, 3)), faces=[[0, 1, 2]]),
      "Mesh(vertices=<float64 (9, 3)>, faces=[[0, 1, 2]])"),
     (Paper(colour=0.5), "Paper(colour=0.5)")],
)  # fmt: skip
def test_a_repr_is_one_short_line(made, text):
    assert repr(made) == text
