"""Lights. Those `ON_SHAPES` are a shape's `emission`; all others stand in a scene's `lights`."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, TypeVar

import numpy as np

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.scene.motion import Keys
from clpt.scene.params import (
    Kind,
    choice,
    emission,
    fields_of,
    flag,
    host,
    params,
    real,
    reflectance,
)
from clpt.scene.roles import EMISSION, REFLECTANCE
from clpt.scene.textures import Bitmap
from clpt.scene.values import ImageLike, Matrix4, SpectrumLike, Textured, Vector3, is_texture
from clpt.spectra import Blackbody, RGBIlluminant, Spectrum, lumens, scaled, watts

RADIANCE = "W m^-2 sr^-1 nm^-1"
SPOT_EDGES = ("linear", "smooth", "quartic")
NARROW = 0.02  # [rad] around a cone that holds all rays of a point
CONE_RINGS = 4096  # of equal width, over which a spot's intensity is summed
Reach = Literal["surface", "placed", "distant", "infinite"]


@dataclass(frozen=True)
class LightBounds:
    """The box that a light lies in, and the cone of its rays (Conty Estevez and Kulla 2018, 4.1).

    low, high: corners (3,) [m]; axis (3,): of unit length; theta_o: largest angle between the axis
    and a normal of the light [rad]; theta_e: largest angle between a normal and a ray [rad], at
    most pi / 2. By default rays leave to all sides.
    """

    low: Floats
    high: Floats
    axis: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    theta_o: float = math.pi
    theta_e: float = math.pi / 2.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Light(Kind):
    """Base of all lights.

    reach: "surface" for a light on a shape; "placed" for a light with a position; "distant" for a
    light that shines on the whole scene and that no ray can meet; "infinite" for a light that a
    ray meets when it leaves the scene.
    """

    reach: ClassVar[Reach] = "placed"
    only_light_paths: ClassVar[bool] = False  # no path from the camera finds it
    falloff = True  # irradiance falls with the distance
    two_sided = False
    visible = True
    directed = False

    motion: Keys | None = host(
        None, "moves it after its place, or None; an area light moves with its shape", form="keys"
    )
    group: str = host("", "lights of one name share a layer of `light_groups`")

    @property
    def record(self) -> str:
        """The name of its record, and of its functions, in kernels."""
        return self.kind

    def record_members(self) -> dict[str, Any]:
        """Return members of its record beside its placement and emission, by name.

        "factor" is the image that its light passes; see `clpt.render.records.lights`.
        """
        return {}

    @property
    def image_half_size(self) -> tuple[float, float]:
        """Half the width and height of its image a metre away; 1 for an image all around."""
        return 1.0, 1.0

    def bounds(self) -> LightBounds | None:
        """Return the box around all points that emit, and the cone of their rays, before `motion`.

        None if the light is infinitely far away, does not fall with the distance, or does not know
        its bounds: such a light has the same chance to be sampled at every point. A tree over
        lights samples a bounded light by its distance; a point or ray outside of the bounds would
        be dark.
        """
        return None

    def sampling_power(self, strength: float, scene_radius: float, image_mean: float) -> float:
        """Estimate the power that the light sends into the scene [W/nm], to share out samples.

        strength: mean of its intensity, irradiance or radiance; scene_radius: [m]; image_mean: of
        the image that its light passes, 1 without an image.
        """
        if self.reach == "placed":
            return 4.0 * math.pi * strength
        disk = math.pi * scene_radius**2
        return disk * strength if self.reach == "distant" else 4.0 * math.pi * disk * strength


def _to_the_eye(doc: str, unit: str) -> Any:
    """Declare the photometric twin of an emission."""
    return host(None, doc, unit, form="optional_number", positive=True)


@dataclass(frozen=True, kw_only=True, eq=False)
class Lamp(Light):
    """Base of the lights with a single spectrum as their emission.

    If a strength of STRENGTHS is set too, the emission is only the colour.
    """

    temperature: float | None = host(
        None, "colour of a black body; the emission is then its luminance", "K",
        form="optional_number", positive=True,
    )  # fmt: skip

    @property
    def emission_name(self) -> str:
        """The name of the parameter that is emitted."""
        return next(name for name, p in params(type(self)).items() if p.role is EMISSION)

    def check(self) -> None:
        """Raise SceneError for a temperature beside another colour, and for two strengths."""
        name, values = self.emission_name, fields_of(self)
        if self.temperature is not None:
            Blackbody(self.temperature, normalised=True)
            if _grey(values[name]) is None:
                message = f"gives a colour, as {name} does: leave one out, or make {name} a number"
                raise SceneError(message, where=f"{self.kind}.temperature")
        strengths = [strength for strength in STRENGTHS if values.get(strength) is not None]
        if not strengths:
            return
        where = f"{self.kind}.{strengths[0]}"
        if len(strengths) > 1:
            raise SceneError(f"says what {strengths[1]} say: give either", where=where)
        if not isinstance(values[name], Spectrum):
            raise SceneError(f"needs {name} to be without a texture", where=where)
        if _grey(values[name]) not in (None, 1.0):
            message = f"says how strong it is, as a number of {name} does: give either"
            raise SceneError(message, where=where)


@dataclass(frozen=True, kw_only=True, eq=False)
class PoweredLamp(Lamp):
    """Base of the lights that send out a finite power, which may be given.

    Their names are `power` and `lumens`.
    """

    power: float | None = host(
        None, "of all its light from 360 to 830 nm", "W", form="optional_number", positive=True
    )
    lumens: float | None = host(
        None, "of all its light to the eye", "lm", form="optional_number", positive=True
    )

    def extent(self, area: float) -> float:
        """Return what it sends out in all for an emission of 1, [m^2 sr], [m^2] or [sr].

        area: of its surface [m^2].
        """
        raise NotImplementedError(f"{type(self).__name__}.extent: what it sends out in all")


def _grey(emitted: object) -> float | None:
    """Return the number that an emission was given as, None for a colour or a texture."""
    alike = isinstance(emitted, RGBIlluminant) and emitted.r == emitted.g == emitted.b
    return emitted.r if isinstance(emitted, RGBIlluminant) and alike else None


_L = TypeVar("_L", bound=Light)


def with_emission(light: _L, area: float = 0.0) -> _L:
    """Return a light whose temperature and strength are part of its emission.

    area: of the shape that it is on [m^2]. Raises SceneError for a light that is dark.
    """
    if not isinstance(light, Lamp):
        return light
    values = fields_of(light)
    asked = {name: None for name in (TEMPERATURE, *STRENGTHS) if values.get(name) is not None}
    if not asked:
        return light
    name = light.emission_name
    emitted = values[name]
    if light.temperature is not None:
        emitted = Blackbody(light.temperature, scale=_grey(emitted) or 0.0, normalised=True)
    for strength in asked.keys() & set(STRENGTHS):
        sent = watts(emitted) if strength == "power" else lumens(emitted)
        if strength in ("power", "lumens") and isinstance(light, PoweredLamp):
            sent *= light.extent(area)
        if not sent > 0.0:
            raise SceneError("its light is 0 whatever its strength", where=light.kind)
        emitted = scaled(emitted, values[strength] / sent)
    return dataclasses.replace(light, **{**asked, name: emitted})


TEMPERATURE = "temperature"
STRENGTHS = ("power", "lumens", "candela", "lux", "nits")  # a lamp has at most a single strength


@dataclass(frozen=True, kw_only=True, eq=False)
class Area(PoweredLamp):
    """A surface that emits uniformly in all directions, from its front or from both sides."""

    reach = "surface"

    radiance: Textured = emission(1.0, "emitted radiance", RADIANCE, textured=True)
    nits: float | None = _to_the_eye("its luminance", "cd/m^2")
    two_sided: bool = flag(False, "True: its back emits too")
    visible: bool = flag(
        True,
        "False: rays do not see the light, as they do not see a point; surfaces still receive it",
    )
    directed: bool = flag(
        False,
        "True: mappings of its radiance, such as spherical, see the direction in which light "
        "leaves, a unit vector in the world, in the place of the position",
    )

    def check(self) -> None:
        """Raise SceneError for the power of a light whose radiance depends on its direction."""
        super().check()
        if self.directed and (self.power is not None or self.lumens is not None):
            raise SceneError("a directed light takes a radiance, no power or lumens", where="area")

    def extent(self, area: float) -> float:
        """Return pi times the area that emits [m^2 sr]."""
        return math.pi * area * (2.0 if self.two_sided else 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class DirectionalArea(PoweredLamp):
    """A surface that emits from its front side along its normal only: a flat surface emits a beam.

    Only the `particle_tracer` finds its light. The surface itself looks dark.
    """

    reach = "surface"
    only_light_paths = True

    irradiance: Textured = emission(
        1.0, "through a surface across the beam", "W m^-2 nm^-1", textured=True
    )
    lux: float | None = _to_the_eye("illuminance of a surface across the beam", "lx")

    def extent(self, area: float) -> float:
        """Return the area of a flat surface [m^2]: all its light leaves along the normal."""
        return area


@dataclass(frozen=True, kw_only=True, eq=False)
class Point(PoweredLamp):
    """A point that emits uniformly in all directions."""

    position: Vector3 = host((0.0, 0.0, 0.0), "where it is", "m")
    intensity: SpectrumLike = emission(1.0, "radiant intensity", "W sr^-1 nm^-1")
    candela: float | None = _to_the_eye("its luminous intensity", "cd")
    falloff: bool = flag(True, "False: irradiance does not fall with the distance (not physical)")

    def extent(self, area: float) -> float:
        """Return the solid angle of all directions [sr]."""
        return 4.0 * math.pi

    def bounds(self) -> LightBounds | None:
        """Return its position if its irradiance falls with the distance."""
        position = np.asarray(self.position, np.float64)
        return LightBounds(position, position) if self.falloff else None


def _cone(
    to_world: Matrix4, theta_o: float = math.pi, theta_e: float = math.pi / 2.0
) -> LightBounds:
    """Return the bounds of a point that emits about +z of `to_world`."""
    matrix = np.asarray(to_world, np.float64)
    origin, axis = matrix[:3, 3], matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
    return LightBounds(origin, origin, axis, theta_o, theta_e)


def _normalized(image: Textured) -> dict[str, Any]:
    scale, factor = image.normalized() if is_texture(image) else (1.0, image)
    return {"scale": scale, "factor": factor}


@dataclass(frozen=True, kw_only=True, eq=False)
class Spot(PoweredLamp):
    """A point that emits into a cone about +z of `to_world`, smoothly cut off at its edge."""

    to_world: Matrix4 = host(np.eye(4), "placement, (4, 4); shines along its +z")
    intensity: SpectrumLike = emission(1.0, "radiant intensity on the axis", "W sr^-1 nm^-1")
    candela: float | None = _to_the_eye("luminous intensity on the axis", "cd")
    cutoff: float = real(20.0, "half angle of the cone; beyond it is dark", "degrees", 0.0, 180.0)
    beam_width: float = real(15.0, "half angle of full intensity", "degrees", 0.0, 180.0)
    edge: str = choice(
        "linear",
        "how it falls off: linear in the angle; smooth, a cubic in the cosine, or its 4th power",
        SPOT_EDGES,
    )
    image: Textured = reflectance(
        1.0, "a filter in its light; a texture fills the square around a cone below 90"
    )

    @property
    def record(self) -> str:
        return "image_spot" if is_texture(self.image) else self.kind

    def record_members(self) -> dict[str, Any]:
        """Return its cone, and its image if any."""
        return {
            "cutoff": np.radians(self.cutoff),
            "beam_width": np.radians(min(self.beam_width, self.cutoff)),
            "edge": SPOT_EDGES.index(self.edge),
            **({"factor": self.image} if is_texture(self.image) else {}),
        }

    @property
    def image_half_size(self) -> tuple[float, float]:
        half = float(np.tan(np.radians(self.cutoff)))
        return half, half

    def extent(self, area: float) -> float:
        """Return the solid angle of its cone, each direction counted as strong as it is [sr]."""
        cutoff = math.radians(self.cutoff)
        theta = cutoff * (np.arange(CONE_RINGS) + 0.5) / CONE_RINGS
        beam = math.radians(min(self.beam_width, self.cutoff))
        if self.edge == "linear":
            across = np.clip((cutoff - theta) / max(cutoff - beam, 1e-7), 0.0, 1.0)
        else:
            end, full = math.cos(cutoff), math.cos(beam)
            x = np.clip((np.cos(theta) - end) / max(full - end, 1e-7), 0.0, 1.0)
            across = x**4 if self.edge == "quartic" else x * x * (3.0 - 2.0 * x)
        return 2.0 * math.pi * float(across @ np.sin(theta)) * cutoff / CONE_RINGS

    def bounds(self) -> LightBounds:
        """Return its position and its cone."""
        return _cone(self.to_world, math.radians(self.cutoff), NARROW)

    def sampling_power(self, strength: float, scene_radius: float, image_mean: float) -> float:
        """Estimate its power [W/nm] from the middle between its full beam and its cutoff."""
        edge = np.radians([min(self.beam_width, self.cutoff), self.cutoff])
        return 2.0 * math.pi * (1.0 - float(np.cos(edge).mean())) * strength

    def check(self) -> None:
        super().check()
        if is_texture(self.image) and self.cutoff >= 90.0:
            raise SceneError("an image needs a cutoff below 90 degrees", where="spot.cutoff")


@dataclass(frozen=True, kw_only=True, eq=False)
class Projector(Lamp):
    """A point that projects an image along +z of `to_world`: a pinhole camera in reverse."""

    image: Textured = reflectance(1.0, "the picture, upright along +y; a bitmap may go beyond 1")
    irradiance: SpectrumLike = emission(
        1.0, "where the image is 1, in the middle, a metre away", "W m^-2 nm^-1"
    )
    lux: float | None = _to_the_eye("illuminance there", "lx")
    fov: float = real(45.0, "angle that the image's width takes", "degrees", 1e-3, 179.0)
    aspect: float = real(
        0.0, "width over height; 0: as the image has it, or 1 without an image", low=0.0
    )
    to_world: Matrix4 = host(np.eye(4), "placement, (4, 4), without a shear")

    @property
    def image_aspect(self) -> float:
        """Width of the image over its height."""
        if self.aspect > 0.0 or not isinstance(self.image, Bitmap):
            return self.aspect or 1.0
        height, width = self.image.pixels(REFLECTANCE).shape[:2]
        return width / height

    def bounds(self) -> LightBounds:
        """Return its position and the half space in front of it."""
        return _cone(self.to_world, math.pi / 2.0, NARROW)

    @property
    def image_half_size(self) -> tuple[float, float]:
        half = float(np.tan(np.radians(self.fov) / 2.0))
        return half, half / self.image_aspect

    def record_members(self) -> dict[str, Any]:
        """Return its image with values up to 1, and their scale."""
        return _normalized(self.image)

    def sampling_power(self, strength: float, scene_radius: float, image_mean: float) -> float:
        """Estimate its power [W/nm] from the area of its image a metre away."""
        half, _ = self.image_half_size
        return 4.0 * half * half / self.image_aspect * strength * image_mean


@dataclass(frozen=True, kw_only=True, eq=False)
class Goniometric(PoweredLamp):
    """A point whose intensity by direction is an image in latitude and longitude.

    Directions lie in the image as in that of an envmap. The first and the last row continue to the
    poles, unless `wrap_v` is set.
    """

    intensity: SpectrumLike = emission(
        1.0, "radiant intensity where the image is 1", "W sr^-1 nm^-1"
    )
    candela: float | None = _to_the_eye("luminous intensity where the image is 1", "cd")
    image: Textured = reflectance(1.0, "factor by direction; a bitmap may go beyond 1")
    to_world: Matrix4 = host(np.eye(4), "placement, (4, 4), without a shear")

    def record_members(self) -> dict[str, Any]:
        """Return its image, clamped at the poles, with values up to 1, and their scale."""
        image = self.image
        return _normalized(image.clamped_at_poles() if is_texture(image) else image)

    def extent(self, area: float) -> float:
        """Return the solid angle of all directions, before the image takes its share [sr]."""
        return 4.0 * math.pi

    def bounds(self) -> LightBounds:
        """Return its position; it emits to all sides."""
        return _cone(self.to_world)

    def sampling_power(self, strength: float, scene_radius: float, image_mean: float) -> float:
        """Estimate its power [W/nm] over all directions."""
        return 4.0 * math.pi * strength * image_mean


@dataclass(frozen=True, kw_only=True, eq=False)
class Directional(Lamp):
    """Light from infinitely far away: parallel, or of a disk, which gives shadows soft edges.

    No ray meets the disk, so mirrors do not show it.
    """

    reach = "distant"

    direction: Vector3 = host((0.0, 0.0, -1.0), "the light travels along it", form="direction")
    irradiance: SpectrumLike = emission(1.0, "on a surface that faces it", "W m^-2 nm^-1")
    lux: float | None = _to_the_eye("illuminance of a surface that faces it", "lx")
    angle: float = real(0.0, "diameter of its disk, the sun's is 0.53", "degrees", 0.0, 180.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Constant(Lamp):
    """A light that surrounds the scene with the same radiance from every direction."""

    reach = "infinite"

    radiance: SpectrumLike = emission(1.0, "radiance of the surroundings", RADIANCE)
    nits: float | None = _to_the_eye("luminance of the surroundings", "cd/m^2")


@dataclass(frozen=True, kw_only=True, eq=False)
class Envmap(Light):
    """Radiance from an image in latitude and longitude around the scene.

    In the light's own space +y is up, and the middle of the image is in the direction +z. Row i of
    h rows lies at pi i / (h - 1) from +y, as in Mitsuba: the first and the last row are the poles.
    Pixels of the camera `spherical` have their middles at pi (i + 1/2) / h.
    """

    reach = "infinite"

    image: ImageLike | None = host(
        None,
        "path of an .exr or .hdr file, or an array (h, w, 3) float32; an .exr may hold spectra, "
        "as clpt.SpectralImage does",
        form="image",
    )
    scale: float = real(1.0, "factor on the radiance", low=0.0)
    to_world: Matrix4 = host(np.eye(4), "rotation, (4, 4)")
    mis_compensation: bool = flag(
        False, "True: shadow rays go to its bright parts; rays from materials find the other parts"
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class CubeMap(Light):
    """Radiance from the six faces of a cube around the scene."""

    reach = "infinite"

    image: Sequence[ImageLike] | ImageLike | None = host(
        None,
        "six images +x -x +y -y +z -z (paths or arrays), or one with the faces in a 4x3 cross",
        form="cube_images",
    )
    scale: float = real(1.0, "factor on the radiance", low=0.0)
    to_world: Matrix4 = host(np.eye(4), "rotation, (4, 4)")


@dataclass(frozen=True, kw_only=True, eq=False)
class Sky(Light):
    """The sky and the sun of a clear day or dusk, by the physics of air over a round earth.

    In the light's own space +y is up. Below the horizon is a ground of a single colour. The light
    is physical, so the brightness changes with the sun: set an `exposure` at dusk. See docs/sky.md.
    """

    reach = "infinite"

    sun_elevation: float = real(
        30.0, "of the sun's middle above the level; below 0 in twilight", "degrees", -12.0, 90.0
    )
    sun_azimuth: float = real(
        0.0, "of the sun, from +z toward +x of the light", "degrees", -360.0, 360.0
    )
    altitude: float = real(0.0, "of the observer above the ground", "m", 0.0, 60000.0)
    aerosol: float = real(0.1, "optical depth of haze, straight up at 550 nm", low=0.0, high=2.0)
    exponent: float = real(
        1.3, "Angstrom's: haze thins with the wavelength to this power", low=0.0, high=4.0
    )
    aerosol_albedo: float = real(0.95, "share of it that haze scatters", low=0.0, high=1.0)
    asymmetry: float = real(0.76, "mean cosine of the scattering by haze", low=-0.9, high=0.9)
    ozone: float = real(300.0, "column of ozone", "Dobson units", 0.0, 1000.0)
    ground: SpectrumLike = reflectance(0.2, "albedo of the ground around", textured=False)
    sky_scale: float = real(1.0, "factor on the sky and the ground", low=0.0)
    sun_scale: float = real(1.0, "factor on the sun's disc; 0: without it", low=0.0)
    to_world: Matrix4 = host(np.eye(4), "rotation, (4, 4)")


ON_SHAPES = (Area, DirectionalArea)
KINDS = (
    *ON_SHAPES, Point, Spot, Projector, Goniometric, Directional, Constant, Envmap, CubeMap, Sky,
)  # fmt: skip
