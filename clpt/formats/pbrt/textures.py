"""A function applied to the value of a parameter, whatever stands for it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images, transforms
from clpt.errors import SceneError, UnknownKindError
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.spectra import SPECTRUM_TYPES, TEXTURE, spectrum, value_of
from clpt.formats.pbrt.state import Definition, State
from clpt.formats.reading import EVEN, GREY
from clpt.images import Stored
from clpt.scene.params import fields_of
from clpt.scene.roles import REAL, Role, Spectral
from clpt.scene.textures import (
    MAPPINGS,
    MOST_OCTAVES,
    Bitmap,
    Checkerboard,
    Checkers,
    Dots,
    Marble,
    Mix,
    Noise,
    Product,
    Texture,
    Voxels,
)
from clpt.spectra import RGB, Constant, RGBUnbounded, Spectrum, Tabulated, cie


def map_values(value: object, function: Callable[[Any], Any], *, bytes_stay: bool = False) -> Any:
    """Apply a function to a number, a colour, a spectrum or a texture.

    It is applied to both ends of a mixture and of a pattern of numbers, and to both factors of a
    product, which is right for powers. bytes_stay: keep sRGB images of 8 bits as such, a quarter as
    large as floats; the function must not leave [0, 1].
    """
    if isinstance(value, tuple):
        return tuple(float(function(v)) for v in value)
    if isinstance(value, (RGB, RGBUnbounded)):
        return type(value)(*(float(function(v)) for v in (value.r, value.g, value.b)))
    if isinstance(value, Constant):
        return Constant(float(function(value.value)))
    if isinstance(value, Spectrum):
        return Tabulated(cie.GRID, function(value.sample(cie.GRID)), "hold")
    if isinstance(value, Bitmap):
        return _bitmap(value, function, bytes_stay)
    if isinstance(value, Voxels):
        return replace(value, values=function(np.asarray(value.values, np.float64)))
    if isinstance(value, Texture) and type(value) not in ENDS:  # patterns between 0 and 1
        return Mix(first=float(function(0.0)), second=float(function(1.0)), amount=value)
    if isinstance(value, Texture):
        names = ENDS[type(value)]
        values = fields_of(value)
        ends = [map_values(values[name], function, bytes_stay=bytes_stay) for name in names]
        return replace(value, **dict(zip(names, ends, strict=True)))
    return float(function(value))


ENDS: dict[type[Texture], tuple[str, ...]] = {
    Checkerboard: ("color0", "color1"),
    Mix: ("first", "second"),
    Product: ("first", "second"),
}


def _bitmap(bitmap: Bitmap, function: Callable[[Any], Any], bytes_stay: bool) -> Bitmap:
    image = bitmap.image
    if isinstance(image, (str, Path)):
        stored = images.read_stored(image)
        images.log_notes(image, stored, raw=bitmap.raw)
    else:
        values = np.asarray(image)
        stored = images.Stored(values, encoded=values.dtype == np.uint8)
    stored = stored.meant(raw=bitmap.raw)
    values = stored.values
    if bytes_stay and values.dtype == np.uint8 and stored.encoded and not bitmap.raw:
        levels = images.srgb_to_linear(np.arange(256, dtype=np.float32) / np.float32(255.0))
        codes = images.linear_to_srgb(function(levels).astype(np.float32))
        return replace(bitmap, image=np.round(255.0 * codes).astype(np.uint8)[values[..., :3]])
    result = function(stored.decoded(linear=not bitmap.raw))
    return replace(bitmap, image=result.astype(np.float32), raw=True)


Values = Any  # a number, a colour or a texture
IDENTITY_UV = np.eye(3)
SRGB = "sRGB"
WRAPS = {"repeat": "repeat", "black": "zero", "clamp": "clamp", "octahedralsphere": "clamp"}
FLOATS = (".exr", ".hdr", ".pfm")  # whose numbers are no colours where a float is asked for
FILTERS = {"point": "nearest", "bilinear": "bilinear", "trilinear": "trilinear", "ewa": "trilinear"}


def textured(
    params: Parameters, name: str, role: Role, state: State, default: object = None
) -> Any:
    """Take a value or a texture in a role of ours; REAL is a number or a float texture.

    A texture is made once for all parameters that name it. Raises SceneError with the location.
    """
    form = "float" if role is REAL else "spectrum"
    values = params.find(name, "texture", "float", *(SPECTRUM_TYPES if form == "spectrum" else ()))
    if values is None:
        return default
    if values.type != "texture":
        used = role if isinstance(role, Spectral) else TEXTURE  # a number is the same in all
        with values.locating():
            return value_of(values, used, state)
    defined = state.latest(state.shared.textures.get((form, values.text()))) is not None
    if state.shared.old and not defined:
        state.warn(values, f"there is no {form} texture {values.text()!r}: the default counts")
        return default
    definition = state.texture(form, values.text(), values)
    return state.shared.once(definition, values, lambda: _texture(form, definition))


def _texture(form: str, definition: Definition) -> Any:
    kind, params, state = definition.kind, definition.params, definition.state
    if kind not in MAKERS:
        raise UnknownKindError("texture", kind, MAKERS, **params.location())
    with params.locating():
        result = MAKERS[kind](form, params, state)
    for extra in params.unused():
        state.warn(extra, "is not known here and is left out")
    return result


def normals(file: str, state: State) -> Bitmap:
    """The image of a normal map, whose colours are read as they are."""
    path = state.image(file)
    return Bitmap(image=EVEN if path is None else path, raw=True)


def _argument(form: str, params: Parameters, name: str, state: State, default: float) -> Any:
    return textured(params, name, REAL if form == "float" else TEXTURE, state, default)


def _constant(form: str, params: Parameters, state: State) -> Any:
    if form == "float":
        return params.one("value", "float", 1.0)
    return spectrum(params, "value", TEXTURE, state, 1.0)


def _scale(form: str, params: Parameters, state: State) -> Any:
    if state.shared.old:
        names = ("tex1", "tex2")
        first, second = (_argument(form, params, name, state, 1.0) for name in names)
        return _product(first, second)
    first = _argument(form, params, "tex", state, 1.0)
    second = textured(params, "scale", REAL, state, 1.0)
    if not isinstance(first, Texture) and not isinstance(second, Texture):
        return map_values(first, lambda v: v * second)
    return first if second == 1.0 else Product(first=first, second=second)


def _product(first: Values, second: Values) -> Values:
    """Return the product of two values or textures, as in versions 2 and 3."""
    if isinstance(first, Texture) or isinstance(second, Texture):
        return Product(first=first, second=second)
    if not isinstance(first, Spectrum) and not isinstance(second, Spectrum):
        product = np.multiply(first, second)
        return tuple(product.tolist()) if product.ndim else float(product)
    pair = (v.to_rgb("unbounded") if isinstance(v, Spectrum) else v for v in (first, second))
    return tuple(np.broadcast_to(np.multiply(*pair), 3).tolist())


def _mix(form: str, params: Parameters, state: State) -> Any:
    return Mix(
        first=_argument(form, params, "tex1", state, 0.0),
        second=_argument(form, params, "tex2", state, 1.0),
        amount=textured(params, "amount", REAL, state, 0.5),
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
        value = spectrum(params, name, TEXTURE, state, default)
        if isinstance(value, Spectrum):
            value = value.to_rgb("unbounded")
        return np.broadcast_to(value, 3).tolist()

    top, bottom = [corner("v01", 1.0), corner("v11", 1.0)], [corner("v00", 0.0), corner("v10", 0.0)]
    centres = np.array([[0.5, 0.0, 0.25], [0.0, 0.5, 0.25], [0.0, 0.0, 1.0]])
    return Bitmap(
        image=np.array([top, bottom], np.float32),
        raw=True,
        wrap="clamp",
        **_mapping(params, state, centres),
    )


def _uv(form: str, params: Parameters, state: State) -> Any:
    """Versions 2 and 3: u is red and v is green, each without its whole part."""
    if form == "float":
        raise params.error("has colours, no numbers")
    image = np.array([[[0, 1, 0], [1, 1, 0]], [[0, 0, 0], [1, 0, 0]]], np.float32)
    centres = np.array([[0.5, 0.0, 0.25], [0.0, 0.5, 0.25], [0.0, 0.0, 1.0]])
    return Bitmap(image=image, raw=True, wrap="clamp", **_mapping(params, state, centres))


def _checkerboard(form: str, params: Parameters, state: State) -> Any:
    if params.one("dimension", "integer", 2) != 2:
        return Mix(
            first=_argument(form, params, "tex1", state, 1.0),
            second=_argument(form, params, "tex2", state, 0.0),
            amount=Checkers(to_texture=transforms.inverse(state.ctm)),
        )
    halved = np.diag([0.5, 0.5, 1.0])
    return Checkerboard(
        color0=_argument(form, params, "tex1", state, 1.0),
        color1=_argument(form, params, "tex2", state, 0.0),
        **_mapping(params, state, halved),
    )


def _imagemap(form: str, params: Parameters, state: State) -> Any:
    file = state.image(params.one("filename", "string", ""))
    wrap = params.choice("wrap", "repeat", WRAPS)
    if wrap == "octahedralsphere":
        state.warn(params, "wrap 'octahedralsphere' is taken as 'clamp'")
    params.one("maxanisotropy", "float", 8.0)
    params.ignore(*(("trilinear",) if state.shared.old else ()))
    usual = "trilinear" if state.shared.old else "bilinear"
    result = Bitmap(
        image=GREY if file is None else file,
        filter=FILTERS[params.choice("filter", usual, FILTERS)],
        wrap=WRAPS[wrap],
        channel="r" if form == "float" and not state.shared.old else "luminance",
        raw=form == "float" and file is not None and file.suffix.lower() in FLOATS,
        **_mapping(params, state),
    )
    bilinear = params.choice("filter", usual, FILTERS) in ("bilinear", "trilinear")
    encoding = _old_encoding(params) if state.shared.old else params.one("encoding", "string", SRGB)
    suffixes = (".png", ".tga") if state.shared.old else (".png",)
    if file is not None and file.suffix.lower() in suffixes:  # pbrt ignores it in other files
        result = _decoded(result, encoding)
    if state.shared.old:
        bilinear = False  # its number is the luminance
    if file is not None and form == "float" and bilinear:
        result = _number(result, state)
    scale, invert = params.one("scale", "float", 1.0), params.one("invert", "bool", False)
    if file is None or (scale == 1.0 and not invert):
        return result
    return map_values(result, lambda v: np.maximum(1.0 - scale * v if invert else scale * v, 0.0))


def _old_encoding(params: Parameters) -> str:
    """Take the `gamma` of version 3, a truth, or of version 2, an exponent."""
    parameter = params.find("gamma", "bool", "float")
    if parameter is None:
        return SRGB
    if parameter.type == "float":
        gamma = parameter.numbers(1)[0]
        return "linear" if gamma == 1.0 else f"gamma {gamma:g}"
    return SRGB if parameter.truth() else "linear"


def _number(bitmap: Bitmap, state: State) -> Bitmap:
    """An image of the number that pbrt-v4 takes between texels (MIPMap::Bilerp of a Float).

    It is alpha where that is not 1 everywhere, else the mean of red, green and blue. Alpha went
    through the transfer that colours did. Filters "point" and "ewa" take red (MIPMap::Texel).
    """
    if isinstance(bitmap.image, np.ndarray):
        stored = Stored(bitmap.image, encoded=False)
    else:
        stored = images.read_stored(Path(str(bitmap.image)))
    values = stored.values
    if values.shape[2] == 1:
        return bitmap
    for note in stored.notes_of(bitmap.raw):
        state.tell(f"{bitmap.image}: {note}")
    opaque = 255 if values.dtype == np.uint8 else 1.0
    if values.shape[2] == 4 and (values[..., 3] != opaque).any():
        chosen = replace(stored, values=values[..., 3:])
    elif (values[..., :3] == values[..., :1]).all():
        chosen = replace(stored, values=values[..., :1])
    else:
        colours = replace(stored, values=values[..., :3]).decoded(not bitmap.raw)
        return replace(bitmap, image=colours.mean(axis=2, keepdims=True), raw=True)
    if values.dtype == np.uint8 and stored.gamma is None:  # bytes stay small
        return replace(bitmap, image=chosen.values)
    return replace(bitmap, image=chosen.decoded(not bitmap.raw), raw=True)


def _decoded(bitmap: Bitmap, encoding: str) -> Bitmap:
    if encoding == SRGB:
        return bitmap
    bitmap = replace(bitmap, raw=True)
    if encoding == "linear":
        return bitmap
    gamma = re.fullmatch(r"gamma\s+([\d.]+)", encoding)
    if gamma is None:
        raise SceneError(f"encoding must be sRGB, linear or 'gamma 2.2', not {encoding!r}")
    return map_values(bitmap, lambda v: v ** float(gamma[1]))


def _dots(form: str, params: Parameters, state: State) -> Any:
    """In pbrt "inside" surrounds the dots: src/textures/dots.cpp swaps both, as does pbrt-v4."""
    return Mix(
        first=_argument(form, params, "inside", state, 1.0),
        second=_argument(form, params, "outside", state, 0.0),
        amount=Dots(**_mapping(params, state)),
    )


def _noise(form: str, params: Parameters, state: State) -> Noise:
    return Noise(pattern="fbm", **_octaves(params), to_texture=transforms.inverse(state.ctm))


def _wrinkled(form: str, params: Parameters, state: State) -> Noise:
    return Noise(pattern="wrinkled", **_octaves(params), to_texture=transforms.inverse(state.ctm))


def _windy(form: str, params: Parameters, state: State) -> Noise:
    return Noise(pattern="windy", to_texture=transforms.inverse(state.ctm))


def _marble(form: str, params: Parameters, state: State) -> Marble:
    return Marble(
        **_octaves(params),
        scale=params.one("scale", "float", 1.0),
        variation=params.one("variation", "float", 0.2),
        to_texture=transforms.inverse(state.ctm),
    )


def _octaves(params: Parameters) -> dict[str, Any]:
    octaves = params.one("octaves", "integer", 8)
    return {
        "octaves": min(max(octaves, 1), MOST_OCTAVES),
        "roughness": params.one("roughness", "float", 0.5),
    }


def _ptex(form: str, params: Parameters, state: State) -> Any:
    name = params.one("filename", "string", "")
    raise params.error(
        f"Ptex textures are not supported: {name!r} has an image for each face of a mesh of "
        "quadrilaterals, and meshes are triangles here; bake it into an image by uv"
    )


def _mapping(params: Parameters, state: State, before: Any = IDENTITY_UV) -> dict[str, Any]:
    """Take a texture's mapping; `before`: transform (3, 3) of pbrt's uv."""
    mapping = params.choice("mapping", "uv", MAPPINGS)
    to_uv, plane = np.eye(3), np.eye(4)
    if mapping in ("uv", "planar"):
        to_uv[:2, 2] = [params.one(name, "float", 0.0) for name in ("udelta", "vdelta")]
    if mapping == "uv":
        scales = [params.one(name, "float", 1.0) for name in ("uscale", "vscale")]
        to_uv[0, 0], to_uv[1, 1] = scales
        return {"to_uv": before @ to_uv}
    if mapping == "planar":
        plane[0, :3] = params.one("v1", "vector3", (1.0, 0.0, 0.0))
        plane[1, :3] = params.one("v2", "vector3", (0.0, 1.0, 0.0))
    to_texture = plane @ transforms.inverse(state.ctm)
    return {"to_uv": before @ to_uv, "mapping": mapping, "to_texture": to_texture}


MAKERS = {
    "constant": _constant,
    "scale": _scale,
    "mix": _mix,
    "directionmix": _direction_mix,
    "bilerp": _bilerp,
    "uv": _uv,
    "checkerboard": _checkerboard,
    "imagemap": _imagemap,
    "dots": _dots,
    "fbm": _noise,
    "windy": _windy,
    "wrinkled": _wrinkled,
    "marble": _marble,
    "ptex": _ptex,
}
