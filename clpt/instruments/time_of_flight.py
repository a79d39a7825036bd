"""Instruments that see when light comes: gates, cameras of phases, and lidars.

They read light by time, `Renderer.times()[..., :-1, c]` of a channel c, which a lamp sends out at
0 ns: `signal` is (..., bins), the radiance of each bin of `Film.time_edges`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.scene.integrators import LIGHT_SPEED


def gate(edges: ArrayLike, opens: float, closes: float) -> Floats:
    """Return the weights of bins (bins,) for a shutter that is open from `opens` to `closes` [ns].

    edges: of the bins (bins + 1,) [ns]. A gated picture is `signal @ gate(edges, 20.0, 25.0)`.
    """
    ends = np.asarray(edges, np.float64)
    seen = np.clip(ends[1:], opens, closes) - np.clip(ends[:-1], opens, closes)
    return np.maximum(seen, 0.0) / np.diff(ends)


def correlation(edges: ArrayLike, frequency: float, phase: float) -> Floats:
    """Return the weights of bins (bins,) for a pixel of a continuous-wave camera.

    The lamp and the pixel go as cosines of a `frequency` [MHz]. The pixel is a `phase` [degrees]
    behind: light of the time t counts (1 + cos(2 pi f t - phase)) / 2. edges: as of `gate`. Each
    weight is the mean over its bin.
    """
    turns = 2e-3 * np.pi * frequency * np.asarray(edges, np.float64) - np.radians(phase)
    mean = np.diff(np.sin(turns)) / np.diff(turns)
    return np.asarray((1.0 + mean) / 2.0)


def phase_ranges(pictures: ArrayLike, frequency: float) -> tuple[Floats, Floats]:
    """Return the ranges (...) [m] and amplitudes (...) that a camera of four phases computes.

    pictures: (4, ...), by `correlation` with the phases 0, 90, 180 and 270 degrees. Light that
    comes on several ways gives one range between theirs, as with the true camera. A range is known
    up to a multiple of c / (2 f), which is 150 m / (f / MHz): it lies from 0 to that.
    """
    values = np.asarray(pictures, np.float64)
    if values.shape[:1] != (4,):
        raise SceneError(f"must be four pictures, not {values.shape}", where="pictures")
    across, along = values[1] - values[3], values[0] - values[2]
    turns = np.mod(np.arctan2(across, along) / (2.0 * np.pi), 1.0)
    return turns * LIGHT_SPEED * 500.0 / frequency, np.hypot(across, along)


def echoes(
    signal: ArrayLike, edges: ArrayLike, threshold: float = 0.0, count: int = 1
) -> tuple[Floats, Floats]:
    """Return the ranges [m] and the intensities of a lidar's first returns, (..., count) each.

    An echo is a run of bins above `threshold`. Its intensity is the sum over these, its range c t /
    2 at their mean time t. NaN and 0 stand for echoes that are not there. edges: as of `gate`.
    """
    values, ends = np.asarray(signal, np.float64), np.asarray(edges, np.float64)
    rows = values.reshape(-1, len(ends) - 1)
    lit = rows > threshold
    begins = lit.copy()
    begins[:, 1:] &= ~lit[:, :-1]
    number = np.cumsum(begins, axis=1) - 1
    row, column = np.nonzero(lit & (number < count))
    place, light = row * count + number[row, column], rows[row, column]
    middle = (ends[1:] + ends[:-1])[column] / 2.0
    size = len(rows) * count
    intensity = np.bincount(place, light, size)
    moment = np.bincount(place, light * middle, size)
    time = np.divide(moment, intensity, out=np.full(size, np.nan), where=intensity > 0.0)
    shape = (*values.shape[:-1], count)
    return (LIGHT_SPEED / 2.0 * time).reshape(shape), intensity.reshape(shape)
