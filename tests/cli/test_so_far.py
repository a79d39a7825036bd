"""`--every`: pictures of a render that goes on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clpt import images
from clpt.__main__ import run
from clpt.cli.display import Display
from clpt.cli.files import outputs
from clpt.cli.options.grading import Grading
from clpt.cli.render import picture
from clpt.cli.render.picture import PictureSoFar
from clpt.errors import SceneError

CORNELL = str(Path(__file__).resolve().parents[2] / "scenes" / "cornell_box")
COMMON = ["--size", "8x6", "--mode", "rgb"]


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand."""
    now = [100.0]
    monkeypatch.setattr(picture.time, "monotonic", lambda: now[0])
    return now


def test_every_format_while_it_renders(tmp_path, monkeypatch):
    written: dict[str, list[float]] = {}
    write = outputs.write

    def count(path, source, stats, grading):
        write(path, source, stats, grading)
        written.setdefault(path.suffix, []).append(stats["spp"])

    monkeypatch.setattr(outputs, "write", count)
    names = [f"a{suffix}" for suffix in (*images.WRITABLE, ".film")]
    given = [word for name in names for word in ("-o", str(tmp_path / name))]
    assert run(["render", CORNELL, *COMMON, *given, "--spp", "6", "--every", "0.0001s"]) == 0
    assert sorted(written) == sorted((*images.WRITABLE, ".film"))
    (passes,) = {tuple(spp) for spp in written.values()}
    assert list(passes) == sorted(passes) and passes[0] == 1.0 and passes[-2:] == (6.0, 6.0)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)


def test_it_waits_for_its_time(clock, monkeypatch):
    written = []
    monkeypatch.setattr(outputs, "write", lambda path, *rest: written.append(clock[0]))
    so_far = PictureSoFar(30.0, (Path("a.png"),), None, Grading(), Display())
    for clock[0] in (101.0, 129.0, 131.0, 140.0, 160.0, 161.0):
        if so_far.is_due:
            so_far.write({})
    assert written == [131.0, 161.0]
    never = PictureSoFar(None, (Path("a.png"),), None, Grading(), Display())
    clock[0] = 1e9
    assert not never.is_due


def test_what_cannot_be_written_is_told_once(clock, monkeypatch):
    told, failing = [], [True]

    def write(path, *_):
        if failing[0]:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(outputs, "write", write)
    shown = Display()
    shown.note = told.append
    so_far = PictureSoFar(1.0, (Path("a.png"), Path("b.exr")), None, Grading(), shown)
    for failing[0] in (True, True, False, True):
        clock[0] += 10.0
        so_far.write({})
    assert len(told) == 4 and "a.png: cannot be written: [Errno 28]" in told[0]
    assert all(text.endswith("the render goes on") for text in told)


def test_a_picture_that_fails_leaves_the_former_one(tmp_path, monkeypatch):
    """What a reader finds is whole: the last picture that could be written."""
    path = tmp_path / "a.npy"
    assert run(["render", CORNELL, *COMMON, "--quiet", "-o", str(path), "--spp", "1"]) == 0
    before = np.load(path)
    header = "write_array_header_1_0"
    monkeypatch.setattr(np.lib.format, header, lambda file, _: file.write(b"\x93NUMPY") and 1 / 0)
    with pytest.raises(ZeroDivisionError):
        images.write(path, before * 2)
    monkeypatch.undo()
    assert np.array_equal(np.load(path), before) and len(list(tmp_path.iterdir())) == 1
    with pytest.raises(SceneError):
        images.write(tmp_path / "no" / "a.npy", before)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--every", "soon"], "does not look like 30s"),
        (["--every", "0"], "is no time to render in"),
        (["--every", "5s", "--frames", "1:2"], "leave out --every"),
        (["--every", "5s", "-o", "-"], "--every writes a file again and again"),
    ],
)
def test_bad_values_are_one_line(capsys, options, told):
    assert run(["render", CORNELL, *options]) == 2
    error = capsys.readouterr().err
    assert told in error and error.count("\n") == 1
