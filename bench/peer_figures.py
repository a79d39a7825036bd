"""Figures of `bench.peers`: errors of pictures without a reference, and efficiency."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

TRIM = 0.001  # share of the pixels that is left out: those of the largest error

Row = Mapping[str, Any]
Picture = NDArray[np.float32]


def relative_mse(image: NDArray[np.floating], reference: NDArray[np.floating]) -> float:
    """Return the mean of squared error over squared picture plus a hundredth of the mean's square,
    without the worst pixels."""
    error = (image - reference) ** 2 / (reference**2 + 1e-2 * reference.mean() ** 2)
    error = np.sort(error.mean(-1).ravel())
    return float(error[: int(error.size * (1 - TRIM))].mean())


def errors(pictures: Mapping[str, Sequence[Picture]]) -> dict[str, list[float]]:
    """Return the error of each picture of each contender; at least two seeds, the same for all.

    The reference of a picture is the mean of all contenders' pictures of the other seeds, each with
    the weight of its contender's inverse error; the reference's own error is subtracted.
    """
    even = _errors(pictures, dict.fromkeys(pictures, 1.0))
    return _errors(pictures, {n: 1.0 / max(float(np.mean(e)), 1e-12) for n, e in even.items()})


def _errors(
    pictures: Mapping[str, Sequence[Picture]], weights: Mapping[str, float]
) -> dict[str, list[float]]:
    """Return errors beside the weighted mean of the pictures of all other seeds.

    Contenders may make equal pictures with a seed, so the error of a seed's weighted mean is
    measured, too: it is that of independent pictures, and a reference has one less than all.
    """
    seeds = range(len(next(iter(pictures.values()))))
    share = sum(weights.values())
    of_seed = [
        sum(w * pictures[n][seed].astype(np.float64) for n, w in weights.items()) / share
        for seed in seeds
    ]
    total = np.sum(of_seed, axis=0)
    references = [(total - mean) / (len(seeds) - 1) for mean in of_seed]
    pairs = zip(of_seed, references, strict=True)
    noise = float(np.mean([relative_mse(mean, reference) for mean, reference in pairs]))
    return {
        name: [
            relative_mse(image, reference) - noise / len(seeds)
            for image, reference in zip(images, references, strict=True)
        ]
        for name, images in pictures.items()
    }


def gain(row: Row, over: Row) -> tuple[float, float]:
    """Return the efficiency of a row over that of another row, and its standard error."""
    own, other = (np.array(r["relmse"]) for r in (row, over))
    ratio = float(other.mean() / own.mean())
    apart = other / other.mean() - own / own.mean()  # seed by seed, as pictures may be equal
    ratio *= over["seconds"] / row["seconds"]
    return ratio, ratio * float(apart.std(ddof=1)) / math.sqrt(own.size)


def rate(row: Row) -> float:
    """Return a million samples a second."""
    width, height = row["size"]
    return float(width * height * (row["spp"] - 1) / row["seconds"] / 1e6)
