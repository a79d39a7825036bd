"""Features of a camera: its kind, and what its lens does."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.records.camera_rows import WEIGHTED
from clpt.render.records.macros import flag


@dataclass(frozen=True)
class CameraFeatures:
    """The kind of camera, and what its lens does."""

    kind: str = "perspective"
    disperses: bool = flag("CAMERA_DISPERSES")  # its glass does
    losses: bool = flag("LENS_LOSSES")  # surfaces of its lens reflect a part of the light
    ghosts: bool = flag("LENS_GHOSTS")  # and samples follow it

    @property
    def weighs(self) -> bool:
        """Whether its rays have weights."""
        return self.kind in WEIGHTED
