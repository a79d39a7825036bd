# SPDX-License-Identifier: GPL-3.0-or-later
"""Images, coordinates and what else is known of a surface; and what reads each node of Cycles.

A function takes the tree that is read and a site, and returns the value of the site's output; None
where it has no counterpart, which is told.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from . import meshes, operations, patterns
from .graphs import TURN, Site, Value, fixed_mapping, origin

Read = Callable[[Any, Site], Value | None]  # of a nodes.Expression, whose `graph` is called g


def _coordinates(tree: Any, at: Site) -> Value | None:
    if at.output == "Object" and at.node.object is not None:
        return tree.of_object(at.node.object)
    known = {"UV": "uv", "Generated": "generated", "Object": "object", "Normal": "normal"}
    return tree.attribute(known[at.output]) if at.output in known else None


def _geometry(tree: Any, at: Site) -> Value | None:
    if at.output == "Position":
        return Value(tree.g, "position", 3)
    if at.output in ("Normal", "True Normal"):
        return tree.attribute("world normal")
    return tree.told(at, f"{at.output} of Geometry counts as 0", 0.0)


def _uv_map(tree: Any, at: Site) -> Value:
    return tree.attribute("uv", at.node.uv_map)


def _attribute(tree: Any, at: Site) -> Value | None:
    if at.node.type == "VERTEX_COLOR":
        name = at.node.layer_name
    elif at.node.attribute_type == "GEOMETRY":
        name = at.node.attribute_name
    else:
        return tree.told(at, "attributes of objects count as 0", 0.0)
    if at.output == "Alpha":
        return tree.g.value(1.0)
    value = tree.attribute("attribute", name)
    return (value[0] + value[1] + value[2]) / 3.0 if at.output == "Fac" else value


def _image(tree: Any, at: Site) -> Value:
    node, alpha = at.node, at.output == "Alpha"
    bitmap = None if node.image is None else tree.image(node)
    if bitmap is None:
        return tree.g.value(1.0) if alpha else tree.g.value([1.0, 0.0, 1.0])
    wraps = {"REPEAT": "repeat", "EXTEND": "clamp", "CLIP": "zero", "MIRROR": "mirror"}
    nearest = {"filter": "nearest"} if node.interpolation == "Closest" else {}
    bitmap |= {"wrap": wraps[node.extension], **({"channel": "a"} if alpha else {}), **nearest}
    width, matrix = 1 if alpha else 3, _affine(at)
    if node.projection != "FLAT":
        tree.tell(f"{node.projection.title()} projection of an image is read as flat")
    if matrix is None:
        return tree.g.look(bitmap, width, tree.vector(at, "uv"))
    placed = {} if np.array_equal(matrix, np.eye(3)) else {"to_uv": matrix.tolist()}
    return tree.g.look({**bitmap, **placed}, width)


def _environment(tree: Any, at: Site) -> Value:
    g, node = tree.g, at.node
    bitmap = None if node.image is None else tree.image(node)
    if bitmap is None:
        return g.value([1.0, 0.0, 1.0])
    v = tree.vector(at, "generated")
    if node.projection != "EQUIRECTANGULAR":
        tree.tell("Mirror Ball of an image is read as equirectangular")
    flat = g("magnitude", g("combine2", v[0], v[1]))
    along, up = 0.5 - g("atan2", v[1], v[0]) / TURN, g("atan2", v[2], flat) / math.pi + 0.5
    return g.look({**bitmap, "wrap": "repeat"}, 3, g("combine2", along, up))


def _affine(at: Site) -> np.ndarray | None:
    """Return how Mapping nodes of numbers place the first uv; None for other coordinates."""
    matrix, groups, socket = np.eye(3), at.groups, at.node.inputs["Vector"]
    while socket.is_linked:
        site, _ = origin(groups, socket)
        if site is None:
            return None
        node, groups = site.node, site.groups
        if node.type == "TEX_COORD" and site.output == "UV":
            return matrix
        fixed = fixed_mapping(node)
        if fixed is None or any(fixed[1][:2]):
            return None
        move, angles, scale = fixed
        cosine, sine = math.cos(angles[2]), math.sin(angles[2])
        step = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        step = step @ np.diag([scale[0], scale[1], 1.0])
        step[:2, 2] = move[:2]
        matrix, socket = matrix @ step, node.inputs["Vector"]
    return matrix


def _constant(tree: Any, at: Site) -> Value:
    value = at.node.outputs[0].default_value
    return tree.g.value(value if isinstance(value, float) else list(value)[:3])


def _light_path(tree: Any, at: Site) -> Value:
    of_camera = tree.tree.surface and at.output in ("Is Camera Ray", "Is Singular Ray")
    kind = "a ray from the camera" if tree.tree.surface else "light, also for the camera"
    return tree.told(at, f"Light Path is that of {kind}", float(of_camera))


def _fresnel(tree: Any, at: Site) -> Value:
    """The mean over directions: a graph does not know where it is seen from."""
    layer, cosine = at.node.type == "LAYER_WEIGHT", (np.arange(256) + 0.5) / 256
    blend = tree.constant(at, "Blend" if layer else "IOR", 0.5 if layer else 1.5)
    if layer and at.output == "Facing":
        b = min(max(blend, 0.0), 1.0 - 1e-5)
        share = cosine ** (2.0 * b if b < 0.5 else 0.5 / (1.0 - b))
        mean = 1.0 - (2.0 * cosine * share).mean()
    else:
        eta = 1.0 / max(1.0 - blend, 1e-5) if layer else max(blend, 1.0 + 1e-5)
        g = np.sqrt(eta * eta - 1.0 + cosine**2)
        a, b = (g - cosine) / (g + cosine), (cosine * (g + cosine) - 1.0)
        parts = 0.5 * a * a * (1.0 + (b / (cosine * (g - cosine) + 1.0)) ** 2)
        mean = (2.0 * cosine * parts).mean()
    return tree.told(at, f"{at.node.bl_label} is its mean over directions", float(mean))


def _object_info(tree: Any, at: Site) -> Value:
    source, tree.tree.personal = tree.object, True
    if source is None:
        return tree.g.value(0.0)
    return tree.g.value({
        "Location": lambda: list(source.matrix_world.translation),
        "Color": lambda: list(source.color)[:3], "Alpha": lambda: source.color[3],
        "Object Index": lambda: source.pass_index, "Random": lambda: tree.random,
        "Material Index": lambda: 0.0,
    }[at.output]())  # fmt: skip


def _hair(tree: Any, at: Site) -> Value:
    known = {"Is Strand": 1.0, "Length": 1.0, "Thickness": 0.001}
    tree.tree.personal = True
    count = 0 if tree.object is None else meshes.count_of_strands(tree.object)
    if at.output == "Intercept" and count:  # clpt's v runs on from strand to strand
        along = tree.g("extract", Value(tree.g, "texcoord", 2), index=1)
        return tree.g("fract", along * float(count))
    return tree.told(at, f"{at.output} of Curves Info is one number", known.get(at.output, 0.5))


def _planck(kelvin: float) -> list[float]:
    """Return the linear Rec. 709 of a black body, of luminance 1."""
    nm = np.arange(380.0, 781.0, 5.0)
    return _rgb(nm, 1.0 / (nm**5 * np.expm1(1.4387769e7 / (nm * max(kelvin, 200.0)))))


def observer(nm: np.ndarray) -> np.ndarray:
    """Return how the eye sees wavelengths (3, n): Wyman, Sloan and Shirley 2013."""

    def lobe(size: float, peak: float, low: float, high: float) -> np.ndarray:
        return size * np.exp(-0.5 * ((nm - peak) / np.where(nm < peak, low, high)) ** 2)

    x = lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7)
    x += lobe(-0.065, 501.1, 20.4, 26.2)
    y = lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1)
    z = lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8)
    return np.array([x, y, z])


def _rgb(nm: np.ndarray, power: np.ndarray) -> list[float]:
    """Return the linear Rec. 709 of a spectrum, of luminance 1."""
    xyz = observer(nm) @ power
    to_rgb = [[3.2404542, -1.5371385, -0.4985314], [-0.969266, 1.8760108, 0.041556],
              [0.0556434, -0.2040259, 1.0572252]]  # fmt: skip
    return (np.array(to_rgb) @ (xyz / xyz[1])).tolist()


def _blackbody(tree: Any, at: Site) -> Value:
    kelvin = tree.input(at, "Temperature")
    if kelvin.constant() is not None:
        return tree.g.value(np.maximum(_planck(kelvin.ref[0]), 0.0).tolist())
    rows = [[k, *np.maximum(_planck(k), 0.0).tolist()] for k in np.geomspace(800.0, 12000.0, 64)]
    return tree.g("convert", tree.stops(kelvin, rows, 0), channels=3)


def _wavelength(tree: Any, at: Site) -> Value:
    def color(nm: float) -> list[float]:
        one = np.array([nm])
        bright = 1.0 / 2.52 * np.exp(-0.5 * ((nm - 560.0) / 45.0) ** 2)
        return np.maximum(np.array(_rgb(one, np.ones(1))) * bright, 0.0).tolist()

    rows = [[nm, *color(nm)] for nm in np.arange(390.0, 731.0, 4.0).tolist()]
    return tree.g("convert", tree.stops(tree.input(at, 0), rows, 0), channels=3)


def _table(tree: Any, at: Site) -> Value:
    """The intensities of an IES file by direction: a lamp gets them, as a factor."""
    node, tables = at.node, tree.tree.tables
    if tables is None:
        return tree.told(at, "IES Texture counts as 1", 1.0)
    if node.inputs["Vector"].is_linked:
        tree.tell("Vector of an IES Texture is left out")
    text = node.ies.as_string() if node.mode == "INTERNAL" and node.ies is not None else ""
    path = bpy.path.abspath(node.filepath)
    if not text and not os.path.isfile(path):
        return tree.told(at, f"the IES file {path!r} is missing: it counts as 1", 1.0)
    tables.append(text or path)
    return tree.input(at, "Strength")


# What is lost, and the number that stands for it; None: the node's first input does.
LOST: dict[str, tuple[str, float | None]] = {
    "AMBIENT_OCCLUSION": ("Ambient Occlusion is read as open everywhere", None),
    "VECT_TRANSFORM": ("Vector Transform is left out", None),
    "LIGHT_FALLOFF": ("Light Falloff is quadratic", None),
    "BEVEL": ("Bevel is left out", 0.0), "CAMERA": ("Camera Data counts as 0", 0.0),
    "PARTICLE_INFO": ("Particle Info counts as 0", 0.0), "TANGENT": ("Tangent is left out", 0.0),
    "POINT_INFO": ("Point Info counts as 0", 0.0), "WIREFRAME": ("Wireframe counts as 0", 0.0),
    "VOLUME_INFO": ("Volume Info counts as 1", 1.0), "TEX_GABOR": ("Gabor Texture is grey", 0.5),
    "UVALONGSTROKE": ("UV Along Stroke is of Freestyle alone", 0.0),
    "SHADERTORGB": ("Shader to RGB is of EEVEE alone", 0.5),
    "SCRIPT": ("Open Shading Language is not read", 0.5),
    "TEX_SKY": ("Sky Texture beside others is grey", 0.3),
    "TEX_POINTDENSITY": ("Point Density counts as 0", 0.0),
}  # fmt: skip


def _lost(text: str, value: float | None) -> Read:
    """Return a function that tells what is lost."""

    def read(tree: Any, at: Site) -> Value:
        tree.tell(text)
        return tree.input(at, 0) if value is None else tree.g.value(value)

    return read


TEXTURES: dict[str, Read] = {
    **operations.READ, **patterns.READ,
    "ATTRIBUTE": _attribute, "VERTEX_COLOR": _attribute, "UVMAP": _uv_map, "HAIR_INFO": _hair,
    "NEW_GEOMETRY": _geometry, "TEX_COORD": _coordinates, "OBJECT_INFO": _object_info,
    "RGB": _constant, "VALUE": _constant, "BLACKBODY": _blackbody, "WAVELENGTH": _wavelength,
    "TEX_IMAGE": _image, "TEX_ENVIRONMENT": _environment, "TEX_IES": _table,
    "FRESNEL": _fresnel, "LAYER_WEIGHT": _fresnel, "LIGHT_PATH": _light_path,
    **{kind: _lost(text, value) for kind, (text, value) in LOST.items()},
}  # fmt: skip
