"""Bricks of grids that emit, as rows of `lights`: kernels/lights/kinds/emissive_brick.cl."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from clpt.render.lights.bricks import Glow
from clpt.render.materials.encoder import Encoder
from clpt.render.records.light_rows import BRICK, RECORDS


@dataclass(frozen=True)
class BrickLights:
    """The bricks of a medium that are lights; word: of the medium."""

    kind: ClassVar[str] = BRICK

    word: int
    glow: Glow

    def rows(self, encoder: Encoder) -> np.ndarray:
        """Append a record for each brick; return the first word of each in `light_params`."""
        glow, record = self.glow, RECORDS[BRICK]
        words = np.zeros(len(glow.numbers), record.dtype)
        across = np.cross(glow.edges[:, [1, 2, 0]], glow.edges[:, [2, 0, 1]])
        surface = 2.0 * np.linalg.norm(across, axis=2).sum(axis=1)
        volume = np.abs(np.linalg.det(glow.edges))
        words["medium"], words["number"], words["corner"] = self.word, glow.numbers, glow.corners
        for axis, name in enumerate("xyz"):
            words[name] = glow.edges[:, axis]
        words["chord"], words["inverse"] = 4.0 * volume / surface, 1.0 / volume
        first = encoder.store.append("light_params", words.view(np.uint32))
        return first + record.words * np.arange(len(words))
