"""Many spheres in a file: a .npz with `centers`, perhaps `radii`, and attributes by their names."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from clpt import output_files
from clpt.errors import SceneError
from clpt.scene.shapes import Spheres
from clpt.scene.textures import ATTRIBUTES

ARRAYS = ("centers", "radii")


def read(path: Path) -> dict[str, Any]:
    """Return the parameters of `spheres` that are in a file. Raises SceneError."""
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: file[name] for name in file.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, AttributeError) as error:
        raise SceneError(f"is no .npz file: {error}", file=path) from None
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
