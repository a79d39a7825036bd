"""What is read does not follow its file: each format, whatever becomes of the file afterwards."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clpt.files import numpy_files
from clpt.formats import native
from tests.formats import fuzz_formats


def truncated(path: Path) -> None:
    os.truncate(path, 0)


def rewritten(path: Path) -> None:
    """Other bytes of the same number in the same file, as `np.save` of another array."""
    with path.open("r+b") as file:
        file.write(bytes(b ^ 0x5A for b in path.read_bytes()))


def replaced(path: Path) -> None:
    other = path.with_name("other")
    other.write_bytes(bytes(path.stat().st_size))
    os.replace(other, path)


FATES: tuple[Callable[[Path], None], ...] = (truncated, rewritten, replaced, Path.unlink)


def content(value: Any, seen: dict[int, Any]) -> bytes:
    """Return a digest of all that a value holds; arrays count by their bytes."""
    if isinstance(value, np.ndarray) and value.dtype.kind != "O":
        return hashlib.sha256(np.ascontiguousarray(value).tobytes()).digest()
    if isinstance(value, (str, bytes, int, float, type, type(None), Path)) or callable(value):
        return repr(value).encode()
    if id(value) in seen:
        return b"again"
    seen[id(value)] = value
    if isinstance(value, Mapping):
        parts: Sequence[Any] = [part for item in value.items() for part in item]
    elif isinstance(value, (Sequence, set, frozenset)):
        parts = list(value)
    elif dataclasses.is_dataclass(value):
        parts = [getattr(value, one.name) for one in dataclasses.fields(value)]
    else:
        parts = list(getattr(value, "__dict__", {}).values())
    inner = [content(part, seen) for part in parts]
    return hashlib.sha256(b"|".join([type(value).__name__.encode(), *inner])).digest()


def is_mapped(path: Path) -> bool:
    return str(path) in Path("/proc/self/maps").read_text()


def read(name: str, folder: Path, number: int) -> tuple[Path, Any]:
    form = fuzz_formats.FORMATS[name]
    path = folder / f"read{form.suffix}"
    path.write_bytes(fuzz_formats.seeds(name)[number])
    return path, form.read(path)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks /proc for maps")
@pytest.mark.parametrize("name", fuzz_formats.FORMATS)
def test_what_is_read_does_not_follow_its_file(tmp_path: Path, name: str) -> None:
    for number in range(len(fuzz_formats.seeds(name))):
        for fate in FATES:
            path, value = read(name, tmp_path, number)
            before = content(value, {})
            assert not is_mapped(path)  # first: a cut map would end the process
            fate(path)
            assert content(value, {}) == before


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks /proc for maps")
@pytest.mark.parametrize("order", "CF")
@pytest.mark.parametrize("kind", ["<f4", ">f4", "<f8", "<f2", "|u1", "<i4"])
def test_arrays_of_each_type_and_order_do_not_follow_their_file(
    tmp_path: Path, kind: str, order: Any
) -> None:
    path = tmp_path / "a.npy"
    values = np.arange(24).reshape(2, 3, 4).astype(kind, order=order)
    for fate in FATES:
        np.save(path, values)
        found = numpy_files.array(path)
        assert found.dtype == values.dtype and not is_mapped(path)
        fate(path)
        np.testing.assert_array_equal(found, values)


NAMED = {  # by what names a .npy: a part of a scene
    "density": {"media": {"m": {"type": "grid", "density": "d.npy", "sigma_t": 1.0}}},
    "albedo_grid": {
        "media": {"m": {
            "type": "grid", "density": "d.npy", "albedo_grid": "c.npy", "sigma_t": 1.0,
        }}
    },
    "sdf_grid": {"shapes": [{"type": "sdf_grid", "file": "d.npy"}]},
    "instances": {
        "groups": {"g": [{"type": "rectangle"}]},
        "shapes": [{"type": "instance", "group": "g", "file": "i.npy"}],
    },
}  # fmt: skip


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks /proc for maps")
@pytest.mark.parametrize("part", NAMED)
@pytest.mark.parametrize("fate", FATES)
def test_a_scene_does_not_follow_the_arrays_that_it_names(
    tmp_path: Path, part: str, fate: Callable[[Path], None]
) -> None:
    lattice = np.linspace(-1.0, 1.0, 64, dtype=np.float32).reshape(4, 4, 4)
    arrays = {
        "d": lattice if part == "sdf_grid" else np.abs(lattice),
        "c": np.full((4, 4, 4, 3), 0.5, np.float32), "i": np.tile(np.eye(3, 4), (4, 1, 1)),
    }  # fmt: skip
    for name, values in arrays.items():
        np.save(tmp_path / f"{name}.npy", values)
    scene = {"camera": {"type": "perspective"}, "film": {"width": 8, "height": 8}, **NAMED[part]}
    if "media" in scene:
        cube = {"type": "cube", "material": {"type": "null"}, "interior": "m"}
        scene["shapes"] = [cube]
    (tmp_path / "s.json").write_text(json.dumps(scene))
    loaded = native.load(tmp_path / "s.json")
    before = content(loaded, {})
    for name in arrays:
        assert not is_mapped(tmp_path / f"{name}.npy")
        fate(tmp_path / f"{name}.npy")
    assert content(loaded, {}) == before
