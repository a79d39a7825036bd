"""`clpt render --frames --cluster`: each frame is that of one process, whatever ends in between."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("distributed")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

sys.path.insert(0, str(Path(__file__).parent))
from machines import LONGEST, client_of, machines, wait_until  # noqa: E402

from clpt import images  # noqa: E402
from clpt.__main__ import run  # noqa: E402
from clpt.cli.opening import ClusterFactory  # noqa: E402

SIZE = ["--size", "16x12", "--mode", "rgb"]
TURN = ["-D", "angle={10*(frame-2)}"]


@pytest.fixture(scope="module")
def hub():
    """Two workers."""
    with machines(2) as found:
        yield found


@pytest.fixture
def folder(scenes, tmp_path, monkeypatch) -> Path:
    """A folder with a box whose camera turns by $angle."""
    text = (scenes / "cornell.xml").read_text()
    look = '<lookat origin="0, 0, 3.9" target="0, 0, 0" up="0, 1, 0"/>'
    (tmp_path / "turn.xml").write_text(text.replace(look, look + '<rotate y="1" angle="$angle"/>'))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def check_frames(numbers, *how: str) -> None:
    """Compare frames with what one process renders."""
    for frame in numbers:
        alone = ["-D", f"angle={10 * (frame - 2)}", "-o", "alone.exr", *SIZE, *how, "--quiet"]
        assert run(["render", "turn.xml", *alone]) == 0
        found = images.read(f"turn.{frame:04}.exr")
        np.testing.assert_array_equal(found, images.read("alone.exr"))


def test_frames_are_those_of_one_process(hub, folder, capsys):
    command = ["render", "turn.xml", "--frames", "1:4", *TURN, *SIZE, "--spp", "6"]
    assert run([*command, *hub.on]) == 0
    told = capsys.readouterr().err
    assert "frame 4 (" in told and "6 spp" in told and "2 workers, 0 lost" in told
    assert told.count(" renders\n") == 2
    check_frames((1, 2, 4), "--spp", "6")
    (folder / "turn.0002.exr").unlink()
    assert run([*command, *hub.on]) == 0
    assert capsys.readouterr().err.count("is complete") == 3
    check_frames((2,), "--spp", "6")


def test_frames_with_noise(hub, folder, capsys):
    how = ["--noise", "0.1", "--spp", "200"]
    command = ["render", "turn.xml", "--frames", "1:3", *TURN, *SIZE, *how]
    assert run([*command, *hub.on]) == 0
    check_frames((1, 3), *how)


def test_an_earlier_frame_comes_first():
    crews: list[ClusterFactory] = []
    crews += [ClusterFactory("", None, crews, {}) for _ in range(2)]
    crews[0].frame, crews[1].frame = 7, 8
    assert crews[0]._priority() > crews[1]._priority()
    crews[0].frame = 9
    assert crews[0]._priority() < crews[1]._priority()


@pytest.mark.slow
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_frames_go_on_after_an_end(how, hub, folder):
    """Of the client, and of a worker: frames that were complete stay as they are."""
    third = hub.start()
    hub.wait(3)
    command = ["render", "turn.xml", "--frames", "1:6", *TURN, *SIZE, "--spp", "1500"]
    command += [*hub.on]
    with client_of(command, folder) as client:
        wait_until((folder / "turn.0001.exr").exists, "a frame")
        hub.end(third)
        wait_until((folder / "turn.0002.exr").exists, "another frame")
        client.send_signal(how)
        told = client.communicate(timeout=LONGEST)[1]
    assert client.returncode == (-how if how == signal.SIGKILL else 128 + how), told
    assert "Traceback" not in told
    before = {path: path.stat().st_mtime_ns for path in folder.glob("turn.*.exr")}
    assert 2 <= len(before) < 6
    assert run(command) == 0
    for path, time in before.items():
        assert os.stat(path).st_mtime_ns == time
    check_frames(range(1, 7), "--spp", "1500")
