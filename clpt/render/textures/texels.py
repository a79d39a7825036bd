"""Images as kernels read them: texels of colours, of spectra, of bands, or of numbers.

The file of an image may change while a scene is rendered: all samples show the version that was
read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from clpt import spectra
from clpt.arrays import Floats32, Words
from clpt.errors import SceneError
from clpt.files import budget
from clpt.images.spectral_exr import SpectralImage
from clpt.render.records.tables import version
from clpt.scene.fingerprint import file_digest
from clpt.scene.roles import REAL, REFLECTANCE, Role
from clpt.spectra import Tabulated

NEGATIVE = 1e-5  # share of an image's light
FAR = 1000.0  # bands of the numbering beyond each end of a spectral image


def negative_notes(values: Floats32, name: object) -> list[str]:
    """Return a warning if an image (h, w, n) of light has negative values, which become 0.

    Rounding makes tiny negative values: light below NEGATIVE of the whole is not told.
    """
    budget.check_time()
    below = np.minimum(values, np.float32(0.0))
    lost = -below.sum(dtype=np.float64)
    if not lost > NEGATIVE * max(float(values.sum(dtype=np.float64)) + lost, 0.0):
        return []
    count = int((below < 0.0).any(axis=-1).sum())
    return [
        f"{name}: {count:,} of {values[..., 0].size:,} texels have a negative value, down to "
        f"{below.min():.3g}; light is never negative, so these values count as 0"
    ]


def texels(image: Floats32, role: Role, spectral: bool) -> Floats32:
    """Return the texels of an image, row by row from the top.

    (h * w, 4): rgb, or sigmoid coefficients and a factor where `spectral`; (h * w,) for REAL.
    """
    budget.check_time()
    if role is REAL:
        return image.reshape(-1)
    colours = np.broadcast_to(image, (*image.shape[:2], 3)).reshape(-1, 3)
    rows = np.ones((len(colours), 4), np.float32)
    if not spectral:
        np.clip(colours, 0.0, 1.0 if role is REFLECTANCE else None, out=rows[:, :3])
    elif role is REFLECTANCE:
        distinct, which = _palette(np.clip(colours, 0.0, 1.0))
        rows[:, :3] = spectra.uplift(distinct)[which]
    else:
        rows[:, 3], rows[:, :3] = spectra.unbounded(colours)
    return rows


def texel_words(image: Floats32, role: Role, spectral: bool) -> Words:
    """Return `texels` as the words of `images`: a colour takes three where not `spectral`."""
    values = texels(image, role, spectral)
    colours = values if role is REAL or spectral else values[:, :3]
    return np.ascontiguousarray(colours, np.float32).reshape(-1).view(np.uint32)


def bands(image: SpectralImage, lo: float, hi: float) -> tuple[Floats32, Tabulated]:
    """Return the texels of a spectral image for the wavelengths from `lo` to `hi` [nm].

    (h * w, n) float32 and the number of the band by wavelength: whole at the bands' wavelengths,
    linear between them and beyond the ends. Outside the range only the next band is kept on each
    side. Raises SceneError for fewer than two bands.
    """
    lambdas, n = image.lambdas, len(image.lambdas)
    if n < 2:
        raise SceneError("a texture of spectra needs two wavelengths at least", where="image")
    first = min(max(int(np.searchsorted(lambdas, lo, "right")) - 1, 0), n - 2)
    end = max(min(int(np.searchsorted(lambdas, hi)) + 1, n), first + 2)
    kept = lambdas[first:end]
    last, ends = len(kept) - 1.0, np.array([kept[1] - kept[0], kept[-1] - kept[-2]]) * FAR
    number = Tabulated(
        [kept[0] - ends[0], *kept, kept[-1] + ends[1]],
        [-FAR, *np.arange(len(kept)), last + FAR],
    )
    values = np.nan_to_num(image.values[..., first:end].reshape(-1, len(kept)))
    return np.clip(values, 0.0, None if image.emissive else 1.0), number


def _palette(colours: Floats32) -> tuple[Floats32, Any]:
    """Return the distinct colours (k, 3), and the index of each of the colours (n, 3) among them.

    The channels of an 8-bit image have at most 256 values. Other images are returned unchanged.
    """
    number, counts = np.zeros(len(colours), np.int64), 1
    for channel in colours.T:
        coarse = np.ascontiguousarray(channel).view(np.uint32) >> 12
        values = np.zeros(1 << 20, np.float32)
        values[coarse] = channel
        present = np.zeros(1 << 20, bool)
        present[coarse] = True
        levels = int(present.sum())
        if levels > 256 or not np.array_equal(values[coarse], channel):
            return colours, slice(None)
        number = number * levels + (np.cumsum(present) - 1)[coarse]
        counts *= levels
    chosen = np.full(counts, -1, np.int64)
    chosen[number] = np.arange(len(colours))
    used = np.flatnonzero(chosen >= 0)
    place = np.zeros(counts, np.int64)
    place[used] = np.arange(len(used))
    return colours[chosen[used]], place[number]


@dataclass(frozen=True)
class ImageFiles:
    """The versions of a scene's files, and the digests of their bytes, by path.

    They are noted before a scene is lowered; `check` compares them afterwards.
    """

    versions: Mapping[str, str] = field(default_factory=dict)
    digests: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, paths: Iterable[str], former: ImageFiles) -> ImageFiles:
        """Note files; former: the files of the scene before, which are not read again.

        Files that cannot be read are left out: lowering raises their errors.
        """
        versions: dict[str, str] = {}
        digests: dict[str, str] = {}
        for path in sorted(paths):
            versions[path] = version(path)
            if former.versions.get(path) == versions[path]:
                digests[path] = former.digests[path]
                continue
            try:
                digests[path] = file_digest(Path(path))
            except SceneError:
                del versions[path]
        return cls(versions, digests)

    def check(self) -> None:
        """Raise SceneError for a file that has changed since, perhaps while it was read."""
        for path, before in self.versions.items():
            if version(path) != before:
                raise SceneError("changed while the scene was read; try again", file=path)
