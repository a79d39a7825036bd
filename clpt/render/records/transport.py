"""Features of light transport: which paths there are, and how they are joined."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.records.macros import flag


@dataclass(frozen=True)
class TransportFeatures:
    """The integrator and the sampler, and what paths do; of one kind of paths of a scene."""

    integrator: str = "path"
    sampler: str = "sobol"
    light_paths: bool = flag("LIGHT_PATHS")  # paths start at lights
    weighed: bool = flag("SUMS_LIGHT_PATHS")  # light paths have sums beside the camera's paths'
    joined: bool = flag("JOINS_CAMERA")  # those are joined to the camera
    merged: bool = False  # those leave photons, which paths from the camera gather
    guided: bool = flag("USES_GUIDE")  # directions of the camera's paths are learned
    aimed: bool = False  # some light paths start toward what is sharp
    lit_ghosts: bool = False  # light paths are ghosts of the lens, and no more
    light_filter: tuple[int, int, int] = (0, 0, 0)  # of weighed light paths: taps, reach, profile

    @property
    def balanced(self) -> bool:
        """Whether paths from the camera are weighed against light paths."""
        return self.weighed and not self.lit_ghosts
