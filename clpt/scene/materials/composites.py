"""Materials that choose other materials or bend their normals, and the absent surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

from clpt.errors import SceneError
from clpt.scene.materials.diffuse import Diffuse
from clpt.scene.materials.material import Material
from clpt.scene.params import flag, host, real
from clpt.scene.scatterer import Scatterer
from clpt.scene.textures import Bitmap, Graph
from clpt.scene.values import TexturedNumber


@dataclass(frozen=True, kw_only=True, eq=False)
class Null(Material):
    """No surface at all: light passes as if it were not there."""

    delta = True
    is_null = True


NO_SURFACE = Null()


@dataclass(frozen=True, kw_only=True, eq=False)
class TwoSided(Material):
    """Puts materials that have only a front on both sides of a surface."""

    is_composite = True
    two_sided = True

    front: Material = host(Diffuse(), "material of the front", form="material")
    back: Material | None = host(
        None, "material of the back; the front's when None", form="material"
    )

    def shading(self, front: bool) -> Material:
        return self.front if front or self.back is None else self.back


@dataclass(frozen=True, kw_only=True, eq=False)
class Mask(Material):
    """Lets light through where `opacity` is below 1."""

    is_composite = True

    material: Material = host(Diffuse(), "the material where it is opaque", form="material")
    opacity: TexturedNumber = real(
        0.5, "share of light that meets the material", "", 0.0, 1.0, textured=True
    )

    @property
    def mixture(self) -> tuple[Any, Scatterer, Scatterer]:
        return self.opacity, NO_SURFACE, self.material


@dataclass(frozen=True, kw_only=True, eq=False)
class Blend(Material):
    """A linear mixture of two materials."""

    is_composite = True

    first: Material = host(Diffuse(), "material where the weight is 0", form="material")
    second: Material = host(Diffuse(), "material where the weight is 1", form="material")
    weight: TexturedNumber = real(0.5, "share of the second", "", 0.0, 1.0, textured=True)

    @property
    def mixture(self) -> tuple[Any, Scatterer, Scatterer]:
        return self.weight, self.first, self.second


@dataclass(frozen=True, kw_only=True, eq=False)
class NormalMapped(Material):
    """Base of the maps that bend the shading normal. Their flags and defaults are Mitsuba 3's."""

    is_composite = True
    perturbs_normals = True
    reversible = False
    slot: ClassVar[str] = ""  # a map of each slot may be around a leaf

    material: Material = host(Diffuse(), "the material under the bent normal", form="material")
    scale: float = real(1.0, "factor on the slopes of the map")
    flip_invalid: bool = flag(True, "turn a normal round that faces away from the viewer")
    shadowing: bool = flag(True, "soften the edge where the bent surface turns dark")

    def shading(self, front: bool) -> Material:
        return self.material


@dataclass(frozen=True, kw_only=True, eq=False)
class NormalMap(NormalMapped):
    """Takes the shading normal from an image, relative to that of the surface."""

    slot = "normal"

    map: Bitmap | Graph | None = host(
        None,
        "bitmap, read raw, or graph; its colours are (x, y, z) / 2 + 1/2; or None",
        form="texture",
    )
    along_v: bool = flag(
        False,
        "x and y of the map go along its own u and v, transformed by `to_uv` or mirrored, as in "
        "glTF; false: x along the u of its set, y at the left of that, as in Mitsuba",
    )

    def check(self) -> None:
        if self.map is not None and not isinstance(self.map, (Bitmap, Graph)):
            raise SceneError(
                f"must be a bitmap or a graph, not {self.map!r}", where="normal_map.map"
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class BumpMap(NormalMapped):
    """Bends the shading normal as if the surface were raised by a height."""

    slot = "bump"

    height: TexturedNumber = real(0.0, "height of the surface", "m", textured=True)


def parts(material: Material) -> Iterator[Material]:
    """Yield a material and all materials inside it; nothing for another object."""
    if isinstance(material, Material):
        yield material
        for part in material.shared_parts.values():
            yield from parts(part)
