"""A word that kernels see while they run, where a device shares memory with the host so finely."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyopencl as cl

from .context import Device


class Flag:
    """A word that the host raises and lowers, also while kernels run.

    argument: for kernels, a `global const volatile uint *`; None, a null pointer, where they would
    not see it. Any thread may call the methods, and a signal's handler too: they wait for nothing.
    """

    def __init__(self, device: Device):
        self.argument: Any = None
        if not device.info.shares_words:
            return
        try:
            self._words = cl.fsvm_empty(device.context, 1, np.uint32)
        except cl.Error:  # another device of the caller's context cannot share it
            return
        self._words[0] = 0
        self.argument = cl.SVM(self._words)

    def raise_(self) -> None:
        """Let kernels see 1."""
        if self.argument is not None:
            self._words[0] = 1

    def lower(self) -> None:
        """Let kernels see 0."""
        if self.argument is not None:
            self._words[0] = 0
