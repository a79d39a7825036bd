"""Several scenes in one command: names, failures, statuses."""

from __future__ import annotations

import importlib
import signal
from pathlib import Path

import pytest

from clpt import images
from clpt.__main__ import run
from clpt.cli.files import outputs
from clpt.cli.process import ending

CORNELL = str(Path(__file__).resolve().parents[2] / "scenes" / "cornell_box")
COMMON = ["--size", "8x6", "--spp", "1", "--mode", "rgb"]
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def meshes(tmp_path, monkeypatch) -> Path:
    """A folder with a.obj, and b.obj that is none; it is the current one."""
    (tmp_path / "a.obj").write_text(TRIANGLE)
    (tmp_path / "b.obj").write_text("v 0 0\nf 1 2 3\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_what_fails_does_not_stop_the_rest(meshes, capsys):
    scenes = ["none.xml", "b.obj", CORNELL]
    assert run(["render", *scenes, *COMMON, "-o", "of_{scene}.npy", "-o", "{scene}.png"]) == 2
    error = capsys.readouterr().err
    for words in (
        "none.xml (1 of 3)", "clpt: error: none.xml: there is no such file", "clpt: error: b.obj:",
        f"{CORNELL} (3 of 3)", "of_cornell_box.npy\n", "\n1 spp, ",
        "clpt: error: 2 of 3 scenes failed: none.xml, b.obj\n",
    ):  # fmt: skip
        assert words in error
    assert images.read("of_cornell_box.npy").shape == (6, 8, 3)
    assert sorted(path.name for path in meshes.iterdir()) == [
        "a.obj", "b.obj", "cornell_box.png", "of_cornell_box.npy",
    ]  # fmt: skip


def test_faults_of_ours_do_not_stop_the_rest_either(meshes, monkeypatch, capsys):
    metadata = outputs.metadata

    def fail_for_a(renderer, scene, seconds):
        if scene.stem == "a":
            raise ZeroDivisionError("of a test")
        return metadata(renderer, scene, seconds)

    monkeypatch.setattr(outputs, "metadata", fail_for_a)
    assert run(["render", "a.obj", CORNELL, *COMMON, "-o", "{scene}.npy", "--quiet"]) == 1
    error = capsys.readouterr().err
    assert "clpt: error: a.obj: ZeroDivisionError: of a test (a fault of clpt" in error
    assert not Path("a.npy").exists() and Path("cornell_box.npy").exists()


def test_a_signal_ends_all(meshes, monkeypatch, capsys):
    (meshes / "c.obj").write_text(TRIANGLE)
    rendering = importlib.import_module("clpt.cli.render.picture")
    seen = []

    def stop(renderer, end, *_, **__):
        seen.append(renderer.scene.name)
        end.stopped.append(signal.SIGINT)
        renderer.run(1)

    monkeypatch.setattr(rendering, "render_samples", stop)
    assert run(["render", "a.obj", "c.obj", *COMMON, "-o", "{scene}.npy"]) == 130
    assert seen == ["a"] and Path("a.npy").exists() and not Path("c.npy").exists()
    assert ending.STATUS + signal.SIGINT == 130
    assert "failed" not in capsys.readouterr().err


@pytest.mark.parametrize("given", [["-o", "a.png"], ["-o", "{scene}.png"], []])
def test_two_scenes_have_two_names(meshes, capsys, given):
    (meshes / "other").mkdir()
    (meshes / "other" / "a.obj").write_text(TRIANGLE)
    assert run(["render", "a.obj", "other/a.obj", *given]) == 2
    error = capsys.readouterr().err
    assert "a.obj and other/a.obj would both be written there" in error
    assert "-o '{scene}.exr'" in error and error.count("\n") == 1


def test_outputs_are_tried_before_the_first_scene(meshes, capsys):
    assert run(["render", "a.obj", CORNELL, "-o", "no/{scene}.png"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("clpt: error: no/a.png: its folder does not exist")
    assert run(["render"]) == 2
    assert "Missing argument 'SCENE...'" in capsys.readouterr().err


CAMERA = (
    '<sensor type="perspective" id="{}"><transform name="to_world"><lookat origin="{},0,4"'
    ' target="{},0,0" up="0,1,0"/></transform></sensor>'
)
ROW = (
    '<scene version="3.0.0"><sensor type="batch">{}<film type="hdrfilm"><integer name="width"'
    ' value="16"/><integer name="height" value="6"/></film></sensor><emitter type="constant"/>'
    '<shape type="sphere"><float name="radius" value="0.5"/></shape></scene>'
)


def test_all_cameras_have_files_of_their_own(meshes, capsys):
    """Of a row of sensors too; the ball is in the middle of the first picture alone."""
    row = CAMERA.format("the left", 0, 0) + CAMERA.format("b", 9, 9)
    Path("row.xml").write_text(ROW.format(row))
    common = ["--spp", "1", "--mode", "rgb", "--camera", "all"]
    assert run(["render", "row.xml", *common]) == 0
    written = ["row.b.exr", "row.b.png", "row.the_left.exr", "row.the_left.png"]
    assert sorted(path.name for path in meshes.glob("row.*.*")) == written
    left, right = images.read("row.the_left.exr"), images.read("row.b.exr")
    assert left.shape == right.shape == (6, 8, 3)
    assert left[2:4, 3:5].mean() < 0.9 < right.min()
    assert run(["render", "row.xml", *common, "-o", "one.npy", "--quiet"]) == 2
    assert "-o '{camera}.exr' names them" in capsys.readouterr().err
    assert run(["render", "a.obj", *COMMON, "--camera", "all", "-o", "a.npy", "--quiet"]) == 0
