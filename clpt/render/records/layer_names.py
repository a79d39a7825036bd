"""The names that layers tell: of shapes, of materials, and of groups of lights."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class LayerNames:
    """Names of what is in a scene, as far as its layers tell of it.

    objects: of the scene's shapes, in their order; materials: of all materials, by number;
    light_groups: those of lights.
    """

    objects: tuple[str, ...] = ()
    materials: tuple[str, ...] = ()
    light_groups: tuple[str, ...] = ()
