"""Lenses: what they are made of, read from files, and what they do to light, in float64.

Lengths are in millimetres here, wavelengths in nm.
"""

from clpt.lenses import paraxial
from clpt.lenses.coatings import COATINGS
from clpt.lenses.files import READERS, library, names, read
from clpt.lenses.paraxial import Cardinal, cardinal
from clpt.lenses.prescription import Coat, Prescription, Surface

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
    "paraxial",
    "read",
]
