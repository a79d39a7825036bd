"""Fineness of a guide, see kernels/guiding/guide.cl, and how much it learns before a film."""

CELLS = 1 << 15  # rows, a power of two
SIDE = 0.14  # of a cell, over the scene's radius
BINS = 256  # of a row
PATHS = 1 << 20  # light paths from which it learns
LONG_PATHS = 1 << 22  # the same at most, where a trial has chosen it
LESSON = 8  # samples of such a film for each light path


def paths_for(samples: int) -> int:
    """Return from how many light paths a guide learns for so many samples of a film.

    One takes about as long as a sample, and four times as many leave .7 to .9 of the variance.
    """
    wanted = 1 << max((samples // LESSON).bit_length() - 1, 0)
    return min(max(wanted, PATHS), LONG_PATHS)
