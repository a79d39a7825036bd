"""Cameras, and directional, point and spot lights (KHR_lights_punctual).

A file with such lights has photometric units: candela, lux, and cd/m^2 of emission. They become
radiance with the spectrum of daylight; a radiance of 1 has UNIT_LUMINANCE. In a file that Blender
wrote the watts are restored: its exporter multiplies them by 683 lm/W in its lighting mode
"Standard", and by 1 in "Unitless"; a point or spot light of W watts then has W / (4 pi), and
emission has W m^-2 sr^-1. The film's `display_exposure` shows 1 cd/m^2, or 1 W m^-2 sr^-1, as 1. A
file without lights has no unit: emission of 1 shows 1, beside the studio's light.
"""

from __future__ import annotations

import math
import re
from contextlib import suppress
from typing import Any

import numpy as np

from clpt import transforms
from clpt.arrays import Matrix
from clpt.errors import SceneError
from clpt.formats.gltf.document import Document, Element, Scale
from clpt.formats.gltf.nodes import Graph
from clpt.scene.cameras import Camera, Orthographic, Perspective
from clpt.scene.integrators import Film
from clpt.scene.lights import Directional, Light, Point, Spot
from clpt.spectra import UNIT_LUMINANCE, RGBIlluminant, watts

Size = tuple[int, int]
FROM_GLTF = np.diag([-1.0, 1.0, -1.0, 1.0])  # glTF looks along -z with +x to the right
HEIGHT = Film().height
FAR = 1e30  # [m] without a far plane
LARGEST_ASPECT = 16.0  # of a film, and of its inverse


def cameras_of(graph: Graph) -> list[tuple[int, Element]]:
    """Return (node, camera) of every camera in the scene, in order."""
    pairs = [(i, graph.node(i).entry("camera", "cameras")) for i in graph.shown]
    return [(node, camera) for node, camera in pairs if camera is not None]


def camera_descriptions(graph: Graph) -> list[str]:
    """Return the kind of every camera in the scene, with its name if it has a name."""
    names = [c.text("name", None) or graph.node(i).text("name", None) for i, c in cameras_of(graph)]
    kinds = [camera.text("type") for _, camera in cameras_of(graph)]
    return [f"{kind} {name or ''}".strip() for kind, name in zip(kinds, names, strict=True)]


def chosen_camera(graph: Graph, name: str | None) -> tuple[Camera, Size] | None:
    """Return a camera and the size of its film, or None where the scene has no camera.

    name: its number in the scene, its own name or its node's; None: the first camera. Raises
    SceneError for an unknown name.
    """
    cameras = cameras_of(graph)
    if name is None:
        if not cameras:
            return None
        return camera(cameras[0][1], graph.to_world[cameras[0][0]])
    for number, (node, element) in enumerate(cameras):
        if name in (str(number), element.text("name", None), graph.node(node).text("name", None)):
            return camera(element, graph.to_world[node])
    names = ", ".join(c.text("name", str(i)) for i, (_, c) in enumerate(cameras)) or "none"
    raise graph.document.root.error(f"shows no camera {name!r}; it shows: {names}")


def camera(element: Element, node: Matrix) -> tuple[Camera, Size]:
    """Return a camera and the size of its film; the node's scale does not count."""
    kind = element.text("type", choices=("perspective", "orthographic"))
    lens = element.needed(kind)
    to_world = rigid(lens, node) @ FROM_GLTF
    if kind == "orthographic":
        x, y = (abs(lens.number(key)) for key in ("xmag", "ymag"))
        if not (x > 0.0 and y > 0.0):
            raise lens.error("xmag and ymag must not be 0")
        planes = _planes(lens, needed=True)
        to_world = to_world @ transforms.scale([x, x, 1.0])
        return Orthographic(to_world=to_world, **planes), size(x / y)
    fov = math.degrees(lens.number("yfov", low=1e-5, high=math.pi - 1e-5))
    aspect = lens.number("aspectRatio", Film().width / HEIGHT, low=1e-6)
    planes = _planes(lens, needed=False)
    return Perspective(to_world=to_world, fov=fov, fov_axis="y", **planes), size(aspect)


def size(aspect: float) -> Size:
    """Return the width and height of a film of the default height and that aspect ratio."""
    aspect = min(max(aspect, 1.0 / LARGEST_ASPECT), LARGEST_ASPECT)
    return max(round(HEIGHT * aspect), 1), HEIGHT


def rigid(element: Element, node: Matrix) -> Matrix:
    """Return a node's transform without its scale: the nearest rotation, and the translation."""
    if transforms.is_singular(node):
        raise element.error("its node's transform flattens space")
    return transforms.rigid(node)


def _planes(lens: Element, needed: bool) -> dict[str, Any]:
    near = lens.number("znear", low=0.0)
    far = lens.number("zfar") if needed else lens.number("zfar", FAR)
    if far <= near:
        raise lens.error("must be farther than znear", "zfar")
    return {"near": near, "far": far}


LIGHTS = "KHR_lights_punctual"
BLENDER = re.compile(r"Khronos glTF Blender I/O v(\d{1,4})\.(\d{1,4})")
WITH_MODES = 3, 6  # the first version of that exporter with lighting modes
LUMENS = 683.0  # of a watt, in its mode "Standard"
DIMMEST = 100.0  # [cd], [lx] of a file's strongest light in that mode: 2 W, or a seventh of 1 W/m^2


def lumens_of(document: Document) -> float | None:
    """Return the factor [lm/W] that a file's exporter applied to watts; None: it wrote candela.

    Blender's is 683; if no light reaches DIMMEST, the exporter was in mode "Unitless": 1.
    """
    extension, generator = document.root.extension(LIGHTS), ""
    with suppress(SceneError):
        generator = document.root.needed("asset").text("generator", "")
    version = BLENDER.match(generator)
    if extension is None or version is None or (int(version[1]), int(version[2])) < WITH_MODES:
        return None
    strengths = [element.number("intensity", 1.0) for element in extension.children("lights")]
    return LUMENS if max(strengths, default=0.0) >= DIMMEST else 1.0


def scale_of(graph: Graph, lumens: float | None) -> Scale:
    """Return the scale of a file's light.

    lumens: the exporter's factor [lm/W], or None. A file without lights has no scale.
    """
    if all(graph.node(index).extension(LIGHTS) is None for index in graph.shown):
        return Scale()
    if lumens is None:
        return Scale(1.0 / UNIT_LUMINANCE, 1.0 / UNIT_LUMINANCE)
    watt = 1.0 / watts(RGBIlluminant(1.0, 1.0, 1.0))
    return Scale(watt, watt / lumens)


def lights_of(graph: Graph) -> list[Light]:
    """Return the lights of the scene."""
    extension = graph.document.root.extension(LIGHTS)
    elements = [] if extension is None else extension.children("lights")
    lights = []
    for index in graph.shown:
        reference = graph.node(index).extension(LIGHTS)
        if reference is None:
            continue
        number = reference.integer("light")
        if number >= len(elements):
            raise reference.error(
                f"there is no light {number}; the file has {len(elements)}", "light"
            )
        lights.append(light(elements[number], graph.to_world[index]))
    return lights


def light(element: Element, to_world: Matrix) -> Light:
    """Return a light; to_world: of its node."""
    colour = element.numbers("color", 3, (1.0, 1.0, 1.0), low=0.0)
    strength = element.number("intensity", 1.0, low=0.0) * element.document.scale.lights
    emitted = RGBIlluminant(*(strength * value for value in colour))
    kind = element.text("type", choices=("directional", "point", "spot"))
    if kind == "point":
        return Point(position=tuple(to_world[:3, 3]), intensity=emitted)
    to_world = rigid(element, to_world) @ FROM_GLTF
    if kind == "directional":
        return Directional(direction=tuple(to_world[:3, 2]), irradiance=emitted)
    cone = element.needed("spot")
    outer = cone.number("outerConeAngle", math.pi / 4.0, low=1e-6, high=math.pi / 2.0)
    inner = cone.number("innerConeAngle", 0.0, low=0.0, high=outer)
    return Spot(
        to_world=to_world,
        intensity=emitted,
        cutoff=math.degrees(outer),
        beam_width=min(math.degrees(inner), 0.9999 * math.degrees(outer)),
    )
