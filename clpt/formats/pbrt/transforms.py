"""The directives of a PBRT file that change the current transform, and coordinate systems."""

from __future__ import annotations

import numpy as np

from clpt import transforms
from clpt.errors import SceneError, did_you_mean
from clpt.files import text
from clpt.formats.pbrt.files import Files


class TransformDirectives(Files):
    """The directives that change `state.ctm`."""

    def _concat(self, matrix: transforms.Matrix) -> None:
        end = None if self.state.end is None else self.state.end @ matrix
        self._set(self.state.ctm @ matrix, end)

    def _set(self, matrix: transforms.Matrix, end: transforms.Matrix | None = None) -> None:
        """Set the transforms that are active; end: at the last time, None for the same."""
        end = matrix if end is None else end
        if not (np.isfinite(matrix).all() and np.isfinite(end).all()):
            raise SceneError("the transform is not finite any more")
        state = self.state
        at_first, at_last = state.active
        former = state.ctm if state.end is None else state.end
        end = end if at_last else former
        state.ctm = matrix if at_first else state.ctm
        state.end = None if end is state.ctm else end

    def identity(self) -> None:
        self._set(np.eye(4))

    def translate(self) -> None:
        self._concat(transforms.translate(self.lexer.numbers(3, "Translate")))

    def scale(self) -> None:
        self._concat(transforms.scale(self.lexer.numbers(3, "Scale")))

    def rotate(self) -> None:
        angle, *axis = self.lexer.numbers(4, "Rotate")
        self._concat(transforms.rotate(axis, angle))

    def look_at(self) -> None:
        values = self.lexer.numbers(9, "LookAt")
        self._concat(transforms.inverse(transforms.look_at(values[:3], values[3:6], values[6:])))

    def transform(self) -> None:
        self._set(self._matrix())

    def concat_transform(self) -> None:
        self._concat(self._matrix())

    def _matrix(self) -> transforms.Matrix:
        """Take 16 numbers, column by column."""
        return self.lexer.numbers(16, self.name).reshape(4, 4).T.copy()

    def coordinate_system(self) -> None:
        self.contents.shared.systems[self.lexer.string("a name")] = self.state.ctm, self.state.end

    def coord_sys_transform(self) -> None:
        name = self.lexer.string("a name")
        systems = self.contents.shared.systems
        if name not in systems:
            raise SceneError(f"there is no coordinate system {name!r}{did_you_mean(name, systems)}")
        self._set(*systems[name])

    def active_transform(self) -> None:
        which = text.decode(self.lexer.next("All, StartTime or EndTime"))
        if which not in ("All", "StartTime", "EndTime"):
            raise SceneError(f"{which[:40]!r} is none of All, StartTime, EndTime")
        self.state.active = which != "EndTime", which != "StartTime"

    def transform_times(self) -> None:
        first, last = self.lexer.numbers(2, "TransformTimes").tolist()
        if not last > first:
            raise SceneError(f"the last time, {last:g} s, must be after the first, {first:g} s")
        self.contents.shared.times = first, last
