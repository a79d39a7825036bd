"""Lights of UsdLux, by OpenUSD's clarification of its quantities (proposal usdlux-clarification).

An intensity of 1 is a radiance of 1 of all three colors, as in renderers that know no units.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdLux

from clpt import transforms
from clpt.arrays import Floats, Floats32, Matrix
from clpt.errors import SceneError
from clpt.files import budget
from clpt.formats import as_openpbr, ies
from clpt.formats.usd import textures
from clpt.formats.usd.document import Document, file_of
from clpt.formats.usd.materials import Surface
from clpt.scene.lights import Area, Constant, Directional, Envmap, Goniometric, Light, Point, Spot
from clpt.scene.materials import Null
from clpt.scene.shapes import Cylinder, Disk, Rectangle, Shape, Sphere
from clpt.scene.textures import Bitmap, Product
from clpt.scene.values import Textured, is_texture
from clpt.spectra import RGBIlluminant

TURNED = transforms.rotate([0.0, 1.0, 0.0], 180.0)  # lights shine along -z, clpt's along +z
Z_POLE = transforms.rotate([1.0, 0.0, 0.0], 90.0)  # from a pole +y to a pole +z
# From the space of a goniometric light, whose -y is the lamp's nadir, to that of a light of USD.
FROM_NADIR = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
SUN_ANGLE, SUN_INTENSITY = 0.53, 50000.0
WIDEST = 180.0  # [degrees] disk of a distant light
SHAPED = "inputs:shaping:"
BALLS: dict[str, Callable[[Floats], Floats]] = {
    "mirroredBall": lambda angle: np.sin(0.5 * angle),
    "angular": lambda angle: angle / np.pi,
}
LINKS = ("lightLink", "shadowLink")


@dataclass
class Lit:
    """A light prim as lights, and as shapes that emit."""

    lights: list[Light]
    shapes: list[Shape]


def light(document: Document, prim: Usd.Prim, placement: Matrix) -> Lit:
    """Return a light prim's lights. placement: to the world, in units of the stage."""
    kind = prim.GetTypeName()
    _tell(document, prim)
    if kind in ("DomeLight", "DomeLight_1"):
        return Lit([_dome(document, prim, placement)], [])
    if kind == "DistantLight":
        return Lit([_distant(document, prim, placement)], [])
    if kind in AREAS:
        return _area(document, prim, placement)
    document.warn(f"{kind} is left out", prim.GetPath())
    return Lit([], [])


def on_mesh(document: Document, prim: Usd.Prim, look: Surface, both: bool, area: float) -> Surface:
    """Return the surface of a mesh with MeshLightAPI.

    look: that of its material. both: its back emits too. area: of the mesh, in units of the stage.
    By `light:materialSyncMode` the light is that of the API alone, with or without the material;
    or what the material emits is its color, if it emits.
    """
    _tell(document, prim)
    rgb = emitted(document, prim)
    if document.value(prim, "inputs:normalize", False):
        rgb = rgb / max(area, 1e-30)
    if _is_shaped(document, prim):
        document.warn("shaping is left out of a mesh", prim.GetPath())
    mode = str(document.value(prim, "light:materialSyncMode", "materialGlowTintsLight"))
    if mode == "noMaterialResponse":
        look = Surface(Null())
    radiance: Textured = RGBIlluminant(*rgb)
    if mode == "materialGlowTintsLight" and look.emission is not None:
        glow = look.emission.radiance
        if is_texture(glow):
            grey = bool(np.all(rgb == rgb[0]))
            tint = float(rgb[0]) if grey else tuple(rgb.tolist())
            radiance = Product(first=glow, second=tint, rgb=not grey)
        else:
            radiance = RGBIlluminant(*(rgb * as_openpbr.rgb(glow, "emission")))
    return dataclasses.replace(look, emission=Area(radiance=radiance, two_sided=both))


def emitted(document: Document, prim: Usd.Prim, usual: float = 1.0) -> Floats:
    """Return the radiance of a light as RGB, (3,), before `normalize`. usual: its intensity."""
    strength = document.number(prim, "inputs:intensity", usual)
    strength *= 2.0 ** min(document.number(prim, "inputs:exposure", 0.0), 120.0)
    color = np.array(document.value(prim, "inputs:color", (1.0, 1.0, 1.0)), np.float64)
    if document.value(prim, "inputs:enableColorTemperature", False):
        kelvin = document.number(prim, "inputs:colorTemperature", 6500.0)
        color *= np.array(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
    return np.maximum(strength * color, 0.0)


def _tell(document: Document, prim: Usd.Prim) -> None:
    """Warn of what a light says and clpt cannot do."""
    for link in LINKS:
        includes = prim.GetAttribute(f"collection:{link}:includeRoot")
        some = any(
            prim.GetRelationship(f"collection:{link}:{side}").HasAuthoredTargets()
            for side in ("includes", "excludes")
        )
        if some or (includes and includes.Get() is False):
            document.warn(f"{link} is left out: the light shines on everything", prim.GetPath())
    for name in ("inputs:diffuse", "inputs:specular"):
        if document.value(prim, name, 1.0) != 1.0:
            document.warn(f"{name} is left out", prim.GetPath())
    for name in ("portals", "light:filters"):
        if prim.GetRelationship(name).HasAuthoredTargets():
            document.warn(f"{name} are left out", prim.GetPath())


def _distant(document: Document, prim: Usd.Prim, placement: Matrix) -> Light:
    normal = document.value(prim, "inputs:normalize", False)
    # Blender 5.0 writes half of a sun's angle, and a quarter of its light.
    whole = 2.0 if normal and _is_of_blender(document) else 1.0
    angle = whole * document.number(prim, "inputs:angle", SUN_ANGLE)
    half = math.radians(min(max(angle, 0.0), 360.0)) / 2.0
    factor = math.pi * (math.sin(half) ** 2 if half <= 0.5 * math.pi else 2.0 - math.sin(half) ** 2)
    if normal or half == 0.0:
        factor = whole**2
    if angle > WIDEST:
        document.warn(f"its angle is {WIDEST:g} degrees in shadows", prim.GetPath())
    rgb = emitted(document, prim, SUN_INTENSITY) * factor
    direction = transforms.rigid(placement)[:3, :3] @ [0.0, 0.0, -1.0]
    return Directional(
        direction=tuple(direction),
        irradiance=RGBIlluminant(*rgb),
        angle=min(max(angle, 0.0), WIDEST),
    )


def _is_of_blender(document: Document) -> bool:
    return bool(document.stage.GetRootLayer().documentation.startswith("Blender"))


def _dome(document: Document, prim: Usd.Prim, placement: Matrix) -> Light:
    rgb = emitted(document, prim)
    asset = document.value(prim, "inputs:texture:file")
    stored = textures.read(document, asset, str(prim.GetPath())) if asset and asset.path else None
    if stored is None:
        return Constant(radiance=RGBIlluminant(*rgb))
    image = stored.decoded()[..., :3]
    image = np.repeat(image[..., :1], 3, axis=2) if image.shape[2] < 3 else image
    form = str(document.value(prim, "inputs:texture:format", "automatic"))
    if form in BALLS:
        image = _unrolled(image, BALLS[form])
    elif form not in ("automatic", "latlong"):
        document.warn(f"format {form!r} is read as latlong", prim.GetPath())
    scale = float(rgb.max())
    if scale > 0.0 and rgb.min() < scale:
        image = image * (rgb / scale).astype(np.float32)
    to_world = transforms.rigid(placement) @ _pole(document, prim, placement)
    return Envmap(image=image, scale=scale, to_world=to_world)


def _unrolled(image: Floats32, sine_of: Callable[[Floats], Floats]) -> Floats32:
    """Return the image of a ball in latitude and longitude.

    sine_of: the distance from the middle of the ball, 1 at its edge, by the angle from its axis,
    which points to +z.
    """
    size = min(image.shape[:2])
    budget.check(16 * 2 * size * size * 3, "its directions")
    theta = np.pi * np.arange(size)[:, None] / (size - 1)
    phi = np.pi * (1.0 - 2.0 * (np.arange(2 * size) + 0.5) / (2 * size))
    x, y, z = np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)
    off = sine_of(np.arccos(np.clip(z, -1.0, 1.0)))
    length = np.maximum(np.hypot(x, y), 1e-12)
    column = 0.5 * (1.0 - off * x / length) * image.shape[1] - 0.5
    row = 0.5 * (1.0 - off * y / length) * image.shape[0] - 0.5
    last = np.array(image.shape[:2]) - 1
    column, row = np.clip(column, 0.0, last[1]), np.clip(row, 0.0, last[0])
    i, j = row.astype(np.int64), column.astype(np.int64)
    below, right = np.minimum(i + 1, last[0]), np.minimum(j + 1, last[1])
    v, u = (row - i)[..., None], (column - j)[..., None]
    upper = (1.0 - u) * image[i, j] + u * image[i, right]
    lower = (1.0 - u) * image[below, j] + u * image[below, right]
    return ((1.0 - v) * upper + v * lower).astype(np.float32)


def _pole(document: Document, prim: Usd.Prim, placement: Matrix) -> Matrix:
    """Return the transform of an image's space, whose up is +y, to that of its dome.

    A DomeLight has the pole +y. On a stage with the up axis z that leaves it lying, it has +z, as
    programs that leave out a turn mean it. Blender to 5.0 does; its image has its middle at +x.
    """
    axis = str(
        document.value(prim, "poleAxis", "scene" if prim.GetTypeName() == "DomeLight_1" else "")
    )
    if axis == "scene":
        axis = document.up.upper()
    if not axis:
        up = placement["xyz".index(document.up), :3]
        axis = "Z" if document.up == "z" and abs(up[2]) > abs(up[1]) else "Y"
        if axis == "Z" and _is_of_blender(document):
            return transforms.rotate([0.0, 0.0, 1.0], 90.0) @ Z_POLE
    return Z_POLE if axis == "Z" else np.eye(4)


def _area(document: Document, prim: Usd.Prim, placement: Matrix) -> Lit:
    """Return a light with a surface; a sphere without a size becomes a point."""
    kind = str(prim.GetTypeName())
    shape, area = AREAS[kind](document, prim, placement)
    rgb = emitted(document, prim)
    if document.value(prim, "inputs:normalize", False) and area > 0.0:
        rgb = rgb / area
    shaped = _is_shaped(document, prim)
    if kind == "SphereLight" and (area == 0.0 or document.value(prim, "treatAsPoint", False)):
        # A sphere's intensity is its radiance times the disk that is seen of it.
        facing = area / 4.0 if area > 0.0 else 0.25
        intensity = rgb * facing * document.metres**2
        return Lit([_point(document, prim, placement, intensity)], [])
    if area == 0.0:
        document.warn("left out, as it has no area", prim.GetPath())
        return Lit([], [])
    peak, share = _share(document, prim, placement) if shaped else (1.0, None)
    radiance = _radiance(document, prim, peak * rgb)
    if share is not None:
        radiance = Product(first=radiance, second=share)
    emission = Area(radiance=radiance, directed=shaped)
    shape = dataclasses.replace(
        shape,
        to_world=document.to_metres @ placement @ np.asarray(shape.to_world),
        material=Null(),  # what a lamp's surface is to others is not told: they see through it
        emission=emission,
        name=prim.GetName(),
    )
    return Lit([], [shape])


def _share(document: Document, prim: Usd.Prim, placement: Matrix) -> tuple[float, Bitmap]:
    """Return the greatest factor of a light's shaping, and the share of that by direction."""
    angle, softness, _ = _cone(document, prim)
    image = _shaping(document, prim, angle, softness)
    peak = float(image.max()) or 1.0
    # From +z of the image's space, which is the light's -z, columns fall to the other pole.
    columns = np.ascontiguousarray(image[::-1, ::-1].swapaxes(0, 1) / peak, np.float32)
    axes = transforms.rigid(placement) @ FROM_NADIR
    to_image = np.eye(4)
    to_image[:3, :3] = np.stack([-axes[:3, 2], axes[:3, 0], -axes[:3, 1]])
    return peak, Bitmap(
        image=columns, raw=True, mapping="spherical", to_texture=to_image, wrap="clamp",
        wrap_v="repeat",
    )  # fmt: skip


def _radiance(document: Document, prim: Usd.Prim, rgb: Floats) -> Any:
    """Return a color, or a rectangle's image times it: upright for who looks at its light."""
    asset = document.value(prim, "inputs:texture:file")
    stored = textures.read(document, asset, str(prim.GetPath())) if asset and asset.path else None
    if stored is None:
        return RGBIlluminant(*rgb)
    colors = stored.decoded()[..., :3] * rgb.astype(np.float32)
    return Bitmap(image=np.ascontiguousarray(colors), raw=True, wrap="clamp")


def _rectangle(document: Document, prim: Usd.Prim, placement: Matrix) -> tuple[Shape, float]:
    width, height = (document.number(prim, f"inputs:{side}", 1.0) for side in ("width", "height"))
    to_world = TURNED @ transforms.scale([0.5 * width, 0.5 * height, 1.0])
    return Rectangle(to_world=to_world), width * height * _stretch(placement)


def _disk(document: Document, prim: Usd.Prim, placement: Matrix) -> tuple[Shape, float]:
    radius = document.number(prim, "inputs:radius", 0.5)
    to_world = TURNED @ transforms.scale([radius, radius, 1.0])
    return Disk(to_world=to_world), math.pi * radius**2 * _stretch(placement)


def _sphere(document: Document, prim: Usd.Prim, placement: Matrix) -> tuple[Shape, float]:
    radius = document.number(prim, "inputs:radius", 0.5)
    scale = abs(float(np.linalg.det(placement[:3, :3]))) ** (1.0 / 3.0)
    return Sphere(radius=max(radius, 1e-9)), 4.0 * math.pi * (radius * scale) ** 2


def _cylinder(document: Document, prim: Usd.Prim, placement: Matrix) -> tuple[Shape, float]:
    radius, length = (
        document.number(prim, f"inputs:{name}", usual)
        for name, usual in (("radius", 0.5), ("length", 1.0))
    )
    along, around = (float(np.linalg.norm(placement[:3, axis])) for axis in (0, 1))
    half = 0.5 * length
    tube = Cylinder(p0=(-half, 0.0, 0.0), p1=(half, 0.0, 0.0), radius=max(radius, 1e-9))
    return tube, 2.0 * math.pi * radius * length * along * around


def _stretch(placement: Matrix) -> float:
    """Return by how much a transform enlarges areas in the plane of x and y."""
    return float(np.linalg.norm(np.cross(placement[:3, 0], placement[:3, 1])))


AREAS = {
    "RectLight": _rectangle, "DiskLight": _disk, "SphereLight": _sphere, "CylinderLight": _cylinder,
}  # fmt: skip


def _is_shaped(document: Document, prim: Usd.Prim) -> bool:
    """Return whether a light is not even over all directions."""
    if not prim.HasAPI(UsdLux.ShapingAPI):
        return False
    asset = document.value(prim, SHAPED + "ies:file")
    focus = document.number(prim, SHAPED + "focus", 0.0)
    angle = document.number(prim, SHAPED + "cone:angle", 90.0)
    least = 180.0 if prim.GetTypeName() == "SphereLight" else 90.0
    return bool(asset and asset.path) or focus > 0.0 or angle < least


def _point(document: Document, prim: Usd.Prim, placement: Matrix, rgb: Floats) -> Light:
    """Return a light of no size. rgb: its radiant intensity (3,) on the axis, if it has one."""
    to_world = document.to_metres @ placement
    intensity = RGBIlluminant(*rgb)
    if not _is_shaped(document, prim):
        return Point(position=tuple(to_world[:3, 3]), intensity=intensity)
    turn = transforms.rigid(placement)
    turn[:3, 3] = to_world[:3, 3]
    angle, softness, even = _cone(document, prim)
    if even:
        beam = min(angle * (1.0 - softness), 0.9999 * angle)
        return Spot(
            to_world=turn @ TURNED,
            intensity=intensity,
            cutoff=angle,
            beam_width=beam,
            edge="smooth",
        )
    image = _shaping(document, prim, angle, softness)
    bitmap = Bitmap(image=image.astype(np.float32), raw=True, wrap="repeat", wrap_v="clamp")
    return Goniometric(image=bitmap, intensity=intensity, to_world=turn @ FROM_NADIR)


def _cone(document: Document, prim: Usd.Prim) -> tuple[float, float, bool]:
    """Return the angle of a cone [degrees], its softness, and whether it is even within."""
    angle = min(max(document.number(prim, SHAPED + "cone:angle", 90.0), 1e-3), 180.0)
    softness = min(max(document.number(prim, SHAPED + "cone:softness", 0.0), 0.0), 1.0)
    asset = document.value(prim, SHAPED + "ies:file")
    focus = document.number(prim, SHAPED + "focus", 0.0)
    return angle, softness, focus <= 0.0 and not (asset and asset.path)


def _shaping(document: Document, prim: Usd.Prim, angle: float, softness: float) -> Floats:
    """Return the factor on a light by direction, (rows, columns, 1 or 3).

    Directions lie as in the image of a goniometric light, counted from -z of the light. angle,
    softness: of its cone.
    """
    focus = max(document.number(prim, SHAPED + "focus", 0.0), 0.0)
    profile = _profile(document, prim)
    off_axis = np.pi * (1.0 - (np.arange(ies.ROWS) + 0.5) / ies.ROWS)[:, None]
    smooth = np.clip(
        (np.degrees(off_axis) / angle - 1.0 + softness) / max(softness, 1e-6), 0.0, 1.0
    )
    cone = 1.0 - smooth * smooth * (3.0 - 2.0 * smooth)
    share = np.abs(np.cos(off_axis)) ** focus
    tint = np.array(document.value(prim, SHAPED + "focusTint", (0.0, 0.0, 0.0)), np.float64)
    image = cone[..., None] * (share[..., None] + (1.0 - share[..., None]) * tint)
    return image if profile is None else image * profile


def _profile(document: Document, prim: Usd.Prim) -> Floats | None:
    """Return the candela of a light's IES file by direction, (rows, columns, 1); None for none."""
    asset = document.value(prim, SHAPED + "ies:file")
    if not isinstance(asset, Sdf.AssetPath) or not asset.path:
        return None
    try:
        lamp = ies.read(file_of(document, asset))
    except SceneError as error:
        document.warn(f"profile {asset.path!r} is left out: {error.message}", prim.GetPath())
        return None
    candela = np.asarray(ies.directional_image(lamp)["image"].image, np.float64)
    scale = document.number(prim, SHAPED + "ies:angleScale", 0.0)
    if scale != 0.0:
        theta = 180.0 * (1.0 - (np.arange(len(candela)) + 0.5) / len(candela))
        at = theta / scale if scale > 0.0 else 180.0 + (theta - 180.0) / -scale
        rows = np.clip(np.round((1.0 - at / 180.0) * len(candela) - 0.5), 0, len(candela) - 1)
        inside = (at >= 0.0) & (at <= 180.0)
        candela = np.where(inside[:, None, None], candela[rows.astype(np.int64)], 0.0)
    if document.value(prim, SHAPED + "ies:normalize", False):
        theta = np.pi * (np.arange(len(candela)) + 0.5) / len(candela)
        power = (candela.mean(axis=1)[:, 0] * np.sin(theta)).sum() * 2.0 * np.pi**2 / len(candela)
        candela = candela * (4.0 * np.pi / power)
    return candela
