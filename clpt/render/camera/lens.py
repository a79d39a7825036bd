"""A lens of surfaces as it is set: its f-number, its focus, and what its film sees through it."""

from __future__ import annotations

import math
from functools import lru_cache

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.lenses import Prescription
from clpt.lenses.paraxial import film_distance, stop_radius
from clpt.lenses.pupils import axis_solid_angle, zones
from clpt.scene.cameras import Lens
from clpt.spectra import Constant, Spectrum

MARGIN = 1.05  # of the film's radius that has zones, as filters reach beyond the film


def glasses(camera: Lens) -> tuple[Spectrum, ...]:
    """Return the indices of a lens that differ between wavelengths, each once."""
    surfaces = camera.prescription.surfaces
    return tuple(dict.fromkeys(s.glass for s in surfaces if not isinstance(s.glass, Constant)))


@lru_cache(maxsize=64)
def _placed(
    lens: Prescription, f_number: float, focus: float, shift: float, radius: float
) -> tuple[Prescription, float, Floats, float]:
    """Return a lens at an f-number, and how it stands before its film.

    It is followed by the way from it to its film [mm], the zones that the film sees, and the
    projected solid angle [sr] at its middle. focus, shift, radius of the film [mm].
    """
    try:
        made = lens if f_number == 0.0 else lens.with_stop(stop_radius(lens, f_number))
    except SceneError as error:
        raise SceneError(error.message, where="lens.f_number") from None
    try:
        distance = film_distance(lens, focus) + shift
    except SceneError as error:
        raise SceneError(error.message, where="lens.focus_distance") from None
    if not distance > 0.0:
        raise SceneError(
            f"the film would stand {-distance:.4g} mm inside of the lens", where="lens.film_shift"
        )
    angle = axis_solid_angle(made, distance)
    if not angle > 0.0:
        raise SceneError("no light comes through to the middle of the film", where="lens")
    return made, distance, zones(made, distance, radius), angle


def focused(camera: Lens, aspect: float) -> tuple[Prescription, float, Floats, float, float]:
    """Return what `_placed` tells of a camera, and the radius of the film that has zones [mm].

    aspect: of the film, height over width. Raises SceneError for a lens that cannot be used.
    """
    unit = camera.unit
    radius = MARGIN * 0.5 * camera.film_width * math.hypot(1.0, aspect) / unit
    placed = _placed(
        camera.prescription, camera.f_number, camera.focus_distance / unit,
        camera.film_shift / unit, radius,
    )  # fmt: skip
    return *placed, radius


def front(camera: Lens, aspect: float) -> float:
    """Return how far the front of the lens is from its film [m]: there light comes in.

    aspect: of the film, height over width. Raises SceneError for a lens that cannot be used.
    """
    lens, back, *_ = focused(camera, aspect)
    return (back + lens.length) * camera.unit
