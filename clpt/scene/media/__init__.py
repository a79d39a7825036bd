"""Media: what light does between surfaces."""

from clpt.scene.media.grids import ON_POINTS, Cloud, Grid, Mixture, Soot
from clpt.scene.media.medium import Dyed, Homogeneous, Lattice, Medium

KINDS: tuple[type[Medium], ...] = (Homogeneous, Grid, Cloud, Dyed, Soot, Mixture)

__all__ = [
    "KINDS", "ON_POINTS", "Cloud", "Dyed", "Grid", "Homogeneous", "Lattice", "Medium", "Mixture",
    "Soot",
]  # fmt: skip
