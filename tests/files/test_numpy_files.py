"""NumPy's files of strangers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.files import numpy_files


def written(path: Path, header: str) -> Path:
    """Write a .npy file of 64 bytes with a header, which NumPy itself would not write."""
    text = header.ljust(118 - 1) + "\n"
    path.write_bytes(
        b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode() + bytes(64)
    )
    return path


def test_an_array_is_read(tmp_path: Path) -> None:
    values = np.arange(6, dtype=np.float32).reshape(2, 3)
    np.save(tmp_path / "a.npy", values)
    np.testing.assert_array_equal(numpy_files.array(tmp_path / "a.npy"), values)


@pytest.mark.parametrize(
    ("descr", "shape"),
    [("<f8", "(2, False, 4)"), ("<f8", "(True,)"), ("<f8", "(-1,)"), ("|O", "(1,)"),
     ("<f8", "(1.0,)"), ("<f8", "(100000,)"), ("|V0", "(4,)")],
)  # fmt: skip
def test_a_header_that_lies_is_told(tmp_path: Path, descr: str, shape: str) -> None:
    header = f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"
    with pytest.raises(SceneError, match=r"is no \.npy file|is cut short"):
        numpy_files.array(written(tmp_path / "a.npy", header))
