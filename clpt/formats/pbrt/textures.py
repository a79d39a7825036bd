"""Textures of a PBRT scene: each becomes a Texture, or a plain value where it is constant.

pbrt's images have v = 1 in their top row, as ours. It filters them with MIP maps, which the many
samples of a pixel do here.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from clpt.errors import SceneError, UnknownKindError
from clpt.formats.pbrt.mapped import mapped
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.spectra import SPECTRUM_TYPES, spectrum, value_of
from clpt.formats.pbrt.state import Definition, State
from clpt.scene.textures import Bitmap, Checkerboard, Mix, Product, Texture
from clpt.spectra import Spectrum

WRAPS = {"repeat": "repeat", "black": "zero", "clamp": "clamp", "octahedralsphere": "clamp"}
FILTERS = {"point": "nearest", **dict.fromkeys(("bilinear", "trilinear", "ewa"), "bilinear")}


def textured(params: Parameters, name: str, role: str, state: State, default: Any = None) -> Any:
    """Take a value or a texture in a role of ours; a "real" is a number or a float texture.

    A texture is made once for all that name it. Raises SceneError with the place.
    """
    form = "float" if role == "real" else "spectrum"
    given = params.find(name, "texture", "float", *(SPECTRUM_TYPES if form == "spectrum" else ()))
    if given is None:
        return default
    if given.type != "texture":
        with given.placed():
            return value_of(given, role, state)
    found = state.texture(form, given.text(), given)
    return state.shared.once(found, given, lambda: _texture(form, found))


def _texture(form: str, found: Definition) -> Any:
    kind, params, state = found.kind, found.params, found.state
    if kind not in MAKERS:
        raise UnknownKindError("texture", kind, MAKERS, **params.place)
    with params.placed():
        made = MAKERS[kind](form, params, state)
    for extra in params.unused():
        state.warn(extra, "is not known here and is passed over")
    return made


def normals(file: str, state: State) -> Bitmap:
    """The image of a normal map, whose colours are read as they are."""
    return Bitmap(image=state.file(file), raw=True)


def _argument(form: str, params: Parameters, name: str, state: State, default: float) -> Any:
    return textured(params, name, "real" if form == "float" else "texture", state, default)


def _constant(form: str, params: Parameters, state: State) -> Any:
    if form == "float":
        return params.one("value", "float", 1.0)
    return spectrum(params, "value", "texture", state, 1.0)


def _scale(form: str, params: Parameters, state: State) -> Any:
    first = _argument(form, params, "tex", state, 1.0)
    second = textured(params, "scale", "real", state, 1.0)
    if not isinstance(first, Texture) and not isinstance(second, Texture):
        return mapped(first, lambda v: v * second)
    return first if second == 1.0 else Product(first=first, second=second)


def _mix(form: str, params: Parameters, state: State) -> Any:
    return Mix(
        first=_argument(form, params, "tex1", state, 0.0),
        second=_argument(form, params, "tex2", state, 1.0),
        amount=textured(params, "amount", "real", state, 0.5),
    )


def _direction_mix(form: str, params: Parameters, state: State) -> Any:
    params.one("dir", "vector3", (0.0, 1.0, 0.0))
    state.warn(params, "'directionmix' is taken as an even mixture, whatever the direction")
    return Mix(
        first=_argument(form, params, "tex1", state, 0.0),
        second=_argument(form, params, "tex2", state, 1.0),
        amount=0.5,
    )


def _bilerp(form: str, params: Parameters, state: State) -> Any:
    def corner(name: str, default: float) -> Any:
        if form == "float":
            return [params.one(name, "float", default)]
        value = spectrum(params, name, "texture", state, default)
        if isinstance(value, Spectrum):
            value = value.to_rgb("unbounded")
        return np.broadcast_to(value, 3).tolist()

    top, bottom = [corner("v01", 1.0), corner("v11", 1.0)], [corner("v00", 0.0), corner("v10", 0.0)]
    centres = np.array([[0.5, 0.0, 0.25], [0.0, 0.5, 0.25], [0.0, 0.0, 1.0]])
    return Bitmap(
        image=np.array([top, bottom], np.float32),
        raw=True,
        wrap="clamp",
        to_uv=centres @ _to_uv(params, state),
    )


def _checkerboard(form: str, params: Parameters, state: State) -> Any:
    if params.one("dimension", "integer", 2) != 2:
        state.warn(params, "a checkerboard in three dimensions is taken as an even mixture")
        ends = [
            _argument(form, params, name, state, v) for name, v in (("tex1", 1.0), ("tex2", 0.0))
        ]
        return Mix(first=ends[0], second=ends[1], amount=0.5)
    halved = np.diag([0.5, 0.5, 1.0])
    return Checkerboard(
        color0=_argument(form, params, "tex1", state, 1.0),
        color1=_argument(form, params, "tex2", state, 0.0),
        to_uv=halved @ _to_uv(params, state),
    )


def _imagemap(form: str, params: Parameters, state: State) -> Any:
    file = state.file(params.one("filename", "string", ""))
    if not file.is_file():
        raise SceneError(f"there is no image {str(file.name)!r}")
    wrap = params.choice("wrap", "repeat", WRAPS)
    if wrap == "octahedralsphere":
        state.warn(params, "wrap 'octahedralsphere' is taken as 'clamp'")
    params.one("maxanisotropy", "float", 8.0)
    made = Bitmap(
        image=file,
        filter=FILTERS[params.choice("filter", "bilinear", FILTERS)],
        wrap=WRAPS[wrap],
        channel="r" if form == "float" else "luminance",
        to_uv=_to_uv(params, state),
    )
    encoding = params.one("encoding", "string", "sRGB")
    if file.suffix.lower() == ".png":  # of other files pbrt passes over the encoding
        made = _decoded(made, encoding)
    scale, invert = params.one("scale", "float", 1.0), params.one("invert", "bool", False)
    if scale == 1.0 and not invert:
        return made
    return mapped(made, lambda v: np.maximum(1.0 - scale * v if invert else scale * v, 0.0))


def _decoded(bitmap: Bitmap, encoding: str) -> Bitmap:
    if encoding == "sRGB":
        return bitmap
    bitmap = replace(bitmap, raw=True)
    if encoding == "linear":
        return bitmap
    gamma = re.fullmatch(r"gamma\s+([\d.]+)", encoding)
    if gamma is None:
        raise SceneError(f"encoding must be sRGB, linear or 'gamma 2.2', not {encoding!r}")
    return mapped(bitmap, lambda v: v ** float(gamma[1]))


def _dots(form: str, params: Parameters, state: State) -> Any:
    """Half of the unit cells have a dot of radius 0.35 somewhere within."""
    params.ignore("mapping", "uscale", "vscale", "udelta", "vdelta", "v1", "v2")
    state.warn(params, "dots are taken as the even mixture that they make from afar")
    inside = _argument(form, params, "inside", state, 1.0)
    outside = _argument(form, params, "outside", state, 0.0)
    return Mix(first=outside, second=inside, amount=0.5 * np.pi * 0.35**2)


def _noise(form: str, params: Parameters, state: State) -> float:
    """Noise and wind go up and down around 0."""
    params.ignore("octaves", "roughness")
    state.warn(params, "noise is not supported: its mean, 0, is taken")
    return 0.0


def _wrinkled(form: str, params: Parameters, state: State) -> float:
    octaves, omega = params.one("octaves", "integer", 8), params.one("roughness", "float", 0.5)
    mean = 0.2 * sum(omega**i for i in range(min(max(octaves, 0), 64)))
    state.warn(params, f"noise is not supported: its mean, {mean:.2g}, is taken")
    return float(mean)


def _marble(form: str, params: Parameters, state: State) -> Any:
    params.ignore("octaves", "roughness", "scale", "variation")
    state.warn(params, "marble is not supported: its light grey is taken")
    return 0.85 if form == "float" else (0.85, 0.85, 0.88)


def _ptex(form: str, params: Parameters, state: State) -> Any:
    raise params.error(f"Ptex textures are not supported: {params.one('filename', 'string', '')!r}")


def _to_uv(params: Parameters, state: State) -> np.ndarray:
    mapping = params.choice("mapping", "uv", ("uv", "spherical", "cylindrical", "planar"))
    offsets = [params.one(name, "float", 0.0) for name in ("udelta", "vdelta")]
    if mapping == "planar":
        params.ignore("v1", "v2")
    if mapping != "uv":
        state.warn(params, f"the mapping {mapping!r} is not supported, the surface's uv are taken")
    scales = [params.one(name, "float", 1.0) for name in ("uscale", "vscale")]
    return np.array([[scales[0], 0.0, offsets[0]], [0.0, scales[1], offsets[1]], [0.0, 0.0, 1.0]])


MAKERS: dict[str, Callable[[str, Parameters, State], Any]] = {
    "constant": _constant,
    "scale": _scale,
    "mix": _mix,
    "directionmix": _direction_mix,
    "bilerp": _bilerp,
    "checkerboard": _checkerboard,
    "imagemap": _imagemap,
    "dots": _dots,
    "fbm": _noise,
    "windy": _noise,
    "wrinkled": _wrinkled,
    "marble": _marble,
    "ptex": _ptex,
}
