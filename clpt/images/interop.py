"""Colour spaces by the names of the Color Interop Forum, as an EXR's `colorInteropID` has them.

A name is a transfer, a set of primaries and a state, such as `srgb_rec709_display` ("Color Space
Encodings for Texture Assets and CG Rendering", and for displays, 2025).
"""

from __future__ import annotations

from dataclasses import dataclass

from clpt.arrays import Floats, Matrix
from clpt.images.colour import decoded
from clpt.spectra import spaces

ADOBE_RGB = (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, 0.3127, 0.329)  # red, green, blue, D65: x, y
SPACES = {
    "ap0": "aces2065_1", "ap1": "acescg", "rec709": "rec709", "rec2020": "rec2020",
    "p3d65": "display_p3",
}  # fmt: skip
GAMMAS = {"g18": 1.8, "g22": 2.2, "g24": 2.4, "g26": 2.6}
STATES = ("scene", "display")
SILENT = ("", "data", "unknown")  # names that state no colours


@dataclass(frozen=True)
class Encoding:
    """The colours that a name states: see `clpt.images.stored.Stored`."""

    encoded: bool
    gamma: float | None
    matrix: Matrix | None

    def linear(self, colours: Floats) -> Floats:
        """Return colours (..., 3) float64 as linear Rec. 709."""
        light = decoded(colours, self.gamma) if self.encoded else colours
        return light if self.matrix is None else light @ self.matrix.T


def encoding(name: str) -> Encoding | None:
    """Return the encoding of a name; None for PQ, HLG and names that are not known."""
    curve, _, remainder = name.partition("_")
    primaries, _, state = remainder.rpartition("_")
    if state not in STATES or curve not in ("lin", "srgb", *GAMMAS):
        return None
    if primaries in SPACES:
        space = SPACES[primaries]
        matrix = None if space == "rec709" else spaces.between(space, "rec709")
    elif primaries == "adobergb":
        matrix = spaces.to_rec709(ADOBE_RGB)
    elif primaries in ("ciexyzd65", "xyzd65"):
        matrix = spaces.from_xyz("rec709")
    else:
        return None
    gamma = 1.0 / GAMMAS[curve] if curve in GAMMAS else None
    return Encoding(curve != "lin", gamma, matrix)
