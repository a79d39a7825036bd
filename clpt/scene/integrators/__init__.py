"""Integrators, samplers, filters and the film: how a scene becomes a picture."""

from clpt.scene.integrators.film import (
    LIGHT_SPEED,
    MOST_BANDS,
    BlackmanHarris,
    Box,
    Film,
    Filter,
    Gaussian,
    Lanczos,
    Mitchell,
    Tent,
)
from clpt.scene.integrators.integrator import (
    DEEPEST,
    MOST_GUIDE_PATHS,
    Auto,
    Direct,
    Independent,
    Integrator,
    ParticleTracer,
    Path,
    Sampler,
    Sobol,
    Vcm,
    Whitted,
    Zsobol,
    is_long,
    shared,
)

NO_AOV = (  # for scenes of former versions
    'the integrator aov is gone: name its channels in "film": {"layers": ["depth", ...]}, and '
    'write "integrator": {"type": "path", "max_depth": 1} where no picture is wanted'
)
KINDS = (Auto, Path, Vcm, Direct, Whitted, ParticleTracer)
HAVE_LAYERS = (Auto, Path, Vcm, Direct)  # beside the picture
TIMED = (Auto, Path, Direct)  # whose light has known times
SAMPLERS = (Sobol, Zsobol, Independent)
PIXELWISE = (Sobol, Independent)  # samplers whose pixels do not know of each other
FILTERS = (Box, Tent, Gaussian, Mitchell, Lanczos, BlackmanHarris)

__all__ = [
    "DEEPEST", "FILTERS", "HAVE_LAYERS", "KINDS", "LIGHT_SPEED", "MOST_BANDS",
    "MOST_GUIDE_PATHS", "NO_AOV", "PIXELWISE", "SAMPLERS", "TIMED", "Auto", "BlackmanHarris", "Box",
    "Direct", "Film", "Filter", "Gaussian", "Independent", "Integrator", "Lanczos", "Mitchell",
    "ParticleTracer", "Path", "Sampler", "Sobol", "Tent", "Vcm", "Whitted", "Zsobol",
    "is_long", "shared",
]  # fmt: skip
