"""Glasses of lenses: by name, or by index and Abbe number."""

from __future__ import annotations

from clpt import spectra
from clpt.errors import SceneError, nearest
from clpt.spectra import Cauchy, Constant, Spectrum

LINE_D, LINE_F, LINE_C = 587.5618, 486.1327, 656.2725  # [nm]
AIR = Constant(1.0)
HIGHEST = 5.0  # index


def by_number(n: float, abbe: float = 0.0) -> Spectrum:
    """Return the index of a glass from its index `n` at the line d and its Abbe number.

    The model is Cauchy's formula with two terms, which fits n_d and n_F - n_C exactly; an Abbe
    number of 0 makes the index constant. Raises SceneError for numbers outside of glasses' range.
    """
    if not 1.0 <= n <= HIGHEST:
        raise SceneError(f"an index lies between 1 and {HIGHEST:g}, not {n:g}")
    if not (abbe == 0.0 or 5.0 <= abbe <= 200.0):
        raise SceneError(f"an Abbe number lies between 5 and 200, not {abbe:g}")
    if abbe == 0.0 or n == 1.0:
        return Constant(n)
    slope = (n - 1.0) / abbe / ((LINE_F * 1e-3) ** -2 - (LINE_C * 1e-3) ** -2)
    return Cauchy(n - slope * (LINE_D * 1e-3) ** -2, slope)


def known(name: str) -> Spectrum | None:
    """Return the index of a glass by its name in any case, or None where clpt has no formula.

    N-BK7 and BK7, a glass without lead and its forerunner, stand for each other.
    """
    wanted = name.strip().lower().replace("_", " ")
    for each in (wanted, f"n-{wanted}", wanted.removeprefix("n-")):
        if each in spectra.glasses():
            return spectra.glass(each)
    return None


def by_name(name: str, n: float = 0.0, abbe: float = 0.0) -> Spectrum:
    """Return the index of a glass by its name, else by `n` and `abbe` where `n` is not 0.

    Raises SceneError where neither is known.
    """
    index = known(name)
    if index is not None:
        return index
    if n == 0.0:
        raise SceneError(
            f"the glass {name!r} is not known{nearest(name.lower(), spectra.glasses())}; give its"
            " index and Abbe number"
        )
    return by_number(n, abbe)
