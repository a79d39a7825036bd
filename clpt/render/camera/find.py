"""Cameras: what each sees, and members of its record for kernels/cameras/kinds/<kind>.cl."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import spectra, transforms
from clpt.arrays import fits_single
from clpt.errors import SceneError
from clpt.render.camera import lens
from clpt.scene.cameras import Camera, Lens, Matrix, Orthographic, Perspective, Spherical, ThinLens
from clpt.scene.motion import Shutter
from clpt.scene.params import fields_of
from clpt.spectra import Constant, Spectrum

CONNECTED = ("perspective", "thin_lens")  # cameras that a point can be joined to
DESIGN_WAVELENGTH = 587.56  # [nm], the helium line d, at which a lens's focal length is given


def dispersive_glasses(camera: Camera) -> tuple[Spectrum, ...]:
    """Return the indices of a camera's glasses that differ between wavelengths, each once."""
    if isinstance(camera, Lens):
        return lens.glasses(camera)
    glass: Any = camera.glass if isinstance(camera, ThinLens) else Constant(1.0)
    index = spectra.index(glass)
    return () if isinstance(index, Constant) else (index,)


def is_connected(camera: Camera, mode: str) -> bool:
    """Return whether paths from lights can be joined to a camera, in the mode of the film."""
    return camera.kind in CONNECTED and (mode == "rgb" or not dispersive_glasses(camera))


@dataclass(frozen=True)
class View:
    """The view of a camera that sees from a point.

    place: that point (3,) [m]; axis: from it to the middle of the film (3,), unit length; width: of
    the film a metre away [m]; angle: from the axis to the film's corners [rad].
    """

    place: NDArray[np.float64]
    axis: NDArray[np.float64]
    width: float
    angle: float


def view_of(camera: Camera, width: int, height: int) -> View | None:
    """Return what a camera sees, None if not from a point; width, height: of the film [pixels].

    Of one that moves it is what the camera sees halfway.
    """
    if isinstance(camera, Lens):
        return None
    pinhole = members(camera, width, height)
    if "extent" not in pinhole:
        return None
    matrix, extent = pinhole["to_world"], pinhole["extent"]
    if camera.motion is not None:
        shutter = camera.shutter or Shutter(0.0, 0.0)
        matrix = camera.motion.at((shutter.open + shutter.close) / 2.0) @ matrix
    return View(matrix[:3, 3], matrix[:3, 2], extent[0], math.atan(math.hypot(*extent) / 2.0))


def origin_of(camera: Camera, width: int, height: int) -> NDArray[np.float64]:
    """Return the point (3,) [m] from which a camera sees before it moves.

    Of a camera without one it is the middle of its film; of a lens, its front. width, height: of
    the film [pixels].
    """
    if isinstance(camera, Lens):
        front = [0.0, 0.0, lens.front(camera, height / width)]
        return np.asarray(transforms.transform_points(rigid(camera), front), np.float64)
    found = members(camera, width, height)
    if "to_world" in found:
        return np.asarray(found["to_world"], np.float64)[:3, 3]
    near = np.asarray(found["near"], np.float64)
    return near[:3] / near[3]


def members(camera: Camera, width: int, height: int) -> dict[str, Any]:
    """Return the members of a camera's record by name; width, height: of the film [pixels].

    Raises SceneError for planes, a matrix or a glass that cannot be used, and beyond float32.
    """
    made = MEMBERS[type(camera)](camera, width, height)
    for name, value in made.items():
        if not fits_single(value):
            raise SceneError("is beyond float32, 3.4e38", where=f"{camera.kind}.{name}")
    return made


def _matrix(camera: Camera, name: str) -> NDArray[np.float64]:
    """A 4x4 matrix of a camera that has an inverse."""
    where = f"{camera.kind}.{name}"
    try:
        matrix = np.asarray(fields_of(camera)[name], np.float64)
    except (TypeError, ValueError):
        matrix = np.zeros(0)
    if matrix.shape != (4, 4):
        raise SceneError("must be a 4x4 matrix", where=where)
    if transforms.is_singular(matrix) or not fits_single(matrix):
        raise SceneError("must have an inverse and be finite", where=where)
    return matrix


def _to_world(camera: Camera) -> NDArray[np.float64]:
    matrix = _matrix(camera, "to_world")
    if not np.allclose(matrix[3], [0.0, 0.0, 0.0, 1.0]):
        raise SceneError("its last row must be 0 0 0 1", where=f"{camera.kind}.to_world")
    return matrix


def rigid(camera: Camera) -> NDArray[np.float64]:
    """Return the `to_world` of a camera whose angles a scale or a shear would change."""
    matrix = _to_world(camera)
    linear = matrix[:3, :3]
    if not np.allclose(linear.T @ linear, np.eye(3), atol=1e-3):
        raise SceneError("must not scale or shear", where=f"{camera.kind}.to_world")
    return matrix


def _pinhole(camera: Perspective, width: int, height: int) -> dict[str, Any]:
    _check_planes(camera)
    side = 2.0 * np.tan(np.radians(camera.fov) / 2.0)
    axis = {"smaller": "x" if width <= height else "y", "larger": "x" if width >= height else "y"}
    along_x = axis.get(camera.fov_axis, camera.fov_axis) == "x"
    pixel = side / (width if along_x else height)
    return {
        "to_world": rigid(camera),
        "extent": [pixel * width, pixel * height],
        "offset": [camera.offset_x, camera.offset_y],
        "near": camera.near,
        "far": camera.far,
    }


def _thin_lens(camera: ThinLens, width: int, height: int) -> dict[str, Any]:
    names = ("aperture_radius", "focus_distance", "focal_length")
    values = {name: fields_of(camera)[name] for name in names}
    glass = dispersive_glasses(camera)
    power = float(glass[0].sample(DESIGN_WAVELENGTH)) - 1.0 if glass else 1.0
    if power < 1e-3:
        raise SceneError(
            f"its index must be above 1, not {power + 1.0:.4g}", where="thin_lens.glass"
        )
    return {**_pinhole(camera, width, height), **values, "power": power}


def _orthographic(camera: Orthographic, width: int, height: int) -> dict[str, Any]:
    _check_planes(camera)
    planes = {"near": camera.near, "far": camera.far}
    return {"to_world": _to_world(camera), "aspect": height / width, **planes}


def _check_planes(camera: Any) -> None:
    if not camera.near < camera.far:
        message = f"near must be below far, not {camera.near:g} and {camera.far:g}"
        raise SceneError(message, where=camera.kind)


def _spherical(camera: Spherical, width: int, height: int) -> dict[str, Any]:
    return {"to_world": rigid(camera)}


def _unprojection(camera: Matrix, width: int, height: int) -> dict[str, Any]:
    """Return a ray's direction and homogeneous point on the near plane, both affine in x and y.

    A clip point at depth z comes from p(z) = A + z B, A = M (x, y, 0, 1), B = M (0, 0, 1, 0), M the
    inverse; the derivative of p.xyz / p.w by z is a positive multiple of B A.w - A B.w, which holds
    no z: so it needs no far plane, and the large terms cancel here in float64.
    """
    forward = _matrix(camera, "projection") @ _matrix(camera, "view")
    if transforms.is_singular(forward):
        raise SceneError("projection @ view must have an inverse", where="matrix.projection")
    x, y, b, a = np.linalg.inv(forward).T
    scale = 1.0 / np.abs(np.stack([x, y, b, a])).max()  # keeps tiny scenes off float32's limits
    x, y, b, a = x * scale, y * scale, b * scale, a * scale
    parts = [b[:3] * column[3] - column[:3] * b[3] for column in (a, x, y)]
    length = max(np.linalg.norm(parts[0]), 1e-300)
    names = ("direction", "direction_x", "direction_y")
    found = {name: part / length for name, part in zip(names, parts, strict=True)}
    return {**found, "near": a - b, "near_x": x, "near_y": y}


MEMBERS: dict[type[Camera], Callable[..., dict[str, Any]]] = {
    Perspective: _pinhole,
    ThinLens: _thin_lens,
    Orthographic: _orthographic,
    Spherical: _spherical,
    Matrix: _unprojection,
}
