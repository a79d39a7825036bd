# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes of the compositor: clpt's layers, groups of lights, and bands of wavelengths."""

from __future__ import annotations

from typing import Any, NamedTuple

import bpy
import numpy as np

FAR = 1e10  # depth where nothing is seen, as in Blender
GROUP = "light_"  # begins clpt's layers of groups of lights
LEVELS = 3  # of mattes, of two names each


class Pass(NamedTuple):
    """A pass: its name, the layer of clpt, its channels, and what they mean.

    number: of a band, or of the two names of a matte.
    """

    name: str
    layer: str
    channels: str
    kind: str
    number: int = -1

    def values(self, arrays: dict[str, bytes], pixels: int) -> np.ndarray:
        """Return the numbers of the pass, of the arrays that came for layers."""
        found = np.frombuffer(arrays[self.layer], np.float32)
        if self.name == "Depth":
            return np.where(found > 0.0, found, np.float32(FAR))
        if self.number < 0:
            return found
        width = len(self.channels)
        return found.reshape(pixels, -1)[:, width * self.number : width * (self.number + 1)].ravel()


PASSES = {  # by options of view layers
    "use_pass_z": Pass("Depth", "z", "Z", "VALUE"),
    "use_pass_normal": Pass("Normal", "shading_normal", "XYZ", "VECTOR"),
    "use_pass_position": Pass("Position", "position", "XYZ", "VECTOR"),
    "use_pass_uv": Pass("UV", "uv", "UVA", "VECTOR"),
    "use_pass_diffuse_color": Pass("Diffuse Color", "albedo", "RGB", "COLOR"),
}
OWN = {  # by options of the engine
    "light_passes": (
        Pass("Direct", "direct", "RGB", "COLOR"), Pass("Indirect", "indirect", "RGB", "COLOR"),
    ),
    "denoising_passes": (
        Pass("Denoising Normal", "denoising_normal", "XYZ", "VECTOR"),
        Pass("Denoising Albedo", "denoising_albedo", "RGB", "COLOR"),
    ),
}  # fmt: skip
MATTES = {
    "use_pass_cryptomatte_object": ("crypto_object", "CryptoObject"),
    "use_pass_cryptomatte_material": ("crypto_material", "CryptoMaterial"),
}


def of_layer(layer: bpy.types.ViewLayer, settings: Any) -> list[Pass]:
    """Return the passes that a view layer and the scene's settings ask for."""
    passes = [found for option, found in PASSES.items() if getattr(layer, option)]
    passes += [each for option, own in OWN.items() if getattr(settings, option) for each in own]
    levels = range((min(layer.pass_cryptomatte_depth, 2 * LEVELS) + 1) // 2)
    for option, (source, name) in MATTES.items():
        if getattr(layer, option):
            passes += [Pass(f"{name}{i:02d}", source, "rgba", "COLOR", i) for i in levels]
    for group in layer.lightgroups:
        passes.append(Pass(f"Combined_{group.name}", f"{GROUP}{group.name}", "RGB", "COLOR"))
    return passes + [
        Pass(f"{nm:.5g} nm", "bands", "X", "VALUE", i) for i, nm in enumerate(centers(settings))
    ]


def centers(settings: Any) -> list[float]:
    """Return the middles of the bands [nm], which only spectral pictures have."""
    if settings.mode != "spectral" or not settings.bands:
        return []
    first, last = ends(settings)
    width = (last - first) / settings.bands
    return [first + (i + 0.5) * width for i in range(settings.bands)]


def ends(settings: Any) -> list[float]:
    """Return the shortest and the longest wavelength of all bands [nm]."""
    return [settings.first_band, max(settings.last_band, settings.first_band + 1.0)]
