"""Images around the scene on their way to the device: their texels and grids."""

from __future__ import annotations

from numpy.typing import ArrayLike

from clpt.render.lights.encode_grids import members as grid_members
from clpt.render.lights.images import axes_of, content
from clpt.render.materials.encoder import Encoder
from clpt.scene.lights import CubeMap, Envmap


def lower_image(lamp: Envmap | CubeMap, encoder: Encoder) -> dict[str, ArrayLike]:
    """Put an image light's texels and grid into the tables; return its members.

    Those of a spectral image have `bands`. Raises SceneError for what is no image, or a transform
    that is more than a rotation.
    """
    axes, made = axes_of(lamp), content(lamp, encoder.look)
    encoder.warnings.update(made.notes)
    members: dict[str, ArrayLike] = {name: axes[:, i] for i, name in enumerate("xyz")}
    members |= {
        "width": made.width,
        "height": made.height,
        "texels": encoder.store.append_floats("texels", made.texels),
        **grid_members(made.corners, made.grid, encoder),
    }
    if made.number is not None:
        members |= {"bands": made.bands, "number": encoder.spectra.row(made.number)}
    return members
