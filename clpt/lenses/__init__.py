"""Lenses: their surfaces and glasses, readers of lens files, and exact optics in float64.

Lengths are in millimetres here, wavelengths in nm.
"""

from clpt.lenses import tracing
from clpt.lenses.files import READERS, library, names, read
from clpt.lenses.prescription import COATINGS, Coat, Prescription, Surface
from clpt.lenses.tracing import Cardinal, cardinal

__all__ = [
    "COATINGS",
    "READERS",
    "Cardinal",
    "Coat",
    "Prescription",
    "Surface",
    "cardinal",
    "library",
    "names",
    "read",
    "tracing",
]
