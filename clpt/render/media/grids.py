"""Densities on grids as bricks of words, see kernels/media/medium_grid.cl.

The host packs arrays of its own. Kernels pack arrays that lie on a device, and evaluate the density
of clouds; encoding reserves the bricks' room in `images` for them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pyopencl.array as cl_array
from numpy.typing import NDArray

from clpt.arrays import Words, on_host
from clpt.records import BRICK_SIZES
from clpt.render.lights.bodies import POINTS, Windows, brick_counts, parts_of, to_lattice
from clpt.render.materials.encoder import Encoder
from clpt.render.records.tables import TableStore, as_words
from clpt.scene.media import ON_POINTS, Lattice, Medium
from clpt.scene.params import fields_of
from clpt.scene.volumes import check_density, resampled
from clpt.spectra import Spectrum, uplift
from clpt.spectra.spectrum import gridded

POINT_WORDS = BRICK_SIZES["words"]
ROUNDED = 1e-4  # a mixture's density exceeds the bound of its parts by this share
GLOW_WORDS = 6  # behind the row of a grid, see kernels/media/medium_grid_light.cl


@dataclass(frozen=True, eq=False)
class CloudDensity:
    """The density of a cloud at points; numbers: see kernels/stage/density.cl, float32."""

    shape: tuple[int, ...]
    numbers: NDArray[np.float32]


Values: TypeAlias = cl_array.Array | CloudDensity


@dataclass(frozen=True, eq=False)
class DeviceGrid:
    """A density that kernels pack into bricks of `images`.

    values: (nx, ny, nz) float32 on the device, or a cloud's parameters; bricks: their number along
    each axis; first: the first word of the bricks.
    """

    values: Values
    bricks: tuple[int, ...]
    first: int


def row(medium: Lattice, encoder: Encoder) -> Words:
    """Append the bricks of a medium, and return the words of its row behind the coefficients.

    Raises SceneError for a density that is negative or not finite; a density on a device is not
    checked.
    """
    counts = brick_counts(medium.size)
    fields = fields_of(medium)
    if medium.noise is not None:
        first = _reserve(encoder.store, _cloud_density(medium), counts)
    elif medium.is_mixture:
        first = encoder.store.append("images", bricks(mixed(medium, encoder)[0]))
    elif _is_read_in_place(medium):
        first = _reserve(encoder.store, fields["density"].view(), counts)
    else:
        words = encoder.cache(bricks, fields["density"], medium.bits)
        first = encoder.store.append("images", words)
    numbers = np.concatenate([to_lattice(medium).ravel(), np.array(medium.size) + 0.5])
    first_and_counts = np.array([first, *counts], np.uint32)
    return np.concatenate([first_and_counts, as_words(numbers)])


def _is_read_in_place(medium: Lattice) -> bool:
    """Return whether kernels pack a density from the caller's buffer.

    They do for float32 on a device, z fastest, in 16 bits a point, without colours or light.
    """
    fields = fields_of(medium)
    density, values = fields["density"], (fields[name] for name in ON_POINTS)
    plain = medium.bits == 16 and medium.light is None and all(v is None for v in values)
    return plain and (
        isinstance(density, cl_array.Array)
        and density.dtype == np.float32
        and bool(density.flags.c_contiguous)
    )


def _cloud_density(medium: Lattice) -> CloudDensity:
    """Return the parameters of a cloud's density at the centres of the cells of its box."""
    low, high = (np.asarray(fields_of(medium)[end], float) for end in ("low", "high"))
    step = (high - low) / medium.size
    numbers = (*(low + 0.5 * step), *step, *(medium.noise or ()))
    return CloudDensity(medium.size, np.array(numbers, np.float32))


def _reserve(store: TableStore, density: Values, counts: tuple[int, ...]) -> int:
    """Append room for the bricks of a density to `images`; return its first word."""
    first = store.append("images", np.zeros(int(np.prod(counts)) * (2 + POINT_WORDS), np.uint32))
    store.device_grids.append(DeviceGrid(density, counts, first))
    return first


def bricks(density: object, bits: int = 16) -> Words:
    """Return the bricks of a density (nx, ny, nz): two words for each, x fastest, then points.

    bits: of a point, 16 or 8.

    The grid gets another layer of points on each side, as dense as the nearest points. Bricks
    without any density have no points.
    """
    windows = Windows(density)
    most = windows.most
    used = np.flatnonzero(most)
    scale = (2**bits - 1) / most[used].astype(np.float64)
    padded = -(-(POINTS**3) * bits // 32) * 32 // bits
    points = np.zeros((len(used), padded), np.uint16 if bits == 16 else np.uint8)
    for some in parts_of(len(used)):
        points[some, : POINTS**3] = np.rint(windows.of(used[some]) * scale[some, None])
    packed = points.view("<u4")
    table = np.zeros((len(most), 2), np.uint32)
    table[used, 0] = 2 * len(most) + packed.shape[1] * np.arange(len(used))
    table[:, 1] = as_words(most)
    return np.concatenate([table.ravel(), packed.ravel()])


def colours(density: object, values: NDArray[Any], spectral: bool) -> Words:
    """Return the colours of the bricks that have a density: a word for each, then three a point.

    A brick's word says where its points begin, 0 without a density. spectral: the three numbers
    are coefficients of curves.
    """
    table, points = _at_used_bricks(density, values)
    words = uplift(points) if spectral else points
    return np.concatenate([table, as_words(words.ravel())])


def _at_used_bricks(density: object, values: NDArray[Any]) -> tuple[Words, NDArray[np.float32]]:
    """Return where each brick's points begin, 0 without a density, and the points' values.

    values (nx, ny, nz, c): channels at the points of the density.
    """
    used = np.flatnonzero(Windows(density).most)
    channels = [Windows(values[..., c]) for c in range(values.shape[-1])]
    points = np.stack([channel.of(used) for channel in channels], axis=-1)
    table = np.zeros(len(channels[0].most), np.uint32)
    table[used] = len(table) + len(channels) * POINTS**3 * np.arange(len(used))
    return table, points


def shares(medium: Lattice, encoder: Encoder, count: int) -> Words:
    """Return the density of each part of a mixture over the density of the mixture.

    The form is that of `colours`: a word for each brick, then `count` numbers for a point, 0 where
    the mixture has fewer parts.
    """
    density, parts = mixed(medium, encoder)
    over = parts / np.where(density > 0.0, density, 1.0)[..., None]
    beyond = count - parts.shape[-1]
    table, points = _at_used_bricks(density, np.pad(over, [(0, 0)] * 3 + [(0, beyond)]))
    return np.concatenate([table, as_words(points.ravel())])


def mixed(medium: Lattice, encoder: Encoder) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the density of a mixture (nx, ny, nz) and the densities of its parts (..., n).

    The mixture's coefficients times its density bound the sum of the parts' extinction at every
    wavelength: they are the majorant. The density is ROUNDED larger, so that rounding keeps this.
    """
    table = encoder.spectra
    return encoder.cache(_mixed, medium, table.spectral, *table.range, table.samples)


def _mixed(
    medium: Lattice, spectral: bool, low: float, high: float, samples: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    lambdas = np.linspace(low, high, samples)

    def extinction(coefficients: tuple[Spectrum, Spectrum]) -> NDArray[np.float64]:
        values = [gridded(c, lambdas) if spectral else c.to_rgb("unbounded") for c in coefficients]
        return np.asarray(values[0] + values[1], np.float64)

    total = extinction(medium.coefficients(spectral))
    over = np.where(total > 0.0, 1.0 / np.maximum(total, 1e-30), 0.0)
    coefficients = medium.of_parts(spectral)
    most = np.unique([extinction(of_part) * over for of_part in coefficients], axis=1)
    parts = np.stack([_density_of_part(part, medium.size) for part in medium.parts], axis=-1)
    rows = parts.reshape(-1, len(medium.parts))
    density = np.empty(len(rows), np.float32)
    for some in parts_of(len(rows)):
        density[some] = (rows[some] @ most).max(axis=1) * (1.0 + ROUNDED)
    return density.reshape(parts.shape[:3]), parts


def _density_of_part(part: Medium, size: tuple[int, ...]) -> NDArray[np.float32]:
    """Return the density of a part at the points of its mixture; a homogeneous part has 1."""
    if part.lattice is None:
        return np.ones(size, np.float32)
    values: NDArray[Any] = np.asarray(on_host(fields_of(part)["density"]))
    check_density(values, "grid.density")
    if values.shape != size:
        values = resampled(values, np.eye(4), size, np.eye(4))
    return values.astype(np.float32)
