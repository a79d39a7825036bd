"""Colour spaces of pictures, and the adaptation of white.

A space is linear; (1, 1, 1) is its white. XYZ is of the 1931 observer, the constant spectrum 1 has
Y = 1. Spaces whose white is D65 take it as tabulated, so that grey under D65 stays exactly grey.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from clpt.arrays import Matrix
from clpt.errors import SceneError, UnknownKindError
from clpt.spectra import cie
from clpt.spectra.emission import Blackbody

Chromaticities = tuple[tuple[float, float], ...]

D60_ACES = (0.32168, 0.33767)  # the white of ACES (SMPTE ST 2065-1), near D60

# Chromaticities (x, y) of red, green and blue, and of the white if it is not D65.
PRIMARIES: dict[str, Chromaticities] = {
    "rec709": cie.REC709_PRIMARIES,  # ITU-R BT.709-6
    "rec2020": ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046)),  # ITU-R BT.2020-2
    "display_p3": ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060)),  # SMPTE EG 432-1, D65
    "aces2065_1": ((0.7347, 0.2653), (0.0, 1.0), (0.0001, -0.077)),  # AP0, SMPTE ST 2065-1
    "acescg": ((0.713, 0.293), (0.165, 0.830), (0.128, 0.044)),  # AP1, S-2014-004
}
WHITES = {"aces2065_1": D60_ACES, "acescg": D60_ACES}
SPACES = (*PRIMARIES, "xyz")

TEMPERATURES = (1000.0, 25000.0)  # [K] that a correlated colour temperature may have

# Cone responses of the Bradford transform (Lam 1985; CIE 159).
BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)


def white(space: str) -> Matrix:
    """XYZ (3,) of a space's white, Y = 1; of "xyz" it is D65's. Raises UnknownKindError."""
    _check(space)
    return xyz_of(WHITES[space]) if space in WHITES else cie.D65_WHITE


def to_xyz(space: str) -> Matrix:
    """The matrix (3, 3) float64 from a space to XYZ. Raises UnknownKindError."""
    _check(space)
    if space == "xyz":
        return np.eye(3)
    if space == "rec709":
        return cie.REC709_TO_XYZ
    return cie.primaries_to_xyz(PRIMARIES[space], white(space))


def from_xyz(space: str) -> Matrix:
    """The matrix (3, 3) float64 from XYZ to a space. Raises UnknownKindError."""
    if space == "rec709":
        return cie.XYZ_TO_REC709
    return np.linalg.inv(to_xyz(space)).astype(np.float64)


def bradford(source: ArrayLike, target: ArrayLike) -> Matrix:
    """The matrix (3, 3) that takes XYZ under the white `source` (3,) to XYZ under `target` (3,).

    Bradford's cone responses (Lam 1985) are scaled (von Kries 1902). Whites are taken at Y = 1, so
    brightness stays.
    """
    whites = [np.asarray(w, np.float64) / np.asarray(w, np.float64)[1] for w in (source, target)]
    cones = [BRADFORD @ w for w in whites]
    scaled = np.diag(cones[1] / cones[0]) @ BRADFORD
    return np.asarray(np.linalg.inv(BRADFORD) @ scaled, np.float64)


def between(source: str, target: str) -> Matrix:
    """The matrix (3, 3) between two spaces, white to white by Bradford's transform."""
    adapted = bradford(white(source), white(target))
    return from_xyz(target) @ adapted @ to_xyz(source)


def chromaticities(space: str) -> tuple[float, ...]:
    """x and y of red, green, blue and white, eight numbers, as an OpenEXR file states them."""
    _check(space)
    if space == "xyz":
        return (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)
    x, y, z = white(space)
    pairs = (*PRIMARIES[space], (x / (x + y + z), y / (x + y + z)))
    return tuple(float(value) for pair in pairs for value in pair)


def to_rec709(stated: ArrayLike) -> Matrix | None:
    """Return the matrix (3, 3) from stated chromaticities to Rec. 709; None if they are Rec. 709's.

    stated: in the order of `chromaticities`. Bradford's transform adapts the white; XYZ stays as it
    is. Raises SceneError if the chromaticities span no colours.
    """
    if _is_near(stated, "rec709"):
        return None
    matrix, whole = stated_to_xyz(stated)
    return cie.XYZ_TO_REC709 @ bradford(whole, cie.D65_WHITE) @ matrix


def stated_to_xyz(stated: ArrayLike) -> tuple[Matrix, Matrix]:
    """The matrix (3, 3) from colours of stated chromaticities to XYZ, and XYZ (3,) of their white.

    Raises SceneError where they span no colours.
    """
    for space in SPACES:
        if _is_near(stated, space):
            return to_xyz(space), white(space)
    numbers = np.asarray(stated, np.float64).reshape(-1)
    if numbers.shape != (8,) or not np.isfinite(numbers).all() or numbers[7] <= 0.0:
        raise SceneError(f"the chromaticities {numbers.tolist()} span no colours")
    xy, whole = numbers[:6].reshape(3, 2).T, xyz_of(numbers[6:])
    primaries = np.vstack([xy, 1.0 - xy.sum(axis=0)])
    if abs(np.linalg.det(primaries)) < 1e-6:
        raise SceneError(f"the chromaticities {numbers.tolist()} span no colours")
    return primaries * np.linalg.solve(primaries, whole), whole


def _is_near(stated: ArrayLike, space: str) -> bool:
    """Return whether stated chromaticities equal a space's to four digits."""
    numbers = np.asarray(stated, np.float64).reshape(-1)
    known = chromaticities(space)
    return numbers.shape == (8,) and np.allclose(numbers, known, rtol=0.0, atol=1e-4)


def xyz_of(xy: ArrayLike) -> Matrix:
    """XYZ (3,) with Y = 1 of a chromaticity (x, y)."""
    x, y = np.asarray(xy, np.float64)
    return np.array([x / y, 1.0, (1.0 - x - y) / y])


def xy_of_temperature(kelvin: float) -> tuple[float, float]:
    """Chromaticity of a correlated colour temperature within TEMPERATURES.

    From 4000 K on daylight's (CIE 15:2004 eq. 3.3 and 3.4), below 4000 K a black body's.
    """
    if kelvin < 4000.0:
        xyz = cie.spectrum_to_xyz(Blackbody(kelvin).sample(cie.GRID))
        return float(xyz[0] / xyz.sum()), float(xyz[1] / xyz.sum())
    t = 1e3 / kelvin
    if kelvin <= 7000.0:
        x = 0.244063 + t * (0.09911 + t * (2.9678 - 4.6070 * t))
    else:
        x = 0.237040 + t * (0.24748 + t * (1.9018 - 2.0064 * t))
    return x, (-3.0 * x + 2.870) * x - 0.275


def _check(space: str) -> None:
    if space not in SPACES:
        raise UnknownKindError("colour space", space, SPACES)
