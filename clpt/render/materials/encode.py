"""Material words: what a hit finds its material by, for each side of a shape.

The upper 8 bits of a word are the number of a leaf kind, or MIXTURE; the lower 24 bits are the
first word of a row in `materials`, or in `mixtures`.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from clpt.errors import SceneError
from clpt.render.materials import gloss
from clpt.render.materials.encoder import Encoder
from clpt.render.materials.normal_maps import NormalPerturbation
from clpt.render.records.parameter_words import MIXTURE, NORMAL_MAP_WORDS
from clpt.render.scene_index import any_of
from clpt.scene import materials as mt
from clpt.scene import roles
from clpt.scene.params import Kind, device_params, fields_of
from clpt.scene.phases import Blend, Phase
from clpt.scene.scatterer import Scatterer
from clpt.scene.shapes import Shape
from clpt.scene.textures import Texture

_NULL, _BLACK = mt.Null(), mt.Diffuse(reflectance=0.0)


@dataclass(frozen=True)
class _Side:
    """A side of a surface, and what stands around the material that is looked at.

    two_sided: the back of the surface is shaded like a front; inside: below a TwoSided.
    """

    front: bool
    two_sided: bool
    inside: bool = False
    perturbation: NormalPerturbation = NormalPerturbation()

    @property
    def key(self) -> tuple[Any, ...]:
        """A key that is equal for sides which are shaded alike."""
        return self.front, self.two_sided, self.inside, self.perturbation.key


class MaterialWords:
    """Makes material words, and notes what the materials that it has met need of the kernels.

    gloss_before: words before a row where its gloss stands, 0 if nobody asks for it;
    uvs, tangents, absorption: whether a material needs them; transmitting: kinds of leaves of which
    some let light through; mixture_depth: how deep masks and blends nest.
    """

    def __init__(
        self,
        encoder: Encoder,
        leaves: tuple[type[Scatterer], ...],
        normal_mapped: bool,
        asks_gloss: bool,
    ):
        self._encoder, self._leaves, self._normal_mapped = encoder, leaves, normal_mapped
        self.gloss_before = (1 + NORMAL_MAP_WORDS * normal_mapped) * asks_gloss
        self._words: dict[tuple[int, tuple[Any, ...]], int] = {}
        self._depths: dict[int, int] = {}  # of mixtures, by their words
        self.uvs = self.tangents = self.absorption = False
        self.transmitting: set[str] = set()

    @property
    def mixture_depth(self) -> int:
        return max(self._depths.values(), default=0)

    def sides(self, shape: Shape) -> tuple[int, int, bool]:
        """Return the words of a shape's front and back, and whether it is two-sided."""
        two_sided = any_of(shape.material, mt.TwoSided)
        front = self._word(shape.material, _Side(front=True, two_sided=two_sided))
        back = self._word(shape.material, _Side(front=False, two_sided=two_sided))
        return front, back, two_sided

    def phase(self, phase: Phase) -> int:
        """Return the word of a phase function, which is found as the material of a side is."""
        if isinstance(phase, Blend):
            children = [self.phase(part) for part in (phase.first, phase.second)]
            return self._mixture_of(phase.weight, children)
        self.transmitting.add(phase.kind)
        return self._leaf(phase, _Side(front=True, two_sided=False))

    def null(self) -> int:
        """Return the word of a surface that is not there."""
        return self._leaf(_NULL, _Side(front=True, two_sided=False))

    def _word(self, material: mt.Material, side: _Side) -> int:
        """The word of a material on a side; the same pair has the same word."""
        key = (id(material), side.key)
        if key not in self._words:
            self._words[key] = self._new_word(material, side)
        return self._words[key]

    def _new_word(self, material: mt.Material, side: _Side) -> int:
        if isinstance(material, mt.TwoSided):
            chosen = material.front if side.front or material.back is None else material.back
            return self._word(chosen, dataclasses.replace(side, inside=True))
        if isinstance(material, (mt.NormalMap, mt.BumpMap)):
            within = side.perturbation.within(material, side.inside)
            return self._word(material.material, dataclasses.replace(side, perturbation=within))
        if isinstance(material, mt.Mask):
            return self._mixture(material.opacity, _NULL, material.material, side)
        if isinstance(material, mt.Blend):
            return self._mixture(material.weight, material.first, material.second, side)
        one_sided = not side.inside and not isinstance(material, mt.Null)
        if side.two_sided and not side.front and one_sided:
            material = _BLACK  # the back of a one-sided part of a two-sided surface
        if material.no_back and not side.front:
            material = _NULL
        return self._leaf(material, side)

    def _leaf(self, material: Scatterer, side: _Side) -> int:
        before = side.perturbation.words(self._encoder, material) if self._normal_mapped else None
        if self.gloss_before:
            maps = () if before is None else before
            before = np.array([gloss.word(material), *maps], np.uint32)
        row = self._encoder.row(material, "materials", before)
        if row >= 1 << 24:
            raise SceneError("the scene has more than 16 million words of material parameters")
        self.uvs |= _has_textures(material)
        self.tangents |= material.uses_tangents
        if isinstance(material, mt.Material):
            self.uvs |= any(map(_has_textures, material.layers))
            self.absorption |= material.absorption != mt.CLEAR
        if material.transmits:
            self.transmitting.add(material.kind)
        return self._leaves.index(type(material)) << 24 | row

    def _mixture(self, weight: object, first: mt.Material, second: mt.Material, side: _Side) -> int:
        return self._mixture_of(weight, [self._word(one, side) for one in (first, second)])

    def _mixture_of(self, weight: object, children: list[int]) -> int:
        words, source = self._encoder.named_words("mixture", "weight", weight, roles.REAL)
        self.uvs |= source == "texture"
        word = MIXTURE << 24 | self._encoder.store.append("mixtures", [*words, *children])
        self._depths[word] = 1 + max(self._depths.get(child, 0) for child in children)
        return word


def _has_textures(kind: Kind) -> bool:
    """Whether a parameter of a kind is a texture that kernels read."""
    values = fields_of(kind)
    return any(isinstance(values[name], Texture) for name in device_params(type(kind)))
