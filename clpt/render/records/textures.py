"""Features of textures: their kinds and roles."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.records.macros import flag
from clpt.render.records.texture_rows import MIPS


@dataclass(frozen=True)
class TextureFeatures:
    """The textures of a scene; roles: their (kind, role) pairs, in their order."""

    roles: tuple[tuple[str, str], ...] = ()
    mappings: bool = False  # some texture makes uv of the place
    depth: int = 0  # how many values their programs stack
    attributes: bool = flag("USES_ATTRIBUTES")  # some reads what meshes say per vertex or face

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of textures, in their order."""
        return tuple(sorted({kind for kind, _ in self.roles}))

    @property
    def mips(self) -> bool:
        """Whether some image has smaller copies, which the cones around rays choose."""
        return not MIPS.keys().isdisjoint(self.kinds)
