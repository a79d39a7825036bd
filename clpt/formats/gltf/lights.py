"""KHR_lights_punctual: directional, point and spot lights.

A file with such lights has photometric units: candela, lux, and cd/m^2 of what emits. They become
radiance by the spectrum of daylight, of which 1 has UNIT_LUMINANCE. Of a file that Blender wrote
the watts are restored: its exporter multiplies them by 683 lm/W in its lighting mode "Standard",
and by nothing in "Unitless"; a point or spot light of W watts has W / (4 pi) then, and emission has
W m^-2 sr^-1. The film's `display_exposure` shows 1 cd/m^2, or 1 W m^-2 sr^-1, as 1. A file
without lights has no unit: emission of 1 shows 1, beside the studio's light.
"""

from __future__ import annotations

import math
import re
from contextlib import suppress

from clpt.arrays import Matrix
from clpt.errors import SceneError
from clpt.formats.gltf.cameras import FROM_GLTF, rigid
from clpt.formats.gltf.document import Document, Element, Scale
from clpt.formats.gltf.nodes import Graph
from clpt.scene.lights import Directional, Light, Point, Spot
from clpt.spectra import UNIT_LUMINANCE, RGBIlluminant, watts

NAME = "KHR_lights_punctual"
BLENDER = re.compile(r"Khronos glTF Blender I/O v(\d{1,4})\.(\d{1,4})")
WITH_MODES = 3, 6  # the first version of that exporter with lighting modes
LUMENS = 683.0  # of a watt, in its mode "Standard"
DIMMEST = 100.0  # [cd], [lx] of a file's strongest light in that mode: 2 W, or a seventh of 1 W/m^2


def lumens_of(document: Document) -> float | None:
    """Return the lumens of a watt by which a file's exporter multiplied watts, None for candela.

    683 of Blender's, unless no light reaches DIMMEST: the file is then of its mode "Unitless", 1.
    """
    extension, generator = document.root.extension(NAME), ""
    with suppress(SceneError):
        generator = document.root.needed("asset").text("generator", "")
    found = BLENDER.match(generator)
    if extension is None or found is None or (int(found[1]), int(found[2])) < WITH_MODES:
        return None
    strengths = [element.number("intensity", 1.0) for element in extension.children("lights")]
    return LUMENS if max(strengths, default=0.0) >= DIMMEST else 1.0


def scale_of(graph: Graph, lumens: float | None) -> Scale:
    """Return the scale of a file; lumens: of a watt, by which its lights were multiplied, or None.

    A file that shows no light has none.
    """
    if all(graph.node(index).extension(NAME) is None for index in graph.shown):
        return Scale()
    if lumens is None:
        return Scale(1.0 / UNIT_LUMINANCE, 1.0 / UNIT_LUMINANCE)
    watt = 1.0 / watts(RGBIlluminant(1.0, 1.0, 1.0))
    return Scale(watt, watt / lumens)


def lights_of(graph: Graph) -> list[Light]:
    """Return the lights of the scene."""
    extension = graph.document.root.extension(NAME)
    elements = [] if extension is None else extension.children("lights")
    lights = []
    for index in graph.shown:
        own = graph.node(index).extension(NAME)
        if own is None:
            continue
        number = own.integer("light")
        if number >= len(elements):
            raise own.error(f"there is no light {number}; the file has {len(elements)}", "light")
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
