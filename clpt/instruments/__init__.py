"""Instruments: light as numbers with units and standard errors, at points and along rays."""

from clpt.instruments.baking import Texels, bake, texels
from clpt.instruments.false_color import write_false_color
from clpt.instruments.glare_rating import Glare, glare
from clpt.instruments.goniophotometry import Distribution, goniophotometer, write_photometry
from clpt.instruments.measuring import Measurement, measure, photometer
from clpt.instruments.quantities import QUANTITIES
from clpt.instruments.sensor import Sensor
from clpt.instruments.time_of_flight import correlation, echoes, gate, phase_ranges

__all__ = [
    "QUANTITIES",
    "Distribution",
    "Glare",
    "Measurement",
    "Sensor",
    "Texels",
    "bake",
    "correlation",
    "echoes",
    "gate",
    "glare",
    "goniophotometer",
    "measure",
    "phase_ranges",
    "photometer",
    "texels",
    "write_false_color",
    "write_photometry",
]
