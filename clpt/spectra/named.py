"""Metals and glasses by name."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

from clpt.errors import UnknownKindError
from clpt.spectra import data
from clpt.spectra.spectrum import RGB, Constant, RGBUnbounded, Sellmeier, Spectrum, Tabulated

NAMES = {  # of the elements, and of brass
    "aluminium": "Al", "aluminum": "Al", "beryllium": "Be", "brass": "CuZn", "chromium": "Cr",
    "cobalt": "Co", "copper": "Cu", "gold": "Au", "iridium": "Ir", "iron": "Fe", "lithium": "Li",
    "mercury": "Hg", "molybdenum": "Mo", "nickel": "Ni", "niobium": "Nb", "palladium": "Pd",
    "platinum": "Pt", "potassium": "K", "rhodium": "Rh", "silicon": "Si", "silver": "Ag",
    "sodium": "Na", "titanium": "Ti", "tungsten": "W", "vanadium": "V",
}  # fmt: skip


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
        return replace(value, outside="hold")
    return RGBUnbounded(value.r, value.g, value.b) if isinstance(value, RGB) else value


@cache
def _glasses() -> dict[str, dict[str, Any]]:
    return json.loads((data.ROOT / "glasses.json").read_text("utf-8"))
