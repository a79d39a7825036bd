"""For authors of materials: the tests that clpt's materials pass."""

from clpt.testing.checks import check_material
from clpt.testing.probe import Probe

__all__ = ["Probe", "check_material"]
