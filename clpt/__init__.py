"""clpt: a spectral path tracer in OpenCL.

>>> import clpt
>>> image = clpt.render("scenes/cornell_box", spp=64)
>>> clpt.write_image("out.exr", image)
"""

import importlib
import logging
import os
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if sys.argv[:1] == ["-m"] and "clpt" in sys.orig_argv:  # python -m clpt: Python has put the current
    # folder first; it stays only if clpt lies there
    _home = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    sys.path[:1] = [path for path in sys.path[:1] if path == _home]

if TYPE_CHECKING:
    from clpt.cluster.multi_renderer import MultiRenderer
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
    from clpt.files.budget import Budget
    from clpt.formats import load, load_dict, save
    from clpt.formats.mitsuba.dicts import ScalarTransform4f
    from clpt.images import read as read_image
    from clpt.images import write as write_image
    from clpt.images.colour import View
    from clpt.images.spectral_exr import SpectralImage
    from clpt.images.spectral_exr import read as read_spectral
    from clpt.images.spectral_exr import write as write_spectral
    from clpt.instruments import Measurement, measure
    from clpt.rays import Accel, AllHits, Hits, InstancedAccel
    from clpt.render.film.layers import write_layers
    from clpt.render.film.pictures import DenoisedPicture
    from clpt.render.film.state import FilmState
    from clpt.render.flow.programs import kernel_source
    from clpt.render.one_call import render
    from clpt.render.options import RenderOptions
    from clpt.render.progress import Progress
    from clpt.render.renderer import Renderer
    from clpt.scene import Film, Scene
    from clpt.version import VERSION as __version__

_Cleaning = importlib.import_module("clpt.errors").Cleaning
logging.getLogger("clpt").addHandler(_Cleaning())  # quiet until the program asks

_HOMES = {  # the module of each name, and what it is called there
    "Budget": ("files.budget", "Budget"),
    "MultiRenderer": ("cluster.multi_renderer", "MultiRenderer"),
    "View": ("images.colour", "View"),
    "ClptError": ("errors", "ClptError"),
    "ClusterError": ("errors", "ClusterError"),
    "DeviceError": ("errors", "DeviceError"),
    "KernelBuildError": ("errors", "KernelBuildError"),
    "MemoryBudgetError": ("errors", "MemoryBudgetError"),
    "SceneError": ("errors", "SceneError"),
    "UnknownKindError": ("errors", "UnknownKindError"),
    "UnusedParameterError": ("errors", "UnusedParameterError"),
    "load": ("formats", "load"),
    "load_dict": ("formats", "load_dict"),
    "ScalarTransform4f": ("formats.mitsuba.dicts", "ScalarTransform4f"),
    "save": ("formats", "save"),
    "read_image": ("images", "read"),
    "write_image": ("images", "write"),
    "render": ("render.one_call", "render"),
    "measure": ("instruments", "measure"),
    "Measurement": ("instruments", "Measurement"),
    "Accel": ("rays", "Accel"),
    "AllHits": ("rays", "AllHits"),
    "Hits": ("rays", "Hits"),
    "InstancedAccel": ("rays", "InstancedAccel"),
    "kernel_source": ("render.flow.programs", "kernel_source"),
    "DenoisedPicture": ("render.film.pictures", "DenoisedPicture"),
    "write_layers": ("render.film.layers", "write_layers"),
    "RenderOptions": ("render.options", "RenderOptions"),
    "Progress": ("render.progress", "Progress"),
    "Renderer": ("render.renderer", "Renderer"),
    "FilmState": ("render.film.state", "FilmState"),
    "Film": ("scene", "Film"),
    "Scene": ("scene", "Scene"),
    "SpectralImage": ("images.spectral_exr", "SpectralImage"),
    "read_spectral": ("images.spectral_exr", "read"),
    "write_spectral": ("images.spectral_exr", "write"),
    "__version__": ("version", "VERSION"),
}
_SHOWN = ("MultiRenderer", "Renderer")  # renderers, whose pictures a notebook shows
_MAKE_SCENES = ("Scene", "load", "load_dict")


class _Front(ModuleType):
    """The front page of clpt: what it names is imported when it is first used."""

    def __getattr__(self, name: str) -> Any:
        if name in _HOMES:
            module, inside = _HOMES[name]
            value = vars(importlib.import_module(f"clpt.{module}"))[inside]
            if name in _SHOWN:
                _give_widgets()
            if name in _MAKE_SCENES:
                _give_pictures()
        else:
            value = _submodule(name)
        self.__dict__[name] = value
        return value

    def __setattr__(self, name: str, value: object) -> None:
        # The package clpt.render, once imported, would take the place of the function.
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*self.__dict__, *__all__})


def _give_widgets() -> None:
    """Let renderers have widgets: they know nothing of who shows their pictures."""
    from clpt.render.resumable import ResumableRenderer
    from clpt.view.notebook import widget

    ResumableRenderer._make_widget = widget


def _give_pictures() -> None:
    """Let scenes show themselves in notebooks: they know no renderer."""
    from clpt.scene import Scene as Shown

    def picture(scene: Shown) -> bytes:
        from clpt.render.one_call import small_picture

        return small_picture(scene)

    Shown._picture = staticmethod(picture)


def _submodule(name: str) -> ModuleType:
    """Return a module of clpt, as `clpt.rays` after `import clpt`. Raises AttributeError."""
    if not name.startswith("_"):
        try:
            return importlib.import_module(f"clpt.{name}")
        except ModuleNotFoundError as error:
            if error.name != f"clpt.{name}":
                raise
    raise AttributeError(f"module 'clpt' has no attribute {name!r}")


sys.modules[__name__].__class__ = _Front

__all__ = [
    "Accel",
    "AllHits",
    "Budget",
    "ClptError",
    "ClusterError",
    "DenoisedPicture",
    "DeviceError",
    "Film",
    "FilmState",
    "Hits",
    "InstancedAccel",
    "KernelBuildError",
    "Measurement",
    "MemoryBudgetError",
    "MultiRenderer",
    "Progress",
    "RenderOptions",
    "Renderer",
    "ScalarTransform4f",
    "Scene",
    "SceneError",
    "SpectralImage",
    "UnknownKindError",
    "UnusedParameterError",
    "View",
    "__version__",
    "kernel_source",
    "load",
    "load_dict",
    "measure",
    "read_image",
    "read_spectral",
    "render",
    "save",
    "write_image",
    "write_layers",
    "write_spectral",
]
