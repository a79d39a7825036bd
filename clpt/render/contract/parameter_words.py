"""Sizes that lowering and kernels share, such as the words of each parameter in a row."""

from __future__ import annotations

from clpt.records import MATERIAL_KINDS, RERADIATION_SIZES
from clpt.scene.params import (
    ORDERS,
    SPECTRUM_ROLES,
    Kind,
    Param,
    device_params,
    interior_params,
)

NORMAL_MAP_WORDS = 11  # before a material's row, see kernels/path/shading_frame_mapped.cl
MIXTURE = MATERIAL_KINDS["mixture"]
FILM_COSINES = 128  # of the table of a film's colours, from 0 to 1
RERADIATION_STEP = RERADIATION_SIZES["step"]  # [nm] between the nodes of a matrix
SPECTRAL = (*SPECTRUM_ROLES, "reradiation")  # roles whose values are spectra in the kernels

# How many words a parameter takes in a row of `materials`, `textures` or `light_params`.
SPECTRUM_WORDS = 5  # x y z w and where the value comes from: 0 here, > 0 texture, < 0 table
REAL_WORDS = 2  # the value, and 0 or 1 + the texture
ORDERS_WORDS = 2 * ORDERS + 1
ANGULAR_WORDS = 5  # of the table: first value, cosines, rows; first wavelength, rows a nm
MEASUREMENT_WORDS = 1 + SPECTRUM_WORDS  # its first number; which colour a wavelength has
MERL_WORDS = 4  # its first number; rows of what red, green and blue are
LAYERS_WORDS = 2  # where the layers lie, see clpt.render.lowering.spectra.thin_films; how many


def words(param: Param) -> int:
    """Return the number of 4-byte words that a parameter takes in its row."""
    if param.role in SPECTRAL:
        return SPECTRUM_WORDS
    given = {"real": REAL_WORDS, "orders": ORDERS_WORDS, "layers": LAYERS_WORDS}
    given["angular"] = ANGULAR_WORDS
    given |= {"measurement": MEASUREMENT_WORDS, "merl": MERL_WORDS}
    return given.get(param.role, 1)


def row_words(cls: type[Kind]) -> int:
    """Return the length of a kind's row."""
    return sum(map(words, [*device_params(cls).values(), *interior_params(cls).values()]))
