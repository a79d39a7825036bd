"""Cameras as uniform records, which kernels/cameras/kinds/<kind>.cl read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from clpt.render.camera import encode_lens as lens
from clpt.render.camera.find import dispersive_glasses, members, rigid
from clpt.render.records.camera_rows import RECORDS
from clpt.scene.cameras import Camera, Lens


def lower_camera(
    camera: Camera, width: int, height: int, glass_rows: Sequence[int] = ()
) -> tuple[str, NDArray[np.float32]]:
    """Return a camera's kind and the words (n,) float32 of its record and what follows it.

    width, height: of the film [pixels]; glass_rows: in `spectra`, of its `dispersive_glasses`; none
    where all wavelengths have one index. Raises SceneError for a matrix, a glass or a lens that
    cannot be used.
    """
    rows = dict(zip(dispersive_glasses(camera), glass_rows, strict=False))
    if isinstance(camera, Lens):
        return camera.kind, lens.lens_words(camera, rigid(camera), width, height, rows)
    record = RECORDS[camera.kind]
    words = np.zeros((), record.dtype)
    for name, value in members(camera, width, height).items():
        words[name] = value
    for row in rows.values():
        words["glass"] = row
    return camera.kind, words.reshape(1).view(np.float32)
