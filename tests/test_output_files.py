"""Files are replaced whole: an error, a full disk or a killed process leaves the old one."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from clpt import images, output_files, spectral_exr
from clpt.errors import SceneError

ROOT = Path(__file__).resolve().parents[1]
SUFFIXES = [*images.WRITABLE, ".bands.exr", ".bands.npy"]
posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")

# In a child of its own for each suffix: write a picture, with a disk that is full or until a kill.
CHILD = """
import os, resource, signal, sys
from pathlib import Path
from clpt import output_files
from clpt.errors import SceneError
from tests.test_output_files import SUFFIXES, write
folder, event = Path(sys.argv[1]), sys.argv[2]
for suffix in SUFFIXES:
    child = os.fork()
    if child == 0:
        if event == "kill":
            output_files.os.fsync = lambda handle: os.kill(os.getpid(), signal.SIGKILL)
        else:
            resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
        try:
            write(folder / f"out{suffix}")
        except (SceneError, OSError) as error:
            os._exit(9 if "out" in str(error) or isinstance(error, OSError) else 1)
        os._exit(0)
    print(suffix, os.waitpid(child, 0)[1])
"""


def write(path: Path) -> None:
    """Write a picture of 60x40 pixels, or of as many spectra."""
    noise = np.random.default_rng(5).random((40, 60, 3), np.float32)
    if path.name == "out.bands.exr":
        spectral_exr.write(path, spectral_exr.SpectralImage(noise, [400.0, 500.0, 600.0], True))
    elif path.name == "out.bands.npy":
        images.write_npy(path, noise)
    else:
        images.write(path, noise)


WRITES = re.compile(r"\.(write_text|write_bytes|savefig)\(|np\.savez?\(")
THROUGH = re.compile(r"output_files\.|partial|\(file, ")


def test_nobody_writes_in_another_way() -> None:
    for path in (ROOT / "clpt").rglob("*.py"):
        if path.name == "output_files.py" or path.name.startswith("make_"):
            continue
        for line in path.read_text("utf-8").splitlines():
            assert not WRITES.search(line) or THROUGH.search(line), f"{path}: {line.strip()}"


@posix
@pytest.mark.parametrize(("event", "status"), [("kill", "9"), ("full", str(9 << 8))])
def test_the_old_picture_stays(tmp_path: Path, event: str, status: str) -> None:
    old = {suffix: f"yesterday's {suffix}".encode() for suffix in SUFFIXES}
    for suffix, content in old.items():
        (tmp_path / f"out{suffix}").write_bytes(content)
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(tmp_path), event],
        cwd=ROOT, capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert dict(row.split() for row in done.stdout.splitlines()) == dict.fromkeys(SUFFIXES, status)
    assert {suffix: (tmp_path / f"out{suffix}").read_bytes() for suffix in SUFFIXES} == old
    partial = list(tmp_path.glob(f"{output_files.PARTIAL}*"))
    assert len(partial) == (len(SUFFIXES) if event == "kill" else 0)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_failing_library_leaves_the_old_picture(tmp_path, monkeypatch, suffix):
    path = tmp_path / f"out{suffix}"
    path.write_bytes(b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(output_files.os, "replace", full)
    with pytest.raises((SceneError, OSError), match="No space left"):
        write(path)
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


def test_a_new_file_has_usual_permissions_and_a_link_stays(tmp_path: Path) -> None:
    path, link = tmp_path / "a.txt", tmp_path / "link.txt"
    output_files.write_text(path, "one")
    (tmp_path / "usual").touch()
    assert path.stat().st_mode == (tmp_path / "usual").stat().st_mode
    path.chmod(0o640)
    link.symlink_to(path)
    output_files.write_text(link, "two")
    assert link.is_symlink() and path.read_text() == "two"
    assert path.stat().st_mode & 0o777 == 0o640


@posix
def test_what_is_no_file_is_written_itself() -> None:
    output_files.write(Path(os.devnull), b"nothing")
    assert not Path(os.devnull).is_file()


def test_targets_are_tried(tmp_path: Path, monkeypatch) -> None:
    output_files.check_writable(tmp_path / "a.png")
    assert not list(tmp_path.iterdir()), "nothing is left"
    for target, told in (
        (tmp_path, "it is a folder"),
        (tmp_path / "no" / "a.png", "its folder does not exist"),
        (Path("/proc/a.png"), "no file can be made there"),
    ):
        if target.parts[1] != "proc" or sys.platform == "linux":
            with pytest.raises(OSError, match=told):
                output_files.check_writable(target)
    path = tmp_path / "a.png"
    path.touch(0o444)
    monkeypatch.setattr(output_files.os, "access", lambda *_: False)  # root may write everything
    with pytest.raises(OSError, match="read-only"):
        output_files.check_writable(path)


def test_what_was_left_behind_is_removed(tmp_path):
    path, other = tmp_path / "a.resume.exr", tmp_path / "b.resume.exr"
    for one in (path, other):
        with pytest.raises(KeyboardInterrupt), output_files.replacing(one) as partial:
            partial.rename(partial.with_name(partial.name.replace(".exr", ".x.exr")))
            raise KeyboardInterrupt
    assert len(list(tmp_path.iterdir())) == 2
    output_files.remove_partials(path)
    (left,) = tmp_path.iterdir()
    output_files.remove_partials(other)
    assert left.name.startswith(output_files.PARTIAL) and not left.exists()


def test_a_second_name_stays_when_the_file_is_replaced(tmp_path, monkeypatch):
    path, other = tmp_path / "a", tmp_path / "a.1"
    output_files.link(path, other)
    assert not list(tmp_path.iterdir())  # there is nothing to keep
    for content in (b"1", b"2", b"3"):
        output_files.link(path, other)
        output_files.link(path, other)  # as after a failure
        output_files.write(path, content)
    assert (path.read_bytes(), other.read_bytes()) == (b"3", b"2")

    def refused(*names):
        raise OSError(1, "not permitted")

    monkeypatch.setattr(os, "link", refused)
    output_files.link(path, other)
    assert (path.read_bytes(), other.read_bytes()) == (b"3", b"2")
    assert len(list(tmp_path.iterdir())) == 2


@posix
def test_a_current_folder_that_is_gone(tmp_path):
    """clpt is imported and writes elsewhere; a picture for that folder is refused."""
    gone = tmp_path / "gone"
    gone.mkdir()
    code = f"""
import os; os.chdir({str(gone)!r}); os.rmdir({str(gone)!r})
import clpt
clpt.write_image({str(tmp_path / "a.png")!r}, [[[0.5, 0.5, 0.5]]])
try: clpt.write_image("b.png", [[[0.5, 0.5, 0.5]]])
except clpt.SceneError as error: print(error)
"""
    own = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=own, capture_output=True, text=True)
    assert done.stdout.strip() == "b.png: its folder does not exist", done.stderr
    assert (tmp_path / "a.png").exists()
