"""Material words: a hit finds the material of each side of a shape by them.

The upper 8 bits of a word are the number of a leaf kind, or MIXTURE; the lower 24 bits are the
first word of a row in `materials`, or in `mixtures`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from clpt.arrays import Words
from clpt.errors import SceneError
from clpt.render.materials.encoder import Encoder
from clpt.render.records.materials import MIXTURE, NORMAL_MAP_WORDS, MaterialFeatures
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.slopes import Slope
from clpt.scene import materials as mt
from clpt.scene import roles
from clpt.scene.materials import BumpMap, NormalMap
from clpt.scene.params import fields_of
from clpt.scene.phases import Phase
from clpt.scene.scatterer import Scatterer
from clpt.scene.shapes import Shape
from clpt.scene.textures import Bitmap, Graph, Placed, Texture, placed_in
from clpt.spectra import RGB, RGBUnbounded, Spectrum

_BLACK = mt.Diffuse(reflectance=0.0)

STRAIGHT = 0.04  # reflectance of a dielectric at normal incidence
TEXTURED = 0.2  # a typical albedo, for textures
ROUGHLY = 0.5  # a typical roughness, for textures
EXPONENT = 30.0  # a typical exponent, for textures
SEEN = np.linspace(420.0, 680.0, 14)  # wavelengths of a mean albedo [nm]

Values = Mapping[str, object]


INSIDE, ALONG_V, AS_IT_IS, UNSHADED, NORMAL, HEIGHT, SECOND = (1 << i for i in range(7))
DIRECTIONS = 11  # first of the words with the directions of u and v, four for each texture

Map: TypeAlias = NormalMap | BumpMap


def _to_uv(placed: Placed | None) -> Words:
    """Return the directions of a texture's u and v in its set of uv: 2 x 2 words, unit rows."""
    matrix = np.eye(2) if placed is None else placed.to_uv[:2, :2] / placed.to_uv[2, 2]
    lengths = np.linalg.norm(matrix, axis=0)
    if not lengths.all() or abs(np.linalg.det(matrix / lengths)) < 1e-9:
        matrix = np.eye(2)
    inverse = np.linalg.inv(matrix)
    return (inverse / np.linalg.norm(inverse, axis=0)).T.astype(np.float32).ravel().view(np.uint32)


def _real(value: object, encoder: Encoder) -> Words:
    return encoder.named_words("perturbation", "value", value, roles.REAL)[0]


def _flags(outer: Map) -> int:
    return (0 if outer.flip_invalid else AS_IT_IS) | (0 if outer.shadowing else UNSHADED)


def _channel(texture: Bitmap | Graph, channel: str) -> Texture:
    """Return a coordinate of the normals as a texture of numbers, 0 to 1."""
    raw = dataclasses.replace(texture, raw=True) if isinstance(texture, Bitmap) else texture
    return raw.with_channel(channel)


@dataclass(frozen=True)
class _Side:
    """A side of a surface, and the composites around the material in hand.

    two_sided: the back of the surface is shaded like a front; inside: below a TwoSided; normal,
    bump: the maps around the material; maps_inside: whether they are below a TwoSided.
    """

    front: bool
    two_sided: bool
    inside: bool = False
    normal: NormalMap | None = None
    bump: BumpMap | None = None
    maps_inside: bool = False

    @property
    def key(self) -> tuple[Any, ...]:
        """A key that is equal for sides with the same shading."""
        sides = self.front, self.two_sided, self.inside
        return *sides, id(self.normal), id(self.bump), self.maps_inside

    def within(self, outer: Any) -> _Side:
        """Return the side for the material inside a two-sided material, or inside a map."""
        inside = self.inside or outer.two_sided
        if not outer.perturbs_normals:
            return dataclasses.replace(self, inside=inside)
        maps = {outer.slot: outer, "maps_inside": self.inside}
        return dataclasses.replace(self, inside=inside, **maps)

    def map_words(self, encoder: Encoder, leaf: Scatterer) -> Words:
        """Append the textures of the maps, and return their NORMAL_MAP_WORDS words."""
        words = np.zeros(NORMAL_MAP_WORDS, np.uint32)
        flags = INSIDE if self.maps_inside else 0
        if self.normal is not None and self.normal.map is not None:
            flags |= NORMAL | _flags(self.normal) | (ALONG_V if self.normal.along_v else 0)
            words[1] = np.float32(self.normal.scale).view(np.uint32)
            for i, channel in enumerate("rgb"):
                image = _channel(self.normal.map, channel)
                words[3 + 2 * i : 5 + 2 * i] = _real(image, encoder)
        if self.bump is not None:
            flags |= HEIGHT | _flags(self.bump)
            words[2] = np.float32(self.bump.scale).view(np.uint32)
            words[9:11] = _real(self.bump.height, encoder)
        along = None if self.normal is None else self.normal.map
        for i, value in enumerate((along, *(leaf.directing or (None, None)))):
            placed = placed_in(value)
            whole = i > 0 or flags & ALONG_V
            words[DIRECTIONS + 4 * i : DIRECTIONS + 4 * i + 4] = _to_uv(placed if whole else None)
            if placed is not None and placed.mapping == "uv1":
                flags |= SECOND << i
        words[0] = flags
        return words


class MaterialWords:
    """The words of materials, and what these materials need of the kernels.

    gloss_before, slope_before: a row's gloss, and 1 more than the row in `spectra` of its slope of
    the index, lie this many words before the row, 0 without them;
    uvs, tangents, absorption: whether a material needs them; transmitting: the kinds of leaves that
    transmit light in this scene; mixture_depth: how deep masks and blends nest.
    """

    def __init__(
        self,
        encoder: Encoder,
        leaves: tuple[type[Scatterer], ...],
        normal_mapped: bool,
        asks_gloss: bool,
        asks_slopes: bool,
    ):
        self._encoder, self._leaves, self._normal_mapped = encoder, leaves, normal_mapped
        self.gloss_before = (1 + NORMAL_MAP_WORDS * normal_mapped) * asks_gloss
        before = 1 + NORMAL_MAP_WORDS * normal_mapped + asks_gloss
        self.slope_before = before * asks_slopes
        self._words: dict[tuple[int, tuple[Any, ...]], int] = {}
        self._depths: dict[int, int] = {}  # of mixtures, by their words
        self.uvs = self.tangents = self.absorption = False
        self.transmitting: set[str] = set()

    @property
    def mixture_depth(self) -> int:
        return max(self._depths.values(), default=0)

    def features(self, index: SceneIndex) -> MaterialFeatures:
        """Return the features of a scene's materials, with the sources of all loaded values."""
        return MaterialFeatures(
            leaves=index.leaves,
            transmitting=tuple(sorted(self.transmitting)),
            shining=index.shining,
            slopes=self.slope_before > 0,
            mixtures=self.mixture_depth,
            normal_mapped=index.normal_mapped,
            free_panes=index.free_panes,
            sources=self._encoder.sources,
        )

    def sides(self, shape: Shape) -> tuple[int, int, bool]:
        """Return the words of a shape's front and back, and whether it is two-sided."""
        two_sided = any(part.two_sided for part in mt.parts(shape.material))
        front = self._word(shape.material, _Side(front=True, two_sided=two_sided))
        back = self._word(shape.material, _Side(front=False, two_sided=two_sided))
        return front, back, two_sided

    def phase(self, phase: Phase) -> int:
        """Return the word of a phase function; kernels find it like a material."""
        for leaf in phase.leaves:
            self.transmitting.add(leaf.kind)
        return self._word(phase, _Side(front=True, two_sided=False))

    def null(self) -> int:
        """Return the word of a null surface."""
        return self._leaf(mt.NO_SURFACE, _Side(front=True, two_sided=False))

    def _word(self, material: Scatterer, side: _Side) -> int:
        key = (id(material), side.key)
        if key not in self._words:
            self._words[key] = self._new_word(material, side)
        return self._words[key]

    def _new_word(self, scatterer: Scatterer, side: _Side) -> int:
        inner = scatterer.shading(side.front)
        if inner is not scatterer:
            return self._word(inner, side.within(scatterer))
        if scatterer.mixture is not None:
            weight, *parts = scatterer.mixture
            return self._mixture(weight, [self._word(part, side) for part in parts])
        one_sided = not side.inside and not scatterer.is_null
        if side.two_sided and not side.front and one_sided:
            scatterer = _BLACK  # a part that is not two-sided has a black back there
        if scatterer.no_back and not side.front:
            scatterer = mt.NO_SURFACE
        return self._leaf(scatterer, side)

    def _leaf(self, material: Scatterer, side: _Side) -> int:
        before = side.map_words(self._encoder, material) if self._normal_mapped else None
        if self.gloss_before:
            maps = () if before is None else before
            before = np.array([gloss_word(material), *maps], np.uint32)
        if self.slope_before:
            slope = Slope.of(material)
            word = 0 if slope is None else 1 + self._encoder.spectra.row(slope)
            before = np.array([word, *(() if before is None else before)], np.uint32)
        row = self._encoder.row(material, "materials", before)
        if row >= 1 << 24:
            raise SceneError("the scene has more than 16 million words of material parameters")
        self.uvs |= material.has_textures
        self.tangents |= material.uses_tangents
        self.absorption |= material.absorbs_inside
        if material.transmits:
            self.transmitting.add(material.kind)
        return self._leaves.index(type(material)) << 24 | row

    def _mixture(self, weight: object, children: list[int]) -> int:
        words, source = self._encoder.named_words("mixture", "weight", weight, roles.REAL)
        self.uvs |= source == "texture"
        word = MIXTURE << 24 | self._encoder.store.append("mixtures", [*words, *children])
        self._depths[word] = 1 + max(self._depths.get(child, 0) for child in children)
        return word


def gloss_word(material: Scatterer) -> int:
    """Return the gloss of a leaf material for the tree over lights, 0 for a dull material.

    The upper 16 bits are the roughness of its microfacets, alpha. The lower 16 bits are the share
    of the glossy lobe in the albedo at normal incidence. The tree only chooses lights by it: a
    guess costs noise and no truth (kernels/lights/receiver.cl).
    """
    glossy = _GLOSSY.get(material.kind)
    if glossy is None or material.transmits:
        return 0
    alpha, share = glossy(fields_of(material))
    alpha, share = np.clip((alpha, share), 1e-3, 1.0)
    return int(alpha * 65535) << 16 | int(share * 65535)


def _mean(value: object, unknown: float = TEXTURED) -> float:
    """Return the mean of a parameter over wavelengths; `unknown` for a texture."""
    if isinstance(value, (int, float)):
        return float(value)
    if isinstance(value, (RGB, RGBUnbounded)):
        return (value.r + value.g + value.b) / 3.0
    return float(value.sample(SEEN).mean()) if isinstance(value, Spectrum) else unknown


def _metal(values: Values) -> tuple[float, float]:
    u, v = (_mean(values[name], ROUGHLY**2) for name in ("alpha_u", "alpha_v"))
    return float(np.sqrt(u * v)), 1.0


def _plastic(values: Values) -> tuple[float, float]:
    share = _share(STRAIGHT, _mean(values["diffuse_reflectance"]))
    return _mean(values["alpha"], ROUGHLY**2), share


def _principled(values: Values) -> tuple[float, float]:
    metal, albedo = _mean(values["metallic"]), _mean(values["base_color"])
    return _mean(values["roughness"], ROUGHLY) ** 2, _metallic_share(metal, albedo)


def _openpbr(values: Values) -> tuple[float, float]:
    metal, albedo = _mean(values["base_metalness"]), _mean(values["base_color"])
    rough, coat = _mean(values["specular_roughness"], ROUGHLY), _mean(values["coat_weight"])
    if coat > metal:
        rough = min(rough, _mean(values["coat_roughness"], ROUGHLY))
    return rough**2, _metallic_share(metal, albedo)


def _metallic_share(metal: float, albedo: float) -> float:
    return _share(metal * albedo + (1.0 - metal) * STRAIGHT, (1.0 - metal) * albedo)


def _phong(values: Values) -> tuple[float, float]:
    share = _share(_mean(values["specular"]), _mean(values["diffuse"]))
    return float(np.sqrt(2.0 / (4.0 * _mean(values["exponent"], EXPONENT) + 2.0))), share


def _share(glossy: float, diffuse: float) -> float:
    return glossy / max(glossy + diffuse, 1e-6)


_GLOSSY: dict[str, Callable[[Values], tuple[float, float]]] = {
    "rough_conductor": _metal,
    "coated_conductor": _metal,
    "rough_plastic": _plastic,
    "principled": _principled,
    "gltf_surface": _principled,
    "openpbr": _openpbr,
    "phong": _phong,
}
