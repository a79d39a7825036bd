"""Textures that combine others as programs in postfix order, see kernels/textures/texture.cl.

A program's row in `textures` is the position of "program" in the table of texture kinds, then
instructions of two words: operand, operation and perhaps END, and the operand's argument.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, reduce
from typing import Any

import numpy as np

from clpt import spectra
from clpt.arrays import Words
from clpt.render.records.materials import SPECTRUM_WORDS
from clpt.render.records.tables import TableStore
from clpt.render.records.textures import END, OPERANDS, OPERATIONS
from clpt.render.spectra.encode import SpectraTable
from clpt.scene.roles import EMISSION, FACTOR, INDEX, REAL, REFLECTANCE, Role, Spectral
from clpt.scene.textures import Bitmap, Checkerboard, MeshAttribute, Mix, Product, Texture
from clpt.spectra import RGB, Constant, RGBIlluminant, RGBUnbounded, Spectrum, Tabulated, cie
from clpt.spectra.spectrum import d65, primaries

Code = list[tuple[int, int]]
Lower = Callable[[Texture, Role], int]


def is_composite(value: object) -> bool:
    """Return whether a value is a texture that combines others."""
    if isinstance(value, Checkerboard):
        return any(_textured(colour) for colour in (value.color0, value.color1))
    return isinstance(value, (Product, Mix))


def folded(value: object, role: Role) -> Any:
    """Return a value whose constants are combined where that is exact.

    In the role REAL all constants are numbers. In other roles a constant counts as a number if it
    is the same at all wavelengths.
    """
    if isinstance(value, Checkerboard) and is_composite(value):
        pattern = Checkerboard(color0=0.0, color1=1.0, to_uv=value.to_uv)
        return folded(Mix(first=value.color0, second=value.color1, amount=pattern), role)
    if isinstance(value, Product):
        return _product(folded(value.first, role), folded(value.second, role), role, value.rgb)
    if isinstance(value, Mix):
        first, second = folded(value.first, role), folded(value.second, role)
        amount = folded(value.amount, REAL)
        a, b, t = _number(first, role), _number(second, role), _number(amount, REAL)
        if t in (0.0, 1.0):
            end, number = (second, b) if t else (first, a)
            return end if role is not REAL or number is None else Constant(number)
        if a is not None and b is not None and t is not None and role is not EMISSION:
            return Constant(a + (b - a) * t)
        return Mix(first=first, second=second, amount=amount if t is None else t)
    return value


def _product(a: Any, b: Any, role: Role, rgb: bool) -> Any:
    if not _textured(a) and _textured(b):
        a, b = b, a  # so that light comes from the texture, and the constant is its factor
    x, y = _number(a, role), _number(b, role)
    if x is not None and y is not None:
        return RGBIlluminant(*[x * y] * 3) if role is EMISSION else Constant(x * y)
    if y == 1.0 and _textured(a):
        return a
    if x == 1.0 and role is not EMISSION:
        return b
    return Product(first=a, second=b, rgb=rgb)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Scaled(Product):
    """A spectrum times a number."""


def separated(value: object, role: Role) -> Any:
    """Return a value with RGB products of colours as sums of three products of numbers.

    A summand is one of `primaries` times its channel. A program adds by mixing halves: the first
    two summands, then this sum with the third. So the first two are times four, the third times
    two.
    """
    if isinstance(value, Mix):
        return replace(
            value, first=separated(value.first, role), second=separated(value.second, role)
        )
    if not isinstance(value, Product):
        return value
    light = role is EMISSION
    if not value.rgb:
        factor = separated(value.second, REFLECTANCE if light else role)
        return replace(value, first=separated(value.first, role), second=factor)
    red, green, blue = (
        _scaled(_primary(i, times, light), _factors(value, i)) for i, times in enumerate((4, 4, 2))
    )
    return Mix(first=Mix(first=red, second=green, amount=0.5), second=blue, amount=0.5)


@cache
def _primary(number: int, times: float, light: bool) -> Tabulated:
    """Return a primary times a number, and times D65 for light."""
    values = times * primaries()[number].sample(cie.GRID)
    return Tabulated(cie.GRID, values * d65().sample(cie.GRID) if light else values, "hold")


def _scaled(spectrum: Spectrum, factors: list[Any]) -> Any:
    """Return a spectrum times textures and numbers; the numbers become their product."""
    number = float(np.prod([f for f in factors if not _textured(f)]))
    product: Any = spectrum
    for factor in (*filter(_textured, factors), *([number] if number != 1.0 else [])):
        product = _Scaled(first=product, second=factor)
    return product


def _factors(value: Any, number: int) -> list[Any]:
    """Return factors whose product is a channel of a product of colours.

    They are numbers, and textures in the role REAL. number: the channel, 0 to 2.
    """
    if isinstance(value, Product):
        return [*_factors(value.first, number), *_factors(value.second, number)]
    if isinstance(value, (Bitmap, MeshAttribute)):
        return [replace(value, channel="rgb"[number])]
    if isinstance(value, Mix):
        first, second = (_joint(_factors(end, number)) for end in (value.first, value.second))
        return [Mix(first=first, second=second, amount=value.amount)]
    return [value if _textured(value) else float(value.to_rgb("unbounded")[number])]


def _joint(factors: list[Any]) -> Any:
    return reduce(lambda a, b: Product(first=a, second=b), factors)


def _number(value: Any, role: Role) -> float | None:
    """Return the number of a constant, None for other values."""
    if isinstance(value, (int, float)):
        return float(value)
    if isinstance(value, Constant):
        return float(value.value)
    if role is REAL and not _textured(value):
        return float(spectra.luminance(value.to_rgb("unbounded")))
    return None


def _textured(value: object) -> bool:
    return isinstance(value, Texture)


def program(
    value: Texture, role: Role, store: TableStore, spectra_: SpectraTable, lower: Lower
) -> tuple[Words, int]:
    """Return the instructions of a composite in a role, and how many values they stack.

    value: a result of `folded`; lower: appends a texture that combines no others and returns its
    row.
    """
    code, depth = _Writer(role, store, spectra_, lower).code(value, "own")
    last, argument = code[-1]
    return np.array([*code[:-1], (last | END, argument)], np.uint32).reshape(-1), depth


class _Writer:
    """Writes the instructions of a program."""

    def __init__(self, role: Role, store: TableStore, spectra_: SpectraTable, lower: Lower):
        self.role, self.store, self.spectra, self.lower = role, store, spectra_, lower

    def code(self, value: object, use: str) -> tuple[Code, int]:
        """Return instructions that push a value, and how many values they stack.

        use: an operand's name.
        """
        if isinstance(value, _Scaled):
            return self._joined([(value.first, use)], (value.second, "real"), "multiply")
        if isinstance(value, Product):
            second = "factor" if use == "own" and self.role is EMISSION else use
            return self._joined([(value.first, use)], (value.second, second), "multiply")
        if isinstance(value, Mix):
            return self._joined(
                [(value.first, use), (value.second, use)], (value.amount, "real"), "mix"
            )
        return [self._operand(value, use)], 1

    def _joined(self, pushed: list, last: tuple[Any, str], operation: str) -> tuple[Code, int]:
        joined: Code = []
        depth = 0
        for below, (value, use) in enumerate(pushed):
            code, needed = self.code(value, use)
            joined, depth = joined + code, max(depth, below + needed)
        value, use = last
        if isinstance(value, (Product, Mix)):
            code, needed = self.code(value, use)
            joined, depth = joined + code, max(depth, len(pushed) + needed)
            operand, argument = OPERANDS.index("top"), 0
        else:
            operand, argument = self._operand(value, use)
        return [*joined, (operand | OPERATIONS[operation], argument)], depth

    def _operand(self, value: Any, use: str) -> tuple[int, int]:
        role = {"own": self.role, "factor": REFLECTANCE, "real": REAL}[use]
        if _textured(value):
            # in a program of numbers every operand is a number
            name = "own" if role == self.role else use
            return OPERANDS.index(name), self.lower(value, role)
        number = _number(value, role)
        if number is not None and role is not EMISSION:
            word = np.float32(number).view(np.uint32)
            return OPERANDS.index("number"), int(word)
        return OPERANDS.index("constant"), self.store.append("textures", self._words(value, role))

    def _words(self, value: Any, role: Role) -> Words:
        """Return a colour or spectrum as five words; colours may exceed 1, emission is D65."""
        if role is EMISSION and isinstance(value, Constant):
            value = RGBIlluminant(*[value.value] * 3)
        if role in (REFLECTANCE, INDEX) and type(value) in (RGB, RGBUnbounded):
            rgb = (value.r, value.g, value.b)
            words = np.zeros(SPECTRUM_WORDS, np.float32)
            if self.spectra.spectral:
                words[3], words[:3] = spectra.unbounded(rgb)
            else:
                words[:3] = rgb
            return words.view(np.uint32)
        if type(value) is RGBUnbounded:
            value = RGB(value.r, value.g, value.b)
        assert isinstance(role, Spectral)
        return self.spectra.words(value, FACTOR if role is REFLECTANCE else role)[0]
