"""EULUMDAT files (.ldt): lamps as European makers measure them, with a value on each line.

Their intensities are in candela for 1000 lm of their lamps; the lines are those of Stockmar's
specification (1990).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import text as text_files
from clpt.formats.ies import MOST_VALUES, Photometry

SYMMETRY, PLANES, ANGLES, FACTOR, SETS = 2, 3, 5, 23, 25  # lines, counted from 0
PER_SET, RATIOS = 6, 10  # lines of a set of lamps, and of direct ratios
FLUX = 2  # of a set's lines
KINDS = 5  # of symmetry


def read(path: Path) -> Photometry:
    """Read an EULUMDAT file. Raises SceneError with the broken line."""
    return _Reader(path).photometry()


class _Reader:
    """The lines of a file."""

    def __init__(self, path: Path):
        self.path = path
        self.lines = text_files.read(path).splitlines()

    def photometry(self) -> Photometry:
        symmetry = self._count(SYMMETRY, "kind of symmetry", 0, KINDS - 1)
        planes = self._count(PLANES, "number of C planes", 1, MOST_VALUES)
        angles = self._count(ANGLES, "number of angles", 1, MOST_VALUES)
        sets = self._count(SETS, "number of sets of lamps", 1, 20)
        if planes * angles > MOST_VALUES:
            self._fail(PLANES, f"{planes} x {angles} values are more than the {MOST_VALUES} read")
        first = SETS + 1 + PER_SET * sets + RATIOS
        around = self._rising(first, planes, "C angles")
        vertical = self._rising(first + planes, angles, "angles")
        if around[0] < 0.0 or around[-1] > 360.0 or vertical[0] < 0.0 or vertical[-1] > 180.0:
            self._fail(first, "angles lie from 0 to 360 around, and from 0 to 180 from below")
        kept = {0: planes, 1: 1, 2: planes // 2 + 1, 3: planes // 2 + 1, 4: planes // 4 + 1}
        rows = kept[symmetry]
        start = first + planes + angles
        values = self._numbers(start, rows * angles, "intensities").reshape(rows, angles)
        if (values < 0.0).any() or not values.any():
            self._fail(start, "intensities must not be negative, and not all zero")
        candela = values * self._lumens(sets) / 1000.0 * self._number(FACTOR, "conversion factor")
        return Photometry(vertical, *self._whole(symmetry, around, candela))

    def _whole(
        self, symmetry: int, around: NDArray[np.float64], candela: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the angles and intensities as Photometry mirrors them."""
        if symmetry == 1:
            return np.zeros(1), candela
        if symmetry == 0 and around[-1] == 360.0:
            return around, candela
        if symmetry == 0:
            return np.append(around, around[0] + 360.0), np.vstack([candela, candela[:1]])
        ends = {2: 180.0, 3: 180.0, 4: 90.0}
        angles = np.linspace(0.0, ends[symmetry], len(candela))
        if symmetry != 3:
            measured = around[: len(candela)]
            if len(candela) < 2 or abs(measured[-1] - ends[symmetry]) > 1e-6 or measured[0]:
                self._fail(SYMMETRY, "its C planes do not cover what its symmetry needs")
            return measured, candela
        if len(candela) < 2:
            self._fail(SYMMETRY, "its C planes do not cover what its symmetry needs")
        return 90.0 + angles, candela[::-1]  # from 270 over 0 to 90, mirrored

    def _lumens(self, sets: int) -> float:
        """Return the light of the first set of lamps [lm]; further sets are alternatives."""
        line = SETS + 1 + FLUX
        lumens = abs(self._number(line, "luminous flux"))
        if not lumens > 0.0:
            self._fail(line, "the luminous flux of its lamps is 0")
        return lumens

    def _rising(self, first: int, count: int, name: str) -> NDArray[np.float64]:
        values = self._numbers(first, count, name)
        if not (np.diff(values) > 0.0).all():
            self._fail(first, f"{name} must rise")
        return values

    def _numbers(self, first: int, count: int, name: str) -> NDArray[np.float64]:
        return np.array([self._number(first + i, name) for i in range(count)])

    def _number(self, line: int, name: str) -> float:
        if line >= len(self.lines):
            self._fail(len(self.lines) - 1, f"ends early, before its {name}")
        text = self.lines[line].strip().replace(",", ".")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self._fail(line, f"{text[:20]!r} is no number: its {name} stands here")
        return value

    def _count(self, line: int, name: str, low: int, high: int) -> int:
        value = self._number(line, name)
        if value != int(value) or not low <= value <= high:
            self._fail(line, f"the {name} must be a whole number from {low} to {high}")
        return int(value)

    def _fail(self, line: int, message: str) -> NoReturn:
        raise SceneError(message, file=self.path, line=max(line, 0) + 1)
