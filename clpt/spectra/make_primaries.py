"""Find the reflectances of the primaries and write data/primaries.csv; run by hand, seconds.

    python -m clpt.spectra.make_primaries

Three reflectances in [0, 1] that have the colours of Rec. 709's primaries under D65, add up to 1 at
every wavelength, and are as smooth as that allows (Mallett and Yuksel 2019, eq. 6 to 9).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from clpt.spectra import cie
from clpt.spectra.data import ROOT
from clpt.spectra.spectrum import d65

STEP = 5.0  # [nm]
WEIGHT = 3e3  # of colours and sums, beside the smoothness


def primaries() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths (n,) [nm] and the reflectances (3, n) there."""
    nodes = np.arange(cie.LAMBDA_MIN, cie.LAMBDA_MAX + 0.1, STEP)
    n = len(nodes)
    hats = np.stack([np.interp(cie.GRID, nodes, hat) for hat in np.eye(n)])
    seen = cie.xyz_to_rgb(cie.spectrum_to_xyz(hats * d65().sample(cie.GRID))).T
    colours = np.kron(np.eye(3), seen)
    bends = np.kron(np.eye(3), np.diff(np.eye(n), 2, axis=0))
    sums = np.hstack([np.eye(n)] * 3)
    rows = np.vstack([WEIGHT * colours, bends, WEIGHT * sums])
    wanted = [WEIGHT * np.eye(3).reshape(-1), np.zeros(len(bends)), np.full(n, WEIGHT)]
    options = {"tol": 1e-14, "max_iter": 2000, "lsq_solver": "exact"}
    found = lsq_linear(rows, np.concatenate(wanted), (0.0, 1.0), **options)
    return nodes, found.x.reshape(3, n)


if __name__ == "__main__":
    header = "wavelength [nm], reflectances of red, green and blue (make_primaries.py)"
    at, values = primaries()
    np.savetxt(ROOT / "primaries.csv", np.vstack([at, values]).T, "%.7f", ",", header=header)
