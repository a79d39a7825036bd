"""An image file as `clpt inspect` shows it: values by wavelength or channel, and colours."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import images, spectral_exr
from ..errors import SceneError

Pixel = tuple[int, int]  # x, y from the top left
LAYOUT = (
    "pixelAspectRatio", "screenWindowWidth", "name", "view", "chunkCount", "version",
    "spectralLayoutVersion", "emissiveUnits", "EV", "cameraResponse", "lensTransmission",
)  # fmt: skip
LETTERS = {1: "Y", 2: "YA", 3: "RGB", 4: "RGBA"}


@dataclass(frozen=True)
class ImageContents:
    """An image as it is inspected.

    values: (h, w, n); labels: a wavelength or a channel's name per value; lambdas: (n,) [nm], None
    where the image is not spectral; colours: (h, w, 3) linear Rec. 709, None where it has none;
    quantity: what the values are, with their unit; facts: what else the file says.
    """

    path: Path
    values: np.ndarray
    labels: tuple[str, ...]
    lambdas: np.ndarray | None
    colours: np.ndarray | None
    quantity: str
    facts: dict[str, str]

    def pixel(self, pixel: Pixel) -> np.ndarray:
        """Return a pixel's values (n,). Raises SceneError outside of the image."""
        (x, y), (height, width) = pixel, self.values.shape[:2]
        if x >= width or y >= height:
            raise SceneError(
                f"{x},{y} is outside of the image of {width} x {height} pixels, whose last one is "
                f"{width - 1},{height - 1}",
                file=self.path,
            )
        return np.asarray(self.values[y, x])

    def hex_colour(self, pixel: Pixel) -> str | None:
        """Return a pixel's colour as #rrggbb in sRGB; None where the image has no colours."""
        if self.colours is None:
            return None
        x, y = pixel
        return "#" + bytes(images.to_srgb8(self.colours[y : y + 1, x : x + 1])[0, 0]).hex()


def read_contents(path: Path) -> ImageContents:
    """Read any image file; an .exr tells how it was made. Raises SceneError."""
    image = _read(path)
    if path.suffix.lower() != ".exr":
        return image
    return dataclasses.replace(image, facts=image.facts | _provenance(images.attributes(path)))


def _provenance(attributes: dict[str, Any]) -> dict[str, str]:
    """What whoever wrote the file says of it, without what the layout needs."""
    plain = {k: v for k, v in attributes.items() if isinstance(v, (str, int, float))}
    return {
        k: f"{v:g}" if isinstance(v, float) else str(v) for k, v in plain.items() if k not in LAYOUT
    }


def _read(path: Path) -> ImageContents:
    if spectral_exr.is_spectral(path):
        return _spectral(path)
    if path.suffix.lower() == ".exr":
        layers = images.read_layers(path)
        if len({layer.shape for layer in layers.values()}) != 1:
            raise SceneError("its channels are of different sizes", file=path)
        if set("RGB") <= layers.keys():  # before others, in the usual order
            layers = {name: layers[name] for name in ("R", "G", "B")} | layers
        labels, values = tuple(layers), np.stack(list(layers.values()), axis=2)
    else:
        values = images.read(path)
        count = values.shape[2]
        labels = tuple(LETTERS.get(count, ())) or tuple(str(i) for i in range(count))
    colours = values[..., :3] if labels[:3] == tuple("RGB") else None
    if labels[0] == "Y":
        colours = np.repeat(values[..., :1], 3, axis=2)
    facts = {"size": _size(values), "channels": ", ".join(labels)}
    return ImageContents(path, values, labels, None, colours, "value (linear)", facts)


def _spectral(path: Path) -> ImageContents:
    image = spectral_exr.read(path)
    lambdas = image.lambdas
    quantity = "reflectance"
    if image.emissive:
        quantity = f"radiance [{image.units}]" if image.units else "radiance"
    facts = {
        "size": _size(image.values),
        "holds": "light" if image.emissive else "reflectances",
        "bands": f"{len(lambdas)}, {lambdas[0]:g} to {lambdas[-1]:g} nm",
        **({"units": image.units} if image.units else {}),
        **({"exposure": f"{image.exposure:g} stops"} if image.exposure else {}),
        **({"response": "of the camera is given"} if image.response else {}),
        **({"transmission": "of the lens is given"} if image.transmission else {}),
        **({"note": "; ".join(image.warnings)} if image.warnings else {}),
    }
    colours = image.to_rgb() * np.float32(2.0**image.exposure)
    labels = tuple(f"{nm:g} nm" for nm in lambdas)
    return ImageContents(path, image.values, labels, lambdas, colours, quantity, facts)


def _size(values: np.ndarray) -> str:
    return f"{values.shape[1]} x {values.shape[0]}"
