"""Textures that combine others as programs in postfix order, see kernels/textures/texture.cl.

A program's row in `textures` is the position of "program" in the table of texture kinds, then
instructions of two words: operand, operation and perhaps END, and the operand's argument.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clpt import spectra
from clpt.arrays import Words
from clpt.render.records.materials import SPECTRUM_WORDS
from clpt.render.records.tables import TableStore
from clpt.render.records.textures import END, OPERANDS, OPERATIONS
from clpt.render.spectra.encode import SpectraTable
from clpt.scene.roles import EMISSION, FACTOR, INDEX, REAL, REFLECTANCE, Role, Spectral
from clpt.scene.values import Operation, Texture, Use, constant_number, is_texture
from clpt.spectra import RGB, Constant, RGBIlluminant, RGBUnbounded

Code = list[tuple[int, int]]
Lower = Callable[[Texture, Role], int]


def program(
    value: Texture, role: Role, store: TableStore, spectra_: SpectraTable, lower: Lower
) -> tuple[Words, int]:
    """Return the instructions of a composite in a role, and how many values they stack.

    value: a result of `Texture.folded`; lower: appends a texture that combines no others and
    returns its row.
    """
    code, depth = _Writer(role, store, spectra_, lower).code(value, "own")
    last, argument = code[-1]
    return np.array([*code[:-1], (last | END, argument)], np.uint32).reshape(-1), depth


class _Writer:
    """Writes the instructions of a program."""

    def __init__(self, role: Role, store: TableStore, spectra_: SpectraTable, lower: Lower):
        self.role, self.store, self.spectra, self.lower = role, store, spectra_, lower

    def code(self, value: object, use: Use) -> tuple[Code, int]:
        """Return instructions that push a value, and how many values they stack."""
        operation = self._operation(value, use)
        if operation is None:
            return [self._operand(value, use)], 1
        name, operands = operation
        joined: Code = []
        depth = 0
        for below, (operand_value, operand_use) in enumerate(operands[:-1]):
            code, needed = self.code(operand_value, operand_use)
            joined, depth = joined + code, max(depth, below + needed)
        last, last_use = operands[-1]
        if self._operation(last, last_use):
            code, needed = self.code(last, last_use)
            joined, depth = joined + code, max(depth, len(operands) - 1 + needed)
            operand, argument = OPERANDS.index("top"), 0
        else:
            operand, argument = self._operand(last, last_use)
        return [*joined, (operand | OPERATIONS[name], argument)], depth

    def _operation(self, value: object, use: Use) -> Operation | None:
        return value.operation(use, self.role) if is_texture(value) else None

    def _operand(self, value: Any, use: Use) -> tuple[int, int]:
        role = {"own": self.role, "factor": REFLECTANCE, "real": REAL}[use]
        if is_texture(value):
            # in a program of numbers every operand is a number
            name = "own" if role == self.role else use
            return OPERANDS.index(name), self.lower(value, role)
        number = constant_number(value, role)
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
