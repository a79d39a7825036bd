"""Smooth reflectance spectra from Rec.709 colours (Jakob and Hanika 2019).

S(lambda) = 1/2 + x / (2 sqrt(1 + x^2)),  x = (c0 lambda + c1) lambda + c2,  lambda in nm.

The table is indexed by the largest component, its value and the ratios of the other two to it. It
holds the coefficients over a unit coordinate times `shrinkage`, which makes them finite and smooth
up to black and white, and linear for greys, so that these are flat to rounding.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.files import budget, disk_cache
from clpt.spectra.data import ROOT

FILE = ROOT / "uplift.npz"
NODES = 40
QUANTUM = 1.0 / 2048.0  # of the table's values; the file stores differences along each axis
CENTRE, HALF_WIDTH = 595.0, 235.0  # [nm] of the unit coordinate
DARKEST = 1e-9  # flat reflectances stay this far inside (0, 1), where x is finite
EDGE = 1e-4  # the outermost layers, in place of black and white
PARTS = 1 << 13  # of [0, 1], fewer than two nodes in each
CHUNK = 1 << 15  # colours at a time, so that the gathered corners stay in the cache


def to_unit(lambdas: ArrayLike) -> Floats:
    """Wavelengths [nm] to the coordinate of the fit, [-1, 1] over 360 to 830 nm."""
    return (np.asarray(lambdas, np.float64) - CENTRE) / HALF_WIDTH


def shrinkage(rgb: ArrayLike) -> Floats:
    """sqrt(m (1 - m)) for the mean m of the components (..., 3); a grey has x = (m - 1/2) / it."""
    r, g, b = np.moveaxis(np.asarray(rgb, np.float64), -1, 0)
    mean = np.clip((r + g + b) / 3.0, DARKEST, 1.0 - DARKEST)
    return np.sqrt(mean * (1.0 - mean))


def node_values() -> Floats:
    """Values of the largest component at the layers (NODES,), dense near white and near black."""
    x = _smoothstep(np.linspace(0.0, 1.0, NODES) ** 1.1)
    return np.clip(0.3 * x + 0.7 * _smoothstep(x), EDGE, 1.0 - EDGE)


def node_ratios() -> Floats:
    """Ratios of the other components (NODES,), dense near saturated colours and greys."""
    return _smoothstep(np.linspace(0.0, 1.0, NODES)) ** 1.3


def node_colours() -> Floats:
    """The colours fitted (3, NODES, NODES, NODES, 3): [largest, its value, ratio, ratio, rgb]."""
    value, first, second = np.meshgrid(node_values(), node_ratios(), node_ratios(), indexing="ij")
    shape = np.stack([value, value * first, value * second], axis=-1)
    return np.stack([np.roll(shape, largest, axis=-1) for largest in range(3)])


def uplift(rgb: ArrayLike) -> NDArray[np.float32]:
    """Coefficients c0, c1, c2 (..., 3) float32 of reflectances of linear Rec.709 colours (..., 3).

    Colours are clipped to [0, 1]; nan counts as black.
    """
    colours = np.asarray(rgb)
    flat = colours.reshape(-1, 3)
    coefficients = np.empty(flat.shape, np.float32)
    for start in range(0, len(flat), CHUNK):
        part = np.nan_to_num(flat[start : start + CHUNK].astype(np.float64))
        coefficients[start : start + CHUNK] = _look_up(np.clip(part, 0.0, 1.0))
    return coefficients.reshape(colours.shape)


def unbounded(rgb: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Scale (...) = 2 max(rgb) and coefficients (..., 3) of colours (..., 3) that may exceed 1.

    The spectrum is the scale times the reflectance, as in Mitsuba 3; negative components are 0.
    """
    colours = np.asarray(rgb)
    flat = colours.reshape(-1, 3)
    scale = np.empty(len(flat), np.float32)
    coefficients = np.empty(flat.shape, np.float32)

    def fill(start: int) -> None:
        part = slice(start, start + CHUNK)
        normalised = np.maximum(np.nan_to_num(flat[part].astype(np.float64)), 0.0)
        r, g, b = normalised.T
        largest = 2.0 * np.maximum(np.maximum(r, g), b)
        normalised /= np.where(largest > 0.0, largest, 1.0)[:, None]
        coefficients[part] = _look_up(normalised, half=True)
        scale[part] = largest

    starts = range(0, len(flat), CHUNK)
    if len(starts) > 1:
        with ThreadPoolExecutor(min(os.cpu_count() or 1, len(starts))) as pool:
            list(pool.map(budget.carried(fill), starts))
    elif starts:
        fill(0)
    return scale.reshape(colours.shape[:-1]), coefficients.reshape(colours.shape)


def evaluate(coefficients: ArrayLike, lambdas: ArrayLike) -> Floats:
    """Reflectances of coefficients (..., 3) at `lambdas` [nm], float64 in [0, 1].

    The result's axes are the colours' axes, then the axes of `lambdas`, which may be a number.
    """
    polynomials, lambdas = np.asarray(coefficients, np.float64), np.asarray(lambdas, np.float64)
    shape = polynomials.shape[:-1] + (1,) * lambdas.ndim
    c0, c1, c2 = (polynomials[..., i].reshape(shape) for i in range(3))
    x = (c0 * lambdas + c1) * lambdas + c2
    return 0.5 + 0.5 * x / np.sqrt(1.0 + x * x)


def table() -> NDArray[np.float32]:
    """Return the tables as kernels look them up: values, ratios, and rows of three coefficients.

    (2 NODES + 9 NODES^3,) float32; the coefficients are over the unit coordinate times `shrinkage`.
    """
    nodes = (node_values().astype(np.float32), node_ratios().astype(np.float32))
    return np.concatenate([*nodes, _table().reshape(-1)])


@cache
def _table() -> NDArray[np.float32]:
    with np.load(FILE, allow_pickle=False) as file:
        steps = file["steps"]
    for axis in (1, 2, 3):
        steps = steps.cumsum(axis=axis + 1, dtype=np.int32)
    return np.ascontiguousarray(steps.reshape(3, -1).T) * np.float32(QUANTUM)


def _smoothstep(x: Floats) -> Floats:
    return x * x * (3.0 - 2.0 * x)


@cache
def _half_table() -> NDArray[np.float32]:
    """Return the table at a largest component of 1/2, the value that `unbounded` looks up."""
    half: NDArray[np.float32] = disk_cache.remembered((__file__, FILE), (), _at_half)
    return half


def _at_half() -> NDArray[np.float32]:
    nodes, table = node_values(), _table().reshape(3, NODES, -1, 3)
    below = int(np.searchsorted(nodes, 0.5, "right")) - 1
    t = np.float32((0.5 - nodes[below]) / (nodes[below + 1] - nodes[below]))
    low, high = table[:, below], table[:, below + 1]
    return np.ascontiguousarray((low + t * (high - low)).reshape(-1, 3))


def _look_up(rgb: Floats, *, half: bool = False) -> Floats:
    """Return coefficients (n, 3) of colours (n, 3); `half`: each largest component is 1/2 or 0."""
    budget.check_time()
    r, g, b = rgb.T
    largest = np.where((b > r) & (b > g), 2, (g > r).astype(np.int64))
    rows = np.arange(len(rgb))
    value = rgb[rows, largest]
    divisor = np.where(value > 0.0, value, 1.0)
    others = [rgb[rows, (largest + i) % 3] / divisor for i in (1, 2)]
    black = value <= 0.0
    for ratio in others:
        ratio[black] = 1.0
    cell, weights = largest, []
    axes = [(node_values, value)] * (not half) + [(node_ratios, ratio) for ratio in others]
    for kind, at in axes:
        nodes, parts = _axis(kind)
        below = _cells_of(nodes, parts, at)
        cell = cell * NODES + below
        t = (at - nodes[below]) / (nodes[below + 1] - nodes[below])
        weights.append(np.clip(t, 0.0, 1.0).astype(np.float32)[:, None])
    shrunk = shrinkage(rgb)
    scaled = _blend(_half_table() if half else _table(), cell, weights)
    a, b, c = scaled.T.astype(np.float64) / shrunk
    grey = (others[0] == 1.0) & (others[1] == 1.0)  # not left to the table's last digit
    a[grey], b[grey] = 0.0, 0.0
    c[grey] = (value[grey] - 0.5) / shrunk[grey]
    # From the unit coordinate to nm.
    a /= HALF_WIDTH**2
    b /= HALF_WIDTH
    return np.column_stack([a, b - 2.0 * CENTRE * a, c + (a * CENTRE - b) * CENTRE])


@cache
def _axis(kind: Callable[[], Floats]) -> tuple[Floats, NDArray[np.int64]]:
    """Return an axis's nodes (NODES,), and the last node at or below the start of each part.

    [0, 1] has PARTS parts. A part has at most a node behind its start, so that a further
    comparison decides.
    """
    nodes = kind()
    return nodes, np.searchsorted(nodes, np.arange(PARTS + 1) / PARTS, "right") - 1


def _cells_of(nodes: Floats, parts: NDArray[np.int64], at: Floats) -> NDArray[np.int64]:
    """Return the cell between nodes of each value (n,) in [0, 1]; nodes, parts: from `_axis`."""
    below = parts.take((at * PARTS).astype(np.int64))
    below += at >= nodes.take(np.minimum(below + 1, NODES - 1))
    return np.minimum(np.maximum(below, 0), NODES - 2)


def _blend(
    table: NDArray[np.float32], cell: NDArray[np.int64], weights: list[NDArray[np.float32]]
) -> NDArray[np.float32]:
    """Return interpolated table entries (n, 3): the last axis is reduced first."""
    steps = [(0, NODES**axis) for axis in reversed(range(len(weights)))]
    corners = [table.take(cell + sum(corner), axis=0) for corner in itertools.product(*steps)]
    for weight in reversed(weights):
        pairs = zip(corners[::2], corners[1::2], strict=True)
        corners = [low + weight * (high - low) for low, high in pairs]
    return corners[0]
