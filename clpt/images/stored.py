"""An image as its file has it, with the meaning of its numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats32, Matrix, on_host, single
from clpt.errors import SceneError
from clpt.files import budget
from clpt.images.colour import decoded, srgb_to_linear

BLOCK = 1 << 22  # values that are decoded at once, so that what is between takes no memory
CHANNELS = (1, 3, 4)


@dataclass(frozen=True)
class Stored:
    """An image as its file has it: (h, w, c) uint8, or float32 where it has not 8 bits.

    encoded: its colours, but not alpha, went through a transfer: that of sRGB, or light to the
    power of `gamma`. matrix: (3, 3) from its linear colours to Rec. 709, None where they are that.
    notes: on statements of the file that are left out; colour_notes: notes that concern colours
    alone.
    """

    values: NDArray[Any]
    encoded: bool
    gamma: float | None = None
    matrix: Matrix | None = None
    notes: tuple[str, ...] = ()
    colour_notes: tuple[str, ...] = ()

    @property
    def is_profiled(self) -> bool:
        """Whether its colours are others than sRGB or linear Rec. 709."""
        return self.gamma is not None or self.matrix is not None

    def decoded(self, linear: bool = True) -> Floats32:
        """(h, w, c) float32; linear: as linear Rec. 709, else the numbers as they are stored.

        Raises SceneError where memory does not suffice.
        """
        try:
            return self._colours() if linear else self._numbers()
        except MemoryError:
            height, width = self.values.shape[:2]
            message = f"an image of {width}x{height} pixels takes more memory than there is"
            raise SceneError(message) from None

    def meant(self, raw: bool) -> Stored:
        """Return the image without gamma and matrix: as data if raw, else with its colours sRGB, or
        linear Rec. 709."""
        if raw or not self.is_profiled:
            return Stored(self.values, self.encoded)
        return Stored(self.decoded(), encoded=False)

    def notes_of(self, raw: bool) -> tuple[str, ...]:
        """Return notes on statements left out, for values that are data if raw, else colours."""
        return self.notes if raw else (*self.notes, *self.colour_notes)

    def _numbers(self) -> Floats32:
        return _SCALE[self.values] if self.values.dtype == np.uint8 else self.values

    def _colours(self) -> Floats32:
        if not self.encoded and self.matrix is None:
            return self._numbers()
        height, width, count = self.values.shape
        linear = np.empty((height, width, count), np.float32)
        rows = max(BLOCK // max(width * count, 1), 1)
        for first in range(0, height, rows):
            budget.check_time()
            part = slice(first, first + rows)
            linear[part] = self._linear(self.values[part])
        return linear

    def _linear(self, values: NDArray[Any]) -> Floats32:
        """Some rows as linear Rec. 709."""
        linear = self._without_transfer(values)
        if self.matrix is not None and linear.shape[2] >= 3:
            colours = linear[..., :3] @ self.matrix.T.astype(np.float32)
            linear = np.concatenate([colours, linear[..., 3:]], axis=2)
        return linear

    def _without_transfer(self, values: NDArray[Any]) -> Floats32:
        is_bytes, curve = values.dtype == np.uint8, self._curve()
        if not self.encoded:
            return _SCALE[values] if is_bytes else values
        linear = curve(_SCALE)[values] if is_bytes else curve(values)
        if values.shape[2] == 4:
            linear[..., 3] = _SCALE[values[..., 3]] if is_bytes else values[..., 3]
        return linear

    def _curve(self) -> Callable[[Floats32], Floats32]:
        if self.gamma is None:
            return srgb_to_linear
        return partial(decoded, gamma=self.gamma)


_SCALE = np.arange(256, dtype=np.float32) / np.float32(255.0)


def from_array(image: object, where: str | None = None) -> Stored:
    """Return an array (h, w), or (h, w, 1, 3 or 4), in host or device memory as an image.

    Floats are linear. Bytes (uint8) are as in a .png: colours in sRGB, not multiplied by alpha.
    Raises SceneError for other numbers, as these do not say what is white, for other shapes, and
    for None.
    """
    if image is None:
        raise SceneError("an image must be a path or an array, not None", where=where)
    try:
        values = np.asarray(on_host(image))
    except ValueError as error:
        raise SceneError(f"is no array: {error}", where=where) from error
    if values.dtype != np.uint8 and values.dtype.kind != "f":
        advice = ", such as image / 65535" if values.dtype.kind in "iu" else ""
        message = f"must be an array of floats, which are linear{advice}, or of bytes in sRGB"
        raise SceneError(f"{message}, not of {values.dtype}", where=where)
    values = checked(values[..., None] if values.ndim == 2 else values, where)
    if values.dtype == np.uint8:
        return Stored(values, encoded=True)
    return Stored(single(values), encoded=False)


def checked(values: NDArray[Any], where: str | None = None) -> NDArray[Any]:
    """Return texels (h, w, 1, 3 or 4). Raises SceneError for other shapes."""
    if values.ndim != 3 or values.shape[2] not in CHANNELS or values.size == 0:
        wanted = "must be (h, w) or (h, w, 1, 3 or 4) and not empty"
        raise SceneError(f"{wanted}, not {values.shape}", where=where)
    return values
