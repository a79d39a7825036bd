"""The way in which a film looks at lights: in spectra or in colours."""

from __future__ import annotations

from dataclasses import dataclass

from clpt.render.analysis.lowering_cache import LoweringCache


@dataclass(frozen=True)
class Look:
    """The way in which a film looks at lights.

    spectral: whether in spectra, from lo to hi [nm], or in colours; cache: of costly pieces.
    """

    spectral: bool
    lo: float
    hi: float
    cache: LoweringCache
