"""Spectra as kernels read them: colours as words, tabulated spectra as rows of `spectra`."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import spectra
from clpt.arrays import Words
from clpt.measured import Measurement, MerlTable
from clpt.render.records.parameter_words import MEASUREMENT_WORDS, MERL_WORDS, SPECTRUM_WORDS
from clpt.render.records.tables import TableStore, as_words
from clpt.render.spectra import measurements, reradiation
from clpt.render.spectra.find import Density
from clpt.scene import phases
from clpt.scene.roles import EMISSION, Spectral
from clpt.spectra import (
    RGB,
    Constant,
    Reradiation,
    RGBIlluminant,
    Sensor,
    Spectrum,
    Tabulated,
    observer,
)
from clpt.spectra.spectrum import d65, gridded, primaries

STEP = 1.0  # [nm] at most, between the nodes of tabulated spectra
FEWEST = 100  # cells between the nodes, however narrow the film's range is
ONE = 1e4  # sigmoid coefficient at which it is 1 in float32


@lru_cache(maxsize=1 << 16)
def _uplifted(value: RGB) -> tuple[float, ...]:
    """The coefficients of a colour; scenes of many materials have few."""
    return tuple(spectra.uplift(value.to_rgb()).tolist())


def angular_values(cosines: NDArray, rows: NDArray) -> NDArray[np.float64]:
    """Return what materials/angular_table.cl reads, of cosines (n,) and densities (m, n)."""
    cells = np.pi * np.diff(cosines) * (rows[:, 1:] + rows[:, :-1])
    running = np.hstack([np.zeros((len(rows), 1)), np.cumsum(cells, axis=1)])
    return np.concatenate([cosines, np.hstack([rows, running]).ravel()])


class SpectraTable:
    """The table `spectra` of a scene, and the words of a spectrum in a parameter's row.

    mode: "spectral" or "rgb"; lambda_min, lambda_max: the film's range [nm]; sensor: what the film
    records with, by default cie1931; density: of its wavelengths, by default visible importance.
    """

    def __init__(
        self,
        store: TableStore,
        mode: str,
        lambda_min: float = 360.0,
        lambda_max: float = 830.0,
        sensor: Sensor | None = None,
        density: Density | None = None,
    ):
        self._store = store
        self.mode, self.lambda_min, self.lambda_max = mode, lambda_min, lambda_max
        self._rows: dict[Any, int] = {}
        self._measurements: dict[tuple[str, int], tuple[Words, str, Any]] = {}
        self._expected_light: NDArray[np.float64] | None = None
        if self.spectral:
            self._add_sensor(sensor or observer("cie1931"), density or Density(*self.range))

    @property
    def spectral(self) -> bool:
        return self.mode == "spectral"

    @property
    def range(self) -> tuple[float, float]:
        """The film's range of wavelengths [nm]."""
        return self.lambda_min, self.lambda_max

    @property
    def samples(self) -> int:
        """The number of samples in a row of `spectra`."""
        cells = int(np.ceil((self.lambda_max - self.lambda_min) / STEP - 1e-9))
        return max(cells, FEWEST) + 1

    @property
    def grid(self) -> NDArray[np.float64]:
        """The wavelengths (samples,) [nm] of tabulated spectra; the ends are the film's."""
        return np.linspace(*self.range, self.samples)

    @property
    def step(self) -> float:
        """The distance [nm] of two nodes of the grid."""
        return (self.lambda_max - self.lambda_min) / (self.samples - 1)

    def row(self, spectrum: Spectrum) -> int:
        """Tabulate a spectrum on the common grid; return its row in `spectra`."""
        if spectrum not in self._rows:
            values = gridded(spectrum, self.grid)
            self._rows[spectrum] = self._store.append_floats("spectra", values) // self.samples
        return self._rows[spectrum]

    def _add_sensor(self, sensor: Sensor, density: Density) -> None:
        """Rows 0 to 3: D65, and the sensor's curves, scaled so that Y of 1 is 1.

        Where visible importance is the density, the curves are divided by it, as it is smooth.
        """
        self.row(d65())
        curves = sensor.sample(self.grid)
        if density.values is None:
            pdf = density.pdf(self.grid)
            curves = np.where(
                pdf[:, None] > 0.0, curves / np.where(pdf > 0.0, pdf, 1.0)[:, None], 0
            )
        self._store.append_floats("spectra", (curves / spectra.CIE_Y_INTEGRAL).T)

    def reaches(self, table: Tabulated) -> bool:
        """Whether the points of a table overlap with the film's range."""
        return table.lambdas[0] <= self.lambda_max and table.lambdas[-1] >= self.lambda_min

    def words(self, value: Spectrum | str, role: Spectral) -> tuple[Words, str]:
        """Return the five words of a spectrum and its source: "constant" or "table".

        An index or a quantity without colour is "grey", so that kernels see it.
        role: of the parameter; an index may be a glass's name.
        """
        if isinstance(value, str) or role.measured:
            value = spectra.index(value)
        if role is EMISSION and isinstance(value, RGB):
            value = RGBIlluminant(value.r, value.g, value.b)
        words = np.zeros(SPECTRUM_WORDS, np.uint32)
        given = "grey" if role.grey and isinstance(value, Constant) else "constant"
        if not self.spectral:
            words[:3] = as_words(value.to_rgb(role.meaning))
            return words, given
        if isinstance(value, Constant):
            words[:4] = as_words([0.0, 0.0, ONE, value.value])
        elif type(value) is RGB:
            words[:4] = as_words([*_uplifted(value), 1.0])
        elif type(value) is RGBIlluminant and value.r == value.g == value.b:
            return self._table_words(d65(), value.r), "table"
        else:
            return self._table_words(value), "table"
        return words, given

    def _table_words(self, spectrum: Spectrum, factor: float = 1.0) -> Words:
        """Five words: a factor, and -1 - the row in `spectra`."""
        words = np.zeros(SPECTRUM_WORDS, np.uint32)
        words[3] = as_words([factor])[0]
        words[4] = np.int32(-1 - self.row(spectrum)).view(np.uint32)
        return words

    def angular_words(self, kind: phases.Tabulated) -> tuple[Words, str]:
        """Return the words of a table over cosines, and its source.

        The source is "row", or "rows" where it depends on the wavelength; see
        kernels/materials/angular_table.cl.
        """
        cosines, rows, start, step = kind.device_rows(self.spectral)
        first = self._store.append_floats("distributions", angular_values(cosines, rows))
        whole = np.array([first, len(cosines), len(rows)], np.uint32)
        return np.concatenate([whole, as_words([start, 1.0 / step])]), (
            "rows" if len(rows) > 1 else "row"
        )

    def measurement_words(self, value: Measurement | None) -> tuple[Words, str]:
        """Return the words of a measured material and its source.

        They tell where its numbers begin, and have a spectrum that says which of its colours a
        wavelength has; kernels/materials/measurement_load.cl reads them.
        """
        key = "measurement", id(value)
        if key not in self._measurements:
            made = measurements.rows(value, self.range if self.spectral else None)
            words = np.zeros(MEASUREMENT_WORDS, np.uint32)
            words[0] = self._append_table(made.values)
            if self.spectral:
                numbers = Tabulated(made.wavelengths, np.arange(len(made.wavelengths)), "hold")
                words[1:] = self._table_words(numbers)
            self._measurements[key] = words, made.source, value
        return self._measurements[key][:2]

    def _append_table(self, values: NDArray[Any]) -> int:
        """Append to `distributions`, not as its first: 0 is where idle lanes look."""
        if not self._store.size("distributions"):
            self._store.append_floats("distributions", [0.0])
        return self._store.append_floats("distributions", values)

    def merl_words(self, value: MerlTable | None) -> tuple[Words, str]:
        """Return the words of a table of MERL and its source.

        They tell where its numbers begin, and what red, green and blue are in spectral mode; see
        kernels/materials/merl_load.cl.
        """
        key = "merl", id(value)
        if key not in self._measurements:
            made = measurements.merl_rows(value)
            words = np.zeros(MERL_WORDS, np.uint32)
            words[0] = self._append_table(made.values)
            if self.spectral:
                words[1:] = [self.row(one) for one in primaries()]
            self._measurements[key] = words, made.source, value
        return self._measurements[key][:2]

    def expect_light(self, lights: Iterable[Spectrum]) -> None:
        """Note what light fluorescent materials will meet; see `reradiation.expected`."""
        self._expected_light = reradiation.expected(lights, reradiation.nodes(*self.range))

    def reradiation_words(self, value: Reradiation | None) -> tuple[Words, str]:
        """Return the words of a matrix: of the sum of its rows; the first says where it lies.

        In RGB mode they hold the colour that is given out under D65.
        """
        if not self.spectral:
            words = np.zeros(SPECTRUM_WORDS, np.uint32)
            if value is not None:
                words[:3] = as_words(value.to_rgb(*self.range))
            return words, "constant"
        nodes = reradiation.nodes(*self.range)
        light = np.ones_like(nodes) if self._expected_light is None else self._expected_light
        values, sums = reradiation.table(value, nodes, light)
        first = self._store.append_floats("distributions", values)
        words = self._table_words(Tabulated(nodes, sums, "hold"))
        words[0] = first
        return words, "table"
