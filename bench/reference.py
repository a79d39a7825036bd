"""Converged pictures to measure errors against, and how errors are measured.

A reference is Mitsuba's, of independent samples, made once and kept in the user's cache folder. It
is made in batches, so that its own noise is known.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import platformdirs

from bench.workers import Worker

BATCH = 64  # samples per pixel of a render by Mitsuba
FIRST = 1000  # batches are numbered from here on, so that no measured picture shares its samples


@dataclass(frozen=True)
class Reference:
    """mean, variance: (h, w, 3) float64, of pixels, and of the mean's noise."""

    mean: np.ndarray
    variance: np.ndarray

    @property
    def radiance(self) -> np.ndarray:
        """Mean of the picture by channel, (3,) float64."""
        return self.mean.mean((0, 1))

    @property
    def radiance_se(self) -> np.ndarray:
        """Standard error of `radiance`, (3,) float64."""
        return mean_error(self.variance)

    def relative_mse(self, image: np.ndarray, trim: float = 0.0) -> float:
        """Mean over pixels of ((image - mean)^2 - variance) / (mean^2 + (0.1 overall mean)^2).

        The variance is taken off since a reference's own noise is no fault of the image. `trim`
        leaves out that share of the pixels, those with the largest errors.
        """
        floor = (0.1 * self.mean.mean()) ** 2
        error = ((image - self.mean) ** 2 - self.variance) / (self.mean**2 + floor)
        error = np.sort(error.mean(-1).ravel())
        return float(error[: len(error) - int(trim * len(error))].mean())


def mean_error(variance: np.ndarray) -> np.ndarray:
    """Standard error of a picture's mean by channel, (3,), from the variance of its pixels."""
    return np.sqrt(variance.sum((0, 1))) / (variance.shape[0] * variance.shape[1])


def reference(scene: Path, mode: str, spp: int, cores: Sequence[int]) -> Reference:
    """The reference of a scene file, from the cache or rendered now."""
    files = b"".join(file.read_bytes() for file in sorted(scene.parent.glob(f"{scene.stem}*")))
    digest = hashlib.sha256(files).hexdigest()[:12]
    folder = Path(platformdirs.user_cache_dir("clpt", appauthor=False)) / "bench"
    path = folder / f"{scene.stem}-{mode}-{spp}-{digest}.npz"
    if not path.is_file():
        images = _render(scene, mode, max(spp // BATCH, 2), cores)
        folder.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(path, mean=images.mean, variance=images.variance)
    with np.load(path) as kept:
        return Reference(kept["mean"], kept["variance"])


def _render(scene: Path, mode: str, batches: int, cores: Sequence[int]) -> Reference:
    worker = Worker("mitsuba", scene, mode, "independent", cores)
    mean, squares = 0.0, 0.0  # Welford 1962
    for n in range(batches):
        image = worker.render(BATCH, FIRST + n).image.astype(np.float64)
        apart = image - mean
        mean = mean + apart / (n + 1)
        squares = squares + apart * (image - mean)
    worker.close()
    return Reference(np.asarray(mean), np.asarray(squares) / (batches - 1) / batches)
