"""Scenes of Nori, the renderer of several courses, in the words of Mitsuba 0.6.

Sources are files of the repository wjakob/nori, unless another repository is named. The course
leaves most plugins to its students: a scene of a fork may have words that no table has.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from clpt.formats.mitsuba.properties import numbers
from clpt.formats.mitsuba.xml import Element

VERSION = "0.6.0"  # of Mitsuba, whose defaults hold
# tag, tag of Mitsuba, source
TAGS = (
    ("mesh", "shape", "src/parser.cpp"),
    ("camera", "sensor", "src/parser.cpp"),
    ("color", "rgb", "src/parser.cpp"),
)
# tag, plugin, parameter, parameter of Mitsuba, source
PARAMETERS = (
    ("bsdf", "diffuse", "albedo", "reflectance", "src/diffuse.cpp"),
    ("emitter", "directional", "radiance", "irradiance", "darvec112357/NoriProjectETHz"),
)
# Integrators that count only light straight from lamps, where nothing is specular.
DIRECT = ("direct", "direct_ems", "direct_mats", "direct_mis", "whitted")
SPECULAR = ("mirror", "dielectric")
UNOCCLUDED = "shows which share of directions is open within a length, and no light"
FOV = 30.0  # defaults of src/perspective.cpp
SIZE = {"width": 1280, "height": 720}
ALPHA, INNER, OUTER, DIFFUSE = 0.1, 1.5046, 1.000277, 0.5  # defaults of src/microfacet.cpp

_TAGS = {old: new for old, new, _ in TAGS}
_PARAMETERS = {(tag, plugin, old): new for tag, plugin, old, new, _ in PARAMETERS}


def is_nori(root: Element) -> bool:
    """Return whether a tree is a scene of Nori, whose files name no version."""
    return "version" not in root.attributes and any(
        child.tag in ("mesh", "camera") for child in root.children
    )


def rename(root: Element) -> None:
    """Give a tree of Nori the words of Mitsuba 0.6. Raises SceneError for what shows no light."""
    root.attributes["version"] = VERSION
    _integrator(root)
    for element in root.walk():
        element.tag = _TAGS.get(element.tag, element.tag)
        if element.tag == "rotate" and "axis" in element.attributes:
            element.attributes["value"] = element.attributes.pop("axis")
        for child in element.children:
            name = _PARAMETERS.get((element.tag, element.type, child.name))
            if name is not None:
                child.attributes["name"] = name
        if element.tag == "bsdf" and element.type == "mirror":
            element.attributes["type"] = "conductor"
            element.children.append(_new(element, "string", "material", "none"))
        if element.tag == "bsdf" and element.type == "microfacet":
            _microfacet(element)
        if element.tag == "emitter" and element.type == "point":
            _point(element)
    samplers = _taken(root, "sampler")
    for sensor in root.children:
        if sensor.tag == "sensor":
            _camera(sensor, samplers)


def _new(parent: Element, tag: str, name: str, value: object) -> Element:
    attributes = {"name": name, "value": str(value)}
    return Element(tag, attributes, parent.file, parent.line)


def _plugin(parent: Element, tag: str, plugin: str, children: Iterable[Element]) -> Element:
    return Element(tag, {"type": plugin}, parent.file, parent.line, [*children])


def _taken(parent: Element, tag: str, name: str = "") -> list[Element]:
    """Remove the children of a tag and a name from their parent; return them."""
    taken = [c for c in parent.children if c.tag == tag and (not name or c.name == name)]
    parent.children = [child for child in parent.children if child not in taken]
    return taken


def _camera(sensor: Element, samplers: list[Element]) -> None:
    """Move the picture's size and filter to a film, and the scene's sampler to the sensor."""
    size = [
        next(iter(_taken(sensor, "integer", name)), _new(sensor, "integer", name, value))
        for name, value in SIZE.items()
    ]
    film = _plugin(sensor, "film", "hdrfilm", [*size, *_taken(sensor, "rfilter")])
    if not any(child.name == "fov" for child in sensor.children):
        sensor.children.append(_new(sensor, "float", "fov", FOV))
    sensor.children += [film, *samplers]


def _microfacet(element: Element) -> None:
    """Make a blend of a diffuse and a rough dielectric's reflection: kd, and 1 - max(kd).

    A metal without extinction has the Fresnel factor of a dielectric, and is opaque.
    """
    kd = [DIFFUSE] * 3
    for child in _taken(element, "rgb", "kd") + _taken(element, "color", "kd"):
        kd = numbers(child, "value", 3)
    values = {"alpha": ALPHA, "int_ior": INNER, "ext_ior": OUTER}
    for name in values:
        for child in _taken(element, "float", name):
            values[name] = numbers(child, "value", 1)[0]
    peak = max(*kd, 0.0)
    if peak > 1.0:
        raise element.error(f"kd must be at most 1, not {peak:g}")
    colour = " ".join(str(value / peak if peak else 0.0) for value in kd)
    eta = _new(element, "spectrum", "eta", values["int_ior"])
    facets = [
        eta,
        _new(element, "spectrum", "k", 0.0),
        _new(element, "float", "extEta", values["ext_ior"]),
        _new(element, "float", "alpha", values["alpha"]),
    ]
    element.attributes["type"] = "blendbsdf"
    element.children += [
        _new(element, "float", "weight", 1.0 - peak),
        _plugin(element, "bsdf", "diffuse", [_new(element, "rgb", "reflectance", colour)]),
        _plugin(element, "bsdf", "roughconductor", facets),
    ]


def _point(lamp: Element) -> None:
    """Give a point light its intensity, the power over the sphere."""
    for child in lamp.children:
        if child.name == "power":
            power = numbers(child, "value", 3)
            child.attributes["name"] = "intensity"
            child.attributes["value"] = " ".join(str(p / (4.0 * math.pi)) for p in power)


def _integrator(root: Element) -> None:
    """Choose the integrator of Mitsuba; of `simple` and `ao` make the lamp that each implies."""
    for element in root.children:
        if element.tag != "integrator":
            continue
        if element.type == "av":
            raise element.error(UNOCCLUDED)
        specular = any(e.tag == "bsdf" and e.type in SPECULAR for e in root.walk())
        if element.type == "normals":
            element.attributes["type"] = "aov"
            element.children = [_new(element, "string", "aovs", "normal:sh_normal")]
        elif element.type in ("simple", "ao"):
            root.children.append(_implied_lamp(element))
            _whiten(root)
        elif element.type.startswith("path"):
            element.attributes["type"] = "path"
        elif element.type in DIRECT and not specular:
            element.attributes["type"] = "direct"
            element.children = []
        return


def _implied_lamp(element: Element) -> Element:
    """Return the lamp of `simple`, a point, or of `ao`, an even sky of radiance 1.

    src/simple.cpp and src/ao.cpp of the course's assignments: energy / (4 pi^2) cos / r^2, and the
    share of the cosine that is open. On a white diffuse surface, whose BSDF is 1 / pi, the lamps
    give the same.
    """
    kind = element.type
    element.attributes["type"] = "direct"
    if kind == "ao":
        element.children = [_new(element, "boolean", "hideEmitters", "true")]
        return _plugin(element, "emitter", "constant", [_new(element, "rgb", "radiance", "1 1 1")])
    inner, element.children = element.children, []
    for child in inner:
        if child.name == "energy":
            child.attributes["name"] = "power"
    return _plugin(element, "emitter", "point", inner)


def _whiten(root: Element) -> None:
    for shape in root.children:
        if shape.tag == "mesh":
            _taken(shape, "bsdf")
            _taken(shape, "emitter")
            white = _new(shape, "rgb", "reflectance", "1 1 1")
            shape.children.append(_plugin(shape, "bsdf", "diffuse", [white]))
