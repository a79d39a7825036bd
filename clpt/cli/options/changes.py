"""Options change a scene: its samples, film, light transport, camera and surroundings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .composition import Composition
from .records import record_of


@dataclass(frozen=True)
class Sampling:
    """Samples of a pixel, the noise at which one ends (0: never), and the seed."""

    spp: int | None = None
    noise: float | None = None
    seed: int | None = None


@dataclass(frozen=True)
class FilmChanges:
    """Parameters of a film, by their names there; size: width and height in pixels."""

    mode: str | None = None
    size: tuple[int, int] | None = None
    sensor: object = None
    white_balance: str | float | tuple[float, float] | None = None
    output_space: str | None = None
    bands: int | None = None
    lambda_min: float | None = None
    lambda_max: float | None = None
    layers: tuple[str, ...] | None = None
    alpha: bool | None = None

    def values(self) -> dict[str, Any]:
        """Return what is given, by the names of the film."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        width_height = given.pop("size", None)
        if width_height is not None:
            given["width"], given["height"] = width_height
        return given


@dataclass(frozen=True)
class Transport:
    """A kind of integrator, one of sampler, and parameters of the integrator."""

    integrator: str | None = None
    sampler: str | None = None
    max_depth: int | None = None
    light_paths: float | str | None = None
    radius: float | None = None
    guiding: bool | None = None

    @property
    def implied(self) -> str:
        """The kind in the place of "auto": a number of light paths, or a radius, is a choice."""
        of_path = self.light_paths is not None or self.guiding is not None
        return "vcm" if self.radius is not None else "path" if of_path else "auto"


@dataclass(frozen=True)
class SceneChanges:
    """Values that take the place of a scene's own, where they are not None."""

    sampling: Sampling = Sampling()
    film: FilmChanges = FilmChanges()
    transport: Transport = Transport()
    composition: Composition = Composition()
    denoise: str | None = None

    @classmethod
    def of(cls, **options: Any) -> SceneChanges:
        """Return the record of options by their names."""
        return record_of(cls, options)
