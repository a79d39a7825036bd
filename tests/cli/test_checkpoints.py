"""Checkpoints: renders that are stopped or killed lose little and go on to the bit."""

from __future__ import annotations

import math
import os
import signal
import subprocess
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from clpt import images
from clpt.__main__ import run
from clpt.cli.files import checkpoints, outputs
from clpt.cli.render import passes
from clpt.errors import MemoryBudgetError, SceneError
from clpt.files import output_files
from clpt.files.output_files import PARTIAL
from clpt.render.film import film_file
from clpt.render.renderer import Renderer
from tests.cli import killing

COMMON = ["--mode", "rgb", "--size", "24x16", "--quiet"]


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def render(*more: str, output: str = "a.npy") -> int:
    return run(["render", killing.SCENE, "-o", output, *COMMON, *more])


def test_a_render_goes_on_with_more_samples(folder, capsys):
    assert render("--spp", "40", output="whole.npy") == 0
    assert render("--spp", "9", "--checkpoint", "1h") == 0
    assert (folder / "a.resume.exr").exists() and images.read("a.resume.exr").shape == (16, 24, 3)
    assert render("--spp", "40", "--resume") == 0
    np.testing.assert_array_equal(np.load("a.npy"), np.load("whole.npy"))
    assert film_file.read("a.resume.exr").film.taken == ((0, 40),)
    assert film_file.read("a.resume.exr.1").film.taken == ((0, 9),)
    assert "a.resume.exr" not in capsys.readouterr().err  # quiet
    os.remove("a.npy")
    command = ["render", killing.SCENE, "-o", "a.npy", *COMMON[:-1], "--spp", "40"]
    assert run(command) == 0  # nothing is left to do, but the picture is written
    assert "goes on from a.resume.exr: samples 0 to 39" in capsys.readouterr().err
    np.testing.assert_array_equal(np.load("a.npy"), np.load("whole.npy"))
    with OpenEXR.File("a.resume.exr", header_only=True) as file:
        assert file.parts[0].name() == "picture"


@pytest.mark.parametrize("length", [244, 248, 255])
def test_pictures_with_long_names_have_checkpoints(folder, length):
    name = "x" * (length - 4) + ".npy"
    for more in (), ("--checkpoint", "1h"), ("--spp", "5", "--resume"):
        assert render("--spp", "3", *more, output=name) == 0
    assert images.read(name).shape[:2] == (16, 24)
    assert len([one for one in folder.iterdir() if ".resume.exr" in one.name]) == 2


def test_what_differs_is_named_and_nothing_begins_anew(folder, capsys):
    assert render("--spp", "3", "--checkpoint", "1h") == 0
    before = (folder / "a.resume.exr").read_bytes()
    for more, named in (
        (["--seed", "4"], "seed: 0 -> 4"),
        (["--size", "25x16"], "film.width: 24 -> 25"),
        (["--samples", "1:9"], "it has samples 0 to 2, not those from 1 on"),
        (["--samples", "0:2"], "it has samples 0 to 2, more than to 1"),
    ):
        assert render("--checkpoint", "1h", *more) == 2
        error = capsys.readouterr().err
        assert error.startswith("clpt: error: a.resume.exr: ") and named in error
        assert "--no-resume" in error
    assert (folder / "a.resume.exr").read_bytes() == before
    assert render("--seed", "4", "--spp", "2", "--checkpoint", "1h", "--no-resume") == 0
    assert film_file.read("a.resume.exr").origin.scene.values["seed"] == 4
    assert (folder / "a.resume.exr.1").read_bytes() == before


def test_resume_without_a_file_is_an_error(folder, capsys):
    assert render("--spp", "3", "--resume") == 2
    assert "a.resume.exr: there is nothing to resume" in capsys.readouterr().err
    assert not list(folder.iterdir())


def test_a_damaged_file_is_passed_over_for_the_former_one(folder, capsys):
    for spp in ("3", "6"):
        assert render("--spp", spp, "--checkpoint", "1h") == 0
    path = folder / "a.resume.exr"
    path.write_bytes(path.read_bytes()[:-9])
    capsys.readouterr()
    command = ["render", killing.SCENE, "-o", "a.npy", *COMMON[:-1], "--spp", "9"]
    assert run(command) == 0
    error = capsys.readouterr().err
    assert "a picture without a film, or it was not written to its end" in error
    assert "a.resume.exr.1 is taken in its place" in error
    assert "goes on from a.resume.exr: samples 0 to 2" in error
    for name in (path, checkpoints.former_of(path)):
        name.write_bytes(b"nothing")
    assert render("--spp", "9") == 2
    assert "a.resume.exr: not a film of clpt" in capsys.readouterr().err
    assert render("--spp", "9", "--no-resume") == 0


def test_without_being_asked_short_renders_write_nothing(folder, monkeypatch):
    assert render("--spp", "3") == 0
    assert [path.name for path in folder.iterdir()] == ["a.npy"]
    written = []
    monkeypatch.setattr(checkpoints, "PATIENCE", 0.0)
    monkeypatch.setattr(checkpoints, "PERIOD", 0.0001)
    write = film_file.write
    monkeypatch.setattr(film_file, "write", lambda *given: written.append(given) or write(*given))
    assert render("--spp", "30") == 0
    assert written and [path.name for path in folder.iterdir()] == ["a.npy"]
    written.clear()
    assert render("--spp", "30", "--checkpoint", "0") == 0
    assert not written
    assert render("--spp", "3", "--checkpoint", "1h") == 0
    assert render("--spp", "30") == 0  # what was there before stays, and has the new samples
    assert film_file.read("a.resume.exr").film.taken == ((0, 30),)


def test_a_full_disk_is_told_and_the_render_goes_on(folder, monkeypatch, capsys):
    assert render("--spp", "3", "--checkpoint", "1h") == 0
    before = (folder / "a.resume.exr").read_bytes()

    def full(path, saved):
        with output_files.replacing(path) as partial:
            partial.write_bytes(b"a part of it")
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(film_file, "write", full)
    command = ["render", killing.SCENE, "-o", "a.npy", *COMMON[:-1], "--spp", "30"]
    assert run([*command, "--checkpoint", "0.001s"]) == 0
    error = capsys.readouterr().err
    assert "warning: a.resume.exr: cannot be written: [Errno 28] No space left" in error
    assert "the render goes on" in error and (folder / "a.npy").exists()
    assert (folder / "a.resume.exr").read_bytes() == before
    assert not list(folder.glob(PARTIAL + "*"))


def test_a_host_without_room_for_a_film(folder, monkeypatch, capsys):
    def full(self, **_):
        raise MemoryError

    monkeypatch.setattr(Renderer, "saved_film", full)
    command = ["render", killing.SCENE, "-o", "a.npy", *COMMON[:-1], "--spp", "30"]
    assert run([*command, "--checkpoint", "0.001s"]) == 0
    error = capsys.readouterr().err
    assert "warning: a.resume.exr: cannot be written: memory has run out" in error
    assert [path.name for path in folder.iterdir()] == ["a.npy"]


def test_a_device_without_room_for_a_copy(folder, monkeypatch, capsys):
    def full(self):
        raise MemoryBudgetError("a copy of the film", 100, 10, "save no films")

    monkeypatch.setattr(Renderer, "_hold", full)
    command = ["render", killing.SCENE, "-o", "a.npy", *COMMON[:-1], "--spp", "3"]
    assert run([*command, "--checkpoint", "1h"]) == 0
    assert "warning: no checkpoints: a copy of the film needs" in capsys.readouterr().err
    assert not (folder / "a.resume.exr").exists()


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_saves_whole_passes(tmp_path, number):
    """The status is 128 + number; the file has whole passes only, and goes on to the bit."""
    path = tmp_path / "a.resume.exr"
    endless = killing.command(tmp_path, "--spp", "1000000000", "--checkpoint", "0.2s")
    command = [*endless, "-o", str(tmp_path / "a.png")]
    with subprocess.Popen(
        command, cwd=killing.ROOT, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),
    ) as process:  # fmt: skip
        while not path.exists():
            assert process.poll() is None, process.stderr.read()
        process.send_signal(number)
        error = process.communicate(timeout=100)[1]
    assert process.returncode == 128 + number, error
    assert (tmp_path / "a.png").exists() and "--resume goes on from it" in error
    saved, film = film_file.read(path), film_file.read(tmp_path / "a.film")
    ((first, end),) = saved.film.taken
    assert first == 0 and (saved.film.samples == end).all()
    np.testing.assert_array_equal(saved.film.words, film.film.words)


@pytest.mark.slow
def test_renders_that_are_killed(tmp_path):
    """A handful of kills at random moments, also while a file is written."""
    figures = killing.kill_and_resume(tmp_path, 3, seed=5)
    assert figures.equal and not figures.left


@pytest.mark.slow
def test_renders_that_are_killed_200_times(tmp_path):
    figures = killing.kill_and_resume(tmp_path, 200, seed=7)
    assert figures.equal and not figures.left and figures.kills["write"] > 40


class Stopped:
    """A renderer of passes, of which a signal cuts the last."""

    first_sample = samples = 0
    active = 1.0

    def __init__(self, whole: int):
        self.whole, self.ended = whole, []

    def run(self, samples, progress, noise=None):
        self.samples += samples
        self.whole -= 1
        return self.whole >= 0


def test_only_whole_passes_are_kept():
    renderer, kept = Stopped(3), []
    passes.render_samples(
        renderer, passes.End(), lambda progress: None, lambda: kept.append(renderer.samples)
    )
    assert kept == [1, 4, 16] and renderer.samples > 16


def test_periods():
    assert checkpoints.PERIOD == 300.0 and math.isfinite(checkpoints.PATIENCE)
    assert run(["render", killing.SCENE, "--checkpoint", "often"]) == 2


@pytest.mark.parametrize("given", ["5", "5:5", "7:3", "a:b", ":4", "0:99999999999"])
def test_ranges_that_are_none(given, capsys):
    assert render("--samples", given) == 2
    assert "is no range of samples" in capsys.readouterr().err


def test_a_range_says_how_many(capsys):
    assert render("--samples", "0:4", "--spp", "4") == 2
    assert "leave out --spp" in capsys.readouterr().err


def test_a_film_without_a_pass(tmp_path):
    with Renderer(killing_scene()) as renderer:
        renderer._hold()
        with pytest.raises(SceneError, match="no pass has come to its end"):
            outputs.write(tmp_path / "a.film", renderer, {}, None)


def killing_scene():
    from clpt.cli.options.applied import changed
    from clpt.cli.options.changes import SceneChanges
    from clpt.formats import load

    return changed(load(killing.SCENE), SceneChanges.of(size=(8, 8), mode="rgb"))
