"""Cameras. Camera space: +z forward, +x left, +y up (as look_at makes it, see clpt.transforms)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clpt.scene.media import Medium
from clpt.scene.motion import Keys, Shutter
from clpt.scene.params import Kind, choice, host, index, real
from clpt.scene.values import IndexLike, Matrix4


@dataclass(frozen=True, kw_only=True, eq=False)
class Camera(Kind):
    """Base of all cameras."""

    to_world: Matrix4 = host(np.eye(4), "camera to world, (4, 4)")
    medium: Medium | None = host(None, "around the camera; None: none", form="medium")
    motion: Keys | None = host(None, "moves it after `to_world`; None: still", form="keys")
    shutter: Shutter | None = host(
        None, "when light comes to the film; None: at 0 s alone", form="shutter"
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Perspective(Camera):
    """A pinhole."""

    fov: float = real(45.0, "field of view along `fov_axis`", "degrees", 1e-3, 179.999)
    fov_axis: str = choice("x", "which side `fov` spans", ("x", "y", "smaller", "larger"))
    near: float = real(1e-2, "nearest distance seen", "m", low=0.0)
    far: float = real(1e4, "farthest distance seen", "m", low=0.0)
    offset_x: float = real(0.0, "of the principal point, in widths of the film")
    offset_y: float = real(0.0, "of the principal point, in heights of the film")


@dataclass(frozen=True, kw_only=True, eq=False)
class ThinLens(Perspective):
    """A pinhole with an aperture: what is not at the focus distance blurs.

    A `glass` that disperses gives it chromatic aberration: `focus_distance` is that at 587.56 nm.
    """

    aperture_radius: float = real(0.1, "of the lens", "m", low=0.0)
    focus_distance: float = real(1.0, "of the plane in focus", "m", low=1e-6)
    glass: IndexLike = index(
        1.5, "of the lens; one that disperses focuses each wavelength elsewhere"
    )
    focal_length: float = real(0.05, "of the lens at 587.56 nm; matters to `glass`", "m", low=1e-6)


@dataclass(frozen=True, kw_only=True, eq=False)
class Orthographic(Camera):
    """Parallel rays along +z; the film spans [-1, 1] in x, scaled by `to_world`."""

    near: float = real(1e-2, "nearest distance seen", "m", low=0.0)
    far: float = real(1e4, "farthest distance seen", "m", low=0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Spherical(Camera):
    """All directions: the film is a map in latitude and longitude, +y up, +z in its middle."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Matrix(Camera):
    """Any camera given as a view and a projection matrix, as OpenGL and glTF have them.

    Rays come from the inverse of projection @ view; clip space z from -1 (near) to 1 (far).
    `to_world` is not used.
    """

    view: Matrix4 = host(np.eye(4), "world to eye, (4, 4), eye space looks along -z")
    projection: Matrix4 = host(np.eye(4), "eye to clip, (4, 4)")


KINDS = (Perspective, ThinLens, Orthographic, Spherical, Matrix)
