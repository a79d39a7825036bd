"""Dispersion by the formulas 1 to 9 of refractiveindex.info; metals and glasses by name.

Formulas: M. N. Polyanskiy, Dispersion formulas (refractiveindex.info/database/doc); wavelengths
in um.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from clpt.arrays import Floats
from clpt.errors import SceneError, UnknownKindError
from clpt.spectra import data
from clpt.spectra.spectrum import (
    RGB,
    Cauchy,
    Constant,
    RGBUnbounded,
    Sellmeier,
    Spectrum,
    Tabulated,
)

MICROMETRE = 1000.0  # [nm]
POINTS = 2001  # of the table of a formula that has no Spectrum class
HERZBERGER = 0.028  # [um^2], the fixed resonance of formula 7
FIXED = {7: 6, 8: 4, 9: 6}  # formula: its number of coefficients, where this is fixed
NAMES = {  # of the elements, and of brass
    "aluminium": "Al", "aluminum": "Al", "beryllium": "Be", "brass": "CuZn", "chromium": "Cr",
    "cobalt": "Co", "copper": "Cu", "gold": "Au", "iridium": "Ir", "iron": "Fe", "lithium": "Li",
    "mercury": "Hg", "molybdenum": "Mo", "nickel": "Ni", "niobium": "Nb", "palladium": "Pd",
    "platinum": "Pt", "potassium": "K", "rhodium": "Rh", "silicon": "Si", "silver": "Ag",
    "sodium": "Na", "titanium": "Ti", "tungsten": "W", "vanadium": "V",
}  # fmt: skip


def from_formula(name: str, coefficients: list[float], ends: list[float]) -> Spectrum:
    """Return the index by formula `name`; where it must be tabulated, over `ends` [um].

    Raises SceneError for an unknown formula or a wrong number of coefficients.
    """
    if name not in tuple("123456789"):
        raise SceneError(f"dispersion formula {name!r} is not known; 1 to 9 are")
    number, c = int(name), list(coefficients)
    if number in FIXED:
        if len(c) > FIXED[number]:
            raise SceneError(f"formula {number} takes {FIXED[number]} coefficients, not {len(c)}")
        c += [0.0] * (FIXED[number] - len(c))
    elif number != 4 and len(c) % 2 == 0:
        raise SceneError(f"formula {number} takes an odd number of coefficients, found {len(c)}")
    pairs = list(zip(c[1::2], c[2::2], strict=False))
    if number in (1, 2):
        b = tuple(pair[0] for pair in pairs)
        squares = tuple(pair[1] ** (3 - number) for pair in pairs)
        return Sellmeier(b, squares, 1.0 + c[0])
    if number == 5 and [p for _, p in pairs] in ([-2.0], [-2.0, -4.0]):
        return Cauchy(c[0], *(b for b, _ in pairs))
    um = np.linspace(ends[0], ends[-1], POINTS)
    return Tabulated(um * MICROMETRE, _index(number, c, pairs, um), "hold")


def _index(number: int, c: list[float], pairs: list[tuple[float, float]], um: Floats) -> Floats:
    """Return the index by formulas 3 to 9 at wavelengths [um]; 0 where its square is negative."""
    l2 = um**2
    if number == 5:
        return sum((b * um**p for b, p in pairs), np.full(um.shape, c[0]))
    if number == 6:
        return sum((b / (s - 1.0 / l2) for b, s in pairs), np.full(um.shape, 1.0 + c[0]))
    if number == 7:
        near = 1.0 / (l2 - HERZBERGER)
        return c[0] + c[1] * near + c[2] * near**2 + c[3] * l2 + c[4] * l2**2 + c[5] * l2**3
    if number == 3:
        squared = sum((b * um**p for b, p in pairs), np.full(um.shape, c[0]))
    elif number == 4:
        squared = _fourth(c + [0.0] * (9 - len(c)), um)
    elif number == 8:  # Lorentz and Lorenz: (n^2 - 1) / (n^2 + 2)
        share = c[0] + c[1] * l2 / (l2 - c[2]) + c[3] * l2
        squared = (1.0 + 2.0 * share) / (1.0 - share)
    else:
        off = um - c[4]
        squared = c[0] + c[1] / (l2 - c[2]) + c[3] * off / (off**2 + c[5])
    return np.sqrt(np.maximum(squared, 0.0))


def _fourth(c: list[float], um: Floats) -> Floats:
    total = c[0] + c[1] * um ** c[2] / (um**2 - c[3] ** c[4])
    total = total + c[5] * um ** c[6] / (um**2 - c[7] ** c[8])
    return sum((b * um**p for b, p in zip(c[9::2], c[10::2], strict=False)), total)


def metals() -> tuple[str, ...]:
    """Return the names that `metal` takes: symbols, elements' names and "none"."""
    return (*data.names("metals"), *NAMES, "none")


def glasses() -> tuple[str, ...]:
    """Return the names that `glass` takes."""
    return tuple(_glasses())


@cache
def metal(name: str) -> tuple[Spectrum, Spectrum]:
    """Complex index (eta, k) of a metal, "gold" or "Au"; "none" reflects everything.

    Mitsuba's suffix `_palik` is ignored.
    Raises UnknownKindError.
    """
    if name == "none":
        return Constant(0.0), Constant(1.0)
    symbol = NAMES.get(name.lower(), name.removesuffix("_palik"))
    if symbol not in data.names("metals"):
        raise UnknownKindError("metal", name, metals())
    lambdas, eta, k = data.table(f"metals/{symbol}.csv").T
    return Tabulated(lambdas, eta, "hold"), Tabulated(lambdas, k, "hold")


@cache
def glass(name: str, dispersion: bool = True) -> Constant | Sellmeier:
    """Index of a glass, liquid, crystal or gas, by its name in any case.

    With `dispersion`, Sellmeier's formula where clpt has it; otherwise the constant that Mitsuba
    and Hecht's Optics list. Raises UnknownKindError.
    """
    entry = _glasses().get(name.lower())
    if entry is None:
        raise UnknownKindError("glass", name, glasses())
    if dispersion and "b" in entry:
        return Sellmeier(entry["b"], entry["c"], entry.get("a", 1.0))
    return Constant(entry["eta"])


def index(value: Spectrum | str) -> Spectrum:
    """Return the spectrum of an index or a coefficient: of a glass by its name, or of a colour.

    A table holds its end values, as nothing has an index of 0. Raises UnknownKindError.
    """
    if isinstance(value, str):
        return glass(value)
    if isinstance(value, Tabulated):
        return value if value.outside == "hold" else replace(value, outside="hold")
    return RGBUnbounded(value.r, value.g, value.b) if isinstance(value, RGB) else value


@cache
def _glasses() -> dict[str, dict[str, Any]]:
    return json.loads((data.ROOT / "glasses.json").read_text("utf-8"))
