"""Spectra as kernels read them: words of colours, rows of `spectra`, matrices of reradiation."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import spectra
from clpt.arrays import Floats, Words
from clpt.measured import Measurement, MerlTable
from clpt.render.records.materials import (
    MEASUREMENT_WORDS,
    MERL_WORDS,
    RERADIATION_STEP,
    SPECTRUM_WORDS,
)
from clpt.render.records.tables import TableStore, as_words
from clpt.render.spectra import measurements
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

STEP = 1.0  # largest distance of nodes of tabulated spectra [nm]
FEWEST = 100  # cells between nodes, however narrow the film's range is
ONE = 1e4  # argument of the sigmoid of a colour for a value of 1 in float32
EVEN = 0.25  # share of the expected light that is equal at all wavelengths


@lru_cache(maxsize=1 << 16)
def _uplifted(value: RGB) -> tuple[float, ...]:
    """Return a colour's coefficients, cached: many materials share few colours."""
    return tuple(spectra.uplift(value.to_rgb()).tolist())


def angular_values(cosines: NDArray, rows: NDArray) -> NDArray[np.float64]:
    """Return densities (m, n) over cosines (n,) with their sums, for materials/angular_table.cl."""
    cells = np.pi * np.diff(cosines) * (rows[:, 1:] + rows[:, :-1])
    running = np.hstack([np.zeros((len(rows), 1)), np.cumsum(cells, axis=1)])
    return np.concatenate([cosines, np.hstack([rows, running]).ravel()])


class SpectraTable:
    """The table `spectra` of a scene, and the words of spectra in the rows of parameters.

    mode: "spectral" or "rgb"; lambda_min, lambda_max: the film's range [nm]; sensor: of the film,
    by default cie1931; density: of sampled wavelengths, by default visible importance.
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
        """The wavelengths (samples,) [nm] of tabulated spectra, over the film's range."""
        return np.linspace(*self.range, self.samples)

    @property
    def step(self) -> float:
        """The distance of two nodes of the grid [nm]."""
        return (self.lambda_max - self.lambda_min) / (self.samples - 1)

    def row(self, spectrum: Spectrum) -> int:
        """Tabulate a spectrum on the common grid; return its row in `spectra`."""
        if spectrum not in self._rows:
            values = gridded(spectrum, self.grid)
            self._rows[spectrum] = self._store.append_floats("spectra", values) // self.samples
        return self._rows[spectrum]

    def _add_sensor(self, sensor: Sensor, density: Density) -> None:
        """Append rows 0 to 3: D65, and the sensor's curves over the integral of Y.

        The curves are divided by visible importance if that is the density, as it is smooth.
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
        """Return whether the points of a table overlap with the film's range."""
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
        source = "grey" if role.grey and isinstance(value, Constant) else "constant"
        if not self.spectral:
            words[:3] = as_words(value.to_rgb(role.meaning))
            return words, source
        if isinstance(value, Constant):
            words[:4] = as_words([0.0, 0.0, ONE, value.value])
        elif type(value) is RGB:
            words[:4] = as_words([*_uplifted(value), 1.0])
        elif type(value) is RGBIlluminant and value.r == value.g == value.b:
            return self._table_words(d65(), value.r), "table"
        else:
            return self._table_words(value), "table"
        return words, source

    def _table_words(self, spectrum: Spectrum, factor: float = 1.0) -> Words:
        """Return five words: a factor in the fourth, -1 - (row in `spectra`) in the fifth."""
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

        They hold the first index of its numbers, and a spectrum from wavelengths to indices of its
        colours; see kernels/materials/measurement.cl.
        """
        key = "measurement", id(value)
        if key not in self._measurements:
            rows = measurements.rows(value, self.range if self.spectral else None)
            words = np.zeros(MEASUREMENT_WORDS, np.uint32)
            words[0] = self._append_table(rows.values)
            if self.spectral:
                numbers = Tabulated(rows.wavelengths, np.arange(len(rows.wavelengths)), "hold")
                words[1:] = self._table_words(numbers)
            self._measurements[key] = words, rows.source, value
        return self._measurements[key][:2]

    def _append_table(self, values: NDArray[Any]) -> int:
        """Append to `distributions`, but never at index 0, which idle lanes read."""
        if not self._store.size("distributions"):
            self._store.append_floats("distributions", [0.0])
        return self._store.append_floats("distributions", values)

    def merl_words(self, value: MerlTable | None) -> tuple[Words, str]:
        """Return the words of a MERL table and its source.

        They hold the first index of its numbers and, in spectral mode, the rows of red, green and
        blue; see kernels/materials/merl_table.cl.
        """
        key = "merl", id(value)
        if key not in self._measurements:
            rows = measurements.merl_rows(value)
            words = np.zeros(MERL_WORDS, np.uint32)
            words[0] = self._append_table(rows.values)
            if self.spectral:
                words[1:] = [self.row(primary) for primary in primaries()]
            self._measurements[key] = words, rows.source, value
        return self._measurements[key][:2]

    def expect_light(self, lights: Iterable[Spectrum]) -> None:
        """Note the light that fluorescent materials will meet; see `expected_light`."""
        self._expected_light = expected_light(lights, reradiation_nodes(*self.range))

    def reradiation_words(self, value: Reradiation | None) -> tuple[Words, str]:
        """Return the words of a reradiation matrix and its source.

        They hold its first index and the spectrum of the integrals of its rows; see
        kernels/materials/reradiation.cl. In RGB mode they hold the colour that it emits under D65.
        """
        if not self.spectral:
            words = np.zeros(SPECTRUM_WORDS, np.uint32)
            if value is not None:
                words[:3] = as_words(value.to_rgb(*self.range))
            return words, "constant"
        nodes = reradiation_nodes(*self.range)
        light = np.ones_like(nodes) if self._expected_light is None else self._expected_light
        values, sums = _reradiation_table(value, nodes, light)
        first = self._store.append_floats("distributions", values)
        words = self._table_words(Tabulated(nodes, sums, "hold"))
        words[0] = first
        return words, "table"


def reradiation_nodes(low: float, high: float) -> Floats:
    """Return the wavelengths [nm] of the nodes of a film's reradiation matrices."""
    count = int(np.ceil((high - low) / RERADIATION_STEP - 1e-9)) + 1
    return np.asarray(low + RERADIATION_STEP * np.arange(count), np.float64)


def expected_light(lights: Iterable[Spectrum], nodes: Floats) -> Floats:
    """Return the expected light (n,) at nodes, mean about 1, for sampling of wavelengths.

    All lights count equally, whatever their powers: surfaces may see any of them.
    """
    fine = np.linspace(nodes[0], nodes[-1], RERADIATION_STEP * (len(nodes) - 1) + 1)
    hats = np.maximum(1.0 - np.abs(fine[:, None] - nodes) / RERADIATION_STEP, 0.0)
    emitted = [gridded(light, fine) @ hats for light in lights]
    emitted = [values / values.mean() for values in emitted if values.mean() > 0.0]
    return EVEN + (1.0 - EVEN) * (np.mean(emitted, axis=0) if emitted else np.ones_like(nodes))


def _reradiation_table(
    value: Reradiation | None, nodes: Floats, light: Floats
) -> tuple[Floats, Floats]:
    """Return the numbers of a matrix for `distributions`, and the integrals of its rows (n,) [1].

    nodes: (n,) [nm]; light: the expected light there.
    """
    rows = np.zeros((len(nodes), len(nodes)))
    if value is not None:
        rows = value.on_nodes(nodes)
    running = _running_integrals(rows * light)
    shares = running / np.maximum(running[:, -1:], 1e-30)
    flat = np.concatenate([light, running[:, -1], np.hstack([rows, shares]).ravel()])
    return flat, _running_integrals(rows)[:, -1]


def _running_integrals(rows: Floats) -> Floats:
    """Return integrals of rows, linear between nodes, from the first node to the others."""
    return np.cumsum(0.5 * RERADIATION_STEP * (rows[:, 1:] + rows[:, :-1]), axis=1)
