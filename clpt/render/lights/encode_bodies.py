"""Homogeneous media that emit, as rows of `lights`: kernels/lights/kinds/emissive_body.cl."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from clpt.render.lights.glow import GlowingBody
from clpt.render.materials.encoder import Encoder
from clpt.render.records.light_rows import BODY, RECORDS


@dataclass(frozen=True)
class BodyLight:
    """A homogeneous medium that is a light; word: of the medium."""

    kind: ClassVar[str] = BODY

    word: int
    body: GlowingBody

    def rows(self, encoder: Encoder) -> np.ndarray:
        """Append the record; return its first word in `light_params` (1,)."""
        body, record = self.body, RECORDS[BODY]
        words = np.zeros(1, record.dtype)
        inverse = np.linalg.inv(np.vstack([body.matrix, [0.0, 0.0, 0.0, 1.0]]))
        words["medium"], words["box"] = self.word, not body.ball
        for axis, name in enumerate("xyz"):
            words[name] = inverse[axis, :3]
            words[f"edge_{name}"] = body.matrix[:, axis]
        words["at"], words["center"] = inverse[:3, 3], body.matrix[:, 3]
        words["inverse"] = 1.0 / body.volume
        first = encoder.store.append("light_params", words.view(np.uint32))
        return np.array([first])
