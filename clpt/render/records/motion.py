"""Features of motion while the shutter is open."""

from __future__ import annotations

from dataclasses import dataclass, fields

from clpt.render.records.macros import flag, number


@dataclass(frozen=True)
class MotionFeatures:
    """The things that move, and where the table of them is."""

    camera: bool = False
    instances: bool = flag("MOVES_INSTANCES")
    shapes: bool = False  # analytic ones
    lights: bool = False
    vertices: bool = flag("MOVES_VERTICES")  # have a row for each key
    spheres: bool = flag("MOVES_SPHERES")  # of shapes `spheres` have a row for each key
    emitters: bool = False  # triangles of lights have a row for each key
    scales: bool = flag("MOTION_SCALES")  # some motion scales
    row: int | None = number("MOTION_ROW", None)  # where in `distributions` its table begins

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of what moves."""
        parts = (field.name for field in fields(self) if field.name not in ("scales", "row"))
        return tuple(name for name in parts if vars(self)[name])

    @property
    def present(self) -> bool:
        """Whether anything moves."""
        return bool(self.parts)
