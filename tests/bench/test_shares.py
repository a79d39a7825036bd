"""The bare kernels beside which a render's stages are timed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from bench.shares import Bare
from clpt import bvh, device
from clpt.device.program import BoundKernel


def test_they_are_compiled_before_they_are_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each has run on as many rays as there may be, before any ray is given."""
    sizes: list[int] = []
    enqueue = BoundKernel.enqueue

    def noted(self: BoundKernel, queue: Any, size: Sequence[int], *rest: Any) -> Any:
        sizes.append(size[0])
        return enqueue(self, queue, size, *rest)

    on = device.choose()
    corners = np.eye(3, dtype=np.float32)
    tree = bvh.build(on, corners, np.array([[0, 1, 2]], np.uint32), layout="wide8")
    monkeypatch.setattr(BoundKernel, "enqueue", noted)
    bare = Bare(on, tree, 128)
    assert sizes == [128, 128]
    assert bare.trace("closest", np.zeros((0, 8), np.float32)) >= 0.0
