"""Sizes of films that make a trial worth it, see clpt.render.trials: what it takes is not large."""

SAMPLES = 1 << 23  # of the film, for a first way to be tried, which compiles nothing more
GUIDE_RAYS = 1 << 27  # rays, some 20 s of a core, beside which to compile a guide is little
PLAIN_RAYS = 1 << 30  # the same, beside which to compile kernels without light paths is little
SHARE = 1 << 7  # samples of a film for each sample of a way that is tried
