"""Measured materials: what they are, their files, and how one is made of a function."""

from clpt.measured.fit import fit, grey
from clpt.measured.measurement import Measurement
from clpt.measured.rgl import read, write

__all__ = ["Measurement", "fit", "grey", "read", "write"]
