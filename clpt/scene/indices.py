"""The rule of indices of refraction: above 0 wherever the film sees."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache

from clpt import spectra
from clpt.errors import SceneError
from clpt.scene.integrators import Film
from clpt.scene.params import Kind, fields_of, params, place_of
from clpt.scene.values import is_texture
from clpt.spectra import Spectrum
from clpt.spectra.spectrum import extremes


def check_indices(kinds: Iterable[Kind], film: Film) -> None:
    """Raise SceneError for an index of some kind that is 0 at a wavelength of the film."""
    for kind in kinds:
        values = fields_of(kind)
        for name in _indices(type(kind)):
            value = values[name]
            if not is_texture(value):
                check_index(value, film, place_of(kind, name))


@cache
def _indices(cls: type[Kind]) -> tuple[str, ...]:
    """The parameters of a class that are indices above 0."""
    return tuple(name for name, param in params(cls).items() if param.positive)


def check_index(value: Spectrum | str, film: Film, where: str) -> None:
    """Raise SceneError for an index that is not above 0 at every wavelength of the film."""
    for index, at in extremes(spectra.index(value), film.lambda_min, film.lambda_max):
        if not 0.0 < index < math.inf:
            raise SceneError(
                f"an index of {index:g} at {at:g} nm, but it must be above 0 within the film's"
                f" {film.lambda_min:g} to {film.lambda_max:g} nm; narrow that range, or give the"
                " index there",
                where=where,
            )
