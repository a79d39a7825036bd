# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps and worlds of Blender as lights of clpt, and as shapes that emit."""

from __future__ import annotations

import hashlib
import math
from typing import TYPE_CHECKING, Any

from mathutils import Matrix

from . import measured
from .graphs import Json, Site, fixed_mapping, origin

if TYPE_CHECKING:
    from .scenes import Writer

TO_CLPT = Matrix.Diagonal((-1.0, 1.0, -1.0, 1.0))  # cameras and lamps look along +z there
# A dome of clpt has +y up and +z in its middle; of Blender +z up and +x in its middle.
DOME = [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
# A table of directions has +y up, and its horizontal angles go from +z to +x; in Blender, with +z
# up, from -y to -x.
TABLE = Matrix(((-1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
CANDELA = 1.0 / 177.83  # [W/sr] of a lamp of D65, as Cycles has it

# Factors from clpt's sky to those of Cycles, by the light on a floor at an elevation of 30 degrees.
SKIES = {
    "SINGLE_SCATTERING": 44.0, "MULTIPLE_SCATTERING": 65.0, "PREETHAM": 6.6, "HOSEK_WILKIE": 0.92,
    "NISHITA": 44.0,
}  # fmt: skip
SUN = 98.0
WORLD_PLACES = (("TEX_COORD", "Generated"), ("TEX_COORD", "Object"), ("NEW_GEOMETRY", "Position"))


def listed(matrix: Matrix) -> list[list[float]]:
    """Return a matrix as a scene file has it."""
    return [list(row) for row in matrix]


def rigid(matrix: Matrix) -> Matrix:
    """Return a placement without its scale."""
    return Matrix.LocRotScale(*matrix.decompose()[:2], (1.0, 1.0, 1.0))


def lamp(writer: Writer, source: Any, matrix: Matrix) -> tuple[str, Json]:
    """Return where a lamp belongs, to "lights" or "shapes", and its description.

    A strength of w watts is w / (4 pi) W/sr of a point.
    """
    data, place = source.data, rigid(matrix)
    color, tables = _color(writer, data)
    kind, size = data.type, data.shadow_soft_size if data.type == "POINT" else 0.0

    def emitted(factor: float) -> Any:
        return _spectrum(writer, data, color, factor)

    if kind == "AREA" or (size > 0.0 and not tables):
        shape, area = _flat(data, matrix) if kind == "AREA" else _ball(size, place)
        writer.named["lamp"] = {"type": "null"}
        glow = {"type": "area", "radiance": emitted(1.0 / (math.pi * area))}
        return "shapes", {
            **shape, "material": "lamp", "emission": {**glow, "group": source.lightgroup},
        }  # fmt: skip
    light: Json = {"type": "point", "position": list(place.translation)}
    if kind == "SUN":
        direction = [-value for value in place.col[2][:3]]
        light = {"type": "directional", "direction": direction, "irradiance": emitted(1.0),
                 "angle": math.degrees(data.angle)}  # fmt: skip
    elif kind == "SPOT":
        edge = math.cos(0.5 * data.spot_size)
        cosines = edge, min(edge + (1.0 - edge) * data.spot_blend, 1.0)
        cutoff, width = (math.degrees(math.acos(cosine)) for cosine in cosines)
        light = {"type": "spot", "to_world": listed(place @ TO_CLPT), "edge": "smooth",
                 "beam_width": width, "cutoff": cutoff}  # fmt: skip
    if tables and kind in ("POINT", "SPOT"):
        light = {"type": "goniometric", "table": tables[0], "to_world": listed(place @ TABLE),
                 "intensity": emitted(CANDELA)}  # fmt: skip
        light |= {"cone": cosines} if kind == "SPOT" else {}
    elif kind != "SUN":
        light["intensity"] = emitted(0.25 / math.pi)
    return "lights", {**light, "group": source.lightgroup}


def _color(writer: Writer, data: Any) -> tuple[list[float], list[str]]:
    """Return a lamp's color with what its nodes emit, which is one color, and its IES files."""
    color = [c * data.energy * 2.0**data.exposure for c in data.color]
    if data.use_temperature:
        color = [c * t for c, t in zip(color, data.temperature_color, strict=True)]
    output = None
    if data.node_tree is not None and data.use_nodes:
        output = data.node_tree.get_output_node("CYCLES")
    if output is None:
        return color, []
    with writer.reads(data.name_full):
        writer.tree.tables = []
        shader = writer.tree.linked(Site(output, (), ""), "Surface")
        tables, writer.tree.tables = writer.tree.tables, None
        glow = [0.0] * 3 if shader is None or shader[1] is None else shader[1]
        if isinstance(glow, dict):
            writer.tell("patterns of lamps are not read: it is white")
            glow = [1.0] * 3
        if tables and data.type in ("SUN", "AREA"):
            writer.tell("IES Texture of a sun or an area counts as 1")
    return [c * g for c, g in zip(color, glow, strict=True)], [_file(writer, t) for t in tables]


def _file(writer: Writer, table: str) -> str:
    """Return the file of an IES Texture; what Blender holds as a text is written."""
    if "\n" not in table:
        return table
    file = writer.folder / f"{hashlib.sha256(table.encode()).hexdigest()[:16]}.ies"
    if not file.is_file():
        file.write_text(table, "utf-8")
    return str(file)


def _spectrum(writer: Writer, data: Any, color: list[float], factor: float) -> Any:
    """Return what a lamp emits: its color, or its standard spectrum of the same luminance."""
    if data.clpt.spectrum:
        luminance = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2]
        try:
            return measured.lamp(data.clpt.spectrum, luminance * factor)
        except ValueError as error:
            writer.tell(str(error))
    return [c * factor for c in color]


def _ball(radius: float, place: Matrix) -> tuple[Json, float]:
    """Return the shape of a lamp that is a ball, and its area [m^2]."""
    shape = {"type": "sphere", "radius": radius, "center": list(place.translation)}
    return shape, 4.0 * math.pi * radius**2


def _flat(data: Any, matrix: Matrix) -> tuple[Json, float]:
    """Return the shape of an area lamp, and its area [m^2]."""
    is_round = data.shape in ("DISK", "ELLIPSE")
    height = data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size
    place = matrix @ TO_CLPT @ Matrix.Diagonal((0.5 * data.size, 0.5 * height, 1.0, 1.0))
    area = place.col[0].xyz.cross(place.col[1].xyz).length * (math.pi if is_round else 4.0)
    return {"type": "disk" if is_round else "rectangle", "to_world": listed(place)}, area


# ---- worlds


def world(writer: Writer, data: Any) -> list[Json]:
    """Return the lights around a scene."""
    if data is None:
        return []
    return [{**light, "group": data.lightgroup} for light in _around(writer, data)]


def _around(writer: Writer, data: Any) -> list[Json]:
    if data.clpt.use_sky:
        return [_sky(data.clpt)]
    if not data.use_nodes or data.node_tree is None:
        return [{"type": "constant", "radiance": list(data.color)}]
    output = data.node_tree.get_output_node("CYCLES")
    site = None if output is None else origin((), output.inputs["Surface"])[0]
    if site is None:
        return []
    with writer.reads(data.name_full):
        writer.tree.surface = False
        try:
            return _surroundings(writer, site)
        finally:
            writer.tree.surface = True


def _surroundings(writer: Writer, site: Site) -> list[Json]:
    """Return the lights of a world's shader: an image or a sky as it is, else a graph."""
    if site.node.type in ("BACKGROUND", "EMISSION"):
        strength = writer.tree.number(site, "Strength", 1.0)
        texture, _ = origin(site.groups, site.node.inputs["Color"])
        kind = "" if texture is None else texture.node.type
        if kind == "TEX_SKY" and isinstance(strength, float):
            writer.tell("Sky Texture becomes clpt's own sky, whose colors differ")
            return [_sky_texture(texture.node, strength)]
        if kind == "TEX_ENVIRONMENT" and isinstance(strength, float):
            dome = _dome(writer, texture, strength)
            if dome is not None:
                return [dome]
    radiance = writer.tree.shader(site)[1]
    if isinstance(radiance, dict):
        return [{"type": "envmap", "image": radiance, "to_world": DOME}]
    return [] if radiance is None else [{"type": "constant", "radiance": radiance}]


def _sky_texture(node: Any, strength: float) -> Json:
    """Return clpt's own sky for a Sky Texture; the scale is by the light on a floor."""
    scale = strength * SKIES[node.sky_type]
    made = {"type": "sky", "sky_scale": scale, "sun_scale": 0.0, "to_world": DOME}
    if node.sky_type in ("PREETHAM", "HOSEK_WILKIE"):
        x, y, z = node.sun_direction
        elevation, azimuth = math.atan2(z, math.hypot(x, y)), math.atan2(y, x)
        made["aerosol"] = measured.haze(node.turbidity)
    else:
        elevation, azimuth = node.sun_elevation, 0.5 * math.pi - node.sun_rotation
        dust = node.dust_density if node.sky_type == "NISHITA" else node.aerosol_density
        made |= {
            "aerosol": min(0.1 * dust, 2.0), "altitude": node.altitude,
            "ozone": min(300.0 * node.ozone_density, 1000.0),
            "sun_scale": strength * SUN * node.sun_intensity if node.sun_disc else 0.0,
        }  # fmt: skip
    degrees = math.degrees(max(elevation, math.radians(-12.0))), math.degrees(azimuth)
    return {**made, "sun_elevation": degrees[0], "sun_azimuth": degrees[1]}


def _sky(sky: Any) -> Json:
    return {
        "type": "sky", "sun_elevation": math.degrees(sky.elevation),
        "sun_azimuth": math.degrees(sky.azimuth), "aerosol": sky.haze,
        "altitude": sky.altitude, "ozone": sky.ozone, "ground": list(sky.ground),
        "sky_scale": sky.strength, "sun_scale": sky.strength, "to_world": DOME,
    }  # fmt: skip


def _dome(writer: Writer, texture: Site, strength: float) -> Json | None:
    """Return an image that is turned about z alone; None for other coordinates."""
    node = texture.node
    bitmap = None if node.image is None else writer.image(node)
    turn, (source, _) = Matrix.Identity(4), origin(texture.groups, node.inputs["Vector"])
    if source is not None and source.node.type == "MAPPING":
        fixed = fixed_mapping(source.node)
        if fixed is None or any(fixed[1][:2]) or any(fixed[0]) or fixed[2] != [1.0] * 3:
            return None
        turn = Matrix.Rotation(fixed[1][2], 4, "Z")
        source = origin(source.groups, source.node.inputs["Vector"])[0]
    own = source is None or (source.node.type, source.output) in WORLD_PLACES
    if bitmap is None or not own or node.projection != "EQUIRECTANGULAR":
        return None
    place = turn.inverted() @ Matrix(DOME)
    return {
        "type": "envmap",
        "image": bitmap["image"],
        "scale": strength,
        "to_world": listed(place),
    }
