"""Droplets and other small spheres: what light does in a cloud of them, by Mie's theory.

`droplets` makes a medium from indices and sizes; the others are its steps.
"""

from .droplets import DENSE, angles, droplets
from .sizes import Sizes, sizes
from .sphere import Spheres, spheres
from .water import water_index

__all__ = [
    "DENSE", "Sizes", "Spheres", "angles", "droplets", "sizes", "spheres", "water_index",
]  # fmt: skip
