"""Textures: images and patterns that stand for a parameter and vary over a surface."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.arrays import Floats, Floats32, on_host
from clpt.errors import SceneError
from clpt.images import spectral_exr
from clpt.images.spectral_exr import SpectralImage
from clpt.scene.params import (
    Kind,
    choice,
    factor,
    fields_of,
    host,
    params,
    real,
    reflectance,
)
from clpt.scene.pixels import averaged, channel, check_image, image_file, thinned
from clpt.scene.roles import EMISSION, REAL, REFLECTANCE, Role
from clpt.scene.textures.graph import SECOND_UV as SECOND_UV
from clpt.scene.textures.graph import Graph as Graph
from clpt.scene.values import (
    Attributes,
    ImageLike,
    Look,
    Matrix4,
    Operation,
    Textured,
    TexturedNumber,
    Use,
    brightness_at,
    channel_factors,
    constant_number,
    folded,
    is_texture,
    mean,
    scaled_primary,
    separated,
)
from clpt.scene.values import Texture as Texture
from clpt.scene.volumes import Volume, check_volume
from clpt.spectra import Constant, RGBIlluminant, Spectrum

ATTRIBUTES = ("vertex_", "face_")  # prefixes of the names of attributes
PATTERNS = ("fbm", "wrinkled", "windy")
MOST_OCTAVES = 32
MAPPINGS = ("uv", "planar", "spherical", "cylindrical", "uv1")
WRAPS = ("repeat", "clamp", "mirror", "zero")


@dataclass(frozen=True, kw_only=True, eq=False)
class Placed(Texture):
    """Base of the textures over uv: a surface's uv, or uv that a mapping derives from positions."""

    fills = "uv"

    to_uv: np.ndarray = host(np.eye(3), "uv transform, (3, 3) float64")
    mapping: str = choice(
        "uv", "where u and v come from; uv1: attributes vertex_u1, vertex_v1", MAPPINGS
    )
    to_texture: Matrix4 = host(np.eye(4), "from the world to the mapping's space, (4, 4)")

    def check(self) -> None:
        _matrix(self, "to_uv", 3)
        _matrix(self, "to_texture", 4)

    @property
    def attributes(self) -> tuple[str, ...]:  # type: ignore[override]
        return SECOND_UV if self.mapping == "uv1" else ()

    @property
    def affine(self) -> Floats:
        """The uv transform (3, 3) with a last row of 0 0 1."""
        return np.asarray(self.to_uv / self.to_uv[2, 2])

    def check_use(self, *, emissive: bool) -> None:
        last = self.to_uv[2]
        if not np.allclose(last[:2], 0.0) or np.isclose(last[2], 0.0):
            raise SceneError("its last row must be 0 0 1", where=f"{self.kind}.to_uv")
        if self.mapping not in ("uv", "uv1"):
            _check_affine(self, self.to_texture)
        super().check_use(emissive=emissive)


@dataclass(frozen=True, kw_only=True, eq=False)
class Solid(Texture):
    """Base of the textures that fill space."""

    fills = "space"

    to_texture: Matrix4 = host(np.eye(4), "from the world to the texture's space, (4, 4)")

    def check(self) -> None:
        _matrix(self, "to_texture", 4)

    def check_use(self, *, emissive: bool) -> None:
        _check_affine(self, self.to_texture)
        super().check_use(emissive=emissive)


@dataclass(frozen=True, kw_only=True, eq=False)
class Bitmap(Placed):
    """An image; v = 0 is its bottom row. A parameter that is a number takes `channel`.

    The samples of a pixel average the texture in the pixel. The mean is exact. It is noisy where
    few samples meet a fine texture far away. The filter "trilinear" takes smaller copies of the
    image there (MIP levels). They have less noise, but blur surfaces at grazing angles. The width
    of a pixel grows along the path as a cone. Rough surfaces widen the cone much, and mirrors do
    not. Lights, masks, blends, images of spectra in spectral mode and mappings other than "uv" use
    no copies.
    """

    alpha = True

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
        "luminance",
        "channel of the image for a number; `a` is never decoded",
        ("luminance", *"rgba"),
    )

    @property
    def wraps(self) -> tuple[str, str]:
        """The wraps of u and of v."""
        return self.wrap, self.wrap_v or self.wrap

    @property
    def image_key(self) -> Any:
        """A key that is equal for the same images: a file's name, or an object's id."""
        return image_file(self.image) or id(self.image)

    @property
    def identity(self) -> Any:
        sampling = self.raw, self.filter, self.wrap, self.wrap_v, self.channel
        to_texture = np.asarray(self.to_texture).tobytes()
        return self.image_key, *sampling, self.to_uv.tobytes(), self.mapping, to_texture

    def spectral(self, role: Role) -> SpectralImage | None:
        """Return its image of spectra in a role, None for an image of colours."""
        emissive = role is EMISSION
        return spectral_exr.find(self.image, emissive=emissive, where="bitmap.image")

    def pixels(self, role: Role, side: int | None = None) -> Floats32:
        """Return its image (h, w, 1 or 3) float32, top row first; for REAL (h, w, 1).

        role: it chooses the colour of spectra; side: about how many texels along each side are
        enough; the others are left out. Raises SceneError for an image that cannot be read.
        """
        spectral = self.spectral(role)
        image: Any = self.image if spectral is None else spectral.to_rgb()
        if image_file(image) is not None:
            stored = images.read_stored(image)
            some = dataclasses.replace(stored, values=thinned(stored.values, side))
            image = some.decoded(not self.raw)
        stored = images.from_array(thinned(np.asarray(on_host(image)), side), "bitmap.image")
        plain = stored.decoded(not self.raw)
        return np.nan_to_num(channel(plain, self.channel) if role is REAL else plain[..., :3])

    def with_channel(self, channel: str) -> Texture:
        return dataclasses.replace(self, channel=channel)

    def mean(self, look: Look) -> float:
        return float(look.levels(self).mean())

    def brightness_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        linear, offset = self.affine[:2, :2], self.affine[:2, 2]
        area = area * abs(np.linalg.det(linear))
        return averaged(look.levels(self), uv @ linear.T + offset, area, self.wraps)

    def number_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        linear, offset = self.affine[:2, :2], self.affine[:2, 2]
        area, values = area * abs(np.linalg.det(linear)), self.pixels(REAL)[..., 0]
        return averaged(values.astype(np.float64), uv @ linear.T + offset, area, self.wraps)

    def clamped_at_poles(self) -> Texture:
        """Return it with `wrap_v` "clamp", unless it has a `wrap_v` or `to_uv` moves it along v."""
        corners = self.to_uv[1] @ np.array([[0, 0, 1, 1], [0, 1, 0, 1], [1, 1, 1, 1]])
        inside = bool((np.abs(corners - 0.5) <= 0.5 + 1e-6).all())
        return dataclasses.replace(self, wrap_v="clamp") if inside and not self.wrap_v else self

    def normalized(self) -> tuple[float, Texture]:
        if self.spectral(REFLECTANCE) is not None:
            return 1.0, self
        values = self.pixels(REFLECTANCE)
        scale = max(float(values.max()), 0.0) or 1.0
        return scale, dataclasses.replace(self, image=values / np.float32(scale), raw=True)

    def check_use(self, *, emissive: bool) -> None:
        check_image(self.image, "bitmap.image", emissive=emissive)
        super().check_use(emissive=emissive)


@dataclass(frozen=True, kw_only=True, eq=False)
class Checkerboard(Placed):
    """Two colours in a 2x2 pattern per unit of uv."""

    color0: Textured = reflectance(
        0.4, "colour where both or neither coordinate is below a half", limited=False
    )
    color1: Textured = reflectance(0.2, "colour elsewhere", limited=False)

    @property
    def combines(self) -> bool:
        return is_texture(self.color0) or is_texture(self.color1)

    def folded(self, role: Role) -> Any:
        if not self.combines:
            return self
        pattern = Checkerboard(color0=0.0, color1=1.0, to_uv=self.to_uv)
        return Mix(first=self.color0, second=self.color1, amount=pattern).folded(role)

    def with_channel(self, channel: str) -> Texture:
        ends = (
            channel_factors(value, "rgb".index(channel)) for value in (self.color0, self.color1)
        )
        (first,), (second,) = ends  # colors: with textures it is a mixture, see `folded`
        return dataclasses.replace(self, color0=first, color1=second)

    def mean(self, look: Look) -> float:
        return 0.5 * (mean(self.color0, look) + mean(self.color1, look))

    def brightness_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        first, second = (
            brightness_at(colour, look, uv, area, attributes)
            for colour in (self.color0, self.color1)
        )
        return np.where(self._first(uv), first, second)

    def number_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        colours = self.color0, self.color1
        first, second = (constant_number(colour, REAL) or 0.0 for colour in colours)
        return np.where(self._first(uv), first, second)

    def _first(self, uv: Floats) -> NDArray[np.bool_]:
        """Return where the first colour is, at uv (..., 2)."""
        cells = uv @ self.affine[:2, :2].T + self.affine[:2, 2]
        return np.equal(*np.moveaxis(cells % 1.0 < 0.5, -1, 0))


@dataclass(frozen=True, kw_only=True, eq=False)
class Product(Texture):
    """The product of two values. In an emission the second value is a factor, and no light."""

    first: Textured = factor(1.0, "one of them")
    second: Textured = factor(1.0, "the other")
    rgb: bool = host(
        False, "True: colours are multiplied as linear Rec. 709, and the product becomes a spectrum"
    )

    @property
    def factor_name(self) -> str:
        """The constant if only the second is a texture, else the second: light times a factor."""
        return "first" if is_texture(self.second) and not is_texture(self.first) else "second"

    @property
    def combines(self) -> bool:
        return True

    def operation(self, use: Use, role: Role) -> Operation | None:
        second: Use = "factor" if use == "own" and role is EMISSION else use
        return "multiply", ((self.first, use), (self.second, second))

    def folded(self, role: Role) -> Any:
        a, b = folded(self.first, role), folded(self.second, role)
        if not is_texture(a) and is_texture(b):
            a, b = b, a  # light comes from the texture, and the constant is its factor
        x, y = constant_number(a, role), constant_number(b, role)
        if x is not None and y is not None:
            return RGBIlluminant(*[x * y] * 3) if role is EMISSION else Constant(x * y)
        if y == 1.0 and is_texture(a):
            return a
        if x == 1.0 and role is not EMISSION:
            return b
        return Product(first=a, second=b, rgb=self.rgb)

    def separated(self, role: Role) -> Any:
        """Return the sum of three products: a primary spectrum times its channel each.

        A program adds by mixing halves: the first two products, then their sum with the third. So
        the first two are times four, the third times two.
        """
        light = role is EMISSION
        if not self.rgb:
            second = separated(self.second, REFLECTANCE if light else role)
            return dataclasses.replace(self, first=separated(self.first, role), second=second)
        red, green, blue = (
            _scaled(scaled_primary(i, times, light), self.channel_factors(i))
            for i, times in enumerate((4, 4, 2))
        )
        return Mix(first=Mix(first=red, second=green, amount=0.5), second=blue, amount=0.5)

    def channel_factors(self, channel: int) -> list[Any]:
        return [*channel_factors(self.first, channel), *channel_factors(self.second, channel)]

    def mean(self, look: Look) -> float:
        return mean(self.first, look) * mean(self.second, look)

    def brightness_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        first = brightness_at(self.first, look, uv, area, attributes)
        return first * brightness_at(self.second, look, uv, area, attributes)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Scaled(Product):
    """A spectrum times a number."""

    def operation(self, use: Use, role: Role) -> Operation | None:
        return "multiply", ((self.first, use), (self.second, "real"))


@dataclass(frozen=True, kw_only=True, eq=False)
class Mix(Texture):
    """Between two values: (1 - amount) first + amount second."""

    first: Textured = factor(0.0, "where the amount is 0")
    second: Textured = factor(1.0, "where it is 1")
    amount: TexturedNumber = real(0.5, "share of the second", textured=True)

    @property
    def combines(self) -> bool:
        return True

    def operation(self, use: Use, role: Role) -> Operation | None:
        return "mix", ((self.first, use), (self.second, use), (self.amount, "real"))

    def folded(self, role: Role) -> Any:
        first, second = folded(self.first, role), folded(self.second, role)
        amount = folded(self.amount, REAL)
        a, b = constant_number(first, role), constant_number(second, role)
        t = constant_number(amount, REAL)
        if t in (0.0, 1.0):
            end, number = (second, b) if t else (first, a)
            return end if role is not REAL or number is None else Constant(number)
        if a is not None and b is not None and t is not None and role is not EMISSION:
            return Constant(a + (b - a) * t)
        return Mix(first=first, second=second, amount=amount if t is None else t)

    def separated(self, role: Role) -> Any:
        ends = {"first": separated(self.first, role), "second": separated(self.second, role)}
        return dataclasses.replace(self, **ends)

    def channel_factors(self, channel: int) -> list[Any]:
        first, second = (
            reduce(lambda a, b: Product(first=a, second=b), channel_factors(end, channel))
            for end in (self.first, self.second)
        )
        return [Mix(first=first, second=second, amount=self.amount)]

    def mean(self, look: Look) -> float:
        share = mean(self.amount, look)
        return (1.0 - share) * mean(self.first, look) + share * mean(self.second, look)

    def brightness_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        share, first, second = (
            brightness_at(value, look, uv, area, attributes)
            for value in (self.amount, self.first, self.second)
        )
        return (1.0 - share) * first + share * second


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

    @property
    def attributes(self) -> tuple[str, ...]:  # type: ignore[override]
        return (self.name,)

    def with_channel(self, channel: str) -> Texture:
        return dataclasses.replace(self, channel=channel)

    def brightness_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        if self.name not in attributes:
            return super().brightness_at(look, uv, area, attributes)
        means = attributes[self.name].mean(axis=1, dtype=np.float64)
        return np.broadcast_to(np.maximum(means, 0.0)[:, None], uv.shape[:2])

    def number_at(self, look: Look, uv: Floats, area: Floats, attributes: Attributes) -> Floats:
        if self.name not in attributes:
            return super().brightness_at(look, uv, area, attributes)
        values = np.asarray(attributes[self.name], np.float64)[:, None]
        return np.broadcast_to(channel(values, self.channel)[:, :, 0], uv.shape[:2])


@dataclass(frozen=True, kw_only=True, eq=False)
class Dots(Placed):
    """1 in round dots, and 0 elsewhere. Half of the cells of uv around whole numbers have a dot."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Checkers(Solid):
    """Cubes of unit size that are 0 and 1 alternately."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Noise(Solid):
    """A number that varies in space, from Perlin's noise, as pbrt's textures of these names."""

    pattern: str = choice(
        "fbm", "fbm: octaves; wrinkled: their absolute values; windy: waves, six octaves", PATTERNS
    )
    octaves: int = host(8, "their number; each is 1.99 times as fine as the octave before")
    roughness: float = host(0.5, "strength of each octave over that of the octave before")

    def check(self) -> None:
        super().check()
        _octaves(self)

    def record_members(self) -> dict[str, Any]:
        pattern = PATTERNS.index(self.pattern)
        return {"pattern": pattern, "octaves": self.octaves, "roughness": self.roughness}


@dataclass(frozen=True, kw_only=True, eq=False)
class Marble(Solid):
    """Marble with veins along y, as pbrt's."""

    octaves: int = host(8, "of the noise that disturbs the veins")
    roughness: float = host(0.5, "strength of each octave over that of the octave before")
    scale: float = host(1.0, "how fine the pattern is")
    variation: float = host(0.2, "how much the veins are disturbed")

    def check(self) -> None:
        super().check()
        _octaves(self)

    def record_members(self) -> dict[str, Any]:
        octaves = {"octaves": self.octaves, "roughness": self.roughness}
        return {**octaves, "scale": self.scale, "variation": self.variation}


@dataclass(frozen=True, kw_only=True, eq=False)
class Voxels(Solid):
    """Numbers or colours on a grid in a box, which is the unit cube of the texture's space.

    The values are those at the centres of the box's cells. A parameter that is a number takes the
    luminance of colours. The texture budget does not count them.
    """

    values: NDArray[Any] | Volume = host(
        np.full((1, 1, 1), 0.5, np.float32),
        "(nx, ny, nz), (nx, ny, nz, 1) or colours (nx, ny, nz, 3), none of them negative; the box "
        "of a `Volume` lies in the texture's space",
        form="colour_volume",
    )
    filter: str = choice("trilinear", "between the centres", ("trilinear", "nearest"))
    wrap: str = choice("clamp", "outside of the box; zero: black", WRAPS)

    def check(self) -> None:
        super().check()
        stored = self.values
        if isinstance(stored, Volume):
            inverse = np.linalg.inv(np.asarray(stored.to_world, float))
            object.__setattr__(self, "to_texture", inverse @ self.to_texture)
            stored = stored.values
        values = np.asarray(on_host(stored))
        values = values[..., 0] if values.shape[3:] == (1,) else values
        check_volume(values, f"{self.kind}.values", colours=values.ndim > 3)
        values = values if values.ndim > 3 else values[..., None]
        object.__setattr__(self, "values", np.asarray(values, np.float32))

    @property
    def slices(self) -> Floats32:
        """Its values (nz, ny, nx, 1 or 3)."""
        return np.asarray(self.values).transpose(2, 1, 0, 3)

    def with_channel(self, channel: str) -> Texture:
        values = np.asarray(self.values)
        number = "rgb".index(channel) if values.shape[3] > 1 else 0
        return dataclasses.replace(self, values=values[..., number])

    def mean(self, look: Look) -> float:
        rgb = np.broadcast_to(self.slices.mean(axis=(0, 1, 2), dtype=np.float64), 3)
        return look.brightness(RGBIlluminant(*rgb.tolist()))


KINDS = (
    Bitmap, Checkerboard, Product, Mix, MeshAttribute, Dots, Checkers, Noise, Marble, Voxels, Graph,
)  # fmt: skip


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


def _check_affine(texture: Texture, to_texture: Matrix4) -> None:
    if not np.allclose(np.asarray(to_texture)[3], [0.0, 0.0, 0.0, 1.0]):
        raise SceneError("its last row must be 0 0 0 1", where=f"{texture.kind}.to_texture")


def _scaled(spectrum: Spectrum, factors: list[Any]) -> Any:
    """Return a spectrum times textures and numbers; the numbers become their product."""
    number = float(np.prod([f for f in factors if not is_texture(f)]))
    textures: list[Any] = [f for f in factors if is_texture(f)]
    product: Any = spectrum
    for part in (*textures, *([number] if number != 1.0 else [])):
        product = _Scaled(first=product, second=part)
    return product


# ---- textures in other kinds


def check_textures(kind: Kind) -> None:
    """Raise SceneError for a texture that its parameter cannot use, see `Texture.check_use`."""
    values = fields_of(kind)
    for name, param in params(type(kind)).items():
        value = values[name]
        if is_texture(value):
            value.check_use(emissive=param.role is EMISSION)
        for part in value if isinstance(value, tuple) else ():
            if isinstance(part, Kind):
                check_textures(part)


def attributes_in(value: object) -> set[str]:
    """Return the names of the attributes of meshes that the textures in a kind read."""
    return {name for texture in textures_in(value) for name in texture.attributes}


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
