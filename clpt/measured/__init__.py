"""Measured materials: what they are, their files, and how one is made of a function."""

from clpt.measured.fit import fit, grey
from clpt.measured.measurement import Measurement
from clpt.measured.merl import MerlTable, tabulate
from clpt.measured.merl import read as read_merl
from clpt.measured.merl import write as write_merl
from clpt.measured.rgl import read, write

__all__ = [
    "Measurement", "MerlTable", "fit", "grey", "read", "read_merl", "tabulate", "write",
    "write_merl",
]  # fmt: skip
