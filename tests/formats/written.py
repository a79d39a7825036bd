"""What tests of writers share: shapes, materials, and how triangles are compared."""

from __future__ import annotations

import inspect

import numpy as np

from clpt import transforms
from clpt.geometry import triangles
from clpt.scene import materials, shapes
from clpt.scene.shapes import Shape

TURN = transforms.translate(0.5, 1.0, -2.0) @ transforms.rotate([1.0, 2.0, 3.0], 40.0)
MATERIALS = [
    cls
    for _, cls in inspect.getmembers(materials, inspect.isclass)
    if issubclass(cls, materials.Material)
    and not inspect.isabstract(cls)
    and cls is not materials.Material
    and cls.__module__.startswith("clpt.scene.materials")
]
SHAPES = {
    "mesh": shapes.Mesh(
        vertices=np.random.default_rng(1).normal(size=(9, 3)).astype(np.float32),
        faces=np.arange(9, dtype=np.uint32).reshape(3, 3), to_world=TURN,
    ),
    "rectangle": shapes.Rectangle(to_world=TURN),
    "flipped": shapes.Rectangle(to_world=TURN, flip_normals=True),
    "mirrored": shapes.Cube(to_world=TURN @ transforms.scale([1.0, -2.0, 1.0])),
    "sdf": shapes.SdfGrid(to_world=TURN),
}  # fmt: skip


def assert_same_triangles(before: Shape, after: Shape) -> None:
    """Triangles, their fronts and texture coordinates are the same, in any order."""
    wanted, found = (triangles.triangulate(shape) for shape in (before, after))
    corners = [np.sort(v[f].reshape(-1, 9), axis=0) for v, f, _, _ in (wanted, found)]
    assert np.allclose(*corners, atol=1e-5)
    fronts = [
        np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]]) for v, f, *_ in (wanted, found)
    ]
    assert np.allclose(fronts[0].sum(0), fronts[1].sum(0), atol=1e-4)
    if wanted[3] is not None:
        uvs = [np.sort(part[3][part[1]].reshape(-1, 2), axis=0) for part in (wanted, found)]
        assert np.allclose(*uvs, atol=1e-6)
