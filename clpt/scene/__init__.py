"""Scenes as plain data, without OpenCL. `KINDS` is the table of all kinds by category."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass, field
from typing import Any

from clpt.errors import SceneError
from clpt.scene import cameras, integrators, lights, materials, media, shapes, textures
from clpt.scene.integrators import Auto, Film, Sobol
from clpt.scene.params import Kind

__all__ = [
    "KINDS",
    "Film",
    "Scene",
    "cameras",
    "integrators",
    "kinds",
    "lights",
    "materials",
    "media",
    "shapes",
    "textures",
]

KINDS: dict[str, tuple[type[Kind], ...]] = {
    "material": materials.KINDS,
    "medium": media.KINDS,
    "phase": media.PHASES,
    "light": lights.KINDS,
    "shape": shapes.KINDS,
    "camera": cameras.KINDS,
    "texture": textures.KINDS,
    "integrator": integrators.KINDS,
    "sampler": integrators.SAMPLERS,
    "filter": integrators.FILTERS,
}


def kinds(category: str) -> dict[str, type[Kind]]:
    """Return the kinds of a category by their names in scene files."""
    return {cls.kind: cls for cls in KINDS[category]}


@dataclass
class Scene:
    """A whole scene.

    shapes, lights: what there is; lights that are surfaces are a shape's `emission`. integrator:
    how light is followed; sampler: where its random numbers come from; film: size, mode, filter and
    colours of the picture. spp: samples of a pixel, for `clpt.render`; noise: below which it gets
    no more, None for all, see clpt.render.wavefront.adaptive; seed: of the random numbers.
    warnings: what a loader had to pass over; extra: what else it found, for people.

    Raises SceneError for `spp` that is no whole number above zero, and `noise` likewise.
    """

    camera: cameras.Camera
    shapes: list[shapes.Shape] = field(default_factory=list)
    lights: list[lights.Light] = field(default_factory=list)
    integrator: integrators.Integrator = field(default_factory=Auto)
    sampler: integrators.Sampler = field(default_factory=Sobol)
    film: Film = field(default_factory=Film)
    spp: int = 64
    noise: float | None = None
    seed: int = 0
    name: str = ""
    warnings: list[str] = field(default_factory=list)
    extra: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if isinstance(self.spp, bool) or not isinstance(self.spp, int) or self.spp < 1:
            raise SceneError(f"must be a whole number above zero, not {self.spp!r}", where="spp")
        if self.noise is not None:
            check_noise(self.noise)


def check_noise(noise: Any) -> None:
    """Raise SceneError for what is no limit of noise."""
    number = isinstance(noise, numbers.Real) and not isinstance(noise, bool)
    if not number or not 0.0 < noise < math.inf:
        message = f"must be a number above zero, such as 0.02, not {noise!r}"
        raise SceneError(message, where="noise")
