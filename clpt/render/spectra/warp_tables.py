"""Tables of warps as kernels/materials/warp_table.cl reads them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.measured.warp import warp

LARGEST = 4096.0  # of the halves that stand for numbers
LEAST = 2.0**-14  # of those, but for 0: what is less needs care that kernels do not take


def scaled(numbers: NDArray[Any]) -> tuple[NDArray[Any], float]:
    """Return numbers from 0 on so that they can be halves, and what these are multiplied by."""
    scale = max(float(numbers.max()), 1e-30) / LARGEST
    return np.where(numbers > 0.0, np.maximum(numbers / scale, LEAST), 0.0), scale


def halves(pairs: NDArray[Any]) -> NDArray[np.float32]:
    """Return pairs (..., 2) as words (...) of two halves."""
    return np.ascontiguousarray(pairs.astype("<f2")).view(np.float32)[..., 0]


def warp_words(density: NDArray[Any]) -> tuple[NDArray[np.float32], float]:
    """Return the words of slices (rows of slices, slices, rows, columns), float32, and their unit.

    There are two slices at least in a row. unit: what the halves are to be multiplied by, if these
    are taken for floats whose bits begin at the same place.
    """
    rounded = scaled(warp(density).values)[0].astype("<f2")
    made = warp(rounded)  # so that integrals are those of what is read
    unit = float(made.values.max() / rounded.max())
    whole = made.across[..., -1:]
    even = np.linspace(0.0, 1.0, made.across.shape[-1])
    shares = np.where(whole > 0.0, made.across / np.where(whole > 0.0, whole, 1.0), even)
    across, down = _ends(shares), _ends(made.down)
    parts = [
        halves(_of_rows(rounded)), _of_rows(made.across),
        _words(0.5 * (across[..., :-1, :, :] + across[..., 1:, :, :])), made.down, _words(down),
    ]  # fmt: skip
    flat = [_slices_last(part) for part in parts]
    return np.concatenate(flat, axis=-1), unit * 2.0**112


def _of_rows(values: NDArray[Any]) -> NDArray[Any]:
    """Every two neighbouring rows (..., rows, columns) as pairs (..., rows - 1, columns, 2)."""
    return np.stack([values[..., :-1, :], values[..., 1:, :]], axis=-1)


def _slices_last(part: NDArray[Any]) -> NDArray[np.float32]:
    """Numbers (rows of slices, slices, nodes ...) with slices behind rows and columns, flat."""
    pairs = part.ndim == 5
    moved = np.moveaxis(part, 1, -2 if pairs else -1)
    return np.asarray(moved, np.float32).reshape(len(part), -1)


def _ends(sums: Floats) -> Floats:
    """Return begin and end (..., n, 2) of even shares of sums (..., n), all from 0 to 1."""
    n = sums.shape[-1]
    flat = sums.reshape(-1, n)
    apart = 2.0 * np.arange(len(flat))[:, None]
    shares, nodes = np.linspace(0.0, 1.0, n + 1), np.linspace(0.0, 1.0, n)
    at = np.interp((shares + apart).ravel(), (flat + apart).ravel(), np.tile(nodes, len(flat)))
    ends = at.reshape(*sums.shape[:-1], n + 1)
    return np.stack([ends[..., :-1], ends[..., 1:]], axis=-1)


def _words(ends: Floats) -> NDArray[np.float32]:
    """Pairs (..., 2) from 0 to 1 as words of two 16383ths; as floats these are finite."""
    steps = np.round(16383.0 * ends).astype("<u4")
    return (steps[..., 0] | steps[..., 1] << np.uint32(16)).view(np.float32)
