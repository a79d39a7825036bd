"""Features of materials, and where all values that kernels load come from."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.records.macros import flag, macro
from clpt.scene.params import device_params
from clpt.scene.roles import INDEX
from clpt.scene.scatterer import Scatterer

Sources = frozenset[tuple[str, str, str]]


@dataclass(frozen=True)
class MaterialFeatures:
    """The materials that a path may meet.

    leaves: classes of leaf materials in their order, then of phase functions: a material word's
    upper bits count in it; transmitting: kinds of leaves of which some let light through; shining:
    kinds of leaves on shapes that are lights; sources: (kind, parameter, source) of all that is
    loaded, of lights and media too, see clpt.render.materials.cases.
    """

    leaves: tuple[type[Scatterer], ...] = ()
    transmitting: tuple[str, ...] = ()
    shining: tuple[str, ...] = ()
    mixtures: int = 0  # how deep masks and blends nest
    normal_mapped: bool = False  # some material has a normal or a bump map
    free_panes: bool = flag("FREE_PANES")  # light goes straight through thin glass
    sources: Sources = frozenset()

    @property
    @macro("BSDF_COUNT")
    def count(self) -> int:
        """Number of kinds."""
        return len(self.leaves)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the leaf materials, in their order."""
        return tuple(cls.kind for cls in self.leaves)

    @property
    def null_surfaces(self) -> bool:
        """Whether some surface lets light through as if it were not there."""
        return self.free_panes or any(cls.is_null for cls in self.leaves)

    @property
    def disperses(self) -> bool:
        """Whether the direction of light depends on its wavelength at some material."""
        indices = (
            (cls.kind, name, "table")
            for cls in self.leaves
            if cls.refracts
            for name, param in device_params(cls).items()
            if param.role is INDEX
        )
        return any(cls.disperses for cls in self.leaves) or not self.sources.isdisjoint(indices)

    def sources_of(self, kind: str) -> dict[str, frozenset[str]]:
        """Return the sources of each parameter of a kind that has some."""
        found: dict[str, frozenset[str]] = {}
        for owner, name, source in self.sources:
            if owner == kind:
                found[name] = found.get(name, frozenset()) | {source}
        return found

    def phase_varies(self, cls: type[Scatterer]) -> bool:
        """Return whether a phase function differs between wavelengths."""
        found = self.sources_of(cls.kind).values()
        varies = cls.is_phase and cls.chromatic
        return varies and any(source not in ("grey", "row") for one in found for source in one)
