"""Lights of a Mitsuba scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clpt.errors import UnknownKindError
from clpt.formats.mitsuba.spectra import emission
from clpt.formats.mitsuba.values import Context, Properties, placed
from clpt.formats.mitsuba.xml import Element
from clpt.scene import lights
from clpt.scene.lights import Light

Parameters = dict[str, Any]


def emitter(element: Element, context: Context) -> Light:
    """Make the light that an <emitter> outside of shapes describes."""
    if element.type in ON_SHAPES:
        raise element.error("an area light must stand in a <shape>")
    if element.type not in PLUGINS:
        raise UnknownKindError("emitter", element.type, [*PLUGINS, *ON_SHAPES], **element.place())
    return _make(element, context, *PLUGINS[element.type])


def area(element: Element, context: Context) -> Light:
    """Make the light that an <emitter> inside a shape describes."""
    if element.type not in ON_SHAPES:
        raise element.error("only an area light can stand in a <shape>")
    return _make(element, context, *ON_SHAPES[element.type])


def _make(
    element: Element,
    context: Context,
    cls: type[Light],
    read: Callable[[Properties], Parameters],
) -> Light:
    props = Properties(element, context)
    props.ignore("sampling_weight")
    with placed(element):
        made = cls(**read(props))
    props.finish()
    return made


def _area(props: Properties) -> Parameters:
    return {"radiance": emission(props, "radiance", textured=True)}


def _directional_area(props: Properties) -> Parameters:
    return {"irradiance": emission(props, "radiance", textured=True)}


def _point(props: Properties) -> Parameters:
    position = props.vector("position", None)
    if position is None:
        position = tuple(props.matrix("to_world")[:3, 3].tolist())
    return {"position": position, "intensity": emission(props, "intensity")}


def _spot(props: Properties) -> Parameters:
    cutoff = props.number("cutoff_angle", 20.0)
    beam = props.number("beam_width", 0.75 * cutoff)
    if not 0.0 <= beam <= cutoff:
        raise props.element.error("beam_width must lie between 0 and cutoff_angle")
    return {
        "to_world": props.placement(),
        "intensity": emission(props, "intensity"),
        "cutoff": cutoff,
        "beam_width": beam,
    }


def _directional(props: Properties) -> Parameters:
    direction = props.vector("direction", None)
    if direction is None:
        direction = tuple(props.placement()[:3, 2].tolist())
    if not np.any(direction):
        raise props.element.error("the direction has no length")
    return {"direction": direction, "irradiance": emission(props, "irradiance")}


def _constant(props: Properties) -> Parameters:
    return {"radiance": emission(props, "radiance")}


def _envmap(props: Properties) -> Parameters:
    props.ignore("mis_compensation")
    return {
        "image": props.file(),
        "scale": props.number("scale", 1.0),
        "to_world": props.placement(),
    }


ON_SHAPES: dict[str, tuple[type[Light], Callable[[Properties], Parameters]]] = {
    "area": (lights.Area, _area),
    "directionalarea": (lights.DirectionalArea, _directional_area),
}
PLUGINS: dict[str, tuple[type[Light], Callable[[Properties], Parameters]]] = {
    "point": (lights.Point, _point),
    "spot": (lights.Spot, _spot),
    "directional": (lights.Directional, _directional),
    "constant": (lights.Constant, _constant),
    "envmap": (lights.Envmap, _envmap),
}
