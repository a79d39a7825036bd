"""Fineness of a guide (transport/guiding/guide.cl), and how much it learns before a film."""

from clpt.scene.integrators import MOST_GUIDE_PATHS

CELLS = 1 << 15  # rows, a power of two
SIDE = 0.14  # of a cell, over the scene's radius
FINE_PATHS = MOST_GUIDE_PATHS  # light paths from which on cells are smaller
FINE_CELLS, FINE_SIDE = 1 << 16, 0.1
BINS = 256  # of a row
PATHS = 1 << 20  # light paths from which it learns
LONG_PATHS = 1 << 22  # the same at most, where a trial has chosen it
LESSON = 8  # samples of such a film for each light path
LONG_LESSON = 64  # the same beyond LONG_PATHS


def paths_for(samples: int) -> int:
    """Return from how many light paths a guide learns for so many samples of a film.

    One takes about as long as a sample, and four times as many leave .7 to .9 of the variance.
    """
    some = min(max(_power_below(samples // LESSON), PATHS), LONG_PATHS)
    return max(some, min(_power_below(samples // LONG_LESSON), MOST_GUIDE_PATHS))


def cells_for(paths: int) -> tuple[int, float]:
    """Return the rows of a guide that learns from so many light paths, and the side of its cells
    over the scene's radius."""
    return (FINE_CELLS, FINE_SIDE) if paths >= FINE_PATHS else (CELLS, SIDE)


def _power_below(number: int) -> int:
    """The largest power of two up to a number."""
    return 1 << max(number.bit_length() - 1, 0)
