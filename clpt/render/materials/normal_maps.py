"""Normal and bump maps on their way to the device: words before a material's row."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from clpt.arrays import Words
from clpt.render.materials.encoder import Encoder
from clpt.render.records.parameter_words import NORMAL_MAP_WORDS
from clpt.scene import roles
from clpt.scene.materials import BumpMap, NormalMap
from clpt.scene.scatterer import Scatterer
from clpt.scene.textures import Bitmap, Placed, placed_in

INSIDE, ALONG_V, AS_IT_IS, UNSHADED, NORMAL, HEIGHT, SECOND = (1 << i for i in range(7))
TURNS = 11  # first of the words that tell what maps are along

Map: TypeAlias = NormalMap | BumpMap


@dataclass(frozen=True)
class NormalPerturbation:
    """The maps around a leaf. inside: whether they stand inside of a two-sided material."""

    normal: NormalMap | None = None
    bump: BumpMap | None = None
    inside: bool = False

    def within(self, outer: Map, inside: bool) -> NormalPerturbation:
        """Return this with one more map, of another kind than it has."""
        if isinstance(outer, NormalMap):
            return dataclasses.replace(self, normal=outer, inside=inside)
        return dataclasses.replace(self, bump=outer, inside=inside)

    @property
    def key(self) -> tuple[int, int, bool]:
        """A key that is equal for perturbations by the same maps."""
        return id(self.normal), id(self.bump), self.inside

    def words(self, encoder: Encoder, leaf: Scatterer) -> Words:
        """Return the NORMAL_MAP_WORDS words, and put the textures into the tables."""
        made = np.zeros(NORMAL_MAP_WORDS, np.uint32)
        flags = INSIDE if self.inside else 0
        if self.normal is not None and self.normal.map is not None:
            flags |= NORMAL | _flags(self.normal) | (ALONG_V if self.normal.along_v else 0)
            made[1] = np.float32(self.normal.scale).view(np.uint32)
            for i, channel in enumerate("rgb"):
                image = _channel(self.normal.map, channel)
                made[3 + 2 * i : 5 + 2 * i] = _real(image, encoder)
        if self.bump is not None:
            flags |= HEIGHT | _flags(self.bump)
            made[2] = np.float32(self.bump.scale).view(np.uint32)
            made[9:11] = _real(self.bump.height, encoder)
        along = None if self.normal is None else self.normal.map
        for i, value in enumerate((along, *(leaf.directing or (None, None)))):
            placed = placed_in(value)
            whole = i > 0 or flags & ALONG_V
            made[TURNS + 4 * i : TURNS + 4 * i + 4] = _to_uv(placed if whole else None)
            if placed is not None and placed.mapping == "uv1":
                flags |= SECOND << i
        made[0] = flags
        return made


def _to_uv(placed: Placed | None) -> Words:
    """Return what the directions of a texture's u and v have of those of its set of uv."""
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
    """One coordinate of the normals, 0 to 1."""
    return dataclasses.replace(texture, channel=channel, raw=True)
