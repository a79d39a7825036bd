"""Fineness of a guide, see kernels/guiding/guide.cl; when clpt.render.trials is asked for one."""

CELLS = 1 << 15  # rows, a power of two
SIDE = 0.14  # of a cell, over the scene's radius
BINS = 256  # of a row
PATHS = 1 << 20  # light paths from which it learns
LONG_PATHS = 1 << 22  # the same, where a trial has chosen it, as many samples are to come
WORTH = 1 << 27  # samples of a film beside which compiling what a trial needs is little
