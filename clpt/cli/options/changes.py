"""Options change a scene: its samples, film, light transport, camera and surroundings."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import click

from ...denoise.needs import prepared
from ...scene import Scene, kinds
from ...scene.integrators import AUTO, NO_AOV, Auto
from ...scene.params import Kind, fields_of, params
from .composition import Composition, composed
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
    sensor: Any = None
    white_balance: Any = None
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


def changed(scene: Scene, changes: SceneChanges) -> Scene:
    """Return the scene as the options want it.

    Raises click.BadParameter, and SceneError for an invalid film.
    """
    sampling, film = changes.sampling, changes.film.values()
    if changes.composition.crop is not None:
        film["crop"] = None  # that of the file may not fit the new size
    if sampling.noise is not None:
        scene = dataclasses.replace(scene, noise=sampling.noise or None)
    given: dict[str, Any] = {"spp": sampling.spp, "seed": sampling.seed}
    given = {name: value for name, value in given.items() if value is not None}
    if changes.transport.sampler is not None:
        given["sampler"] = kinds("sampler")[changes.transport.sampler]()
    given["film"] = dataclasses.replace(scene.film, **film)
    given["integrator"] = _integrator(scene.integrator, changes.transport)
    scene = composed(dataclasses.replace(scene, **given), changes.composition)
    return prepared(scene, changes.denoise)


PARAMETERS = {  # of integrators, and what an integrator without one has not
    "max_depth": "depth",
    "light_paths": "light paths beside it",
    "radius": "photons",
    "guiding": "guiding",
}


def _integrator(how: Any, transport: Transport) -> Any:
    """Return an integrator, as the options want it. Raises click.BadParameter."""
    if transport.integrator is not None and transport.integrator != how.kind:
        how = _of_kind(transport.integrator, how)
    if isinstance(how, Auto) and transport.implied != how.kind:
        how = _of_kind(transport.implied, how)
    for name, what in PARAMETERS.items():
        value = vars(transport)[name]
        if value is None:
            continue
        if not hasattr(how, name):
            message = f"the integrator {how.kind} has no {what}"
            raise click.BadParameter(message, param_hint=f"--{name.replace('_', '-')}")
        how = dataclasses.replace(how, **{name: value})
    return how


def _of_kind(name: str, old: Kind) -> Any:
    """Return an integrator of another kind, with the parameters that both have."""
    known = kinds("integrator")
    if name not in known:
        message = NO_AOV if name == "aov" else f"{name!r} is none of {', '.join(known)}"
        raise click.BadParameter(message, param_hint="--integrator")
    given = {key: value for key, value in fields_of(old).items() if key in params(known[name])}
    if name == "vcm" and "light_paths" in given:  # a whole number, 1 or more
        number = given.pop("light_paths")
        given |= {} if number == AUTO else {"light_paths": max(round(number), 1)}
    return known[name](**given)
