"""Names that users choose from, as plain data: the help of commands imports this and no numpy.

tests/cli/test_help.py keeps them equal to the tables that give them a meaning.
"""

from __future__ import annotations

from typing import Literal

MODES = ("spectral", "rgb")
INTEGRATORS = ("auto", "path", "vcm", "direct", "whitted", "particle_tracer")
SAMPLERS = ("sobol", "zsobol", "independent")
AUTO = "auto"  # light paths as suits the scene
MOST_LIGHT_PATHS = 64  # for a sample of the camera
MOST_SAMPLES = 2**31 - 1  # of a pixel
MOST_SEED = 2**32 - 1  # of random numbers
LAYERS = (
    "albedo", "shading_normal", "geometric_normal", "depth", "z", "position", "uv", "motion",
    "shape_id", "primitive_id", "material_id", "denoising_albedo", "denoising_normal", "direct",
    "indirect", "light_groups", "crypto_object", "crypto_material", "samples", "variance",
)  # fmt: skip
QUANTITIES = (
    "irradiance",
    "spectral_irradiance",
    "scalar_irradiance",
    "illuminance",
    "scalar_illuminance",
    "tristimulus",
    "cct",
    "cri",
    "rf",
    "photon_flux_density",
    "radiance",
    "spectral_radiance",
    "luminance",
)  # of light, to be measured
OBSERVERS = ("cie1931", "cie1964")
SPACES = ("rec709", "rec2020", "display_p3", "aces2065_1", "acescg", "xyz")
LAYOUTS = ("brute", "binary", "wide8", "compact")  # of triangles, for rays
TREES = ("binary", "wide8", "compact")  # those of them that are trees
PICTURE_SCENES = ("cornell", "atrium", "spheres", "glass", "mist")  # of the benchmark
PICTURE_SIZES = ("quick", "standard", "large")  # of the benchmark
Quality = Literal["high", "fast"]
"""high: the surface area heuristic down to the leaves, on CPUs large trees improved by reinsertion;
fast: leaves are cut out of a curve."""
Programs = Literal["own", "shared"]
"""own: compiled for the scene; shared: with all scenes of the usual kinds of materials, textures
and lights."""
Missing = Literal["error", "grey"]
"""What stands for an image file that is not there: an error, or grey and a warning."""

DENOISERS = ("oidn", "statistical")
TONES = ("none", "reinhard", "aces", "agx", "neutral")
OCIO_CONFIG = "ocio://default"  # the config for computer graphics that comes with OpenColorIO
CHANNEL_NAMES = ("clpt", "blender")  # sets of names of channels in an .exr
FOR_SCREENS = (".png", ".jpg", ".jpeg", ".webp")  # files of 8 bits, which exposure concerns
WRITABLE = (".exr", *FOR_SCREENS, ".hdr", ".pfm", ".npy")
Exposure = float | Literal["auto"]
"""Stops by which files of 8 bits are brightened, or those that suit the picture."""

VIEWER = "127.0.0.1"  # where tev and HDRView listen

DROP_SIZES = ("mono", "log_normal", "gamma")  # laws of the sizes of drops
