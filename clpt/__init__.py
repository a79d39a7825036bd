"""clpt: a spectral path tracer in OpenCL.

>>> import clpt
>>> scene = clpt.load("scenes/cornell_box")
>>> image = clpt.render(scene, spp=64)
>>> clpt.write_image("out.exr", image)
"""

import logging
import os
import sys

if sys.argv[:1] == ["-m"] and "clpt" in sys.orig_argv:  # python -m clpt: Python has put the current
    # folder first, from which nothing is imported unless clpt itself is there
    _home = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    sys.path[:1] = [path for path in sys.path[:1] if path == _home]

from clpt.budget import Budget
from clpt.cluster.multi_renderer import MultiRenderer
from clpt.colour.view import View
from clpt.errors import (
    ClptError,
    ClusterError,
    DeviceError,
    KernelBuildError,
    MemoryBudgetError,
    SceneError,
    UnknownKindError,
    UnusedParameterError,
)
from clpt.formats import load, save
from clpt.images import read as read_image
from clpt.images import write as write_image
from clpt.rays import Accel, AllHits, Hits, InstancedAccel
from clpt.render.codegen.library import kernel_source
from clpt.render.film.denoised_picture import DenoisedPicture
from clpt.render.film.layer_channels import write_layers
from clpt.render.options import RenderOptions
from clpt.render.pictures import Pictures as _Pictures
from clpt.render.progress import Progress
from clpt.render.renderer import Renderer, render
from clpt.render.wavefront.film_state import FilmState
from clpt.scene import Scene
from clpt.spectral_exr import SpectralImage
from clpt.spectral_exr import read as read_spectral
from clpt.spectral_exr import write as write_spectral
from clpt.version import VERSION as __version__
from clpt.view.notebook import widget as _widget

_Pictures.make_widget = _widget  # renderers know nothing of who shows their pictures
logging.getLogger("clpt").addHandler(logging.NullHandler())  # quiet until the program asks

__all__ = [
    "Accel",
    "AllHits",
    "Budget",
    "ClptError",
    "ClusterError",
    "DenoisedPicture",
    "DeviceError",
    "FilmState",
    "Hits",
    "InstancedAccel",
    "KernelBuildError",
    "MemoryBudgetError",
    "MultiRenderer",
    "Progress",
    "RenderOptions",
    "Renderer",
    "Scene",
    "SceneError",
    "SpectralImage",
    "UnknownKindError",
    "UnusedParameterError",
    "View",
    "__version__",
    "kernel_source",
    "load",
    "read_image",
    "read_spectral",
    "render",
    "save",
    "write_image",
    "write_layers",
    "write_spectral",
]
