"""Verification of pictures: tile means beside a reference's, by Student's t.

A reference is the mean and the standard deviation s over `count` renders with different seeds. If
another render has r times as many samples, the difference of a tile's means has the variance
s^2 (1 / r + 1 / count); divided by its root it has Student's t distribution with count - 1 degrees
of freedom. More samples a pixel lower the variance of Sobol points by more than 1 / r, and smaller
pixels do not raise it, so the test is then conservative.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from clpt.arrays import Floats, Image

FILE = Path(__file__).parent / "data" / "references.npz"
TILES = 8  # along each side
FALSE_ALARMS = 1e-4  # share of right pictures that the test rejects
ROUNDING = 1e-3  # relative difference between devices, of a tile's mean


@dataclass(frozen=True)
class Reference:
    """Expected tile means of a scene.

    mean, deviation: (65, 3), of a render's `regions`; count: renders; samples: of all pixels of a
    render; films: digests of films by size, and their device class.
    """

    mean: Floats
    deviation: Floats
    count: int
    samples: int
    films: Mapping[str, str]


class Verdict(NamedTuple):
    """A picture beside its reference: share of wrong tiles, largest |t|, a complaint or ""."""

    share: float
    largest: float
    wrong: str


def regions(image: Image) -> Floats:
    """Return the means (65, 3) of the 8 x 8 tiles of a picture, row by row, and of all of it."""
    height, width = image.shape[:2]
    parts = image[..., :3].astype(np.float64)
    parts = parts.reshape(TILES, height // TILES, TILES, width // TILES, 3)
    means = parts.mean((1, 3)).reshape(-1, 3)
    return np.concatenate([means, means.mean(0, keepdims=True)])


def compare(image: Image, reference: Reference, samples: int) -> Verdict:
    """Compare a picture with its reference; samples: of all pixels together."""
    means = regions(image)
    share = reference.samples / samples + 1.0 / reference.count
    noise, rounding = reference.deviation * math.sqrt(share), ROUNDING * np.abs(reference.mean)
    expected: Floats = np.hypot(noise, rounding)
    with np.errstate(all="ignore"):
        t: Floats = np.abs(means - reference.mean) / np.maximum(expected, 1e-9)
    t = np.where(np.isfinite(means), t, np.inf)
    off = np.asarray((t > limit(reference.count - 1, FALSE_ALARMS / t.size)).any(1))
    tiles, largest = float(off[:-1].mean()), float(t.max())
    if off[:-1].any():
        return Verdict(tiles, largest, f"wrong: {max(tiles, 0.01):.0%} of tiles".replace("%", " %"))
    if off[-1]:
        ratio = means[-1].mean() / reference.mean[-1].mean() - 1.0
        return Verdict(0.0, largest, f"wrong: all of it is {100 * ratio:+.2g} % off")
    return Verdict(0.0, largest, "")


@cache
def limit(freedom: int, rate: float) -> float:
    """Return the |t| that is exceeded at a rate; freedom: degrees of freedom, odd.

    The distribution is Abramowitz and Stegun 26.7.3.
    """
    low, high = 0.0, 1e6
    for _ in range(80):
        middle = 0.5 * (low + high)
        angle = math.atan(middle / math.sqrt(freedom))
        term, total = math.cos(angle), 0.0
        for k in range(1, freedom, 2):
            total += term
            term *= (k + 1) / (k + 2) * math.cos(angle) ** 2
        inside = 2.0 / math.pi * (angle + math.sin(angle) * total)
        low, high = (middle, high) if 1.0 - inside > rate else (low, middle)
    return high


@cache
def references() -> Mapping[str, Reference]:
    """Return clpt's references by scene."""
    with np.load(FILE, allow_pickle=False) as file:
        about = json.loads(str(file["about"]))
        return {
            name: Reference(mean=file[f"{name}_mean"], deviation=file[f"{name}_deviation"], **more)
            for name, more in about["scenes"].items()
        }
