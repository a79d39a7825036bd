"""The sky on its way to the device: its images and grids."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from clpt.render.lights.encode_grids import members as grid_members
from clpt.render.lights.images import axes_of
from clpt.render.lights.sky import content
from clpt.render.materials.encoder import Encoder
from clpt.scene.lights import Sky
from clpt.sky.dome import COLUMNS, ROWS, SUN_RADIUS, horizon


def lower_sky(lamp: Sky, encoder: Encoder) -> tuple[str, dict[str, ArrayLike]]:
    """Put a sky into the tables; return its record's name and its members.

    Raises SceneError for a transform that is more than a rotation.
    """
    axes, spectra, made = axes_of(lamp), encoder.spectra, content(lamp, encoder.look)
    x, y, z = axes.T
    turn, up = np.radians(lamp.sun_azimuth), np.radians(lamp.sun_elevation)
    members: dict[str, ArrayLike] = {
        "x": np.cos(turn) * x - np.sin(turn) * z,
        "y": y,
        "z": np.sin(turn) * x + np.cos(turn) * z,
        "width": COLUMNS,
        "height": ROWS,
        "texels": encoder.store.append_floats("texels", made.texels),
        "sun_texels": encoder.store.append_floats("texels", made.sun),
        **grid_members(made.corners, made.grid, encoder),
        "horizon": horizon(lamp.altitude),
        "sun_cos": np.cos(up),
        "sun_sin": np.sin(up),
        "sun_radius": np.sin(SUN_RADIUS),
        "sun_share": made.sun_share,
    }
    if made.number is None:
        return "sky", members
    members |= {"bands": made.texels.shape[1], "number": spectra.row(made.number)}
    return "spectral_sky", members
