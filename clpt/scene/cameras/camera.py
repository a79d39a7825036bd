"""Cameras with a formula: a pinhole, lenses, a parallel and a spherical projection."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import InitVar, dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import lenses, spectra, transforms
from clpt.arrays import fits_single
from clpt.errors import SceneError
from clpt.lenses import Prescription
from clpt.lenses.tracing import MARGIN, FocusedLens, focused_lens
from clpt.scene import roles
from clpt.scene.media import Medium
from clpt.scene.motion import Keys, Shutter
from clpt.scene.params import (
    Kind,
    Shorthand,
    choice,
    fields_of,
    flag,
    host,
    index,
    member,
    params,
    real,
)
from clpt.scene.roles import Param
from clpt.scene.values import IndexLike, Matrix4, Vector3
from clpt.spectra import Constant, Spectrum

MOST_BLADES = 24
DESIGN_WAVELENGTH = 587.56  # [nm], the helium line d, of a lens's focal length


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
        "up": Param(roles.host("vector"), "the direction up in the picture; (0, 1, 0) if left out"),
    },
    ("to_world",),
    _looking,
)


@dataclass(frozen=True)
class View:
    """The view from a point.

    origin: the point (3,) [m]; axis: from it to the film's middle (3,), unit length; width: of the
    film at a distance of 1 m [m]; angle: between the axis and the film's corners [rad].
    """

    origin: NDArray[np.float64]
    axis: NDArray[np.float64]
    width: float
    angle: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Camera(Kind):
    """Base of all cameras.

    A kind whose record holds `to_world` and `extent` sees from the origin of that matrix.
    """

    connects: ClassVar[bool] = False  # whether light paths can be joined to the camera
    has_axis: ClassVar[bool] = False  # whether the layer z has a meaning
    has_screen: ClassVar[bool] = False  # whether the layer motion has: kernels project points
    is_rigid: ClassVar[bool] = True  # whether `to_world` must keep lengths

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

    @property
    def dispersive_glasses(self) -> tuple[Spectrum, ...]:
        """The different indices of refraction of its glasses that depend on the wavelength."""
        return ()

    @property
    def reflects(self) -> bool:
        """Whether surfaces of its lens reflect a part of the light."""
        return False

    @property
    def has_ghosts(self) -> bool:
        """Whether samples follow light that two surfaces of its lens reflect."""
        return False

    @property
    def traced_lens(self) -> Lens | None:
        """The lens whose surfaces each ray passes in turn; None for a camera with a formula."""
        return None

    def record_members(self, width: int, height: int) -> dict[str, ArrayLike]:
        """Return the members of its record in `clpt.render.records.camera` by name.

        Parameters that are declared by `member` are no part of them. A traced lens has only
        those that need no table. width, height: of the film [pixels].
        Raises SceneError for planes, a matrix, a glass or a lens that cannot be used.
        """
        raise NotImplementedError

    def record_tables(self, width: int, height: int) -> dict[str, NDArray[np.float32]]:
        """Return tables (n, words) float32 behind its record, by the member that finds each.

        width, height: of the film [pixels]. Raises SceneError for values that cannot be used.
        """
        return {}

    def checked_members(self, width: int, height: int) -> dict[str, Any]:
        """Return `record_members` and the parameters that are declared as members.

        Raises SceneError for a value beyond float32.
        """
        values, declared = fields_of(self), params(type(self))
        members = self.record_members(width, height)
        members |= {name: values[name] for name, param in declared.items() if param.member}
        for name, value in members.items():
            if not fits_single(value):
                raise SceneError("is beyond float32, 3.4e38", where=f"{self.kind}.{name}")
        return members

    def view_point(self, width: int, height: int) -> NDArray[np.float64]:
        """Return the centre of projection (3,) [m], before `motion`.

        A camera without a centre of projection returns the middle of its film, a lens its front.
        width, height: of the film [pixels].
        """
        return np.asarray(self.checked_members(width, height)["to_world"], np.float64)[:3, 3]

    def view_of(self, width: int, height: int) -> View | None:
        """Return its view in the middle of the shutter; None without a centre of projection.

        width, height: of the film [pixels].
        """
        members = self.checked_members(width, height)
        if not {"to_world", "extent"} <= members.keys():
            return None
        extent = members["extent"]
        return self._view(members["to_world"], extent[0], math.atan(math.hypot(*extent) / 2.0))

    def _view(self, matrix: NDArray[np.float64], width: float, angle: float) -> View:
        """Return the view along +z of a matrix, in the middle of the shutter."""
        if self.motion is not None:
            shutter = self.shutter or Shutter(0.0, 0.0)
            matrix = self.motion.at((shutter.open + shutter.close) / 2.0) @ matrix
        return View(matrix[:3, 3], matrix[:3, 2], width, angle)

    def half_height(self, aspect: float) -> float:
        """Return half the height of the film at a distance of 1, or across parallel rays [m].

        aspect: the film's width over its height. 1 for a camera without a film in front of it.
        """
        return 1.0

    def pixel_camera(self, width: int, height: int, x: int, y: int) -> Camera | None:
        """Return a camera whose film is the single pixel (x, y) of a film; None if it has none.

        width, height: of the film [pixels].
        """
        return None

    def moved(self, motion: NDArray[np.float64]) -> Camera:
        """Return the camera after a motion of the world (4, 4) that takes it along."""
        return dataclasses.replace(self, to_world=motion @ np.asarray(self.to_world, float))

    def enlarged(self, factor: float) -> Camera | None:
        """Return a camera of parallel rays with a film `factor` as wide; None for other cameras."""
        return None

    @property
    def rolls(self) -> bool:
        """Whether its shutter opens row by row: light paths do not know the time of a row."""
        return self.shutter is not None and self.shutter.readout > 0.0

    def is_connected(self, mode: str) -> bool:
        """Return whether light paths can be joined to it, in the mode of a film."""
        return self.connects and not self.rolls and (mode == "rgb" or not self.dispersive_glasses)

    def affine_matrix(self) -> NDArray[np.float64]:
        """Return `to_world`. Raises SceneError if it has no inverse, or projects."""
        matrix = self._invertible("to_world", self.to_world)
        if np.abs(matrix[3] - [0.0, 0.0, 0.0, 1.0]).max() > 1e-5:
            raise SceneError("its last row must be 0 0 0 1", where=f"{self.kind}.to_world")
        return matrix

    def rigid_matrix(self) -> NDArray[np.float64]:
        """Return `to_world`. Raises SceneError also if it scales or shears: angles would change."""
        matrix = self.affine_matrix()
        linear = matrix[:3, :3]
        if np.abs(linear.T @ linear - np.eye(3)).max() > 1e-3:
            raise SceneError("must not scale or shear", where=f"{self.kind}.to_world")
        return matrix

    def _invertible(self, name: str, values: Matrix4) -> NDArray[np.float64]:
        where = f"{self.kind}.{name}"
        try:
            matrix = np.asarray(values, np.float64)
        except (TypeError, ValueError):
            matrix = np.zeros(0)
        if matrix.shape != (4, 4):
            raise SceneError("must be a 4x4 matrix", where=where)
        if transforms.is_singular(matrix) or not fits_single(matrix):
            raise SceneError("must have an inverse and be finite", where=where)
        return matrix


def _check_planes(camera: Perspective | Orthographic) -> None:
    if not camera.near < camera.far:
        message = f"near must be below far, not {camera.near:g} and {camera.far:g}"
        raise SceneError(message, where=camera.kind)


@dataclass(frozen=True, kw_only=True, eq=False)
class Perspective(Camera):
    """A pinhole."""

    connects: ClassVar[bool] = True
    has_axis: ClassVar[bool] = True
    has_screen: ClassVar[bool] = True

    fov: float = real(45.0, "field of view along `fov_axis`", "degrees", 1e-3, 179.999)
    fov_axis: str = choice("x", "the side that `fov` spans", ("x", "y", "smaller", "larger"))
    near: float = member(1e-2, "nearest distance seen", "m", low=0.0)
    far: float = member(1e4, "farthest distance seen", "m", low=0.0)
    offset_x: float = real(
        0.0, "shift of the principal point: it lies at 1/2 - offset from the left, in widths"
    )
    offset_y: float = real(
        0.0, "shift of the principal point: it lies at 1/2 - offset from the top, in heights"
    )

    def extent(self, width: float, height: float) -> tuple[float, float]:
        """Return width and height of the film at a distance of 1 m [m].

        width, height: of the film [pixels]. All that depends on the field of view follows from it.
        """
        side = 2.0 * np.tan(np.radians(self.fov) / 2.0)
        smaller, larger = ("x", "y") if width <= height else ("y", "x")
        if width == height:
            larger = "x"
        axis = {"smaller": smaller, "larger": larger}.get(self.fov_axis, self.fov_axis)
        pixel = side / (width if axis == "x" else height)
        return pixel * width, pixel * height

    def half_height(self, aspect: float) -> float:
        """Return half the height of the film at a distance of 1 m [m]."""
        return 0.5 * float(self.extent(aspect, 1.0)[1])

    def pixel_camera(self, width: int, height: int, x: int, y: int) -> Camera | None:
        """Return a camera that sees a pixel alone; None if the pixel's angle is too small."""
        wanted = np.array(self.extent(width, height)) / [width, height]
        fov = math.degrees(2.0 * math.atan(0.5 * wanted[0]))
        if fov < 1e-3:
            return None
        pixel = dataclasses.replace(
            self,
            fov=fov,
            fov_axis="x",
            offset_x=0.5 - width * (0.5 - self.offset_x) + x,
            offset_y=0.5 - height * (0.5 - self.offset_y) + y,
        )
        return pixel if np.allclose(pixel.extent(1, 1), wanted, rtol=1e-6, atol=0.0) else None

    def record_members(self, width: int, height: int) -> dict[str, ArrayLike]:
        """Return its matrix, and the film's extent at a distance of 1 m."""
        _check_planes(self)
        return {
            "to_world": self.rigid_matrix(),
            "extent": list(self.extent(width, height)),
            "offset": [self.offset_x, self.offset_y],
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class ThinLens(Perspective):
    """A pinhole with an aperture: what is not at the focus distance blurs.

    A `glass` that disperses gives it chromatic aberration: `focus_distance` is that at 587.56 nm.
    """

    aperture_radius: float = member(0.1, "of the lens", "m", low=0.0)
    focus_distance: float = member(1.0, "of the plane in focus", "m", low=1e-6)
    glass: IndexLike = index(1.5, "of the lens; with dispersion each wavelength has its own focus")
    focal_length: float = member(
        0.05, "of the lens at 587.56 nm; matters to `glass`", "m", low=1e-6
    )

    @property
    def dispersive_glasses(self) -> tuple[Spectrum, ...]:
        """The index of its glass if it depends on the wavelength."""
        glass: Any = self.glass
        index_ = spectra.index(glass)
        return () if isinstance(index_, Constant) else (index_,)

    def record_members(self, width: int, height: int) -> dict[str, ArrayLike]:
        """Return the members of a pinhole, and its refractive power."""
        glass = self.dispersive_glasses
        power = float(glass[0].sample(DESIGN_WAVELENGTH)) - 1.0 if glass else 1.0
        if power < 1e-3:
            message = f"its index must be above 1, not {power + 1.0:.4g}"
            raise SceneError(message, where="thin_lens.glass")
        return {**super().record_members(width, height), "power": power}


@dataclass(frozen=True, kw_only=True, eq=False)
class Lens(Camera):
    """A lens traced surface by surface, with a film behind it; its origin is the film's middle.

    The whole lens moves to focus. Where its glasses disperse, each path has a single wavelength.
    """

    lens: Prescription | str = host("double_gauss", "its surfaces", form="lens")
    film_width: float = real(0.036, "of the film; its height follows from the picture's", "m", 1e-6)
    focus_distance: float = real(1e4, "from the film to the plane in focus", "m", low=1e-6)
    film_shift: float = real(0.0, "of the film away from the lens, out of that focus", "m")
    f_number: float = real(0.0, "focal length over entrance pupil; 0: wide open", low=0.0)
    blades: int = host(0, "of the diaphragm, from 3 on; 0: it is round", form="integer")
    blade_angle: float = real(0.0, "the diaphragm is turned by it", "degrees")
    losses: bool = flag(False, "lens surfaces reflect a part of the light, and it is lost")
    coating: str = choice(
        "none", "of surfaces between glass and air that have none", tuple(lenses.COATINGS)
    )
    ghosts: float = real(
        0.0, "share of the samples for light that two lens surfaces reflect", low=0.0, high=0.9
    )
    exposure: str = choice(
        "relative",
        "value of radiance 1 in the middle of the film: 1, or its irradiance, as in pbrt",
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
    def has_ghosts(self) -> bool:
        """Whether `ghosts` gets a share of the samples."""
        return self.ghosts > 0.0

    @property
    def traced_lens(self) -> Lens:
        """This camera."""
        return self

    @property
    def dispersive_glasses(self) -> tuple[Spectrum, ...]:
        """The different indices of its glasses that depend on the wavelength."""
        glasses = (surface.glass for surface in self.prescription.surfaces)
        return tuple(dict.fromkeys(glass for glass in glasses if not isinstance(glass, Constant)))

    def focused(self, aspect: float) -> FocusedLens:
        """Return its lens at its f-number and focus; aspect: of the film, height over width.

        Raises SceneError for a lens that cannot be used.
        """
        unit = self.unit
        radius = MARGIN * 0.5 * self.film_width * math.hypot(1.0, aspect) / unit
        return focused_lens(
            self.prescription, self.f_number, self.focus_distance / unit, self.film_shift / unit,
            radius,
        )  # fmt: skip

    def record_members(self, width: int, height: int) -> dict[str, ArrayLike]:
        """Return its matrix, the film's extent [m] and its distance from the lens [m]."""
        matrix, lens = self.rigid_matrix(), self.focused(height / width)
        extent = [self.film_width, self.film_width * height / width]
        return {"to_world": matrix, "extent": extent, "back": lens.back * self.unit}

    def view_of(self, width: int, height: int) -> None:
        """Return None: each point of the film has its own pupil."""

    def view_point(self, width: int, height: int) -> NDArray[np.float64]:
        """Return the point (3,) [m] where its axis meets its front: light enters there."""
        lens = self.focused(height / width)
        front = [0.0, 0.0, (lens.back + lens.prescription.length) * self.unit]
        return np.asarray(transforms.transform_points(self.rigid_matrix(), front), np.float64)

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

    is_rigid: ClassVar[bool] = False
    has_axis: ClassVar[bool] = True
    has_screen: ClassVar[bool] = True

    near: float = member(1e-2, "nearest distance seen", "m", low=0.0)
    far: float = member(1e4, "farthest distance seen", "m", low=0.0)

    def half_height(self, aspect: float) -> float:
        """Return half the height of the film [m]."""
        return float(np.linalg.norm(np.asarray(self.to_world, float)[:3, 1])) / aspect

    def pixel_camera(self, width: int, height: int, x: int, y: int) -> Camera:
        """Return a camera that sees a pixel alone."""
        centre = [1.0 - (2 * x + 1) / width, (height - (2 * y + 1)) / width, 0.0]
        scale = np.diag([1.0 / width, 1.0 / width, 1.0, 1.0])
        matrix = np.asarray(self.to_world, float) @ transforms.translate(centre) @ scale
        return dataclasses.replace(self, to_world=matrix)

    def enlarged(self, factor: float) -> Camera:
        """Return the camera with a film `factor` as wide and as high."""
        scale = np.diag([factor, factor, 1.0, 1.0])
        return dataclasses.replace(self, to_world=np.asarray(self.to_world, float) @ scale)

    def record_members(self, width: int, height: int) -> dict[str, ArrayLike]:
        """Return its matrix, and the film's aspect."""
        _check_planes(self)
        return {"to_world": self.affine_matrix(), "aspect": height / width}


@dataclass(frozen=True, kw_only=True, eq=False)
class Spherical(Camera):
    """All directions: the film is a map in latitude and longitude, +y up, +z in its middle.

    The middle of row i of h rows lies at pi (i + 1/2) / h from +y. Rows of an `envmap` lie at pi i
    / (h - 1), from pole to pole. So the film as an `envmap` is stretched by half a row at the
    poles. That is 3 % of the height with 16 rows, and invisible with 1024.
    """

    def record_members(self, width: int, height: int) -> dict[str, ArrayLike]:
        """Return its matrix."""
        return {"to_world": self.rigid_matrix()}
