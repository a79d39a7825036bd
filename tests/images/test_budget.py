"""Memory of images is asked for by what headers say; there is one way in."""

from __future__ import annotations

import ast
import tracemalloc
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

import clpt
from clpt import images
from clpt.errors import SceneError
from clpt.files import budget
from clpt.images import stored
from tests.images import files

PACKAGE = Path(clpt.__file__).parent
PLAIN = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}


def bombs(folder: Path) -> dict[str, Path]:
    """Files of a few kilobytes that announce much, by name."""
    zeros = np.zeros((1500, 1500), np.float32)
    OpenEXR.File(dict(PLAIN), {f"ch{i:02d}": zeros for i in range(24)}).write(str(folder / "a.exr"))
    files.png(folder / "b.png", np.zeros((2000, 2000, 3), np.uint16), 16, 2)
    files.png(folder / "c.png", np.zeros((2000, 2000, 4), np.uint8), 8, 6)
    (folder / "d.hdr").write_bytes(b"#?RADIANCE\n\n-Y 2000 +X 2000\n")
    (folder / "e.pfm").write_bytes(b"PF\n3000 3000\n-1\n")
    np.save(folder / "f.npy", np.zeros((3000, 3000, 3), np.float32))
    return {path.name: path for path in sorted(folder.iterdir())}


def test_what_takes_too_much_is_refused_by_its_header(tmp_path):
    limits = budget.Budget(memory=16 << 20)
    for name, path in bombs(tmp_path).items():
        tracemalloc.start()
        with pytest.raises(SceneError) as raised, budget.opened(limits):
            images.read(path)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert str(raised.value).startswith(f"{path}: "), name
        assert "of memory, the limit is 16.0 MiB" in str(raised.value)
        assert peak < 4 << 20, name


def test_channels_that_are_not_the_picture_cost_nothing(tmp_path):
    plane = np.ones((500, 500), np.float32)
    channels = {"R": plane, "G": plane, "B": plane} | {f"z{i:02d}": plane for i in range(40)}
    OpenEXR.File(dict(PLAIN), channels).write(str(tmp_path / "a.exr"))
    limits = budget.Budget(memory=3 * 8 * 500 * 500)
    with budget.opened(limits):
        assert images.read(tmp_path / "a.exr").shape == (500, 500, 3)
    refused = pytest.raises(SceneError, match="what its channels hold would take")
    with refused, budget.opened(limits):
        images.read_channels(tmp_path / "a.exr")


@pytest.mark.parametrize("suffix", images.WRITABLE)
def test_memory_that_is_not_there_is_an_error_of_the_file(tmp_path, monkeypatch, suffix):
    path = tmp_path / f"a{suffix}"
    images.write(path, np.ones((4, 4, 3)))

    def none_left(*arguments: object) -> None:
        raise MemoryError

    monkeypatch.setitem(images.READERS, suffix, none_left)
    with pytest.raises(SceneError, match="reading it takes more memory than there is"):
        images.read(path)


def test_decoding_without_memory_is_an_error(monkeypatch):
    image = images.Stored(np.zeros((4, 5, 3), np.float32), encoded=True)

    def none_left(*arguments: object) -> None:
        raise MemoryError

    monkeypatch.setattr(stored, "srgb_to_linear", none_left)
    with pytest.raises(SceneError, match="an image of 5x4 pixels takes more memory than there is"):
        image.decoded()


def opening_calls(path: Path) -> set[str]:
    """What a module calls that opens an image: of Pillow, or OpenEXR."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            owner = ast.unparse(node.func.value)
            if (owner, node.func.attr) == ("Image", "open"):
                found.add("Image.open")
            if owner == "OpenEXR" and node.func.attr in ("File", "InputFile"):
                found.add("OpenEXR")
    return found


def test_one_module_opens_the_files_of_each_library():
    found = {
        path.relative_to(PACKAGE).as_posix(): calls
        for path in PACKAGE.rglob("*.py")
        if (calls := opening_calls(path))
    }
    assert found == {"images/pillow.py": {"Image.open"}, "images/exr_files.py": {"OpenEXR"}}
