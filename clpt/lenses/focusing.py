"""A lens before a film: its stop, its distance from the film, and the pupils that the film sees."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.lenses.paraxial import film_distance, stop_radius
from clpt.lenses.prescription import Prescription
from clpt.lenses.pupils import axis_solid_angle, zones

MARGIN = 1.05  # zones cover this multiple of the film's radius: filters reach beyond the film


@dataclass(frozen=True)
class FocusedLens:
    """A lens at an f-number, focused on a distance.

    back: from the film to the last surface [mm]; zones: ellipses of the rear plane by rings of the
    film, see `clpt.lenses.pupils.zones`; solid_angle: projected, of the pupil that the film's
    middle sees [sr]; film_radius: that the zones cover [mm].
    """

    prescription: Prescription
    back: float
    zones: Floats
    solid_angle: float
    film_radius: float


@lru_cache(maxsize=64)
def focused_lens(
    lens: Prescription, f_number: float, focus: float, shift: float, film_radius: float
) -> FocusedLens:
    """Return a lens before its film.

    f_number: 0 for the widest stop; focus: distance of the sharp plane from the film [mm]; shift:
    of the film away from the lens [mm]; film_radius: that the zones cover [mm]. Raises SceneError
    for an f-number, a focus or a shift that the lens cannot have.
    """
    try:
        stopped = lens if f_number == 0.0 else lens.with_stop(stop_radius(lens, f_number))
    except SceneError as error:
        raise SceneError(error.message, where="lens.f_number") from None
    try:
        back = film_distance(lens, focus) + shift
    except SceneError as error:
        raise SceneError(error.message, where="lens.focus_distance") from None
    if not back > 0.0:
        raise SceneError(
            f"the film would stand {-back:.4g} mm inside of the lens", where="lens.film_shift"
        )
    angle = axis_solid_angle(stopped, back)
    if not angle > 0.0:
        raise SceneError("no light comes through to the middle of the film", where="lens")
    return FocusedLens(stopped, back, zones(stopped, back, film_radius), angle, film_radius)
