"""A camera's sensor: light of a picture to the numbers that its converter gives.

The model is that of EMVA 1288 (release 4.0, linear): photons become electrons by the quantum
efficiency; shot noise is Poisson's, of light and of dark current together; read noise is Gaussian;
a pixel holds no more than its full well; the converter rounds and clips.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.files import input_files
from clpt.spectra.emission import LIGHT, PLANCK

PATTERNS = {"rggb": (0, 1, 1, 2), "bggr": (2, 1, 1, 0), "grbg": (1, 0, 2, 1), "gbrg": (1, 2, 0, 1)}


@dataclass(frozen=True)
class Sensor:
    """A sensor behind a lens.

    pitch: side of a pixel [m]; f_number and exposure [s]: of the lens and the shutter. efficiency:
    electrons of a photon, a number or (channels, k) at `wavelengths` (k,) [nm], linear between them
    and 0 beyond. dark_current [e/s], read_noise [e], full_well [e] of a pixel. gain: electrons of a
    step of the converter; bits: of it; black_level: its number without light [steps]. pattern:
    "rggb", "bggr", "grbg", "gbrg" or rows of channels of a mosaic; "": each pixel has all channels.
    vignetting: factors of r^2, r^4, ... that are added to 1, r from the middle of the picture, 1 at
    its corners. fixed_pattern: relative standard deviation of the pixels' sensitivities, which
    depend on `serial` alone.
    """

    pitch: float = 3.45e-6
    f_number: float = 2.8
    exposure: float = 0.01
    efficiency: ArrayLike = 0.6
    wavelengths: ArrayLike = ()
    dark_current: float = 5.0
    read_noise: float = 2.5
    full_well: float = 10500.0
    gain: float = 2.6
    bits: int = 12
    black_level: int = 64
    pattern: str | ArrayLike = ""
    vignetting: tuple[float, ...] = ()
    fixed_pattern: float = 0.0
    serial: int = 0

    def __post_init__(self) -> None:
        for name in ("pitch", "f_number", "exposure", "full_well", "gain"):
            if not vars(self)[name] > 0.0:
                raise SceneError(f"must be above 0, not {vars(self)[name]!r}", where=name)
        for name in ("dark_current", "read_noise", "fixed_pattern", "black_level"):
            if not vars(self)[name] >= 0.0:
                raise SceneError(f"must not be below 0, not {vars(self)[name]!r}", where=name)
        if not 1 <= self.bits <= 16:
            raise SceneError(f"must lie between 1 and 16, not {self.bits}", where="bits")
        if isinstance(self.pattern, str) and self.pattern not in ("", *PATTERNS):
            message = f"must be rows of channels or {', '.join(PATTERNS)}, not {self.pattern!r}"
            raise SceneError(message, where="pattern")
        shape = np.shape(self.efficiency)
        if shape and shape[-1:] != np.shape(self.wavelengths):
            message = f"must end with the {np.size(self.wavelengths)} wavelengths, not {shape}"
            raise SceneError(message, where="efficiency")

    def electrons(self, image: ArrayLike, wavelengths: ArrayLike) -> Floats:
        """Return the mean electrons (h, w, channels) of light, without dark current.

        image: radiance (h, w, bands) [W m^-2 sr^-1 nm^-1] of a spectral film with `bands`;
        wavelengths: middles of the bands (bands,) [nm], `Film.band_centres`, evenly spaced. The
        irradiance of a pixel is pi L / (4 N^2), without the lens's losses. Raises SceneError.
        """
        radiance, centres = np.asarray(image, np.float64), np.asarray(wavelengths, np.float64)
        if radiance.ndim != 3 or centres.shape != radiance.shape[2:]:
            message = (
                f"must be (h, w, {centres.size}), as the wavelengths are, not {radiance.shape}"
            )
            raise SceneError(message, where="image")
        width = centres[1] - centres[0] if len(centres) > 1 else 1.0
        energy = PLANCK * LIGHT / (centres * 1e-9)  # of a photon [J]
        area = np.pi / (4.0 * self.f_number**2) * self.pitch**2 * self.exposure
        photons = np.maximum(radiance, 0.0) * (area * width / energy)
        return photons @ self._efficiency(centres).T * self._falloff(*radiance.shape[:2])[..., None]

    def _efficiency(self, at: Floats) -> Floats:
        """Return electrons of a photon (channels, bands)."""
        if np.ndim(self.efficiency) == 0:
            return np.full((1, len(at)), np.asarray(self.efficiency, np.float64))
        rows = np.atleast_2d(np.asarray(self.efficiency, np.float64))
        knots = np.asarray(self.wavelengths, np.float64)
        return np.stack([np.interp(at, knots, row, left=0.0, right=0.0) for row in rows])

    def _falloff(self, height: int, width: int) -> Floats:
        """Return the factors of vignetting (h, w)."""
        y, x = np.mgrid[:height, :width] + 0.5
        square = ((x - width / 2) ** 2 + (y - height / 2) ** 2) / ((width**2 + height**2) / 4)
        powers = (k * square ** (i + 1) for i, k in enumerate(self.vignetting))
        return np.maximum(1.0 + sum(powers, np.zeros((height, width))), 0.0)

    def mosaic(self, electrons: Floats) -> Floats:
        """Return electrons (h, w) of the channel that each pixel has, by the pattern."""
        pattern: ArrayLike = self.pattern
        if isinstance(pattern, str):
            pattern = np.reshape(PATTERNS[pattern], (2, 2))
        rows = np.asarray(pattern, int)
        height, width, channels = electrons.shape
        if rows.ndim != 2 or not 0 <= rows.min() <= rows.max() < channels:
            message = f"must be rows of channels below {channels}, not {rows.tolist()}"
            raise SceneError(message, where="pattern")
        y, x = np.mgrid[:height, :width]
        chosen = rows[y % rows.shape[0], x % rows.shape[1]]
        return np.take_along_axis(electrons, chosen[..., None], axis=2)[..., 0]

    def read(self, electrons: ArrayLike, seed: int = 0) -> NDArray[np.uint16]:
        """Return the converter's numbers (h, w) or (h, w, channels) of mean electrons.

        electrons: see `electrons`. seed: of the noise: the same call gives the same numbers, for a
        version of numpy. Another picture takes another seed.
        """
        mean = np.asarray(electrons, np.float64)
        if not isinstance(self.pattern, str) or self.pattern:
            mean = self.mosaic(mean)
        elif mean.ndim == 3 and mean.shape[2] == 1:
            mean = mean[..., 0]
        if self.fixed_pattern:
            pixels = np.random.default_rng([self.serial]).normal(
                1.0, self.fixed_pattern, mean.shape
            )
            mean = mean * np.maximum(pixels, 0.0)
        rng = np.random.default_rng([seed, 1])
        counts = rng.poisson(mean + self.dark_current * self.exposure).astype(np.float64)
        counts = np.minimum(counts, self.full_well) + rng.normal(0.0, self.read_noise, mean.shape)
        steps = np.rint(counts / self.gain) + self.black_level
        return np.clip(steps, 0, 2**self.bits - 1).astype(np.uint16)

    def with_response(self, path: str | Path) -> Sensor:
        """Return the sensor with the efficiencies of a CSV file.

        Each row has a wavelength [nm] and electrons of a photon for each channel, rising in
        wavelength; a first row of titles and comments after `#` are allowed. Raises SceneError.
        """
        rows = []
        for number, line in enumerate(input_files.read(path).splitlines(), 1):
            fields = [field.strip() for field in line.split("#")[0].split(",")]
            if fields == [""]:
                continue
            try:
                rows.append([float(field) for field in fields])
            except ValueError:
                if rows or number > 1:
                    message = f"line {number}: {line.strip()!r} has no numbers"
                    raise SceneError(message, file=path) from None
        widths = {len(row) for row in rows}
        if len(rows) < 2 or len(widths) != 1 or min(widths) < 2:
            message = "must have two rows or more of a wavelength and as many efficiencies each"
            raise SceneError(message, file=path)
        table = np.array(rows)
        if not (np.diff(table[:, 0]) > 0.0).all():
            raise SceneError("wavelengths must rise", file=path)
        return dataclasses.replace(self, wavelengths=table[:, 0], efficiency=table[:, 1:].T)
