"""Re-radiation matrices as kernels/materials/reradiation.cl reads them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from clpt.arrays import Floats
from clpt.render.records.parameter_words import RERADIATION_STEP
from clpt.spectra import Reradiation, Spectrum
from clpt.spectra.spectrum import gridded

EVEN = 0.25  # share of the light to expect that is the same at all wavelengths


def nodes(low: float, high: float) -> Floats:
    """The wavelengths [nm] between which a film's matrices are linear."""
    count = int(np.ceil((high - low) / RERADIATION_STEP - 1e-9)) + 1
    return np.asarray(low + RERADIATION_STEP * np.arange(count), np.float64)


def expected(lights: Iterable[Spectrum], at: Floats) -> Floats:
    """Return the light to expect at nodes, mean about 1: it decides where light is looked for.

    Every light counts the same, whatever its power: which one a surface sees is not known here.
    """
    fine = np.linspace(at[0], at[-1], RERADIATION_STEP * (len(at) - 1) + 1)
    hats = np.maximum(1.0 - np.abs(fine[:, None] - at) / RERADIATION_STEP, 0.0)
    found = [gridded(light, fine) @ hats for light in lights]
    found = [values / values.mean() for values in found if values.mean() > 0.0]
    return EVEN + (1.0 - EVEN) * (np.mean(found, axis=0) if found else np.ones_like(at))


def table(value: Reradiation | None, at: Floats, light: Floats) -> tuple[Floats, Floats]:
    """Return what stands in `distributions` for a matrix, and the integrals of its rows (n,) [1].

    at: nodes (n,) [nm]; light: what to expect there, see `expected`.
    """
    rows = np.zeros((len(at), len(at)))
    if value is not None:
        rows = value.on_nodes(at)
    running = _running(rows * light)
    shares = running / np.maximum(running[:, -1:], 1e-30)
    flat = np.concatenate([light, running[:, -1], np.hstack([rows, shares]).ravel()])
    return flat, _running(rows)[:, -1]


def _running(rows: Floats) -> Floats:
    """Integrals from the first node to each other one, of rows that are linear between nodes."""
    return np.cumsum(0.5 * RERADIATION_STEP * (rows[:, 1:] + rows[:, :-1]), axis=1)
