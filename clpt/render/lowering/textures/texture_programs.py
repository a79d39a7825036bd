"""Textures that combine others, as programs in postfix order for kernels/texture/program.cl.

A program's row in `textures` is the position of "program" in the table of texture kinds, then
instructions of two words: operand, operation and perhaps END, and the operand's argument.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clpt import spectra
from clpt.render.contract.parameter_words import SPECTRUM_WORDS
from clpt.render.contract.texture_records import END, OPERANDS, OPERATIONS
from clpt.render.lowering.spectra_table import SpectraTable
from clpt.render.lowering.tables import TableStore, Words
from clpt.scene.textures import Checkerboard, Mix, Product, Texture
from clpt.spectra import RGB, Constant, RGBUnbounded

Code = list[tuple[int, int]]
Lower = Callable[[Texture, str], int]


def is_composite(value: Any) -> bool:
    """Whether a value is a texture that combines others."""
    if isinstance(value, Checkerboard):
        return any(_textured(colour) for colour in (value.color0, value.color1))
    return isinstance(value, (Product, Mix))


def folded(value: Any, role: str) -> Any:
    """Return a value, with constants that meet each other put together where that is exact.

    In the role "real" all constants are numbers; else those that are the same at all wavelengths.
    """
    if isinstance(value, Checkerboard) and is_composite(value):
        pattern = Checkerboard(color0=0.0, color1=1.0, to_uv=value.to_uv)
        return folded(Mix(first=value.color0, second=value.color1, amount=pattern), role)
    if isinstance(value, Product):
        return _product(folded(value.first, role), folded(value.second, role), role)
    if isinstance(value, Mix):
        first, second = folded(value.first, role), folded(value.second, role)
        amount = folded(value.amount, "real")
        a, b, t = _number(first, role), _number(second, role), _number(amount, "real")
        if t in (0.0, 1.0):
            return second if t else first
        if a is not None and b is not None and t is not None and role != "emission":
            return Constant(a + (b - a) * t)
        return Mix(first=first, second=second, amount=amount if t is None else t)
    return value


def _product(a: Any, b: Any, role: str) -> Any:
    if not _textured(a) and _textured(b):
        a, b = b, a  # so that light comes from the texture, and the constant is its factor
    x, y = _number(a, role), _number(b, role)
    if x is not None and y is not None:
        return Constant(x * y)
    if y == 1.0 and _textured(a):
        return a
    if x == 1.0 and role != "emission":
        return b
    return Product(first=a, second=b)


def _number(value: Any, role: str) -> float | None:
    """The number that a constant is."""
    if isinstance(value, (int, float)):
        return float(value)
    if isinstance(value, Constant):
        return float(value.value)
    if role == "real" and not _textured(value):
        return float(spectra.luminance(value.to_rgb("unbounded")))
    return None


def _textured(value: Any) -> bool:
    return isinstance(value, Texture)


def program(
    value: Texture, role: str, store: TableStore, spectra_: SpectraTable, lower: Lower
) -> tuple[Words, int]:
    """Return the instructions of a composite in a role, and how many values they stack.

    value: as `folded` gave it; lower: puts a texture that combines nothing into the tables and
    returns its row.
    """
    code, depth = _Writer(role, store, spectra_, lower).code(value, "own")
    last, argument = code[-1]
    return np.array([*code[:-1], (last | END, argument)], np.uint32).reshape(-1), depth


class _Writer:
    """Writes one program."""

    def __init__(self, role: str, store: TableStore, spectra_: SpectraTable, lower: Lower):
        self.role, self.store, self.spectra, self.lower = role, store, spectra_, lower

    def code(self, value: Any, use: str) -> tuple[Code, int]:
        """Instructions that push a value, and how many they stack; use: an operand's name."""
        if isinstance(value, Product):
            second = "factor" if use == "own" and self.role == "emission" else use
            return self._joined([(value.first, use)], (value.second, second), "multiply")
        if isinstance(value, Mix):
            return self._joined(
                [(value.first, use), (value.second, use)], (value.amount, "real"), "mix"
            )
        return [self._operand(value, use)], 1

    def _joined(self, pushed: list, last: tuple[Any, str], operation: str) -> tuple[Code, int]:
        made: Code = []
        depth = 0
        for below, (value, use) in enumerate(pushed):
            code, needed = self.code(value, use)
            made, depth = made + code, max(depth, below + needed)
        value, use = last
        if isinstance(value, (Product, Mix)):
            code, needed = self.code(value, use)
            made, depth = made + code, max(depth, len(pushed) + needed)
            operand, argument = OPERANDS.index("top"), 0
        else:
            operand, argument = self._operand(value, use)
        return [*made, (operand | OPERATIONS[operation], argument)], depth

    def _operand(self, value: Any, use: str) -> tuple[int, int]:
        role = {"own": self.role, "factor": "reflectance"}.get(use, use)
        if _textured(value):
            # of a program for a number every operand is one
            name = "own" if role == self.role else use
            return OPERANDS.index(name), self.lower(value, role)
        number = _number(value, role)
        if number is not None and role != "emission":
            word = np.float32(number).view(np.uint32)
            return OPERANDS.index("number"), int(word)
        return OPERANDS.index("constant"), self.store.append("textures", self._words(value, role))

    def _words(self, value: Any, role: str) -> Words:
        """A colour or spectrum as five words; colours may exceed one."""
        if role in ("reflectance", "index") and type(value) in (RGB, RGBUnbounded):
            rgb = (value.r, value.g, value.b)
            words = np.zeros(SPECTRUM_WORDS, np.float32)
            if self.spectra.spectral:
                words[3], words[:3] = spectra.unbounded(rgb)
            else:
                words[:3] = rgb
            return words.view(np.uint32)
        if type(value) is RGBUnbounded:
            value = RGB(value.r, value.g, value.b)
        return self.spectra.words(value, "factor" if role == "reflectance" else role)[0]
