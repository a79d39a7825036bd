"""Colours and spectra of a PBRT scene, and pbrt's names of measured spectra.

pbrt divides every light by the photometric integral of its spectrum, so that all have luminance
`scale`; a colour counts as a multiple of its colour space's illuminant. The constant spectrum 1
has luminance 1 here too, so no further factor stands between a file and a Scene.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from clpt import spectra
from clpt.errors import SceneError, UnknownKindError
from clpt.formats.pbrt.params import Parameter, Parameters
from clpt.formats.pbrt.state import State
from clpt.formats.reading import colour
from clpt.scene.roles import EMISSION, REFLECTANCE, ROUNDING, Spectral
from clpt.spectra import Blackbody, Spectrum, Tabulated, cie, scaled, spaces

SPACES = {"srgb": "rec709", "rec2020": "rec2020", "dci-p3": "display_p3"}
ACES = "aces2065-1"
AP0 = ((0.7347, 0.2653), (0.0, 1.0), (0.0001, -0.077))  # SMPTE ST 2065-1
WIEN = 2.8977721e6  # wavelength [nm] of a black body's maximum, times its temperature [K]
CUT = 1e-3  # by how much a colour may be changed without a warning
SPECTRUM_TYPES = ("rgb", "spectrum", "blackbody")
GLASSES = {  # what pbrt's tables hold, which is not always what their name says
    "glass-BK7": "n-bk7",
    "glass-BAF10": "n-baf10",
    "glass-FK51A": "n-fk51a",
    "glass-LASF9": "n-lasf9",
    "glass-F5": "n-sf5",
    "glass-F10": "n-sf10",
    "glass-F11": "sf11",
}
TEXTURE = Spectral("texture", colour=None)  # what textures are made of


def spectrum(
    params: Parameters, name: str, role: Spectral, state: State, default: object = None
) -> Any:
    """Take a number or a spectrum in the role of a parameter of clpt; `default` if omitted.

    role: TEXTURE for the operands of a texture. An emission gets luminance 1, or its colour's
    luminance. Raises SceneError with the location.
    """
    values = params.find(name, "float", *SPECTRUM_TYPES)
    if values is None:
        return default
    with values.locating():
        return value_of(values, role, state)


def value_of(values: Parameter, role: Spectral, state: State) -> Any:
    """Return the value in a role of a parameter whose type is "float" or among SPECTRUM_TYPES."""
    if values.type == "float":
        return values.numbers(1)[0]
    if values.type == "rgb":
        return _rgb(values, role, state)
    if values.type == "blackbody" and state.shared.old:
        result: Spectrum = _peaked(values)
    elif values.type == "blackbody":
        result = Blackbody(values.numbers(1)[0], normalised=True)
    elif values.is_text:
        result = _named(values.text(), role, state)
    else:
        result = _pairs(values.numbers(), role)
    if role is REFLECTANCE:
        result = _limited(values, result, state)
    return _of_luminance_one(result) if role is EMISSION and not state.shared.old else result


def _limited(values: Parameter, result: Spectrum, state: State) -> Spectrum:
    """Return a reflectance that is cut off at 1, as in pbrt, with a warning."""
    table = (
        result if isinstance(result, Tabulated) else Tabulated(cie.GRID, result.sample(cie.GRID))
    )
    if max(table.values) <= 1.0 + ROUNDING:
        return result
    state.warn(values, "exceeds 1 and is cut off")
    return replace(table, values=tuple(min(float(value), 1.0) for value in table.values))


def _peaked(entries: Parameter) -> Spectrum:
    """Return a black body whose maximum is the second number: pbrt-v3, src/core/paramset.cpp."""
    values = entries.numbers()
    if len(values) not in (1, 2) or not values[0] > 0.0:
        raise SceneError("a black body is a temperature [K] above 0 and a scale")
    peak = Blackbody(values[0]).sample(np.array([WIEN / values[0]]))[0]
    return Blackbody(values[0], (values[1] if len(values) == 2 else 1.0) / float(peak))


def to_rec709(rgb: object, space: str, *, light: bool) -> Any:
    """Colours (..., 3) of a space as linear Rec. 709; white stays white but for `light`."""
    if space == ACES:
        white = spaces.xyz_of(spaces.D60_ACES)
        to_xyz = cie.primaries_to_xyz(AP0, white)
        adapted = np.eye(3) if light else spaces.bradford(white, cie.D65_WHITE)
        matrix = cie.XYZ_TO_REC709 @ adapted @ to_xyz
    elif space in SPACES:
        matrix = spaces.between(SPACES[space], "rec709")
    else:
        raise UnknownKindError("colour space", space, (*SPACES, ACES))
    return np.asarray(rgb, np.float64) @ matrix.T if space != "srgb" else np.asarray(rgb)


def _rgb(values: Parameter, role: Spectral, state: State) -> Any:
    rgb = values.numbers(3)
    if min(rgb) < 0.0:
        raise SceneError("a colour cannot be negative")
    if role is REFLECTANCE and max(rgb) > 1.0 and state.shared.old:
        state.warn(values, "exceeds 1 and is cut off")
        rgb = [min(value, 1.0) for value in rgb]
    if role is REFLECTANCE and max(rgb) > 1.0:
        raise SceneError("a colour that is reflected cannot exceed 1")
    ours = to_rec709(rgb, state.colour_space, light=role is EMISSION)
    clipped = np.clip(ours, 0.0, 1.0 if role is REFLECTANCE else None)
    if np.abs(clipped - ours).max() > CUT:
        state.warn(values, "this colour lies outside Rec. 709, and what exceeds that is cut off")
    result = tuple(clipped.tolist())
    return colour(role, result)


def _pairs(values: list[float], role: Spectral) -> Tabulated:
    if len(values) % 2 or not values:
        raise SceneError("a spectrum is pairs of a wavelength [nm] and a value")
    return Tabulated(values[0::2], values[1::2], _outside(role))


def _outside(role: Spectral) -> Any:
    """An index goes on as it ends; whatever is reflected or emitted is zero beyond, as in pbrt."""
    return "hold" if role.measured else "zero"


def _named(text: str, role: Spectral, state: State) -> Spectrum:
    known = named(text)
    if known is not None:
        return known
    path = state.file(text)
    if not path.is_file():
        raise UnknownKindError("spectrum (and no file)", text, names())
    return spectra.read_table(path, _outside(role))


@cache
def named(name: str) -> Spectrum | None:
    """Return a spectrum that pbrt names, such as metal-Cu-eta or stdillum-D65; else None."""
    start, _, others = name.partition("-")
    if start == "metal":
        metal, _, part = others.rpartition("-")
        if metal in spectra.metals() and part in ("eta", "k"):
            return spectra.metal(metal)[0 if part == "eta" else 1]
    if name in GLASSES:
        return spectra.glass(GLASSES[name])
    if start == "stdillum" and others in spectra.illuminants():
        return spectra.illuminant(others)
    return _aces_d60() if name == "illum-acesD60" else None


def names() -> list[str]:
    """The names that `named` knows."""
    metals = [f"metal-{name}-{part}" for name in spectra.metals() for part in ("eta", "k")]
    lamps = [f"stdillum-{name}" for name in spectra.illuminants()]
    return [*metals, *GLASSES, *lamps, "illum-acesD60"]


def _aces_d60() -> Spectrum:
    """The white of ACES from its neighbours on the daylight locus, D50 and D65."""
    lamps = [spectra.illuminant(name).sample(cie.GRID) for name in ("D50", "D65")]
    wanted = spaces.xyz_of(spaces.D60_ACES)
    shares = np.linalg.lstsq(cie.spectrum_to_xyz(lamps).T, wanted, rcond=None)[0]
    return Tabulated(cie.GRID, shares @ lamps)


def _of_luminance_one(result: Spectrum) -> Spectrum:
    luminance = float(cie.spectrum_to_xyz(result.sample(cie.GRID))[1])
    if not luminance > 0.0:
        raise SceneError("this spectrum is dark, so pbrt cannot scale it to luminance 1")
    return scaled(result, 1.0 / luminance)
