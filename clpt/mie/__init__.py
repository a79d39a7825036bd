"""Scattering by droplets and other small spheres, by Mie's theory.

`droplets` returns a medium from indices and sizes; the other functions are its steps.
"""

from .droplets import DENSE, Sizes, angles, droplets, sizes, water_index
from .sphere import Spheres, spheres

__all__ = [
    "DENSE", "Sizes", "Spheres", "angles", "droplets", "sizes", "spheres", "water_index",
]  # fmt: skip
