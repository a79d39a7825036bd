"""Fineness of a guide: see kernels/guiding/guide.cl."""

CELLS = 1 << 15  # rows, a power of two
SIDE = 0.14  # of a cell, over the scene's radius
BINS = 256  # of a row
PATHS = 1 << 20  # light paths from which it learns
