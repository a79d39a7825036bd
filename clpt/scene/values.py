"""Types of the values that parameters of a scene accept, for type checkers.

The dataclasses convert their arguments: a colour becomes a `clpt.spectra.Spectrum`. So the value of
a parameter has such a type too.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Protocol, TypeAlias

from numpy.typing import NDArray

from clpt.images.spectral_exr import SpectralImage
from clpt.scene.texture_values import Texture
from clpt.spectra import Spectrum


class OnDevice(Protocol):
    """An array or a buffer of PyOpenCL, in a device's memory."""

    @property
    def context(self) -> Any: ...


SpectrumLike: TypeAlias = float | Sequence[float] | NDArray[Any] | Spectrum
"""A number for all wavelengths, (r, g, b) linear Rec. 709, or a spectrum."""
Textured: TypeAlias = SpectrumLike | Texture
"""The same, or a texture that varies it over a surface."""
IndexLike: TypeAlias = SpectrumLike | str
"""An index of refraction: also a name, such as "diamond"."""
TexturedNumber: TypeAlias = float | Texture
"""A number, or a texture that varies it over a surface."""
Vector3: TypeAlias = Sequence[float] | NDArray[Any]
"""(3,) float: a point or a direction."""
Matrix4: TypeAlias = NDArray[Any] | Sequence[Sequence[float]]
"""(4, 4) float: a transform; column vectors, so that `a @ b` applies b first."""
ImageLike: TypeAlias = str | os.PathLike[str] | NDArray[Any] | SpectralImage
"""The path of an image file, or its texels (h, w) or (h, w, c)."""
