"""Normal and bump maps: the words before a material's row."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from clpt.arrays import Words
from clpt.render.materials.encoder import Encoder
from clpt.render.records.materials import NORMAL_MAP_WORDS
from clpt.scene import roles
from clpt.scene.materials import BumpMap, NormalMap
from clpt.scene.scatterer import Scatterer
from clpt.scene.textures import Bitmap, Placed, placed_in

INSIDE, ALONG_V, AS_IT_IS, UNSHADED, NORMAL, HEIGHT, SECOND = (1 << i for i in range(7))
DIRECTIONS = 11  # first of the words with the directions of u and v, four for each texture

Map: TypeAlias = NormalMap | BumpMap


@dataclass(frozen=True)
class NormalPerturbation:
    """The maps around a leaf; inside: whether the maps are inside of a two-sided material."""

    normal: NormalMap | None = None
    bump: BumpMap | None = None
    inside: bool = False

    def within(self, outer: Any, inside: bool) -> NormalPerturbation:
        """Return this with another map, of the kind that is missing."""
        return dataclasses.replace(self, inside=inside, **{outer.slot: outer})

    @property
    def key(self) -> tuple[int, int, bool]:
        """A key that is equal for perturbations by the same maps."""
        return id(self.normal), id(self.bump), self.inside

    def words(self, encoder: Encoder, leaf: Scatterer) -> Words:
        """Append the textures, and return the NORMAL_MAP_WORDS words."""
        words = np.zeros(NORMAL_MAP_WORDS, np.uint32)
        flags = INSIDE if self.inside else 0
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


def _channel(texture: Bitmap, channel: str) -> Bitmap:
    """Return a coordinate of the normals as a texture of numbers, 0 to 1."""
    return dataclasses.replace(texture, channel=channel, raw=True)
