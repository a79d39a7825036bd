"""Transforms as Mitsuba's Python scripts write them: `ScalarTransform4f().translate([0, 0, 1])`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clpt import transforms


class _Step:
    """A method that appends a step, of a transform or, as in older scripts, of the class."""

    def __init__(self, function: Callable[..., Any]):
        self.function = function

    def __get__(self, start: ScalarTransform4f | None, owner: type[ScalarTransform4f]) -> Any:
        before = np.eye(4) if start is None else start.matrix
        return lambda *values, **named: owner(before @ self.function(*values, **named))


class ScalarTransform4f:
    """A transform (4, 4) float64; its steps act from right to left, as matrices do.

    `look_at(origin, target, up)`, `translate(v)`, `scale(v)` and `rotate(axis, angle)` [degrees]
    return the transform with another step. `@` joins two. matrix: (4, 4), by default the identity.
    """

    look_at = _Step(lambda origin, target, up: transforms.look_at(origin, target, up))
    translate = _Step(lambda v: transforms.translate(v))
    scale = _Step(lambda v: transforms.scale(v))
    rotate = _Step(lambda axis, angle: transforms.rotate(axis, angle))

    def __init__(self, matrix: ArrayLike | None = None):
        self.matrix = np.eye(4) if matrix is None else np.array(matrix, np.float64).reshape(4, 4)

    def __matmul__(self, other: ScalarTransform4f) -> ScalarTransform4f:
        return ScalarTransform4f(self.matrix @ other.matrix)

    def inverse(self) -> ScalarTransform4f:
        """Return the transform back. Raises SceneError where there is none."""
        return ScalarTransform4f(transforms.inverse(self.matrix))
