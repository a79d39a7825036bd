"""Cameras. Camera space: +z forward, +x left, +y up (as look_at makes it, see clpt.transforms)."""

from __future__ import annotations

from dataclasses import InitVar, dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from clpt import lenses, transforms
from clpt.errors import SceneError
from clpt.lenses import Prescription
from clpt.scene import roles
from clpt.scene.media import Medium
from clpt.scene.motion import Keys, Shutter
from clpt.scene.params import Kind, Shorthand, choice, flag, host, index, real
from clpt.scene.roles import Param
from clpt.scene.values import IndexLike, Matrix4, Vector3

MOST_BLADES = 24


def _looking(
    origin: Vector3 | None = None, target: Vector3 | None = None, up: Vector3 = (0.0, 1.0, 0.0)
) -> dict[str, Any]:
    """Return the placement of a camera at `origin` that looks at `target`."""
    if origin is None or target is None:
        raise SceneError(
            "give origin and target, both", where="origin" if origin is None else "target"
        )
    return {"to_world": transforms.look_at(origin, target, up)}


LOOK_AT = Shorthand(
    {
        "origin": Param(roles.host("vector"), "where the camera is", "m"),
        "target": Param(roles.host("vector"), "what it looks at", "m"),
        "up": Param(roles.host("vector"), "what is up in the picture; (0, 1, 0) if left out"),
    },
    ("to_world",),
    _looking,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Camera(Kind):
    """Base of all cameras."""

    shorthands: ClassVar[tuple[Shorthand, ...]] = (LOOK_AT,)
    if TYPE_CHECKING:  # arguments only: they stand for `to_world`
        origin: InitVar[Vector3 | None] = None
        target: InitVar[Vector3 | None] = None
        up: InitVar[Vector3 | None] = None

    to_world: Matrix4 = host(np.eye(4), "camera to world, (4, 4)")
    medium: Medium | None = host(None, "around the camera, or None", form="medium")
    motion: Keys | None = host(None, "moves it after `to_world`, or None", form="keys")
    shutter: Shutter | None = host(
        None, "when the film gets light; None: at 0 s only", form="shutter"
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Perspective(Camera):
    """A pinhole."""

    fov: float = real(45.0, "field of view along `fov_axis`", "degrees", 1e-3, 179.999)
    fov_axis: str = choice("x", "which side `fov` spans", ("x", "y", "smaller", "larger"))
    near: float = real(1e-2, "nearest distance seen", "m", low=0.0)
    far: float = real(1e4, "farthest distance seen", "m", low=0.0)
    offset_x: float = real(
        0.0, "the principal point lies at 1/2 less this from the left, in widths of the film"
    )
    offset_y: float = real(
        0.0, "the principal point lies at 1/2 less this from the top, in heights of the film"
    )


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
class Lens(Camera):
    """A lens traced surface by surface, with a film behind it; its origin is the film's middle.

    The whole lens moves to focus. Where its glasses disperse, each path has one wavelength.
    """

    lens: Prescription | str = host("double_gauss", "its surfaces", form="lens")
    film_width: float = real(0.036, "of the film; its height follows from the picture's", "m", 1e-6)
    focus_distance: float = real(1e4, "of what is sharp, from the film", "m", low=1e-6)
    film_shift: float = real(0.0, "of the film away from the lens, out of that focus", "m")
    f_number: float = real(
        0.0, "focal length over entrance pupil; 0: as far open as it is", low=0.0
    )
    blades: int = host(0, "of the diaphragm, from 3 on; 0: it is round", form="integer")
    blade_angle: float = real(0.0, "by which the diaphragm is turned", "degrees")
    losses: bool = flag(False, "surfaces reflect a part of the light, which is lost")
    coating: str = choice(
        "none", "of surfaces between glass and air that have none", tuple(lenses.COATINGS)
    )
    ghosts: float = real(
        0.0, "share of the samples that follow light which two surfaces reflect", low=0.0, high=0.9
    )
    exposure: str = choice(
        "relative",
        "what radiance 1 makes of the film's middle: 1, or its irradiance, as pbrt has it",
        ("relative", "irradiance"),
    )
    unit: float = real(1e-3, "a millimetre of the lens in the scene", "m", low=1e-12)

    def check(self) -> None:
        if not (self.blades == 0 or 3 <= self.blades <= MOST_BLADES):
            raise SceneError(
                f"must be 0 or 3 to {MOST_BLADES}, not {self.blades}", where="lens.blades"
            )

    @property
    def reflects(self) -> bool:
        """Whether its surfaces reflect a part of the light."""
        return self.losses or self.ghosts > 0.0

    @property
    def prescription(self) -> Prescription:
        """Its surfaces, from the library if `lens` is a name. Raises SceneError."""
        if isinstance(self.lens, str):
            return lenses.library(self.lens)
        if not isinstance(self.lens, Prescription):
            raise SceneError(f"must be a name or a prescription, not {self.lens!r}", where="lens")
        return self.lens


@dataclass(frozen=True, kw_only=True, eq=False)
class Orthographic(Camera):
    """Parallel rays along +z; the film spans [-1, 1] in x, scaled by `to_world`."""

    near: float = real(1e-2, "nearest distance seen", "m", low=0.0)
    far: float = real(1e4, "farthest distance seen", "m", low=0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Spherical(Camera):
    """All directions: the film is a map in latitude and longitude, +y up, +z in its middle.

    The middle of row i of h rows lies at pi (i + 1/2) / h from +y. Rows of an `envmap` lie at
    pi i / (h - 1), from pole to pole: a film of few rows that becomes one is stretched by half a
    row at the poles, by 3 % of the height with 16 rows and nothing to see with 1024.
    """


@dataclass(frozen=True, kw_only=True, eq=False)
class Matrix(Camera):
    """Any camera given as a view and a projection matrix, as OpenGL and glTF have them.

    Rays come from the inverse of projection @ view; clip space z from -1 (near) to 1 (far).
    `to_world` is not used.
    """

    shorthands = ()

    view: Matrix4 = host(np.eye(4), "world to eye, (4, 4), eye space looks along -z")
    projection: Matrix4 = host(np.eye(4), "eye to clip, (4, 4)")


KINDS = (Perspective, ThinLens, Lens, Orthographic, Spherical, Matrix)
