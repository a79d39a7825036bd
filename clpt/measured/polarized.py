"""Measurements of polarised light (Baek et al. 2020): what they say of light without polarisation.

A file `.pbsdf` is a tensor file. `M` has Mueller matrices [1/sr], (azimuths, difference, halfway,
wavelengths, 4, 4), in the angles of `clpt.measured.merl`; the azimuths go from -pi to pi. `phi_d`,
`theta_d` and `theta_h` are the angles [rad], (1, n), or empty: then they have even steps. `wvls`
are the wavelengths [nm].
"""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.files import budget
from clpt.measured import merl
from clpt.measured.measurement import read_tensors
from clpt.spectra import Tabulated, cie
from clpt.spectra.spectrum import d65

CHUNK = 1 << 16  # directions that are looked up at a time
MEMORY = 384 << 20  # bytes that a table takes while it is made, beside the file's numbers
ENDS = {"phi_d": (-np.pi, np.pi), "theta_d": (0.0, 0.5 * np.pi), "theta_h": (0.0, 0.5 * np.pi)}


def read(path: str | Path, wavelength: float | None = None) -> merl.MerlTable:
    """Return the first number of the matrices as a table.

    wavelength: [nm] of a grey table; None: the colour of all wavelengths. Raises SceneError.
    """
    fields = read_tensors(path)
    budget.check(MEMORY + sum(values.nbytes for values in fields.values()), "its table", Path(path))
    try:
        return _table(fields, wavelength)
    except SceneError as error:
        raise SceneError(error.message, file=Path(path)) from None


def _table(fields: dict[str, NDArray[Any]], wavelength: float | None) -> merl.MerlTable:
    matrices, lambdas = fields.get("M", np.zeros(0)), fields.get("wvls", np.zeros(0)).ravel()
    if matrices.ndim != 6 or matrices.shape[3:] != (len(lambdas), 4, 4) or min(matrices.shape) < 2:
        raise SceneError(f"is no measurement of polarised light: 'M' is {matrices.shape}")
    axes = [_axis(fields, name, n) for name, n in zip(ENDS, matrices.shape, strict=False)]
    table = np.maximum(np.nan_to_num(matrices[..., 0, 0] @ _colours(lambdas, wavelength)), 0.0)

    def looked_up(wo: Floats, wi: Floats) -> Floats:
        m = wo + wi
        halfway, difference, phi = merl.angles(m, wo, wi)
        at = [
            np.interp(angle, axis, np.arange(len(axis)))
            for angle, axis in zip((phi, difference, halfway), axes, strict=True)
        ]
        low = [np.minimum(a.astype(int), len(axis) - 2) for a, axis in zip(at, axes, strict=True)]
        total = np.zeros((len(wo), 3))
        for corner in product((0, 1), repeat=3):
            index = tuple(i + c for i, c in zip(low, corner, strict=True))
            weights = [1.0 - np.abs(a - i) for a, i in zip(at, index, strict=True)]
            total += np.prod(weights, axis=0)[:, None] * table[index]
        return total

    def averaged(wo: Floats, wi: Floats) -> Floats:
        means = []
        for first in range(0, len(wo), CHUNK):
            o, i = wo[first : first + CHUNK], wi[first : first + CHUNK]
            means.append(0.5 * (looked_up(o, i) + looked_up(i, o)))
        return np.concatenate(means)

    return merl.tabulate(averaged)


def _axis(fields: dict[str, NDArray[Any]], name: str, count: int) -> Floats:
    """Return the angles (count,) of an axis."""
    values = fields.get(name, np.zeros(0)).ravel().astype(np.float64)
    if not len(values):
        return np.linspace(*ENDS[name], count)
    if len(values) != count or not np.isfinite(values).all() or not (np.diff(values) > 0.0).all():
        raise SceneError(f"{name!r} must be {count} angles that ascend")
    return values


def _colours(lambdas: NDArray[Any], wavelength: float | None) -> Floats:
    """Return the weights (wavelengths, 3) of the numbers in red, green and blue."""
    bands = [Tabulated(lambdas.tolist(), row, "hold") for row in np.eye(len(lambdas)).tolist()]
    if wavelength is not None:
        return np.array([np.repeat(band.sample(np.array([wavelength])), 3) for band in bands])
    light = d65().sample(cie.GRID)
    xyz = [cie.spectrum_to_xyz(band.sample(cie.GRID) * light) for band in bands]
    return np.array([cie.xyz_to_rgb(values) for values in xyz])
