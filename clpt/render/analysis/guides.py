"""Fineness of a guide, see kernels/guiding/guide.cl; when clpt.render.wavefront.pilot is asked."""

CELLS = 1 << 15  # rows, a power of two
SIDE = 0.14  # of a cell, over the scene's radius
BINS = 256  # of a row
PATHS = 1 << 20  # light paths from which it learns
PILOTED_PATHS = 1 << 17  # where a pilot decides
PILOT_BEGINS = 1 << 22  # samples of the whole film without a guide, before it learns
WORTH = 1 << 27  # samples of a film beside which compiling a guide and its pilot are nothing
