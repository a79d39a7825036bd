"""Measured materials: their data, readers and writers of files, and a fit to any reflection."""

from clpt.measured.fit import fit, grey
from clpt.measured.measurement import Measurement, read, write
from clpt.measured.merl import MerlTable, tabulate
from clpt.measured.merl import read as read_merl
from clpt.measured.merl import write as write_merl
from clpt.measured.polarized import read as read_polarized

__all__ = [
    "Measurement", "MerlTable", "fit", "grey", "read", "read_merl", "read_polarized", "tabulate",
    "write", "write_merl",
]  # fmt: skip
