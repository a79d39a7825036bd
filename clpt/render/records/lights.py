"""Features of lights: their kinds, and how one is chosen."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.records.light_rows import BODY, BRICK, VOLUMES
from clpt.render.records.macros import flag, macro


@dataclass(frozen=True)
class LightFeatures:
    """The device kinds of lights, see clpt.render.records.light_rows, and what they do."""

    kinds: tuple[str, ...] = ()
    infinite: bool = False  # some light is met by rays that leave the scene
    visible: bool = False  # some light is no delta light: a camera may see it
    two_sided: bool = False  # some shape emits from its back too
    unseen: bool = False  # some shape emits, but no ray sees it
    tree: bool = False  # a tree chooses among the lights
    gloss: int = 0  # words before a material's row where its gloss stands; 0: nobody asks for it
    few: bool = flag("FEW_LIGHTS", True)  # the number that chooses one also places the point on it

    @property
    @macro("USES_LIGHTS")
    def present(self) -> bool:
        """Whether there is a light."""
        return bool(self.kinds)

    @property
    def volumes(self) -> bool:
        """Whether parts of media are lights: bricks of grids, or whole bodies."""
        return any(kind in self.kinds for kind in VOLUMES)

    @property
    def bricks(self) -> bool:
        """Whether bricks of media are lights."""
        return BRICK in self.kinds

    @property
    def bodies(self) -> bool:
        """Whether homogeneous media are lights."""
        return BODY in self.kinds
