"""Scattering by droplets and other small spheres, by Mie's theory.

`droplets` returns a medium from indices and sizes; the other functions are its steps.
"""

from .droplets import DENSE, Sizes, Spheres, angles, droplets, sizes, spheres, water_index

__all__ = [
    "DENSE", "Sizes", "Spheres", "angles", "droplets", "sizes", "spheres", "water_index",
]  # fmt: skip
