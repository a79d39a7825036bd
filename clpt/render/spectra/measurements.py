"""Measured materials and warps, for kernels/materials/measurement.cl and warp_table.cl."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import measured
from clpt.arrays import Floats, Floats32
from clpt.measured import Measurement, MerlTable, merl
from clpt.measured.fit import hemispherical, warp
from clpt.spectra import cie
from clpt.spectra.spectrum import d65, primaries

LARGEST = 4096.0  # value of a half
LEAST = 2.0**-14  # positive value of a half: kernels do not read subnormal halves


@dataclass(frozen=True)
class Rows:
    """The numbers of a measurement.

    counts: the first numbers; wavelengths: of its colours [nm], empty for rgb.
    """

    values: Floats32
    counts: tuple[int, ...]
    wavelengths: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))

    @property
    def source(self) -> str:
        """The source of the measurement in kernel text, which depends on its counts."""
        return "table " + " ".join(map(str, self.counts))


def rows(value: Measurement | None, film: tuple[float, float] | None) -> Rows:
    """Return the numbers for `distributions`; film: its range [nm], None in RGB mode."""
    whole = measured.grey() if value is None else value
    shown = _in_rgb(whole) if film is None else _in_range(whole, *film)
    theta = shown.theta_i
    vndf, luminance, spectra = shown.vndf, shown.luminance, shown.spectra
    if len(theta) == 1:  # kernels read two neighbours
        theta = np.append(theta, theta + 1.0)
        vndf, luminance, spectra = (np.repeat(x, 2, axis=1) for x in (vndf, luminance, spectra))
    counts = [len(shown.phi_i), len(theta)]
    for table in (shown.ndf, shown.sigma, vndf, luminance):
        counts += table.shape[-2:]
    angles = [_guided(nodes) for nodes in (shown.phi_i, theta)]
    counts += [spectra.shape[2], int(shown.jacobian) + 2 * shown.reduction]
    counts += [len(angles[0]) - len(shown.phi_i), len(angles[1]) - len(theta)]
    (normals, normal_unit), (bright, bright_unit) = warp_words(vndf), warp_words(luminance)
    light, scale = scaled(spectra)
    parts = [
        [*counts, scale, normal_unit, bright_unit], *angles, hemispherical(shown), shown.ndf,
        shown.sigma, normals, bright, _pairs(light),
    ]  # fmt: skip
    return Rows(_joined(*parts), tuple(counts), np.asarray(shown.wavelengths, np.float64))


def _joined(*parts: Any) -> Floats32:
    return np.concatenate([np.asarray(part, np.float32).ravel() for part in parts])


def _guided(nodes: Floats32) -> Floats32:
    """Return angles with their guide, for `warp_node` of kernels/materials/warp_table.cl."""
    if len(nodes) == 1:
        return np.array([0.0, nodes[0]], np.float32)
    whole = float(nodes[-1] - nodes[0])
    cells = int(np.ceil(whole / float(np.diff(nodes).min()) * 1.01)) + 1
    begins = nodes[0] + whole * np.arange(cells) / cells
    first = np.clip(np.searchsorted(nodes, begins, "right") - 1, 0, len(nodes) - 2)
    return np.concatenate([first, nodes]).astype(np.float32)


def _pairs(spectra: NDArray[Any]) -> Floats32:
    """Return pairs of neighbouring colours (phi, pairs, rows, columns, theta) as words."""
    if spectra.shape[2] == 1:
        spectra = np.repeat(spectra, 2, axis=2)
    last = np.moveaxis(spectra, 1, -1)
    return halves(np.stack([last[:, :-1], last[:, 1:]], axis=-1))


def merl_rows(value: MerlTable | None) -> Rows:
    """Return the numbers of a MERL table for `distributions`, see materials/merl_table.cl.

    None stands for a diffuse grey.
    """
    f = np.full((2, 2, 2, 3), 0.5 / np.pi) if value is None else merl.filled(value)
    angles, density, share = merl.densities(f)
    counts = (len(angles), *density.shape[1:], *f.shape[:3])
    words, unit = warp_words(density[None])
    around, scale = scaled(np.concatenate([f, f[:, :, :1]], axis=2))
    colours = halves(np.pad(around, [(0, 0)] * 3 + [(0, 1)]).reshape(*around.shape[:3], 2, 2))
    head = [*counts, *share, 1.0 / angles[1], unit, scale * 2.0**112]
    return Rows(_joined(head, words, colours), counts)


def _in_rgb(measurement: Measurement) -> Measurement:
    """Return a measurement whose spectra are reduced to red, green and blue under D65."""
    if not len(measurement.wavelengths):
        return measurement
    nodes = np.asarray(measurement.wavelengths, np.float64)
    hats = np.stack([np.interp(cie.GRID, nodes, hat) for hat in np.eye(len(nodes))])
    seen = cie.xyz_to_rgb(cie.spectrum_to_xyz(hats * d65().sample(cie.GRID)))
    colours = np.maximum(
        np.einsum("ptnyx,nc->ptcyx", measurement.spectra, seen.astype(np.float32)), 0.0
    )
    return replace(measurement, spectra=colours, wavelengths=np.zeros(0))


def _in_range(measurement: Measurement, low: float, high: float) -> Measurement:
    """Return a measurement at the wavelengths that a film needs; rgb becomes reflectances."""
    if not len(measurement.wavelengths):
        basis = primaries()
        nodes = np.array(basis[0].lambdas)
        curves = np.stack([curve.sample(nodes) for curve in basis]).astype(np.float32)
        reflectances = np.einsum("ptcyx,cn->ptnyx", measurement.spectra, curves)
        measurement = replace(measurement, spectra=reflectances, wavelengths=nodes)
    nodes = measurement.wavelengths
    first = max(int(np.searchsorted(nodes, low, "right")) - 1, 0)
    last = min(int(np.searchsorted(nodes, high, "left")), len(nodes) - 1)
    kept = slice(min(first, last), last + 1)
    return replace(measurement, spectra=measurement.spectra[:, :, kept], wavelengths=nodes[kept])


def scaled(numbers: NDArray[Any]) -> tuple[NDArray[Any], float]:
    """Return numbers >= 0 in the range of halves, and the factor that restores them."""
    scale = max(float(numbers.max()), 1e-30) / LARGEST
    return np.where(numbers > 0.0, np.maximum(numbers / scale, LEAST), 0.0), scale


def halves(pairs: NDArray[Any]) -> NDArray[np.float32]:
    """Return pairs (..., 2) as words (...), each of two halves."""
    return np.ascontiguousarray(pairs.astype("<f2")).view(np.float32)[..., 0]


def warp_words(density: NDArray[Any]) -> tuple[NDArray[np.float32], float]:
    """Return the words of slices (rows of slices, slices, rows, columns), float32, and their unit.

    Each row has at least two slices. unit: factor of the halves after a shift of their bits into a
    float32. See kernels/materials/warp_table.cl.
    """
    rounded = scaled(warp(density).values)[0].astype("<f2")
    table = warp(rounded)  # integrals must agree with the rounded values that kernels read
    unit = float(table.values.max() / rounded.max())
    whole = table.across[..., -1:]
    even = np.linspace(0.0, 1.0, table.across.shape[-1])
    shares = np.where(whole > 0.0, table.across / np.where(whole > 0.0, whole, 1.0), even)
    across, down = _guide(shares), _guide(table.down)
    parts = [
        halves(_row_pairs(rounded)), _row_pairs(table.across),
        _guide_words(0.5 * (across[..., :-1, :, :] + across[..., 1:, :, :])), table.down,
        _guide_words(down),
    ]  # fmt: skip
    flat = [_slices_last(part) for part in parts]
    return np.concatenate(flat, axis=-1), unit * 2.0**112


def _row_pairs(values: NDArray[Any]) -> NDArray[Any]:
    """Return neighbouring rows of (..., rows, columns) as pairs (..., rows - 1, columns, 2)."""
    return np.stack([values[..., :-1, :], values[..., 1:, :]], axis=-1)


def _slices_last(part: NDArray[Any]) -> NDArray[np.float32]:
    """Return numbers (rows of slices, slices, nodes ...), flat, with slices as the last axis."""
    pairs = part.ndim == 5
    last = np.moveaxis(part, 1, -2 if pairs else -1)
    return np.asarray(last, np.float32).reshape(len(part), -1)


def _guide(sums: Floats) -> Floats:
    """Return the cell's begin and end (..., n, 2) of n even shares of sums (..., n) in [0, 1]."""
    n = sums.shape[-1]
    flat = sums.reshape(-1, n)
    offsets = 2.0 * np.arange(len(flat))[:, None]  # so that a single call interpolates all rows
    shares, nodes = np.linspace(0.0, 1.0, n + 1), np.linspace(0.0, 1.0, n)
    nodes_at = np.interp(
        (shares + offsets).ravel(), (flat + offsets).ravel(), np.tile(nodes, len(flat))
    )
    ends = nodes_at.reshape(*sums.shape[:-1], n + 1)
    return np.stack([ends[..., :-1], ends[..., 1:]], axis=-1)


def _guide_words(ends: Floats) -> NDArray[np.float32]:
    """Return pairs (..., 2) in [0, 1] as words of two 14-bit steps, which are finite floats."""
    steps = np.round(16383.0 * ends).astype("<u4")
    return (steps[..., 0] | steps[..., 1] << np.uint32(16)).view(np.float32)
