"""Cameras that other programs have measured or made: a matrix, a calibration, or a list of rays."""

from __future__ import annotations

import dataclasses
import functools
import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.arrays import vectors
from clpt.errors import SceneError
from clpt.lenses import projections
from clpt.lenses.projections import Projection
from clpt.scene.cameras.camera import Camera, View
from clpt.scene.params import (
    choice,
    host,
)
from clpt.scene.values import Matrix4

log = logging.getLogger("clpt.scene.cameras")

FLIPPED = np.array([-1.0, -1.0, 1.0])  # from OpenCV's camera space, x right and y down, and back


@dataclass(frozen=True, kw_only=True, eq=False)
class Matrix(Camera):
    """Any camera given as a view and a projection matrix, as OpenGL and glTF have them.

    Rays come from the inverse of projection @ view; clip space z from -1 (near) to 1 (far).
    `to_world` is not used.
    """

    is_rigid: ClassVar[bool] = False

    shorthands = ()

    view: Matrix4 = host(np.eye(4), "world to eye, (4, 4), eye space looks along -z")
    projection: Matrix4 = host(np.eye(4), "eye to clip, (4, 4)")

    def moved(self, motion: NDArray[np.float64]) -> Camera:
        """Return the camera after a motion of the world (4, 4) that takes it along."""
        view = np.asarray(self.view, float) @ np.linalg.inv(motion)
        return dataclasses.replace(self, view=view)

    def pixel_camera(self, width: int, height: int, x: int, y: int) -> Camera:
        """Return a camera that sees a pixel alone."""
        zoom = np.eye(4)
        zoom[0, 0], zoom[0, 3] = width, width - (2 * x + 1)
        zoom[1, 1], zoom[1, 3] = height, (2 * y + 1) - height
        return dataclasses.replace(self, projection=zoom @ np.asarray(self.projection, float))

    def record_members(self, width: int, height: int) -> dict[str, ArrayLike]:
        """Return a ray's direction and its homogeneous near point, both affine in film x and y.

        A clip point at depth z comes from p(z) = A + z B with A = M (x, y, 0, 1) and
        B = M (0, 0, 1, 0), where M is the inverse. The derivative of p.xyz / p.w by z is a positive
        multiple of B A.w - A B.w, which does not depend on z. So no far plane is needed, and large
        terms cancel here in float64.
        """
        projection = self._invertible("projection", self.projection)
        forward = projection @ self._invertible("view", self.view)
        if transforms.is_singular(forward):
            raise SceneError("projection @ view must have an inverse", where="matrix.projection")
        x, y, b, a = np.linalg.inv(forward).T
        scale = 1.0 / np.abs(np.stack([x, y, b, a])).max()  # keeps tiny scenes off float32's limits
        x, y, b, a = x * scale, y * scale, b * scale, a * scale
        parts = [b[:3] * column[3] - column[:3] * b[3] for column in (a, x, y)]
        length = max(np.linalg.norm(parts[0]), 1e-300)
        names = ("direction", "direction_x", "direction_y")
        directions = {name: part / length for name, part in zip(names, parts, strict=True)}
        return {**directions, "near": a - b, "near_x": x, "near_y": y}

    def view_point(self, width: int, height: int) -> NDArray[np.float64]:
        """Return the middle (3,) [m] of its near plane."""
        near = np.asarray(self.checked_members(width, height)["near"], np.float64)
        return near[:3] / near[3]


@dataclass(frozen=True, kw_only=True, eq=False)
class Rays(Camera):
    """A list of rays: pixel i of the film, row by row, is the radiance along ray i mod n.

    If a film has several times n pixels, it measures each ray several times, independently. Only a
    `box` filter keeps pixels apart. With a radius of 0.25 it does so also where positions on the
    film are rounded. `to_world` and `motion` move all rays. The camera's medium is the medium
    around their mean origin.
    """

    shorthands = ()

    origins: ArrayLike = host(((0.0, 0.0, 0.0),), "(n, 3), where rays begin", "m", form="rows3")
    directions: ArrayLike = host(((0.0, 0.0, 1.0),), "(n, 3), or a row for all", form="rows3")
    weights: ArrayLike = host(1.0, "(n,) factors, or a factor for all", form="number_or_list")

    def _origins(self) -> NDArray[np.float64]:
        return vectors(self.origins, "rays.origins").reshape(-1, 3)

    def record_members(self, width: int, height: int) -> dict[str, ArrayLike]:
        """Return the film's size and the count of rays."""
        return {"columns": width, "rows": height, "count": len(self._origins())}

    def record_tables(self, width: int, height: int) -> dict[str, NDArray[np.float32]]:
        """Return rows of origin, unit direction and weight in the world. Raises SceneError."""
        matrix, origins = self.affine_matrix(), self._origins()
        directions = vectors(self.directions, "rays.directions").reshape(-1, 3)
        if len(directions) not in (1, len(origins)):
            message = f"{len(directions)} rows for {len(origins)} origins"
            raise SceneError(message, where="rays.directions")
        directions = transforms.transform_vectors(matrix, directions)
        lengths = np.linalg.norm(directions, axis=1, keepdims=True)
        if not lengths.all():
            raise SceneError(f"row {np.argmin(lengths)} is 0, 0, 0", where="rays.directions")
        weights = np.asarray(self.weights, np.float64).reshape(-1, 1)
        if len(weights) not in (1, len(origins)) or not np.isfinite(weights).all():
            message = f"must be a finite number, or one for each of {len(origins)} rays"
            raise SceneError(message, where="rays.weights")
        parts = transforms.transform_points(matrix, origins), directions / lengths, weights
        rows = [np.broadcast_to(part, (len(origins), part.shape[1])) for part in parts]
        return {"list": np.hstack(rows).astype(np.float32)}

    def view_point(self, width: int, height: int) -> NDArray[np.float64]:
        """Return the mean origin (3,) [m]."""
        mean = self._origins().mean(axis=0)
        return np.asarray(transforms.transform_points(self.affine_matrix(), mean), np.float64)


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibrated(Camera):
    """A calibrated camera: intrinsics in pixels, and a model of the distortion.

    Camera space and pixels are OpenCV's in `project`, `unproject` and the coefficients: x right,
    y down, z forward; (0, 0) is the middle of the top left pixel. A film of another size than
    `size` scales the intrinsics. Pixels whose distortion cannot be inverted are black; the log
    "clpt.scene.cameras" counts them.
    """

    connects: ClassVar[bool] = True
    has_axis: ClassVar[bool] = True
    has_screen: ClassVar[bool] = True

    model: str = choice("opencv", "of the projection", projections.MODELS)
    intrinsics: Sequence[float] = host(
        (320.0, 320.0, 319.5, 239.5), "fx, fy, cx, cy", "pixels", form="numbers"
    )
    distortion: Sequence[float] = host((), "coefficients of the model", form="numbers")
    size: Sequence[float] = host(
        (),
        "width, height of the calibration's pictures; none: the film's",
        "pixels",
        form="numbers",
    )

    def project(self, points: ArrayLike, width: int, height: int) -> NDArray[np.float64]:
        """Return pixels (..., 2) of points (..., 3) in the world [m]; NaN for what is not seen.

        width, height: of the film [pixels]. `motion` does not count. Raises SceneError.
        """
        away = transforms.transform_points(np.linalg.inv(self.rigid_matrix()), points)
        scale, focal, middle = self._pixels(width, height)
        plane = self._projection().project(np.asarray(away, np.float64) * FLIPPED)
        return (plane * focal + middle + 0.5) * scale - 0.5

    def unproject(self, pixels: ArrayLike, width: int, height: int) -> NDArray[np.float64]:
        """Return unit directions (..., 3) in the world of pixels (..., 2); NaN where none leads.

        width, height: of the film [pixels]. `motion` does not count. Raises SceneError.
        """
        scale, focal, middle = self._pixels(width, height)
        plane = ((np.asarray(pixels, np.float64) + 0.5) / scale - 0.5 - middle) / focal
        directions = self._projection().directions(plane) * FLIPPED
        return np.asarray(transforms.transform_vectors(self.rigid_matrix(), directions), np.float64)

    def _projection(self) -> Projection:
        return Projection(self.model, tuple(float(k) for k in self.distortion))

    def _pixels(self, width: int, height: int) -> NDArray[np.float64]:
        """Return the film's pixels over those of the calibration, (fx, fy) and (cx, cy): (3, 2)."""
        values = np.asarray(self.intrinsics, np.float64)
        if values.shape != (4,) or not np.isfinite(values).all() or not (values[:2] > 0.0).all():
            message = f"must be fx, fy above 0, cx and cy, not {list(self.intrinsics)}"
            raise SceneError(message, where="calibrated.intrinsics")
        whole = tuple(self.size) or (width, height)
        if len(whole) != 2 or not min(whole) >= 1:
            raise SceneError(f"must be width, height, not {[*whole]}", where="calibrated.size")
        return np.array([[width / whole[0], height / whole[1]], values[:2], values[2:]])

    def record_members(self, width: int, height: int) -> dict[str, ArrayLike]:
        """Return its matrix, the film's size, and how its model sees directions."""
        (scale, focal, middle), model = self._pixels(width, height), self._projection()
        return {
            "to_world": self.rigid_matrix(), "columns": width, "rows": height,
            "form": model.kernel_form()[0], "widest": math.cos(model.widest),
            "focal": focal * scale, "middle": (middle + 0.5) * scale,
        }  # fmt: skip

    def view_of(self, width: int, height: int) -> View:
        """Return its view along the axis: it holds every pixel that has a direction."""
        pixels = self._pixels(width, height)
        angle = _widest(self._projection(), width, height, pixels.tobytes())
        return self._view(self.rigid_matrix(), width / float(pixels[0, 0] * pixels[1, 0]), angle)

    def record_tables(self, width: int, height: int) -> dict[str, NDArray[np.float32]]:
        """Return directions in camera space of the pixels' corners, row by row (0: none), and
        the numbers of the model.
        """
        model, scaled = self._projection(), self._pixels(width, height).tobytes()
        return {
            "directions": _corner_directions(model, width, height, scaled),
            "coefficients": np.array(model.kernel_form()[1], np.float32),
        }


@functools.lru_cache(maxsize=8)
def _corner_directions(
    projection: Projection, width: int, height: int, pixels: bytes
) -> NDArray[np.float32]:
    """Return unit directions ((height + 1) * (width + 1), 3) of `pixels`, see `Calibrated`."""
    scale, focal, middle = np.frombuffer(pixels).reshape(3, 2)
    corners = np.stack(np.meshgrid(np.arange(width + 1), np.arange(height + 1)), -1)
    directions = projection.directions((corners / scale - 0.5 - middle) / focal) * FLIPPED
    seen = ~np.isnan(directions[..., 0])
    whole = seen[:-1, :-1] & seen[1:, :-1] & seen[:-1, 1:] & seen[1:, 1:]
    if not whole.all():
        message = "%d of %d pixels are black: the distortion (%s) cannot be inverted there"
        log.warning(message, (~whole).sum(), whole.size, projection.model)
    directions[~seen] = 0.0
    return directions.reshape(-1, 3).astype(np.float32)


@functools.lru_cache(maxsize=8)
def _widest(projection: Projection, width: int, height: int, pixels: bytes) -> float:
    """Return the largest angle to the axis of `_corner_directions` [rad]."""
    directions = _corner_directions(projection, width, height, pixels)
    cosines = directions[directions.any(axis=1), 2]
    return math.acos(min(float(cosines.min(initial=1.0)), 1.0))
