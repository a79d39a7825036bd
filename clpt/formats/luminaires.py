"""Lamps that a file of their maker describes: candela by direction, for a `goniometric` light."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clpt.formats import eulumdat, ies
from clpt.scene.lights import STRENGTHS, Goniometric
from clpt.scene.params import fields_of
from clpt.spectra import RGBIlluminant

EULUMDAT = ".ldt"


def parameters(path: Path) -> dict[str, Any]:
    """Return `image` and `candela` of a Goniometric from an .ies or .ldt file.

    Raises SceneError with the broken line.
    """
    read = eulumdat.read if path.suffix.lower() == EULUMDAT else ies.read
    return ies.table(read(path))


def joined(lamp: Goniometric, file: dict[str, Any]) -> Goniometric:
    """Return a lamp with the table of its file.

    A number of its intensity and its own `candela` are factors. Its own `power` or `lumens` are of
    all its light: the table then says only how it is distributed.
    """
    intensity, image = lamp.intensity, file["image"]
    candela = file["candela"] if lamp.candela is None else lamp.candela
    alike = isinstance(intensity, RGBIlluminant) and intensity.r == intensity.g == intensity.b
    values = fields_of(lamp)
    if any(values.get(name) is not None for name in STRENGTHS if name != "candela"):
        shares = np.asarray(image.image, np.float32) / np.float32(mean(image.image))
        return dataclasses.replace(lamp, image=dataclasses.replace(image, image=shares))
    if isinstance(intensity, RGBIlluminant) and alike:
        if intensity.r == 0.0:  # switched off
            return dataclasses.replace(lamp, image=image, candela=None)
        candela, intensity = candela * intensity.r, RGBIlluminant(1.0, 1.0, 1.0)
    return dataclasses.replace(lamp, image=image, candela=candela, intensity=intensity)


def mean(image: ArrayLike) -> float:
    """Return the mean over all directions of a table (h, w, 1) in latitude and longitude."""
    values = np.asarray(image, np.float64)
    edges = np.cos(np.linspace(0.0, np.pi, len(values) + 1))
    return float(values.mean(axis=(1, 2)) @ -np.diff(edges)) / 2.0
