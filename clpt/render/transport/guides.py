"""The cells of a guide (transport/guiding/guide.cl), and the light paths that train it."""

from clpt.scene.integrators import MOST_GUIDE_PATHS

CELLS = 1 << 15  # rows, a power of two
SIDE = 0.14  # of a cell, over the scene's radius
FINE_PATHS = MOST_GUIDE_PATHS  # with so many light paths cells are smaller
FINE_CELLS, FINE_SIDE = 1 << 16, 0.1
BINS = 256  # of a row
PATHS = 1 << 20  # light paths that train a guide
LONG_PATHS = 1 << 22  # the most light paths of a guide that a trial has chosen
LESSON = 8  # samples of the film for each light path of such a guide
LONG_LESSON = 64  # the same beyond LONG_PATHS


def paths_for(samples: int) -> int:
    """Return the number of light paths that train a guide; samples: of the whole film.

    A light path takes about as long as a sample; four times as many light paths leave .7 to .9 of
    the variance.
    """
    some = min(max(_power_below(samples // LESSON), PATHS), LONG_PATHS)
    return max(some, min(_power_below(samples // LONG_LESSON), MOST_GUIDE_PATHS))


def cells_for(paths: int) -> tuple[int, float]:
    """Return the rows of a guide, and the side of its cells over the scene's radius.

    paths: light paths that train it.
    """
    return (FINE_CELLS, FINE_SIDE) if paths >= FINE_PATHS else (CELLS, SIDE)


def _power_below(number: int) -> int:
    """The largest power of two up to a number."""
    return 1 << max(number.bit_length() - 1, 0)
