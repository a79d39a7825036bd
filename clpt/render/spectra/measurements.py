"""Measured materials as kernels/materials/measurement.cl reads them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import measured
from clpt.arrays import Floats32
from clpt.measured import Measurement, MerlTable, merl
from clpt.measured.fit import hemispherical
from clpt.render.spectra.warp_tables import halves, scaled, warp_words
from clpt.spectra import cie
from clpt.spectra.spectrum import d65, primaries


@dataclass(frozen=True)
class Rows:
    """The numbers of a measurement.

    counts: those at their head; wavelengths: [nm] of its colours, of rgb none.
    """

    values: Floats32
    counts: tuple[int, ...]
    wavelengths: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))

    @property
    def source(self) -> str:
        """The source of the measurement, by which kernels are made for its counts."""
        return "table " + " ".join(map(str, self.counts))


def rows(value: Measurement | None, film: tuple[float, float] | None) -> Rows:
    """Return what stands in `distributions`; film: its range [nm], None in RGB mode."""
    given = measured.grey() if value is None else value
    shown = _in_rgb(given) if film is None else _in_range(given, *film)
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
    (normals, of_normals), (bright, of_bright) = warp_words(vndf), warp_words(luminance)
    light, scale = scaled(spectra)
    parts = [
        [*counts, scale, of_normals, of_bright], *angles, hemispherical(shown), shown.ndf,
        shown.sigma, normals, bright, _pairs(light),
    ]  # fmt: skip
    return Rows(_joined(*parts), tuple(counts), np.asarray(shown.wavelengths, np.float64))


def _joined(*parts: Any) -> Floats32:
    return np.concatenate([np.asarray(part, np.float32).ravel() for part in parts])


def _guided(nodes: Floats32) -> Floats32:
    """Angles as `warp_node` of kernels/materials/warp_table.cl reads them."""
    if len(nodes) == 1:
        return np.array([0.0, nodes[0]], np.float32)
    whole = float(nodes[-1] - nodes[0])
    cells = int(np.ceil(whole / float(np.diff(nodes).min()) * 1.01)) + 1
    begins = nodes[0] + whole * np.arange(cells) / cells
    first = np.clip(np.searchsorted(nodes, begins, "right") - 1, 0, len(nodes) - 2)
    return np.concatenate([first, nodes]).astype(np.float32)


def _pairs(spectra: NDArray[Any]) -> Floats32:
    """Pairs of neighbouring colours (phi, pairs, rows, columns, theta), two halves in a word."""
    if spectra.shape[2] == 1:
        spectra = np.repeat(spectra, 2, axis=2)
    last = np.moveaxis(spectra, 1, -1)
    return halves(np.stack([last[:, :-1], last[:, 1:]], axis=-1))


def merl_rows(value: MerlTable | None) -> Rows:
    """Return what stands in `distributions` for a table of MERL, see materials/merl_table.cl.

    None is a matt grey.
    """
    f = np.full((2, 2, 2, 3), 0.5 / np.pi) if value is None else merl.filled(value)
    angles, density, share = merl.densities(f)
    counts = (len(angles), *density.shape[1:], *f.shape[:3])
    words, unit = warp_words(density[None])
    around, scale = scaled(np.concatenate([f, f[:, :, :1]], axis=2))
    colours = halves(np.pad(around, [(0, 0)] * 3 + [(0, 1)]).reshape(*around.shape[:3], 2, 2))
    head = [*counts, *share, 1.0 / angles[1], unit, scale * 2.0**112]
    return Rows(_joined(head, words, colours), counts)


def _in_rgb(given: Measurement) -> Measurement:
    """The measurement with red, green and blue, which its spectra have under D65."""
    if not len(given.wavelengths):
        return given
    nodes = np.asarray(given.wavelengths, np.float64)
    hats = np.stack([np.interp(cie.GRID, nodes, hat) for hat in np.eye(len(nodes))])
    seen = cie.xyz_to_rgb(cie.spectrum_to_xyz(hats * d65().sample(cie.GRID)))
    colours = np.maximum(np.einsum("ptnyx,nc->ptcyx", given.spectra, seen.astype(np.float32)), 0.0)
    return replace(given, spectra=colours, wavelengths=np.zeros(0))


def _in_range(given: Measurement, low: float, high: float) -> Measurement:
    """The measurement at those of its wavelengths that a film needs; rgb as three reflectances."""
    if not len(given.wavelengths):
        basis = primaries()
        nodes = np.array(basis[0].lambdas)
        curves = np.stack([one.sample(nodes) for one in basis]).astype(np.float32)
        made = np.einsum("ptcyx,cn->ptnyx", given.spectra, curves)
        given = replace(given, spectra=made, wavelengths=nodes)
    nodes = given.wavelengths
    first = max(int(np.searchsorted(nodes, low, "right")) - 1, 0)
    last = min(int(np.searchsorted(nodes, high, "left")), len(nodes) - 1)
    kept = slice(min(first, last), last + 1)
    return replace(given, spectra=given.spectra[:, :, kept], wavelengths=nodes[kept])
