"""Properties of every shape: its name in messages, the source of its geometry, its transform."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import fits_single, on_host
from clpt.errors import SceneError
from clpt.files import budget
from clpt.scene.params import fields_of
from clpt.scene.shapes import Shape


def where(shape: Shape) -> str:
    """Return how a message names the shape."""
    kind = {"tubes": "curves", "tessellated": "mesh"}.get(shape.kind, shape.kind)
    return f"{kind} {shape.name!r}" if shape.name else kind


def geometry(shape: Shape) -> tuple[Any, ...]:
    """Return all that the triangles of a shape follow from: its fields but for the surface."""
    fields = fields_of(shape)
    return type(shape), *[fields[name] for name in fields if name not in ("material", "emission")]


def placement(shape: Shape) -> NDArray[np.float64]:
    """Return a shape's transform. Raises SceneError if it is singular, or no affine 4x4 matrix."""
    budget.check_time()
    try:
        matrix = np.asarray(on_host(shape.to_world), np.float64)
    except (TypeError, ValueError) as error:
        raise SceneError(f"to_world is not a matrix: {error}", where=where(shape)) from error
    if matrix.shape != (4, 4):
        raise SceneError(f"to_world must be (4, 4), found {matrix.shape}", where=where(shape))
    if transforms.is_singular(matrix):
        raise SceneError(
            "its transform is singular: it flattens space or is not finite", where=where(shape)
        )
    if not fits_single(matrix):
        raise SceneError("its transform is beyond float32, 3.4e38", where=where(shape))
    if not transforms.is_affine(matrix):
        raise SceneError("its transform is a projection, not affine", where=where(shape))
    return matrix
