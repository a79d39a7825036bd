"""Emitters of Mitsuba, and the sun's direction by date and place."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images, transforms
from clpt.errors import SceneError
from clpt.formats import ies
from clpt.formats.mitsuba.limits import within
from clpt.formats.mitsuba.media import around
from clpt.formats.mitsuba.properties import Context, PluginReader, Properties, unknown
from clpt.formats.mitsuba.sensors import from_focal_length
from clpt.formats.mitsuba.spectra import TOP_DOWN, emission, reflectance
from clpt.formats.mitsuba.xml import Element
from clpt.scene import lights
from clpt.scene.lights import Light
from clpt.scene.textures import Bitmap, Placed, Texture
from clpt.spectra import RGBIlluminant, scaled

# parameters and their defaults: Tokyo, in its summer
DATE = {"year": 2010.0, "month": 7.0, "day": 10.0, "hour": 15.0, "minute": 0.0, "second": 0.0}
PLACE = {"latitude": 35.6894, "longitude": 139.6917, "timezone": 9.0}
PARALLAX = 6371.01 / 149597890.0  # the earth's radius over the distance of the sun


def sun_direction(props: Properties) -> Any:
    """Take a date and a place; return the direction to the sun (3,), +y up, -z north, +x east."""
    date = {name: props.number(name, value) for name, value in DATE.items()}
    place = {name: props.number(name, value) for name, value in PLACE.items()}
    hours = date["hour"] - place["timezone"] + (date["minute"] + date["second"] / 60.0) / 60.0
    days = _julian_day(*(int(date[name]) for name in ("year", "month", "day")))
    return _direction(days - 0.5 + hours / 24.0 - 2451545.0, hours, place)


def _julian_day(year: int, month: int, day: int) -> int:
    early = int((month - 14) / 12)  # rounded toward zero, as in C
    months = int(367 * (month - 2 - 12 * early) / 12)
    centuries = int(3 * int((year + 4900 + early) / 100) / 4)
    return int(1461 * (year + 4800 + early) / 4) + months - centuries + day - 32075


def _direction(days: float, hours: float, place: dict[str, float]) -> Any:
    """Blanco-Muriel et al. 2001; days: since noon of 2000-01-01 in UT."""
    omega = 2.1429 - 0.0010394594 * days
    mean = 4.8950630 + 0.017202791698 * days
    anomaly = 6.2400600 + 0.0172019699 * days
    longitude = mean + 0.03341607 * math.sin(anomaly) + 0.00034894 * math.sin(2.0 * anomaly)
    longitude -= 0.0001134 + 0.0000203 * math.sin(omega)
    obliquity = 0.4090928 - 6.2140e-9 * days + 0.0000396 * math.cos(omega)
    across = math.cos(obliquity) * math.sin(longitude)
    ascension = math.atan2(across, math.cos(longitude)) % (2.0 * math.pi)
    declination = math.asin(math.sin(obliquity) * math.sin(longitude))
    sidereal = 6.6974243242 + 0.0657098283 * days + hours
    angle = math.radians(15.0 * sidereal + place["longitude"]) - ascension
    latitude = math.radians(place["latitude"])
    height = math.cos(latitude) * math.cos(angle) * math.cos(declination)
    zenith = math.acos(height + math.sin(declination) * math.sin(latitude))
    north = math.tan(declination) * math.cos(latitude) - math.sin(latitude) * math.cos(angle)
    azimuth = math.atan2(-math.sin(angle), north)
    zenith += PARALLAX * math.sin(zenith)
    level = math.sin(zenith)
    return np.array([math.sin(azimuth) * level, math.cos(zenith), -math.cos(azimuth) * level])


Parameters = dict[str, Any]


def emitter(element: Element, context: Context) -> Light | None:
    """Make the light that an <emitter> outside of shapes describes; None: shapes refer to it."""
    if element.type in ON_SHAPES:
        if "id" in element.attributes:
            return None
        raise element.error("an area light must stand in a <shape>, or have an id for references")
    if element.type not in PLUGINS:
        return context.stand_in(unknown(element, [*PLUGINS, *ON_SHAPES]), element, None)
    return _make(element, context, *PLUGINS[element.type])


def area(element: Element, context: Context) -> Light | None:
    """Make the light that an <emitter> inside a shape describes."""
    if element.type not in ON_SHAPES:
        error = element.error("only an area light can stand in a <shape>")
        return context.stand_in(error, element, None)
    return _make(element, context, *ON_SHAPES[element.type])


def _make(
    element: Element, context: Context, cls: type[Light], read: PluginReader[Parameters]
) -> Light:
    props = Properties(element, context)
    props.ignore("sampling_weight")
    around(props)  # a ray to it knows its medium from where it begins
    with element.locating():
        light = cls(**within(cls, read(props), props), motion=props.motion)
    props.finish()
    return light


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
    beam = min(props.number("beam_width", 0.75 * cutoff), cutoff)
    if beam < 0.0:
        raise props.element.error("beam_width cannot be negative")
    return {
        "to_world": props.placement(),
        "intensity": emission(props, "intensity"),
        "cutoff": cutoff,
        "beam_width": beam,
        "image": reflectance(props, "texture", 1.0),
    }


def _projector(props: Properties) -> Parameters:
    """Mitsuba's irradiance is taken times pi; an image lies there with its top row at v = 0."""
    if "fov" in props.named:
        axis = props.text("fov_axis", "x", ("x", "y", "diagonal", "smaller", "larger"))
        fov = props.number("fov", 0.0)
    else:
        fov, axis = from_focal_length(props), "diagonal"
    scale = props.number("scale", 1.0)
    if not 0.0 < fov < 179.0:
        raise props.element.error("the field of view 'fov' must lie between 0 and 179")
    if scale < 0.0:
        raise props.element.error("'scale' cannot be negative")
    shown = emission(props, "irradiance", textured=True)
    wide = 1.0 if axis == "x" else _aspect(shown)
    if isinstance(shown, Placed):
        shown = replace(shown, to_uv=shown.to_uv @ TOP_DOWN)
    light: Parameters = {"irradiance": (scale * np.pi,) * 3, "image": shown}
    if isinstance(shown, RGBIlluminant):
        light = {"irradiance": tuple(scale * np.pi * v for v in (shown.r, shown.g, shown.b))}
    elif not isinstance(shown, Texture):
        light = {"irradiance": scaled(shown, scale * np.pi)}
    share = {"y": wide, "diagonal": wide / np.hypot(wide, 1.0), "smaller": max(wide, 1.0)}
    share["larger"] = min(wide, 1.0)
    half = np.tan(np.radians(fov) / 2.0) * share.get(axis, 1.0)
    angle = float(np.degrees(2.0 * np.arctan(half)))
    return {**light, "fov": angle, "to_world": props.placement()}


def _aspect(image: object) -> float:
    """Return width over height of an image; 1 for any other value."""
    if not isinstance(image, Bitmap):
        return 1.0
    entries: Any = image.image
    values = images.read_stored(entries).values if isinstance(entries, (str, Path)) else entries
    height, width = np.shape(values)[:2]
    return width / height


def _ies(props: Properties) -> Parameters:
    """Ours, see docs/mitsuba_plugins.md: a lamp whose axis, straight down in its file, is -z."""
    path, scale = props.file(), props.number("scale", 1.0)
    if scale < 0.0:
        raise props.element.error("'scale' cannot be negative")
    try:
        lamp = ies.parameters(path)
    except SceneError as error:
        line = f":{error.line}" if error.line else ""
        raise props.element.error(f"{path.name}{line}: {error.message}") from None
    intensity = emission(props, "intensity")
    image = replace(lamp["image"], image=lamp["image"].image * np.float32(scale))
    upright = props.placement() @ transforms.rotate([1, 0, 0], 90.0)
    return {"image": image, "intensity": intensity, "to_world": upright}


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
    return {
        "image": props.image(),
        "scale": props.number("scale", 1.0),
        "to_world": props.placement(),
        "mis_compensation": props.flag("mis_compensation", False),
    }


def _sun_direction(props: Properties) -> Any:
    """Take the direction to the sun (3,): of the file, or in old files of a date and a place."""
    element = props.element
    if "sun_direction" not in props.named and props.context.old:
        return sun_direction(props)
    if "sun_direction" not in props.named:
        raise element.error(
            "needs a 'sun_direction'; of a place and a time, compute it: that of the sun in the "
            "emitter's own space, +z up"
        )
    d = np.array(props.vector("sun_direction", None))
    if not np.any(d):
        raise element.error("the sun_direction has no length")
    return d


def _sky(props: Properties) -> Parameters:
    """Mitsuba's skies; their turbidity as haze after Angstrom (Preetham 1999).

    Up is +z; in Mitsuba 0.x +y, src/emitters/sunsky/sunmodel.h.
    """
    element, old = props.element, props.context.old
    dated = old and "sun_direction" not in props.named
    d = _sun_direction(props)
    inner = props.placement()
    if not dated:
        d = np.linalg.inv(inner[:3, :3]) @ d  # the file gives it in the world
    place = inner if old else inner @ transforms.rotate([1, 0, 0], 90.0)  # +y up
    east, above, south = d if old else (d[0], d[2], -d[1])
    elevation = float(np.degrees(np.arctan2(above, np.hypot(east, south))))
    turbidity = props.number("turbidity", 3.0)
    if not 1.0 <= turbidity <= 10.0:
        raise element.error("'turbidity' must lie between 1 and 10")
    haze = max(0.04608 * turbidity - 0.04586, 0.0) * 0.55**-1.3
    props.ignore("sun_aperture", "complex_sun", "sun_aperture_scale")
    ground = reflectance(props, "albedo", 0.15 if old else 0.3)
    scale = props.number("scale", 1.0) if old else 1.0
    if isinstance(ground, Texture):
        raise element.error("'albedo' cannot be a texture")
    props.context.warn(
        element, f"becomes a sky by physics: turbidity {turbidity:g} as haze of optical depth "
        f"{haze:.2f}, a sun 0.533 degrees wide, an even ground below the horizon"
    )  # fmt: skip
    return {
        "sun_elevation": elevation,
        "sun_azimuth": float(np.degrees(np.arctan2(east, south))),
        "aerosol": min(haze, 2.0),
        "ground": ground,
        "sun_scale": 0.0 if element.type == "sky" else scale * props.number("sun_scale", 1.0),
        "sky_scale": 0.0 if element.type == "sun" else scale * props.number("sky_scale", 1.0),
        "to_world": place,
    }


def _old_sky(props: Properties) -> Parameters:
    """Read Mitsuba 0.x's `sky` and `sun`: parts of its `sunsky`."""
    if not props.context.old:
        raise unknown(props.element, [*PLUGINS, *ON_SHAPES])
    return _sky(props)


def _collimated(props: Properties) -> Parameters:
    raise props.element.error(
        "is a beam without width, which no camera sees and no light path meets: take a 'spot' of a "
        "small cutoff_angle"
    )


ON_SHAPES: dict[str, tuple[type[Light], PluginReader[Parameters]]] = {
    "area": (lights.Area, _area),
    "directionalarea": (lights.DirectionalArea, _directional_area),
}
PLUGINS: dict[str, tuple[type[Light], PluginReader[Parameters]]] = {
    "point": (lights.Point, _point),
    "spot": (lights.Spot, _spot),
    "projector": (lights.Projector, _projector),
    "directional": (lights.Directional, _directional),
    "constant": (lights.Constant, _constant),
    "envmap": (lights.Envmap, _envmap),
    "sunsky": (lights.Sky, _sky),
    "sky": (lights.Sky, _old_sky),
    "sun": (lights.Sky, _old_sky),
    "collimated": (lights.Directional, _collimated),
    "ies": (lights.Goniometric, _ies),
}
