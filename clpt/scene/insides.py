"""The inside of a body by how it looks: absorption by a colour at a depth, index by Abbe number.

Indices of refraction must be above 0 wherever the film sees.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np

from clpt import spectra
from clpt.errors import SceneError
from clpt.scene.integrators import Film
from clpt.scene.params import Kind, fields_of, params, place_of
from clpt.scene.values import is_texture
from clpt.spectra import Cauchy, RGBUnbounded, Spectrum
from clpt.spectra.spectrum import extremes

DARKEST = 1e-4  # colour at a depth: black would absorb all at once
DENSEST = 1e6  # [1/m]
LINES = (0.48613, 0.58756, 0.65627)  # of Fraunhofer: F, d and C [um]


def absorbed(color: object, depth: float) -> float | RGBUnbounded:
    """Return the absorption [1/m] that leaves a colour of white light after a depth [m].

    Raises SceneError for what is no number and no linear rgb.
    """
    if not isinstance(color, (int, float, tuple, list, np.ndarray)):
        raise SceneError(f"must be a number or a colour where there is a depth, not {color!r}")
    left = np.broadcast_to(np.asarray(color, float), 3).tolist()
    a = [min(-math.log(max(value, DARKEST)) / depth, DENSEST) for value in left]
    return a[0] if a[0] == a[1] == a[2] else RGBUnbounded(*a)


def dispersed(ior: float, abbe: float) -> Spectrum:
    """Return an index that is `ior` at line d, of an Abbe number (OpenPBR 1.1, Translucent base).

    KHR_materials_dispersion has the same formula.
    """
    f, d, c = (line**-2 for line in LINES)
    b = (ior - 1.0) / (abbe * (f - c))
    return Cauchy(ior - b * d, b)


def spelled(transmission_color: object = 1.0, transmission_depth: float = 0.0) -> dict[str, Any]:
    """Return the parameters of `openpbr` for its colour of transmission at a depth [m].

    A depth of 0 makes it a factor at the surface. Raises SceneError, see `absorbed`.
    """
    if transmission_depth == 0.0:
        return {"transmission_tint": transmission_color, "absorption": 0.0}
    a = absorbed(transmission_color, transmission_depth)
    return {"transmission_tint": 1.0, "absorption": a}


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
