"""The tables that ship with clpt; LICENSES.md names the source and licence of each."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parent


@cache
def table(name: str) -> NDArray[np.float64]:
    """Rows of the CSV file `name`, read-only (n, columns) float64."""
    # Opened here: numpy asks for the current folder, which may be gone.
    with (ROOT / name).open(encoding="utf-8") as file:
        rows = np.loadtxt(file, delimiter=",", comments="#", ndmin=2)
    rows.setflags(write=False)
    return rows


@cache
def names(folder: str) -> tuple[str, ...]:
    """Stems of the CSV files in a folder, sorted."""
    return tuple(sorted(path.stem for path in (ROOT / folder).glob("*.csv")))
