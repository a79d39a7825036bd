"""`clpt render --frames`: what frames show, which are rendered again, and over devices."""

from __future__ import annotations

import signal
import sys
import types
from pathlib import Path

import click
import numpy as np
import pytest
from PIL import Image

from clpt import device, images
from clpt.__main__ import run
from clpt.cli import opening
from clpt.cli.render import frames as frames_module
from clpt.cli.render.settings import Frames, expanded, numbered
from clpt.device.stream import Stream

SIZE = ["--size", "16x12", "--spp", "2", "--mode", "rgb"]
TURN = ["-D", "angle={10*(frame-2)}"]


@pytest.fixture
def scene(scenes: Path, tmp_path: Path, monkeypatch) -> Path:
    """A box whose camera turns by $angle, in the folder that is the present one."""
    text = (scenes / "cornell.xml").read_text()
    look = '<lookat origin="0, 0, 3.9" target="0, 0, 0" up="0, 1, 0"/>'
    assert look in text
    text = text.replace(look, look + '<rotate y="1" angle="$angle"/>')
    path = tmp_path / "turn.xml"
    path.write_text(text)
    monkeypatch.chdir(tmp_path)
    return path


def times(paths) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in paths}


def test_each_frame_is_what_it_would_be_alone(scene, tmp_path, capsys):
    assert run(["render", "turn.xml", "--frames", "1:3", *TURN, *SIZE]) == 0
    told = capsys.readouterr().err
    assert "frame 3 (3 of 3): turn.0003.exr  2 spp" in told
    names = [f"turn.000{frame}.exr" for frame in (1, 2, 3)]
    assert sorted(path.name for path in tmp_path.glob("*.*.*")) == names
    for frame in (1, 3):
        alone = ["-D", f"angle={10 * (frame - 2)}", "-o", "alone.exr"]
        assert run(["render", "turn.xml", *alone, *SIZE, "--quiet"]) == 0
        found = images.read(names[frame - 1])
        np.testing.assert_array_equal(found, images.read("alone.exr"))
        assert images.attributes(Path(names[frame - 1]))["frame"] == frame
    assert not np.array_equal(images.read(names[0]), images.read(names[1]))


def test_complete_frames_stay_and_others_are_rendered(scene, tmp_path, capsys):
    command = [
        "render",
        "turn.xml",
        "--frames",
        "1:4",
        *TURN,
        *SIZE,
        "-o",
        "f_##.exr",
        "-o",
        "f.png",
    ]
    assert run(command) == 0
    files = sorted(tmp_path.glob("f[_.]*"))
    assert [path.name for path in files] == [
        *(f"f.000{i}.png" for i in (1, 2, 3, 4)), *(f"f_0{i}.exr" for i in (1, 2, 3, 4))
    ]  # fmt: skip
    before, words = times(files), {path.name: path.read_bytes() for path in files}
    assert run(command) == 0
    assert times(files) == before and "is complete" in capsys.readouterr().err
    Path("f_01.exr").unlink()
    Path("f_02.exr").write_bytes(words["f_02.exr"][:-200])  # cut off
    Path("f.0003.png").write_bytes(words["f.0002.png"])  # of another frame
    assert run(command) == 0
    told, after = capsys.readouterr().err, times(files)
    assert {name for name in before if after[name] != before[name]} == {
        f"f{sign}{number}" for frame in (1, 2, 3)
        for sign, number in (("_", f"0{frame}.exr"), (".", f"000{frame}.png"))
    }  # fmt: skip
    assert "frame 4 (1 of 4): is complete" in told or "frame 4 (4 of 4): is complete" in told
    assert np.array_equal(images.read("f_02.exr"), images.read(tmp_path / "f_02.exr"))


@pytest.mark.parametrize(
    "change", ["scene", ["--spp", "3"], ["--exposure", "1"], ["--seed", "4"], "version"],
    ids=str,
)  # fmt: skip
def test_a_change_renders_frames_again_and_says_so(scene, tmp_path, capsys, monkeypatch, change):
    command = ["render", "turn.xml", "--frames", "1:2", *TURN, *SIZE]
    assert run(command) == 0
    before = times(tmp_path.glob("*.exr"))
    if change == "scene":
        scene.write_text(scene.read_text().replace("18.387", "9"))
    elif change == "version":
        monkeypatch.setattr(frames_module, "VERSION", "99")
    assert run([*command, *(change if isinstance(change, list) else [])]) == 0
    after = times(tmp_path.glob("*.exr"))
    assert all(after[name] != before[name] for name in before)
    assert "frame 1: the scene or an option has changed" in capsys.readouterr().err


def test_scenes_of_their_own(scene, tmp_path):
    for frame, angle in ((7, 0), (9, 20)):
        (tmp_path / f"s.{frame:03}.xml").write_text(scene.read_text().replace("$angle", str(angle)))
    assert run(["render", "s.###.xml", "--frames", "7:9:2", *SIZE, "-o", "out.npy"]) == 0
    first, second = np.load("out.0007.npy"), np.load("out.0009.npy")
    assert not np.array_equal(first, second)
    assert run(["render", "s.###.xml", "--frames", "7:8", *SIZE]) == 2  # there is no 8


def test_a_signal_keeps_whole_frames_only(scene, tmp_path, capsys, monkeypatch):
    original, count = frames_module.render_samples, [0]

    def stop_in_the_third(*args, **named):
        count[0] += 1
        if count[0] == 3:
            args[1].stopped.append(signal.SIGINT)
        original(*args, **named)

    monkeypatch.setattr(frames_module, "render_samples", stop_in_the_third)
    command = ["render", "turn.xml", "--frames", "1:5", *TURN, *SIZE]
    assert run(command) == 130
    assert sorted(p.name for p in tmp_path.glob("*.exr")) == ["turn.0001.exr", "turn.0002.exr"]
    monkeypatch.setattr(frames_module, "render_samples", original)
    assert run(command) == 0
    assert len([*tmp_path.glob("*.exr")]) == 5
    assert capsys.readouterr().err.count("is complete") == 2


@pytest.fixture
def two_devices(monkeypatch) -> list[device.Device]:
    pair = [device.choose(), device.choose()]
    monkeypatch.setattr(frames_module, "choose_devices", lambda machine: pair)
    return pair


@pytest.mark.parametrize("count", [1, 5])
def test_several_devices(scene, tmp_path, two_devices, monkeypatch, count):
    """A frame is a device's, but where there are fewer frames than devices."""
    used, original = set(), opening.new_renderer

    def note(plan, devices, **made):
        used.add(len(devices))
        return original(plan, devices, **made)

    monkeypatch.setattr(opening, "new_renderer", note)
    assert run(["render", "turn.xml", "--frames", f"1:{count}", *TURN, *SIZE]) == 0
    assert used == {2 if count == 1 else 1}
    for frame in range(1, count + 1):
        alone = ["-D", f"angle={10 * (frame - 2)}", "-o", "alone.exr"]
        assert run(["render", "turn.xml", *alone, *SIZE, "--quiet"]) == 0
        np.testing.assert_array_equal(images.read(f"turn.{frame:04}.exr"), images.read("alone.exr"))


def test_a_device_that_fails_leaves_its_frames_to_others(
    scene, tmp_path, two_devices, monkeypatch, capsys
):
    run_command, left = Stream.run, [0]

    def fails(self, *args, **named):
        if self.queue is two_devices[0].queue:
            left[0] -= 1
            if left[0] < 0:
                raise RuntimeError("the device was reset")
        return run_command(self, *args, **named)

    monkeypatch.setattr(Stream, "run", fails)
    assert run(["render", "turn.xml", "--frames", "1:6", *TURN, *SIZE]) == 0
    assert "failed and is left out" in capsys.readouterr().err
    assert len([*tmp_path.glob("turn.*.exr")]) == 6


def test_a_video_has_all_frames(scene, tmp_path, monkeypatch, capsys):
    """The package is another's; what goes into it is ours."""
    ffmpeg = tmp_path / "ffmpeg"  # writes what it was given
    ffmpeg.write_text(f"""#!{sys.executable}
import sys
assert "-s 16x12 -r 12 -i -" in " ".join(sys.argv), sys.argv
with open(sys.argv[-1], "wb") as file:
    file.write(sys.stdin.buffer.read())
""")
    ffmpeg.chmod(0o755)
    package = types.SimpleNamespace(get_ffmpeg_exe=lambda: str(ffmpeg))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", package)
    command = ["render", "turn.xml", "--frames", "1:3", *TURN, *SIZE, "--fps", "12"]
    assert run([*command, "--video", "a.mp4"]) == 0
    sent = np.frombuffer(Path("a.mp4").read_bytes(), np.uint8).reshape(3, 12, 16, 3)
    expected = images.read_stored("turn.0002.png").values
    np.testing.assert_array_equal(sent[1], expected)
    ffmpeg.write_text("#!/bin/sh\necho the disk is full >&2\nexit 1\n")
    before = Path("a.mp4").read_bytes()
    assert run([*command, "--video", "a.mp4"]) == 2
    assert "a.mp4: cannot be written: the disk is full" in capsys.readouterr().err
    assert Path("a.mp4").read_bytes() == before and not [*tmp_path.glob(".clpt*")]
    assert run([*command, "--video", "a.mp4", "-o", "a.exr"]) == 2
    assert run([*command, "--video", "a.txt"]) == 2
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert run([*command, "--video", "a.mp4"]) == 2
    assert "clpt[video]" in capsys.readouterr().err
    assert run([*command, "--video", "a.webp"]) == 0  # this one needs no other package
    with Image.open("a.webp") as moving:
        assert moving.n_frames == 3 and moving.size == (16, 12) and moving.info["loop"] == 0


@pytest.mark.parametrize(
    "words",
    [
        ["--frames", "1:2"], ["--frames", "3:1", *TURN], ["--frames", "1:2:0", *TURN],
        ["--frames", "a", *TURN], ["--video", "a.mp4"], ["--frames", "1:2", "-D", "angle={x}"],
        ["--frames", "1:2", "-D", "angle={frame/0}"], ["--frames", "1:2", "-D", "angle={frame**9}"],
        ["--frames", "1:2", *TURN, "--fps", "0"], ["--frames", "1:2", "-D", "other={frame}"],
    ],
    ids=" ".join,
)  # fmt: skip
def test_what_makes_no_sense_is_one_line(scene, tmp_path, capsys, words):
    assert run(["render", "turn.xml", *words, *SIZE]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert lines[-1].startswith("clpt: error:") and not [*tmp_path.glob("*.exr")]


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("{frame}", "6"), ("{time}", "0.25"), ("{frame:04}.ply", "0006.ply"), ("x", "x"),
        ("{-360*frame/24+1}", "-89.0"), ("{(frame+1)//2 % 2}", "1"),
        ("{time:.2f}s {frame}", "0.25s 6"),
    ],
)  # fmt: skip
def test_expressions(value, expected):
    assert expanded({"a": value}, 6, 24.0) == {"a": expected}


@pytest.mark.parametrize(
    "value",
    [
        "{__import__('os')}", "{frame.real}", "{[1][0]}", "{}", "{1 if 1 else 2}", "{1:99999}",
        "{1j}", "{'a'*9}", "{" + "-" * 9999 + "1}", "{1e308*10:d}", "{2**frame}", "{frame or 2}",
    ],
    ids=lambda value: value[:20],
)  # fmt: skip
def test_what_is_no_arithmetic_is_refused(value):
    with pytest.raises(click.BadParameter):
        expanded({"a": value}, 1, 24.0)


def test_names_and_ranges():
    names = {"a.exr": "a.0012.exr", "a_##.png": "a_12.png", "a%05d.exr": "a00012.exr",
             "a%d.exr": "a12.exr", "#####": "00012"}  # fmt: skip
    assert {name: str(numbered(Path(name), 12)) for name in names} == names
    frames = Frames()
    assert frames.convert("1:240", None, None) == range(1, 241)
    assert frames.convert("0:10:5", None, None) == range(0, 11, 5)
    assert frames.convert("7", None, None) == range(7, 8)
