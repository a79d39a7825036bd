"""Views of OpenColorIO (`pip install 'clpt[colour]'`): from light to the codes of a display.

Files get OpenColorIO's own result. A device gets a table of it, see `View.table`.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from clpt.arrays import Floats32
from clpt.choices import OCIO_CONFIG
from clpt.errors import SceneError, UnknownKindError
from clpt.files import input_files

REC709 = "Linear Rec.709 (sRGB)"  # of OpenColorIO's own config

# A table's axes: more points about black than among highlights. What is outside is clamped.
TABLE_SIZE = 97
LOWEST, HIGHEST, NEAR = -0.5, 128.0, 0.012


@dataclass(frozen=True, eq=False)
class Table:
    """Codes of colours over a cube, for kernels/film/table.cl.

    values: (n, n, n, 4) float32, by blue, green and red, the last is 0; bounds: asinh(v / NEAR) at
    the ends of an axis, NEAR, and 0.
    """

    values: Floats32
    bounds: tuple[float, float, float, float]


class View:
    """A view of OpenColorIO: the transform from light to the values of a display.

    name: of the view; display, look: by default the config's first display and no look; config: a
    file, or a name such as ocio://default, or "$OCIO" for what the environment names. By default
    each is the config's own default.

    Raises SceneError where OpenColorIO is not installed or refuses the config, UnknownKindError for
    names that the config does not have.
    """

    def __init__(
        self,
        name: str | None = None,
        *,
        display: str | None = None,
        look: str | None = None,
        config: str = OCIO_CONFIG,
    ):
        ocio = _opencolorio()
        self.config = os.environ.get("OCIO", "") if config == "$OCIO" else config
        if not self.config:
            raise SceneError("the environment has no OCIO that names a config", where="config")
        loaded = _loaded(ocio, self.config)
        self.display = display or loaded.getDefaultDisplay()
        if self.display not in [*loaded.getDisplays()]:
            raise UnknownKindError("display", self.display, loaded.getDisplays())
        self.name = name or loaded.getDefaultView(self.display)
        views = [*loaded.getViews(self.display)]
        if self.name not in views:
            raise UnknownKindError(f"view of {self.display!r}", self.name, views)
        self.look = look
        if look is not None and look not in [*loaded.getLookNames()]:
            raise UnknownKindError("look", look, loaded.getLookNames())
        self._processors = _processors(ocio, loaded, self)

    def __repr__(self) -> str:
        look = "" if self.look is None else f", look={self.look!r}"
        return f"View({self.name!r}, display={self.display!r}{look}, config={self.config!r})"

    def codes(self, colours: Floats32) -> Floats32:
        """Return the codes (..., 3) float32 that a display gets for linear Rec. 709 (..., 3).

        What is no number is black. 0 and 1 are the least and the largest code.
        """
        known = np.nan_to_num(colours, nan=0.0, posinf=HIGHEST, neginf=0.0)
        return np.clip(self._unclipped(known.astype(np.float32)), 0.0, 1.0)

    def _unclipped(self, colours: Floats32) -> Floats32:
        codes = colours.copy()
        for processor in self._processors:
            processor.applyRGB(codes.reshape(-1))
        return codes

    def table(self, size: int = TABLE_SIZE) -> Table:
        """Return the codes as a table, to which tetrahedra are fitted."""
        low, high = np.arcsinh(LOWEST / NEAR), np.arcsinh(HIGHEST / NEAR)
        axis = (NEAR * np.sinh(np.linspace(low, high, size))).astype(np.float32)
        values = np.zeros((size, size, size, 4), np.float32)
        blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
        values[..., :3] = self._unclipped(np.stack([red, green, blue], axis=-1))
        return Table(values, (float(low), float(high), NEAR, 0.0))


def views(config: str = OCIO_CONFIG) -> dict[str, tuple[str, ...]]:
    """Return the views of a config by display. Raises SceneError."""
    loaded = _loaded(_opencolorio(), config)
    return {display: tuple(loaded.getViews(display)) for display in loaded.getDisplays()}


def _opencolorio() -> Any:
    """The package. Raises SceneError where it is not installed."""
    try:
        import PyOpenColorIO
    except ImportError as error:
        advice = "a view needs OpenColorIO: pip install 'clpt[colour]'; tone curves do not"
        raise SceneError(advice, where="view") from error
    return PyOpenColorIO


def _loaded(ocio: Any, config: str) -> Any:
    """A config. Raises SceneError."""
    if os.path.exists(config):  # else it is a name of the library's own
        input_files.regular(Path(config))
    try:
        return ocio.Config.CreateFromFile(config)
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        first = str(error).strip().splitlines()[0]
        raise SceneError(f"OpenColorIO cannot read it: {first}", file=config) from error


def _processors(ocio: Any, config: Any, view: View) -> list[Any]:
    """From linear Rec. 709 to the config's light, and from that to codes. Raises SceneError."""
    light = config.getRoleColorSpace(ocio.ROLE_SCENE_LINEAR)
    shown = ocio.DisplayViewTransform(src=light, display=view.display, view=view.name)
    both = ocio.GroupTransform()
    if view.look is not None:
        both.appendTransform(ocio.LookTransform(src=light, dst=light, looks=view.look))
    both.appendTransform(shown)
    try:
        found = [
            ocio.Config.GetProcessorFromBuiltinColorSpace(REC709, config, light),
            config.getProcessor(both),
        ]
        return [one.getDefaultCPUProcessor() for one in found if not one.isNoOp()]
    except (ocio.Exception, ocio.ExceptionMissingFile) as error:
        first = str(error).strip().splitlines()[0]
        raise SceneError(f"OpenColorIO refuses the view: {first}", file=view.config) from error
