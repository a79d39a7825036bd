"""Instruments: light as numbers with units and standard errors, at points and along rays."""

from clpt.instruments.measuring import Measurement, measure, photometer
from clpt.instruments.quantities import QUANTITIES
from clpt.instruments.sensor import Sensor

__all__ = ["QUANTITIES", "Measurement", "Sensor", "measure", "photometer"]
