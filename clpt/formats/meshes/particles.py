"""Many spheres in a file: a .npz with `centers`, perhaps `radii`, and attributes by their names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from clpt.errors import SceneError
from clpt.files import numpy_files, output_files
from clpt.scene.shapes import Spheres
from clpt.scene.textures import ATTRIBUTES

ARRAYS = ("centers", "radii")


def read(path: Path) -> dict[str, Any]:
    """Return the parameters of `spheres` that are in a file. Raises SceneError."""
    found = numpy_files.arrays(path)
    for name in found:
        if name not in ARRAYS and not name.startswith(ATTRIBUTES):
            message = (
                f"holds {name!r}; there may be centers, radii and attributes {ATTRIBUTES[0]}..."
            )
            raise SceneError(message, file=path)
    if "centers" not in found:
        raise SceneError("has no array 'centers'", file=path)
    given: dict[str, Any] = {name: found.pop(name) for name in ARRAYS if name in found}
    return {**given, "attributes": found}


def write(path: Path, spheres: Spheres) -> None:
    """Write what `read` returns of spheres. Raises OSError."""
    with output_files.replacing(path) as partial:
        np.savez(partial, centers=spheres.centers, radii=spheres.radii, **spheres.attributes)
