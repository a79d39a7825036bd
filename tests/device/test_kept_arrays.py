"""Values that take long to compute: each process but the first reads them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clpt.files import disk_cache


def test_what_was_made_before_is_read(
    tmp_path: Path, cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(disk_cache, "WORTH", 0.0)
    codes, made = [tmp_path / "a.py", tmp_path / "b.py"], []
    for code in codes:
        code.write_text(code.name)

    def kept(number: float, others: tuple[int, ...], code: Path = codes[0]) -> Any:
        def make() -> tuple[np.ndarray, np.ndarray]:
            made.append(number)
            return np.full((2, 3), number), np.array(others, np.float32)

        given = np.array([number]), repr(others).encode()
        return disk_cache.remembered([code], given, make)

    first, again = kept(0.1, (1, 2)), kept(0.1, (1, 2))
    assert made == [0.1] and len(again) == 2
    for one, other in zip(first, again, strict=True):
        assert one.dtype == other.dtype and np.array_equal(one, other)
    kept(0.2, (1, 2))
    kept(0.1, (1, 3))
    kept(0.1, (1, 2), codes[1])
    assert made == [0.1, 0.2, 0.1, 0.1]
    for path in (cache_folder / "programs").iterdir():
        path.write_bytes(path.read_bytes()[:-1])
    assert np.array_equal(kept(0.1, (1, 2))[0], first[0])
    assert made == [0.1, 0.2, 0.1, 0.1, 0.1]


def test_what_takes_no_time_is_not_kept(cache_folder: Path) -> None:
    assert disk_cache.remembered([], [b"a"], lambda: 1) == 1
    assert not (cache_folder / "programs").exists()


def test_values_of_files(
    tmp_path: Path, cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file's value is made again when the file has changed; a young file's is not kept."""
    files = [tmp_path / "a", tmp_path / "b"]
    for file in files:
        file.write_text("one")

    def values(*by: object) -> list[tuple[Any, bool]]:
        kept = disk_cache.OfFiles([], "a scene")
        found = [kept.get(file.stat(), by, file.read_text) for file in files]
        kept.store()
        return found

    assert values() == values() == [("one", True)] * 2
    monkeypatch.setattr(disk_cache, "_FRESH", -60.0)
    values()
    assert values() == [("one", False)] * 2
    files[0].write_text("two")
    assert values() == [("two", True), ("one", False)]
    assert values() == [("two", False), ("one", False)]
    assert values("other") == [("two", True), ("one", True)]
