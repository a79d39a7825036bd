"""Open Image Denoise (`pip install 'clpt[denoise]'`), by its binding pyoidn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from clpt.arrays import Image
from clpt.errors import DeviceError, SceneError
from clpt.images.colour import LUMINANCE

GREY = 0.18  # what the mean of logarithms of luminance becomes, as Open Image Denoise has it
DARKEST = 1e-8  # that counts in this mean


class Oidn:
    """Denoises pictures that see the same surfaces.

    albedo: (h, w, 3) float32, 0 to 1; normal: likewise, -1 to 1; both or none. They are denoised
    first, by themselves, and then taken to be clean.

    Raises SceneError where pyoidn is not installed, DeviceError for errors of the library.
    """

    def __init__(self, albedo: Image | None = None, normal: Image | None = None):
        self._package = _pyoidn()
        self._device = self._package.Device()
        self._device.commit()
        self._beside: dict[str, Image] = {}
        if albedo is not None and normal is not None:
            for name, image in (("albedo", np.clip(albedo, 0.0, 1.0)), ("normal", normal)):
                self._beside[name] = self._filter({name: image}, {})

    @property
    def version(self) -> str:
        """The version of the library, such as 2.5.1."""
        return str(self._package.version.oidn_version)

    def close(self) -> None:
        """Give the library's memory back."""
        self._device.release()

    def __enter__(self) -> Oidn:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def colours(self, image: Image) -> Image:
        """Return a picture (h, w, 3) float32 without noise; NaN counts as 0."""
        return self._signed(image, scale_of(image @ LUMINANCE))

    def bands(self, image: Image) -> Image:
        """Return a picture (h, w, n) float32 without noise: three bands at a time."""
        scale, count = scale_of(image.mean(axis=2)), image.shape[2]
        clean = np.empty_like(image)
        for first in range(0, count, 3):
            three = np.minimum(np.arange(first, first + 3), count - 1)  # the last band fills up
            clean[..., three] = self._signed(image[..., three], scale)
        return clean

    def _signed(self, image: Image, scale: float) -> Image:
        """A picture whose values may be below 0, as colours outside of a space are.

        The library takes these for 0. So what is above and what is below 0 go through it apart:
        their difference has the mean of the picture.
        """
        known = np.where(np.isnan(image), np.float32(0.0), image)
        clean = self._colour(np.maximum(known, 0.0), scale)
        if known.min() < 0.0:
            clean -= self._colour(np.maximum(-known, 0.0), scale)
        return clean

    def _colour(self, image: Image, scale: float) -> Image:
        flags = {"hdr": True, "cleanAux": bool(self._beside)}
        return self._filter({"color": image, **self._beside}, flags, scale)

    def _filter(
        self, images: Mapping[str, Image], flags: Mapping[str, bool], scale: float | None = None
    ) -> Image:
        package = self._package
        inputs = {name: np.ascontiguousarray(image, np.float32) for name, image in images.items()}
        clean = np.empty_like(next(iter(inputs.values())))
        with package.Filter(self._device, "RT") as chosen:
            for name, image in (*inputs.items(), ("output", clean)):
                chosen.set_image(name, image, package.OIDN_FORMAT_FLOAT3)
            for name, flag in flags.items():
                chosen.set_bool(name, flag)
            if scale is not None:
                chosen.set_float("inputScale", scale)
            chosen.commit()
            chosen.execute()
        error = self._device.get_error()
        if error is not None:
            raise DeviceError(f"Open Image Denoise: {error}")
        return clean


def scale_of(luminance: Image) -> float:
    """Return the factor that brings a picture (h, w) to the brightness of grey cards."""
    lit = luminance[luminance > DARKEST]
    return float(GREY / np.exp(np.log(lit).mean(dtype=float))) if lit.size else 1.0


def is_installed() -> bool:
    """Return whether the library can be loaded."""
    try:
        check_installed()
    except SceneError:
        return False
    return True


def check_installed() -> None:
    """Raise SceneError where the library is not installed."""
    _pyoidn()


def _pyoidn() -> Any:
    """The package. Raises SceneError where it is not installed."""
    try:
        import pyoidn
    except (ImportError, OSError) as error:
        advice = "Open Image Denoise is not installed: pip install 'clpt[denoise]'"
        raise SceneError(f"{advice}; or denoise by statistical, which needs nothing") from error
    return pyoidn
