"""Lights. Those `ON_SHAPES` are a shape's `emission`; all others stand in a scene's `lights`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from clpt.errors import SceneError
from clpt.scene.motion import Keys
from clpt.scene.params import Kind, choice, emission, flag, host, real, reflectance
from clpt.scene.textures import Texture
from clpt.scene.values import ImageLike, Matrix4, SpectrumLike, Textured, Vector3

RADIANCE = "W m^-2 sr^-1 nm^-1"
SPOT_EDGES = ("linear", "smooth")
Reach = Literal["surface", "placed", "distant", "infinite"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Light(Kind):
    """Base of all lights.

    reach: "surface" for what emits from a shape; "placed" for a light with a position; "distant"
    for one that shines on the whole scene, and that no ray can meet; "infinite" for one that a ray
    meets when it leaves the scene.
    """

    reach: ClassVar[Reach] = "placed"
    falloff = True  # irradiance falls with the distance
    two_sided = False

    motion: Keys | None = host(
        None, "moves it after its place, or None; an area light moves with its shape", form="keys"
    )
    group: str = host("", "lights of one name share a layer of `light_groups`")


@dataclass(frozen=True, kw_only=True, eq=False)
class Area(Light):
    """A surface that emits from its front side, or from both, evenly in all directions."""

    reach = "surface"

    radiance: Textured = emission(1.0, "emitted radiance", RADIANCE, textured=True)
    two_sided: bool = flag(False, "True: its back emits too")


@dataclass(frozen=True, kw_only=True, eq=False)
class DirectionalArea(Light):
    """A surface that emits from its front side along its normal only: a flat one sends out a beam.

    Only the `particle_tracer` finds it. The camera does not see it shine.
    """

    reach = "surface"

    irradiance: Textured = emission(
        1.0, "through a surface across the beam", "W m^-2 nm^-1", textured=True
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Point(Light):
    """A point that emits evenly."""

    position: Vector3 = host((0.0, 0.0, 0.0), "where it is", "m")
    intensity: SpectrumLike = emission(1.0, "radiant intensity", "W sr^-1 nm^-1")
    falloff: bool = flag(True, "False: irradiance does not fall with the distance (not physical)")


@dataclass(frozen=True, kw_only=True, eq=False)
class Spot(Light):
    """A point that emits into a cone about +z of `to_world`, smoothly cut off at its edge."""

    to_world: Matrix4 = host(np.eye(4), "placement, (4, 4); shines along its +z")
    intensity: SpectrumLike = emission(1.0, "radiant intensity on the axis", "W sr^-1 nm^-1")
    cutoff: float = real(20.0, "half angle beyond which it is dark", "degrees", 0.0, 180.0)
    beam_width: float = real(15.0, "half angle of full intensity", "degrees", 0.0, 180.0)
    edge: str = choice(
        "linear", "how it falls off: linear in the angle, or smooth in its cosine", SPOT_EDGES
    )
    image: Textured = reflectance(
        1.0, "what its light passes through; a texture fills the square around a cone below 90"
    )

    def check(self) -> None:
        if isinstance(self.image, Texture) and self.cutoff >= 90.0:
            raise SceneError("an image needs a cutoff below 90 degrees", where="spot.cutoff")


@dataclass(frozen=True, kw_only=True, eq=False)
class Projector(Light):
    """A point that throws an image along +z of `to_world`: a pinhole camera in reverse."""

    image: Textured = reflectance(1.0, "what it shows, upright along +y; a bitmap may go beyond 1")
    irradiance: SpectrumLike = emission(
        1.0, "where the image is 1, in the middle, a metre away", "W m^-2 nm^-1"
    )
    fov: float = real(45.0, "angle that the image's width takes", "degrees", 1e-3, 179.0)
    aspect: float = real(0.0, "width over height; 0: that of the image, 1 if it has none", low=0.0)
    to_world: Matrix4 = host(np.eye(4), "placement, (4, 4), without a shear")


@dataclass(frozen=True, kw_only=True, eq=False)
class Goniometric(Light):
    """A point whose intensity depends on the direction, as an image in latitude and longitude says.

    Directions lie in the image as in that of an envmap.
    """

    intensity: SpectrumLike = emission(
        1.0, "radiant intensity where the image is 1", "W sr^-1 nm^-1"
    )
    image: Textured = reflectance(1.0, "factor by direction; a bitmap may go beyond 1")
    to_world: Matrix4 = host(np.eye(4), "placement, (4, 4), without a shear")


@dataclass(frozen=True, kw_only=True, eq=False)
class Directional(Light):
    """Parallel light from infinitely far away."""

    reach = "distant"

    direction: Vector3 = host((0.0, 0.0, -1.0), "in which the light travels", form="direction")
    irradiance: SpectrumLike = emission(1.0, "on a surface that faces it", "W m^-2 nm^-1")


@dataclass(frozen=True, kw_only=True, eq=False)
class Constant(Light):
    """A light that surrounds the scene with the same radiance from every direction."""

    reach = "infinite"

    radiance: SpectrumLike = emission(1.0, "radiance of the surroundings", RADIANCE)


@dataclass(frozen=True, kw_only=True, eq=False)
class Envmap(Light):
    """Radiance from an image in latitude and longitude around the scene.

    In the light's own space +y is up, and the middle of the image is in the direction +z.
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

    In the light's own space +y is up. Below the horizon lies an even ground. Its light is physical:
    1 is no day's brightness, so an `exposure` goes with it at dusk. See docs/sky.md.
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
        1.3, "Angstrom's, by which haze thins with wavelength", low=0.0, high=4.0
    )
    aerosol_albedo: float = real(0.95, "share of it that haze scatters", low=0.0, high=1.0)
    asymmetry: float = real(0.76, "mean cosine of what haze scatters", low=-0.9, high=0.9)
    ozone: float = real(300.0, "column of ozone", "Dobson units", 0.0, 1000.0)
    ground: SpectrumLike = reflectance(0.2, "albedo of the ground around", textured=False)
    sky_scale: float = real(1.0, "factor on the sky and the ground", low=0.0)
    sun_scale: float = real(1.0, "factor on the sun's disc; 0: without it", low=0.0)
    to_world: Matrix4 = host(np.eye(4), "rotation, (4, 4)")


ON_SHAPES = (Area, DirectionalArea)
KINDS = (
    *ON_SHAPES, Point, Spot, Projector, Goniometric, Directional, Constant, Envmap, CubeMap, Sky,
)  # fmt: skip
