"""Colours, spectra and textures of a Mitsuba scene.

An <rgb> or a number in an emitter is a multiple of D65; a <spectrum> there is taken as it is.
Mitsuba's bitmaps have v = 0 in their top row, ours in the bottom row; `to_uv` flips them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from clpt import images, spectra
from clpt.errors import UnknownKindError
from clpt.formats.mitsuba import grids
from clpt.formats.mitsuba.properties import (
    Context,
    PluginReader,
    Properties,
    number,
    numbers,
    triple,
    unknown,
)
from clpt.formats.mitsuba.spectrum_plugins import PLAIN
from clpt.formats.mitsuba.xml import Element
from clpt.formats.reading import GREY, attempt, colour
from clpt.scene.roles import COEFFICIENT, EMISSION, FACTOR, INDEX, REFLECTANCE, Spectral
from clpt.scene.textures import (
    ATTRIBUTES,
    Bitmap,
    Checkerboard,
    MeshAttribute,
    Mix,
    Product,
    Texture,
)
from clpt.spectra import RGB, Blackbody, Constant, RGBIlluminant, RGBUnbounded, Spectrum, Tabulated
from clpt.spectra.spectrum import WIDEST, Outside

LUMINANCE = (0.212671, 0.715160, 0.072169)  # of Rec. 709, as Mitsuba has it
VOLUMES = ("constvolume", "gridvolume")
WRAPS = ("repeat", "clamp", "mirror", "zero")
CHANNELS = ("luminance", "r", "g", "b", "a")
GRID_TEXELS = 1024  # of a side of the image of a `gridtexture`
TOP_DOWN = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]])


def reflectance(props: Properties, name: str, default: float) -> Any:
    """Take a reflectance: a number, a colour, a spectrum or a texture."""
    return _take(props, name, REFLECTANCE, default)


def emission(props: Properties, name: str, *, textured: bool = False) -> Any:
    """Take an emitted spectrum, D65 where none is given."""
    value = _take(props, name, EMISSION, RGBIlluminant(1.0, 1.0, 1.0))
    if isinstance(value, Texture) and not textured:
        raise props.element.error(f"{name!r} cannot be a texture")
    return value


def index(props: Properties, name: str, default: object) -> Any:
    """Take an optical constant of a conductor: a number, a colour, a spectrum or a texture."""
    return _take(props, name, INDEX, default)


def factor(props: Properties, name: str, default: object) -> Any:
    """Take a spectrum without limits: a number, a colour, a spectrum or a texture."""
    return _take(props, name, FACTOR, default)


def coefficient(props: Properties, name: str, default: float = 0.0) -> Any:
    """Take a coefficient of a medium [1/m]: a number, a colour or a spectrum."""
    value = _take(props, name, COEFFICIENT, default)
    if isinstance(value, Texture):
        raise props.element.error(f"{name!r} cannot be a texture")
    if type(value) is RGBUnbounded and max(value.r, value.g, value.b) <= 1.0:
        return RGB(value.r, value.g, value.b)  # whose spectrum is Mitsuba's: that of a reflectance
    return value


def ior(props: Properties, name: str, default: str) -> Any:
    """Take a refractive index: a number, a name (without dispersion, as Mitsuba), or a spectrum."""
    child = props.take(name)
    if child is None:
        return spectra.glass(default, dispersion=False)
    if child.tag == "spectrum":
        with child.locating():
            return _spectrum(child, INDEX, props, name)
    if child.tag == "string":
        with child.locating():
            return spectra.glass(child.attribute("value"), dispersion=False)
    return number(child)


def over(value: float | Spectrum | Texture, divisor: float) -> float | Spectrum | Texture:
    """Return what `index` gives, divided by a number."""
    if divisor == 1.0:
        return value
    if isinstance(value, Texture):
        return _scaled(value, 1.0 / divisor)
    if isinstance(value, RGBUnbounded):
        return RGBUnbounded(*(value.to_rgb() / divisor))
    if isinstance(value, Spectrum):
        if not isinstance(value, (Constant, Tabulated)):
            value = Tabulated(WIDEST, value.sample(WIDEST), "hold")
        return spectra.scaled(value, 1.0 / divisor)
    return value / divisor


def real(props: Properties, name: str, default: float) -> float | Texture:
    """Take a number or a texture of numbers."""
    child = props.take(name)
    if child is None:
        return default
    target = props.context.resolve(child)
    with target.locating():
        result = _value(target, FACTOR, props, name)
    if isinstance(result, Constant):
        return result.value
    if isinstance(result, RGBUnbounded):
        return float(np.dot(LUMINANCE, (result.r, result.g, result.b)))
    if not isinstance(result, (float, Texture)):
        raise target.error("must be a number or a texture")
    if isinstance(result, Checkerboard):  # Mitsuba swaps its colours where it reads numbers
        return replace(result, color0=result.color1, color1=result.color0)
    return result


def _take(props: Properties, name: str, role: Spectral, default: object) -> Any:
    child = props.take(name)
    if child is None:
        return default
    target = props.context.resolve(child)
    with target.locating():
        return _value(target, role, props, name)


def _value(element: Element, role: Spectral, props: Properties, name: str) -> Any:
    """Make a colour, a spectrum or a texture; Mitsuba writes the last two alike."""
    if element.tag == "volume":
        return _volume(element, role, props.context)
    if element.type == "volume":
        return _held(element, role, props.context)
    if element.type in TEXTURES or (element.tag == "texture" and element.type not in PLUGINS):
        return texture(element, props)
    return _spectrum(element, role, props, name)


def _held(element: Element, role: Spectral, context: Context) -> Any:
    """Make the value of the volume that a <texture type="volume"> holds."""
    outer = Properties(element, context)
    child = outer.take("volume")
    outer.finish()
    if child is None:
        raise element.error("needs the parameter 'volume'")
    volume = context.resolve(child)
    if volume.tag != "volume":
        raise volume.error("must be a <volume>")
    return _volume(volume, role, context)


def _volume(element: Element, role: Spectral, context: Context) -> Any:
    """Make the value of a volume: a constant, or a texture by a grid."""
    if element.type == "gridvolume":
        return grids.voxels(element, context)
    if element.type != "constvolume":
        raise UnknownKindError("volume", element.type, VOLUMES, **element.location())
    props = Properties(element, context)
    props.placement()
    value = props.take("value")
    props.finish()
    return 1.0 if value is None else _spectrum(context.resolve(value), role, props, "value")


def _spectrum(child: Element, role: Spectral, props: Properties, name: str) -> Any:
    """Make a number, a colour or a spectrum; what lies beyond limits is left to `within`."""
    if child.tag in ("float", "integer"):
        value = number(child)
        return colour(role, [value] * 3) if role is EMISSION else value
    if child.tag in ("rgb", "srgb"):
        return colour(role, _colour(child, props.context))
    if child.tag == "blackbody":
        return _old_blackbody(child)
    if child.tag not in ("spectrum", "texture"):
        raise child.error("must be a number, a colour, a spectrum or a texture")
    if child.type:
        return _plugin(child, role, props)
    outside: Outside = "hold" if role.measured else "zero"
    if "filename" in child.attributes:
        path = props.context.document.find_file(child, child.attributes["filename"])
        if role is INDEX:
            return spectra.read_index(path, "k" if name == "k" else "eta")
        if role is COEFFICIENT:
            return spectra.read_absorption(path)
        return spectra.read_table(path, outside)
    text = child.attribute("value")
    if ":" not in text and props.context.old:
        return _old_numbers(child, role)
    if ":" not in text:
        return Constant(numbers(child, "value", 1)[0])
    points = numbers(_with_attribute(child, "value", text.replace(":", " ")), "value")
    if len(points) % 2:
        raise child.error("value must be pairs like 400:0.1, 700:0.5")
    return Tabulated(points[0::2], points[1::2], outside)


def _old_numbers(child: Element, role: Spectral) -> Any:
    """Read a <spectrum> of Mitsuba 0.x without wavelengths: src/librender/scenehandler.cpp.

    A single number is a multiple of D65 in a light. Three are linear RGB, as the public builds have
    three samples of a spectrum.
    """
    values = numbers(child, "value")
    if len(values) not in (1, 3):
        raise child.error(f"value must be 1 or 3 numbers, not {len(values)}")
    if len(values) == 1 and role is not EMISSION:
        return Constant(values[0])
    return colour(role, values * (3 // len(values)))


def _old_blackbody(child: Element) -> Spectrum:
    """Read the <blackbody temperature="5000K" scale="1"> of Mitsuba 0.x."""
    bare = child.attribute("temperature").strip().rstrip("kK")
    temperature = numbers(_with_attribute(child, "temperature", bare), "temperature", 1)[0]
    scale = numbers(child, "scale", 1)[0] if "scale" in child.attributes else 1.0
    return Blackbody(temperature, scale)


def _with_attribute(child: Element, name: str, value: str) -> Element:
    return Element(child.tag, {**child.attributes, name: value}, child.file, child.line)


def _colour(child: Element, context: Context) -> list[float]:
    """Return linear r, g and b of <rgb value="r, g, b"> or <srgb value="#rrggbb">.

    An <rgb value="#rrggbb"> of Mitsuba 0.x is linear.
    """
    text = child.attribute("value").strip()
    if (child.tag == "srgb" or context.old) and text.startswith("#"):
        try:
            encoded = np.frombuffer(bytes.fromhex(text[1:]), np.uint8) / 255.0
        except ValueError:
            encoded = np.empty(0)
        if encoded.size != 3:
            raise child.error(f"a colour looks like #rrggbb, not {text[:20]!r}")
    else:
        encoded = np.array(numbers(child, "value"))
        if encoded.size == 1:
            encoded = np.repeat(encoded, 3)
        if encoded.size != 3:
            raise child.error(f"a colour has 1 or 3 numbers, not {encoded.size}")
    if child.tag == "srgb":
        curve = ((np.maximum(encoded, 0.0) + 0.055) / 1.055) ** 2.4
        encoded = np.where(encoded <= 0.04045, encoded / 12.92, curve)
    return encoded.tolist()


def nested_textures(props: Properties) -> list[Element]:
    """Take the textures that stand in an object, whatever their names."""
    tags = {name: props.context.resolve(child).tag for name, child in props.named.items()}
    named = [props.take(name) for name, tag in tags.items() if tag == "texture"]
    matches = [props.context.resolve(child) for child in named if child is not None]
    return matches + props.objects("texture")


def _d65(props: Properties) -> Any:
    """D65, times a colour or a texture."""
    matches = nested_textures(props)
    if matches:
        return _scaled(texture(matches[0], props), props.number("scale", 1.0))
    child = props.take("color")
    rgb = _colour(child, props.context) if child is not None else [1.0, 1.0, 1.0]
    scale = props.number("scale", 1.0)
    return colour(EMISSION, [scale * value for value in rgb])


def _srgb(props: Properties) -> Spectrum:
    return RGBUnbounded(*_needed_colour(props))


def _needed_colour(props: Properties) -> list[float]:
    child = props.take("color")
    if child is None:
        raise props.element.error("needs the parameter 'color'")
    return _colour(child, props.context)


def _raw_constant(props: Properties) -> Any:
    """Read a <vector>: a number, or three that become a colour like <rgb> if a colour is needed.

    Mitsuba refuses three in spectral mode.
    """
    child = props.take("value")
    if child is None:
        raise props.element.error("needs the parameter 'value'")
    if child.tag in ("float", "integer"):
        return Constant(number(child))
    if child.tag not in ("vector", "point"):
        raise child.error("must be a <float> or a <vector>")
    return RGBUnbounded(*triple(child, "value", 0.0).tolist())


PLUGINS: dict[str, PluginReader[Any]] = {
    **PLAIN,
    "d65": _d65,
    "srgb": _srgb,
    "rawconstant": _raw_constant,
}


def _plugin(child: Element, role: Spectral, outer: Properties) -> Any:
    if child.type not in PLUGINS:
        raise unknown(child, PLUGINS)
    props = Properties(child, outer.context)
    result = PLUGINS[child.type](props)
    props.finish()
    if role is REFLECTANCE and type(result) is RGBUnbounded:
        return result.r, result.g, result.b
    return result


def texture(element: Element, outer: Properties) -> Texture:
    """Make the texture that an element describes, once for all references."""
    grey: Texture = Bitmap(image=GREY)
    return outer.context.once(element, lambda _: attempt(lambda: _texture(element, outer), grey))


def _texture(element: Element, outer: Properties) -> Texture:
    if element.type not in TEXTURES:
        raise unknown(element, TEXTURES)
    props = Properties(element, outer.context)
    with element.locating():
        result = TEXTURES[element.type](props)
    props.finish()
    return result


def _bitmap(props: Properties) -> Bitmap:
    props.ignore("format", "accel")
    both = props.text("wrap_mode", "repeat", WRAPS)
    along_u = along_v = both
    channel = "luminance"
    if props.context.old:
        along_u, along_v = (props.text(f"wrap_mode_{axis}", both, WRAPS) for axis in "uv")
        channel = props.text("channel", channel, CHANNELS)
    gamma = props.number("gamma", -1.0)  # Mitsuba 0.6's exponent of the texels; -1: sRGB
    bitmap = Bitmap(
        image=props.image(),
        raw=props.flag("raw", gamma == 1.0),
        filter=_filter(props),
        wrap=along_u,
        wrap_v=None if along_v == along_u else along_v,
        channel=channel,
        to_uv=TOP_DOWN @ _to_uv(props),
    )
    if gamma in (-1.0, 0.0, 1.0) or bitmap.raw or bitmap.image is GREY:
        return bitmap
    if gamma < 0.0:
        raise props.element.error(f"gamma must be above 0, or -1 for sRGB, not {gamma:g}")
    return replace(bitmap, image=_powers(bitmap.image, gamma), raw=True)


def _powers(image: Any, gamma: float) -> Any:
    """Return the texels of an image file to the power of gamma, alpha as it is: float32."""
    texels = images.read(image, linear=False).copy()
    colours = texels[..., : 3 if texels.shape[2] > 3 else texels.shape[2]]
    np.power(np.maximum(colours, 0.0), np.float32(gamma), out=colours)
    return texels


def _filter(props: Properties) -> str:
    """Take a filter; those of Mitsuba 0.6 that average over a pixel have the same limit."""
    smooth = ("bilinear", "trilinear", "ewa")
    name = props.text("filter_type", "bilinear", (*smooth, "nearest"))
    return "bilinear" if name in smooth else name


def _checkerboard(props: Properties) -> Checkerboard:
    return Checkerboard(
        color0=reflectance(props, "color0", 0.4),
        color1=reflectance(props, "color1", 0.2),
        to_uv=_to_uv(props),
    )


def _mesh_attribute(props: Properties) -> Texture:
    usual = "vertex_color" if props.context.old else ""
    name, scale = props.text("name", usual), props.number("scale", 1.0)
    if not name.startswith(ATTRIBUTES):
        message = f"'name' must begin with {' or '.join(ATTRIBUTES)}, not {name!r}"
        raise props.element.error(message)
    return _scaled(MeshAttribute(name=name), scale)


def _scaled(result: Texture, scale: float) -> Texture:
    return result if scale == 1.0 else Product(first=result, second=scale)


def _to_uv(props: Properties) -> np.ndarray:
    """Take a uv transform, (3, 3): what the 4x4 matrix does to (u, v, 0, 1)."""
    if "to_uv" in props.named:
        matrix = props.matrix("to_uv")
        return matrix[np.ix_([0, 1, 3], [0, 1, 3])]
    # Mitsuba 0.6's lists, in the order of Mitsuba 3's.
    offsets = [props.number(name, 0.0) for name in ("uoffset", "voffset")]
    both = props.number("uvscale", 1.0)
    scales = [props.number(name, both) for name in ("uscale", "vscale")]
    uv = np.eye(3)
    moved = offsets if props.context.old else np.multiply(scales, offsets)
    uv[:2, 2], uv[0, 0], uv[1, 1] = moved, *scales  # 0.6: src/librender/texture.cpp
    return uv


def _scale(props: Properties) -> Any:
    """Read Mitsuba 0.6's `scale`: a texture or a colour, times a number or a colour."""
    factors = factor(props, "scale", 1.0)
    inner = nested_textures(props)
    if len(inner) > 1 or not (inner or "value" in props.named):
        raise props.element.error("needs one nested texture, or a 'value'")
    first = texture(inner[0], props) if inner else factor(props, "value", 1.0)
    return Product(first=first, second=factors)


def _grid(props: Properties) -> Mix:
    """Read Mitsuba 0.6's `gridtexture`: lines around the edges of each unit of uv."""
    width = min(max(props.number("line_width", 0.01), 0.0), 0.5)
    edges = np.arange(GRID_TEXELS + 1) / GRID_TEXELS
    clear = np.clip(edges, width, 1.0 - width)
    covered = 1.0 - np.diff(clear) * GRID_TEXELS
    lines = 1.0 - np.outer(1.0 - covered, 1.0 - covered)
    return Mix(
        first=factor(props, "color0", 0.2),
        second=factor(props, "color1", 0.4),
        amount=Bitmap(image=lines[..., None].astype(np.float32), raw=True, to_uv=_to_uv(props)),
    )


TEXTURES: dict[str, PluginReader[Any]] = {
    "scale": _scale,
    "gridtexture": _grid,
    "bitmap": _bitmap,
    "checkerboard": _checkerboard,
    "mesh_attribute": _mesh_attribute,
}
