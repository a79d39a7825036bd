"""Textures: images and patterns that stand for a parameter and vary over a surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from clpt.errors import SceneError
from clpt.scene.params import Kind, choice, factor, fields_of, host, real, reflectance
from clpt.scene.params import Texture as Texture
from clpt.scene.values import ImageLike, Matrix4, Textured, TexturedNumber

ATTRIBUTES = ("vertex_", "face_")  # prefixes of the names of attributes
PATTERNS = ("fbm", "wrinkled", "windy")
MOST_OCTAVES = 32
MAPPINGS = ("uv", "planar", "spherical", "cylindrical", "uv1")
SECOND_UV = ("vertex_u1", "vertex_v1")  # the attributes of a mesh that the mapping uv1 takes
WRAPS = ("repeat", "clamp", "mirror", "zero")


@dataclass(frozen=True, kw_only=True, eq=False)
class Placed(Texture):
    """Base of the textures over uv: a surface's uv, or uv that a mapping derives from positions."""

    to_uv: np.ndarray = host(np.eye(3), "uv transform, (3, 3) float64")
    mapping: str = choice(
        "uv", "where u and v come from; uv1: attributes vertex_u1, vertex_v1", MAPPINGS
    )
    to_texture: Matrix4 = host(np.eye(4), "from the world to the mapping's space, (4, 4)")

    def check(self) -> None:
        _matrix(self, "to_uv", 3)
        _matrix(self, "to_texture", 4)


@dataclass(frozen=True, kw_only=True, eq=False)
class Solid(Texture):
    """Base of the textures that fill space."""

    to_texture: Matrix4 = host(np.eye(4), "from the world to the texture's space, (4, 4)")

    def check(self) -> None:
        _matrix(self, "to_texture", 4)


@dataclass(frozen=True, kw_only=True, eq=False)
class Bitmap(Placed):
    """An image; v = 0 is its bottom row. Where a number is asked for it takes `channel`.

    A pixel's samples average what lies within it. That is exact, but noisy where few samples meet
    fine textures far away. The filter "trilinear" takes smaller copies of the image there, its MIP
    levels: less noise, but a blur where a surface is seen at a grazing angle. The pixel's width
    grows along the path as a cone; rough surfaces widen it much, mirrors do not. Lights, masks,
    blends, images of spectra in spectral mode and mappings other than "uv" take no copies.
    """

    image: ImageLike | None = host(
        None,
        "path of an image, or an array (h, w) or (h, w, 1|3|4), float32, or uint8 as 8-bit files "
        "have; an .exr may hold spectra, as clpt.SpectralImage does",
        form="image",
    )
    raw: bool = host(False, "True: values as they are, without the sRGB decoding of 8-bit files")
    filter: str = choice(
        "bilinear",
        "between texels; trilinear: and between smaller copies where texels are smaller than what "
        "is looked at",
        ("bilinear", "nearest", "trilinear"),
    )
    wrap: str = choice("repeat", "outside [0, 1]; zero: black, and no alpha", WRAPS)
    wrap_v: str | None = choice(None, "the same for v alone; none: as `wrap`", WRAPS)
    channel: str = choice(
        "luminance", "what a number is taken from; a is never decoded", ("luminance", *"rgba")
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Checkerboard(Placed):
    """Two colours in a 2x2 pattern per unit of uv."""

    color0: Textured = reflectance(
        0.4, "colour where both or neither coordinate is below a half", limited=False
    )
    color1: Textured = reflectance(0.2, "colour elsewhere", limited=False)


@dataclass(frozen=True, kw_only=True, eq=False)
class Product(Texture):
    """The product of two values; in an emission the second is a factor, not a light of its own."""

    first: Textured = factor(1.0, "one of them")
    second: Textured = factor(1.0, "the other")
    rgb: bool = host(
        False, "True: colours are multiplied as linear Rec. 709, and the product made a spectrum"
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Mix(Texture):
    """Between two values: (1 - amount) first + amount second."""

    first: Textured = factor(0.0, "where the amount is 0")
    second: Textured = factor(1.0, "where it is 1")
    amount: TexturedNumber = real(0.5, "share of the second", textured=True)


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshAttribute(Texture):
    """Values that a mesh holds per vertex or face: those of its `attributes` with this name."""

    name: str = host("vertex_color", "begins with vertex_ or face_")
    channel: str = choice(
        "luminance", "of a colour, where a number is asked for", ("luminance", *"rgb")
    )

    def check(self) -> None:
        if not str(self.name).startswith(ATTRIBUTES):
            message = f"must begin with {' or '.join(ATTRIBUTES)}, not {self.name!r}"
            raise SceneError(message, where=f"{self.kind}.name")


@dataclass(frozen=True, kw_only=True, eq=False)
class Dots(Placed):
    """1 within round dots, 0 elsewhere: half of the cells of uv around whole numbers have a dot."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Checkers(Solid):
    """0 and 1 by turns in cubes of unit size."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Noise(Solid):
    """A number that varies in space, from Perlin's noise, as pbrt's textures of these names."""

    pattern: str = choice(
        "fbm", "fbm: octaves; wrinkled: their absolute values; windy: waves, six octaves", PATTERNS
    )
    octaves: int = host(8, "how many, each 1.99 times as fine as the one before")
    roughness: float = host(0.5, "how strong each is beside the one before")

    def check(self) -> None:
        super().check()
        _octaves(self)


@dataclass(frozen=True, kw_only=True, eq=False)
class Marble(Solid):
    """Marble with veins along y, as pbrt's."""

    octaves: int = host(8, "of the noise that disturbs the veins")
    roughness: float = host(0.5, "how strong each octave is beside the one before")
    scale: float = host(1.0, "how fine the pattern is")
    variation: float = host(0.2, "how much the veins are disturbed")

    def check(self) -> None:
        super().check()
        _octaves(self)


KINDS = (Bitmap, Checkerboard, Product, Mix, MeshAttribute, Dots, Checkers, Noise, Marble)


def _matrix(texture: Texture, name: str, size: int) -> None:
    """Make a texture's matrix float64. Raises SceneError for another form of matrix."""
    matrix = np.asarray(fields_of(texture)[name], dtype=np.float64)
    if matrix.shape != (size, size) or not np.isfinite(matrix).all():
        raise SceneError(f"must be a finite {size}x{size} matrix", where=f"{texture.kind}.{name}")
    object.__setattr__(texture, name, matrix)


def _octaves(texture: Noise | Marble) -> None:
    """Raise SceneError for octaves beyond the precision of float32."""
    if not 0 < texture.octaves <= MOST_OCTAVES:
        message = f"must be 1 to {MOST_OCTAVES}, not {texture.octaves}"
        raise SceneError(message, where=f"{texture.kind}.octaves")


def attributes_in(value: object) -> set[str]:
    """Return the names of the attributes of meshes that the textures in a kind read."""
    names: set[str] = set()
    for texture in textures_in(value):
        if isinstance(texture, MeshAttribute):
            names.add(texture.name)
        elif isinstance(texture, Placed) and texture.mapping == "uv1":
            names |= set(SECOND_UV)
    return names


def placed_in(value: object) -> Placed | None:
    """Return the first texture on a set of uv in a value, None without such a texture."""
    placed = (texture for texture in textures_in(value) if isinstance(texture, Placed))
    return next((texture for texture in placed if texture.mapping in ("uv", "uv1")), None)


def turned(value: object) -> bool:
    """Return whether a texture's u and v have other directions than the surface's u and v."""
    placed = placed_in(value) if isinstance(value, Texture) else None
    if placed is None:
        return False
    matrix = placed.to_uv[:2, :2] / placed.to_uv[2, 2]
    straight = matrix[0, 1] == matrix[1, 0] == 0.0 and matrix.diagonal().min() > 0.0
    return placed.mapping == "uv1" or not straight


def textures_in(value: object) -> Iterator[Texture]:
    """Yield the textures in a kind's parameters, at any depth."""
    if isinstance(value, (list, tuple)):
        for entry in value:
            yield from textures_in(entry)
    elif isinstance(value, Kind):
        if isinstance(value, Texture):
            yield value
        for part in fields_of(value).values():
            if isinstance(part, (Kind, list, tuple)):
                yield from textures_in(part)
