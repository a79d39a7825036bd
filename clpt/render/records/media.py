"""Features of media, inside or outside of shapes, or around the camera."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.records.macros import flag, macro, number

MOST_AIMS = 8  # lamps near which flights end, see kernels/media/equiangular.cl


@dataclass(frozen=True)
class GridFeatures:
    """Media whose density is on a grid."""

    present: bool = False
    emissive: bool = False  # some give out light
    hot: bool = False  # some have a temperature
    tinted: bool = False  # some have an albedo on a grid
    coloured: bool = False  # some have colours of their extinction on a grid
    mixed: int = flag("GRIDS_MIXED", 0)  # parts of the one that is made of most
    bytes: bool = False  # some have 8 bits for each number


@dataclass(frozen=True)
class MediaFeatures:
    """Media, and bodies whose insides absorb light."""

    absorption: bool = False  # inside of a dielectric
    present: bool = flag("USES_MEDIA")
    chromatic: bool = False  # some extinction depends on the wavelength
    emissive: bool = False  # some give out light
    dyed: bool = False  # some have a dye that gives out light
    sealed: bool = flag("SEALED_MEDIA")  # no ray to a light can leave some
    escapes: bool = False  # rays of their own leave them toward lamps
    bodies: bool = False  # they may overlap, of different priorities
    aims: int = number("MEDIUM_AIMS")  # rows about lamps near which flights through media end
    grids: GridFeatures = GridFeatures()

    @property
    def aim_cones(self) -> bool:
        """Whether some of these lamps shine into a cone; then each has two rows."""
        return self.aims > 0 and self.aims != 1 and self.aims != MOST_AIMS

    @property
    @macro("USES_ABSORPTION")
    def absorbing(self) -> bool:
        """Whether light may be lost on its way."""
        return self.absorption or self.present
