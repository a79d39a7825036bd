"""Arrays that take seconds to compute: each process but the first reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clpt.device import buffers


def test_what_was_made_before_is_read(tmp_path: Path, cache_folder: Path) -> None:
    code, made = tmp_path / "code.py", []
    code.write_text("a = 1")

    def make(number: float, others: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        made.append(number)
        return np.full((2, 3), number), np.array(others, np.float32)

    def kept(*given: object) -> tuple[np.ndarray, ...]:
        return buffers.kept(make, *given, files=[code])

    first, again = kept(0.1, (1, 2)), kept(0.1, (1, 2))
    assert made == [0.1] and len(again) == 2
    for one, other in zip(first, again, strict=True):
        assert one.dtype == other.dtype and np.array_equal(one, other)
    kept(0.2, (1, 2))
    kept(0.1, (1, 3))
    code.write_text("a = 2")
    kept(0.1, (1, 2))
    assert made == [0.1, 0.2, 0.1, 0.1]
    for path in (cache_folder / "programs").iterdir():
        path.write_bytes(path.read_bytes()[:-1])
    assert np.array_equal(kept(0.1, (1, 2))[0], first[0])
    assert made == [0.1, 0.2, 0.1, 0.1, 0.1]
