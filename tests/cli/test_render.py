"""`clpt render`: what it writes, when it stops, and that bad input is one line."""

from __future__ import annotations

import dataclasses
import json
import logging
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from clpt import __version__, device, images
from clpt.__main__ import run
from clpt.cli.files import outputs
from clpt.cli.files import targets as names
from clpt.cli.options.applied import changed
from clpt.cli.options.changes import SceneChanges
from clpt.cli.process import ending
from clpt.cli.render import picture
from clpt.cli.render.passes import render_samples
from clpt.errors import DeviceError, SceneError
from clpt.formats import load
from clpt.images import exr_files, spectral_exr
from clpt.images.colour import View
from clpt.render.film import film_file
from clpt.render.renderer import Renderer
from clpt.spectra import read_sensor

ROOT = Path(__file__).resolve().parents[2]
CORNELL = str(ROOT / "scenes" / "cornell_box")
SMALL = ["--size", "8x8", "--spp", "1", "--mode", "rgb"]


def test_several_formats_and_the_facts_in_the_exr(tmp_path, capsys):
    paths = [tmp_path / f"out{suffix}" for suffix in (".exr", ".png", ".npy")]
    given = [word for path in paths for word in ("-o", str(path))]
    assert run(["render", CORNELL, *given, "--size", "20x12", "--spp", "3", "--seed", "5"]) == 0
    told = capsys.readouterr().err
    assert all(str(path) in told for path in paths)
    assert {images.read(path).shape for path in paths} == {(12, 20, 3)}
    with OpenEXR.File(str(paths[0])) as file:
        header = dict(file.header())
    expected = {"mode": "spectral", "integrator": "auto", "sampler": "sobol", "seed": 5, "spp": 3.0}
    assert {name: header[name] for name in expected} == expected
    assert header["software"] == f"clpt {__version__}" and header["seconds"] > 0
    assert header["scene"] == CORNELL and header["device"]


def test_light_by_time_is_written(tmp_path, capsys):
    """In an .npy, and as channels of an .exr; a note tells how much light other times have."""
    paths = [tmp_path / "out.npy", tmp_path / "out.exr"]
    given = [word for path in paths for word in ("-o", str(path))]
    times = ["--time-bins", "5", "--time-min", "10", "--time-max", "30"]
    assert run(["render", CORNELL, *given, *SMALL, *times]) == 0
    assert re.search(r"% of the light is not in 10 to 30 ns", capsys.readouterr().err)
    array, layers = np.load(paths[0]), images.read_layers(paths[1])
    assert array.shape == (8, 8, 6, 3)
    np.testing.assert_array_equal(layers["time_0003.G"], array[:, :, 3, 1])
    np.testing.assert_array_equal(layers["time_outside.B"], array[:, :, 5, 2])


def test_passes_add_up_to_one_step(tmp_path):
    """21 samples are 1 + 3 + 12 + 5, bit for bit."""
    path = tmp_path / "out.npy"
    common = ["--size", "17x9", "--spp", "21", "--mode", "rgb", "--quiet"]
    assert run(["render", CORNELL, "-o", str(path), *common]) == 0
    whole = Renderer(changed(load(CORNELL), SceneChanges.of(size=(17, 9), mode="rgb")))
    whole.run(21)
    assert np.array_equal(np.load(path), whole.image())


def test_noise_ends_a_render(tmp_path, capsys):
    """The .exr tells how many samples each pixel got; 0 takes the scene's noise back."""
    path = tmp_path / "out.exr"
    common = ["--size", "17x9", "--mode", "rgb", "-o", str(path)]
    assert run(["render", CORNELL, *common, "--noise", "0.5", "--verbose"]) == 0
    assert "below 0.5 in 100.0% of the pixels" in capsys.readouterr().err
    samples = images.read_layers(path)["samples.X"]
    assert samples.shape == (9, 17) and samples.min() >= 16
    assert (
        changed(dataclasses.replace(load(CORNELL), noise=0.5), SceneChanges.of(noise=0.0)).noise
        is None
    )


def test_a_limit_of_time_leaves_a_whole_picture(tmp_path, capsys, monkeypatch):
    """The limit is the render's own: neither reading the scene nor compiling counts.

    64 samples take a tenth of a second: the limit ends nothing here, whatever else runs.
    """
    limits, path = [], tmp_path / "out.exr"

    def spied(renderer, end, *others, **options):
        limits.append(end.seconds)
        render_samples(renderer, end, *others, **options)

    monkeypatch.setattr(picture, "render_samples", spied)
    arguments = ["-o", str(path), "--size", "64x64", "--spp", "64", "--time", "1m"]
    assert run(["render", CORNELL, *arguments]) == 0
    assert limits == [60]
    with OpenEXR.File(str(path)) as file:
        assert file.header()["spp"] >= 1
    assert (images.read(path).mean(axis=2) > 0).mean() > 0.5  # one sample a pixel at least
    told = capsys.readouterr().err
    assert re.search(r"^cornell_box  64x64  spectral  auto -> path  \w", told, re.MULTILINE)
    assert re.fullmatch(r"\d+ spp, [\d.]+ s in all", told.splitlines()[-1])


@pytest.mark.skipif(sys.platform == "win32", reason="no signals for other processes")
@pytest.mark.parametrize("number", [signal.SIGINT, *ending.ENDING], ids=lambda n: n.name)
def test_a_signal_writes_what_is_there(tmp_path, number):
    path = tmp_path / "out.npy"
    command = [sys.executable, "-m", "clpt", "render", CORNELL, "-o", str(path), "--time", "1h"]
    common = ["--size", "32x32", "--mode", "rgb"]
    listening = {} if sys.platform == "win32" else {"preexec_fn": listen}
    with subprocess.Popen(
        command + common, cwd=ROOT, stderr=subprocess.PIPE, text=True, **listening
    ) as process:
        assert process.stderr is not None
        lines = iter(process.stderr.readline, "")
        assert any("Mrays/s" in line for line in lines)
        process.send_signal(number)
        rest = process.stderr.read()
        assert process.wait(20) == 128 + number
    assert str(path) in rest and "Traceback" not in rest
    assert np.isfinite(np.load(path)).all()


def listen() -> None:
    """Have signals as a terminal gives them, whatever the tests run under."""
    for number in (signal.SIGINT, *ending.ENDING):
        signal.signal(number, signal.SIG_DFL)


def test_targets_are_tried_before_anything_is_read(tmp_path, monkeypatch, capsys):
    """A folder, no folder, a folder without a right to write, a file without one."""

    def refuse(*_, **__):
        raise AssertionError("the scene is read")

    monkeypatch.setattr(sys.modules["clpt.cli.options.scene_options"], "load", refuse)
    targets = {tmp_path / "no" / "a.png": "its folder does not exist"}
    (tmp_path / "folder.png").mkdir()
    targets[tmp_path / "folder.png"] = "it is a folder"
    if sys.platform == "linux":
        targets[Path("/proc/a.exr")] = "no file can be made there"
    for target, told in targets.items():
        given = ["-o", str(tmp_path / "fine.png"), "-o", str(target)]
        assert run(["render", CORNELL, *given]) == 2
        error = capsys.readouterr().err
        assert error.startswith(f"clpt: error: {target}: ") and told in error
        assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), MemoryError()], ids=str)
def test_a_target_that_fails_at_the_end(tmp_path, monkeypatch, capsys, error):
    """The others are written, this one goes to the temporary folder, and the message says where."""
    monkeypatch.setattr(outputs.tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    fine, full = tmp_path / "fine.png", tmp_path / "full.exr"
    write_channels = exr_files.write_channels

    def write(path, *rest):
        if path == full:
            raise error
        write_channels(path, *rest)

    monkeypatch.setattr(exr_files, "write_channels", write)
    assert run(["render", CORNELL, "-o", str(full), "-o", str(fine), *SMALL]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    (rescued,) = (tmp_path / "temporary").iterdir()
    assert f"{full}: cannot be written: " in said
    assert (str(error) or "memory has run out") in said
    assert f"the picture is in {rescued}" in said
    assert images.read(rescued).shape == images.read(fine).shape == (8, 8, 3)


def test_a_film_is_kept_where_no_picture_can_be_made(tmp_path, monkeypatch, capsys):
    """In the cache folder, where the temporary one has no room either."""
    monkeypatch.setattr(outputs.tempfile, "tempdir", str(tmp_path / "nowhere"))
    monkeypatch.setattr(outputs.disk_cache, "folder", lambda: tmp_path)

    def write(*_):
        raise MemoryError

    monkeypatch.setattr(outputs, "write", write)
    assert run(["render", CORNELL, "-o", str(tmp_path / "a.png"), *SMALL]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    (film,) = tmp_path.glob("a-*.film")
    assert f"memory has run out; the film is in {film}" in said
    monkeypatch.undo()
    assert run(["merge", str(film), "-o", str(tmp_path / "a.png")]) == 0
    assert images.read(tmp_path / "a.png").shape == (8, 8, 3)


def test_an_output_folder_that_vanishes(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(outputs.tempfile, "tempdir", str(tmp_path))
    folder, samples = tmp_path / "folder", picture.render_samples
    folder.mkdir()

    def render(*given, **named):
        samples(*given, **named)
        shutil.rmtree(folder)

    monkeypatch.setattr(picture, "render_samples", render)
    command = ["render", CORNELL, "-o", str(folder / "a.exr"), *SMALL, "--checkpoint", "1h"]
    assert run(command) == 2
    told, said = capsys.readouterr().err.splitlines()[-2:]
    (rescued,) = tmp_path.glob("a-*.exr")
    assert "a.resume.exr: cannot be written" in told and f"the picture is in {rescued}" in said
    assert images.read(rescued).shape == (8, 8, 3) and not folder.exists()


@pytest.mark.parametrize("error", [DeviceError("the device is gone"), MemoryError(), ValueError(1)])
def test_a_render_that_fails_keeps_what_it_has(tmp_path, monkeypatch, capsys, error):
    samples = picture.render_samples

    def render(*given, **named):
        samples(*given, **named)
        raise error

    monkeypatch.setattr(picture, "render_samples", render)
    command = ["render", CORNELL, "-o", str(tmp_path / "a.exr"), *SMALL, "--checkpoint", "1h"]
    assert run(command) == (2 if isinstance(error, DeviceError) else 1)
    said = capsys.readouterr().err
    assert "--resume goes on from it" in said.splitlines()[-2] and str(error) in said
    assert film_file.read(tmp_path / "a.resume.exr").film.taken == ((0, 1),)
    assert images.read(tmp_path / "a.exr").shape == (8, 8, 3)


@pytest.mark.skipif(sys.platform != "linux", reason="bytes in file names")
def test_names_that_the_locale_cannot_spell(tmp_path):
    scene = tmp_path / "caf\u00e9.obj"
    shutil.copy(ROOT / "tests" / "scenes" / "bowl.obj", scene)
    plain = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "clpt", "render", str(scene), "--size", "8x8", "--spp", "1"]
    command += ["--mode", "rgb"]
    done = subprocess.run(
        command, cwd=tmp_path, env={**os.environ, **plain}, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert b"Traceback" not in done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {
        "caf\u00e9.obj", "caf\u00e9.exr", "caf\u00e9.png"
    }  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="closes streams by the shell")
@pytest.mark.parametrize("streams", ["2>&- >&- <&-", "2>/dev/full"])
def test_closed_streams(tmp_path, streams):
    words = [sys.executable, "-m", "clpt", "render", CORNELL, "-o", str(tmp_path / "out.png")]
    words += ["--size", "8x8", "--spp", "1", "--mode", "rgb"]
    if "full" in streams and not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    done = subprocess.run(
        f"{shlex.join(words)} {streams}", shell=True, cwd=ROOT, capture_output=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")
    assert images.read(tmp_path / "out.png").shape == (8, 8, 3)


def test_warnings_of_a_file_come_first(tmp_path, capsys):
    path = tmp_path / "a.pbrt"
    path.write_text('Integrator "bdpt"\nWorldBegin\nLightSource "infinite"\nShape "sphere"\n')
    common = ["-o", str(tmp_path / "a.png"), "--size", "8x8", "--spp", "1", "--mode", "rgb"]
    assert run(["render", str(path), *common]) == 0
    told = capsys.readouterr().err
    assert told.count("what suits the scene") == 1
    assert told.index("what suits the scene") < told.index("a  8x8  rgb")


def test_verbose_before_and_behind_the_command(tmp_path, capsys):
    path = tmp_path / "out.png"
    arguments = [CORNELL, "-o", str(path), "--size", "8x8", "--spp", "1", "--mode", "rgb"]
    for words in (["-v", "render"], ["render", "-v"]):
        assert run([*words, *arguments]) == 0
        assert "36 triangles" in capsys.readouterr().err
        assert logging.getLogger("clpt").level == logging.INFO
    assert run(["-v", "render", "-v", *arguments]) == 0
    assert logging.getLogger("clpt").level == logging.DEBUG


def test_verbose_tells_where_light_paths_end(tmp_path, capsys):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps({
        "camera": {"type": "perspective"},
        "integrator": {"type": "path", "light_paths": 1},
        "film": {"width": 8, "height": 8, "mode": "rgb"},
        "shapes": [{"type": "rectangle", "material": {"type": "grating"}}],
        "lights": [{"type": "constant"}],
    }))  # fmt: skip
    given = ["render", str(path), "-o", str(tmp_path / "out.png"), "--spp", "1", "--verbose"]
    assert run(given) == 0
    assert "light paths end          at grating; what follows" in capsys.readouterr().err


def test_quiet_says_nothing(tmp_path, capfd):
    path = tmp_path / "out.png"
    assert run(["render", CORNELL, "-o", str(path), "--size", "8x8", "--spp", "1", "--quiet"]) == 0
    out, err = capfd.readouterr()
    assert out == "" and "spp" not in err and path.is_file()


def test_verbose_tells_of_tables_and_stages(tmp_path, capsys):
    path = tmp_path / "out.png"
    arguments = ["-o", str(path), "--size", "8x8", "--spp", "1", "--verbose"]
    assert run(["render", CORNELL, *arguments]) == 0
    told = capsys.readouterr().err
    expected = ("36 triangles", "tree triangles", "table vertices", "from clpt's cache",
                "time to read the file", "time until it is ready", "time to the first sample",
                "path: nothing is specular",
                "stage loop" if device.choose().info.is_cpu else "stage shade_diffuse")  # fmt: skip
    for words in expected:
        assert words in told


@pytest.mark.parametrize(
    ("given", "told"),
    [((), "high None"), (("--tree-quality", "fast", "--bvh", "compact"), "fast compact")],
)
def test_the_renderer_gets_the_tree_that_was_asked_for(given, told, monkeypatch, capsys):
    def refuse(*_, tree_quality, layout, **__):
        raise SceneError(f"{tree_quality} {layout}")

    monkeypatch.setattr(sys.modules["clpt.cli.opening"], "Renderer", refuse)
    assert run(["render", CORNELL, "--quiet", *given]) == 2
    assert f"clpt: error: {told}" in capsys.readouterr().err


def test_a_quality_of_trees_that_there_is_not(capsys):
    assert run(["render", CORNELL, "--tree-quality", "best"]) == 2
    assert "'high', 'fast'" in capsys.readouterr().err


def test_a_film_of_bands(tmp_path):
    """All bands where a file holds them, else the colours, in the space asked for."""
    common = ["--size", "8x8", "--spp", "2", "--quiet", "--bands", "6", "--output-space", "xyz"]
    targets = [tmp_path / f"out{suffix}" for suffix in (".npy", ".pfm", ".png", ".exr")]
    given = [word for path in targets for word in ("-o", str(path))]
    assert run(["render", CORNELL, *given, *common, "--white-balance", "0.4,0.4"]) == 0
    assert [images.read(path).shape[2] for path in targets] == [6, 3, 3, 3]
    spectral = spectral_exr.read(targets[3])
    assert spectral.emissive
    assert np.array_equal(spectral.values, images.read(targets[0]))
    np.testing.assert_allclose(np.diff(spectral.lambdas), 470.0 / 6.0)
    assert np.array_equal(images.read(targets[3]), images.read(targets[1]))


def test_a_sensor_and_its_white(tmp_path):
    """What the command line says of the film is what Python says."""
    path, curves = tmp_path / "out.npy", tmp_path / "camera.csv"
    curves.write_text("400 0 0 1\n500 0 1 1\n600 1 1 0\n700 1 0 0\n")
    common = ["--size", "9x8", "--spp", "2", "--quiet", "--sensor", str(curves)]
    assert run(["render", CORNELL, "-o", str(path), *common, "--white-balance", "4500"]) == 0
    film = {"sensor": read_sensor(curves), "white_balance": 4500.0}
    whole = Renderer(changed(load(CORNELL), SceneChanges.of(size=(9, 8), **film)))
    whole.run(2)
    assert np.array_equal(np.load(path), whole.image())


def test_names_of_pictures():
    assert names.default(Path(CORNELL)) == (Path("cornell_box.exr"), Path("cornell_box.png"))
    assert names.default(Path("a/scene.json"))[0] == Path("a.exr")  # though there is no such file
    assert names.default(ROOT / "tests" / "scenes" / "bowl.obj")[1] == Path("bowl.png")
    assert names.default(Path("a/b.pbrt.gz"))[0] == Path("b.exr")


def test_the_picture_goes_to_the_current_folder(tmp_path, monkeypatch):
    shutil.copy(ROOT / "tests" / "scenes" / "bowl.obj", tmp_path)
    monkeypatch.chdir(tmp_path)
    assert run(["render", "bowl.obj", "--size", "8x8", "--spp", "1", "--quiet"]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"bowl.obj", "bowl.exr", "bowl.png"}


def test_changes_of_a_scene():
    scene = changed(
        load(CORNELL), SceneChanges.of(size=(30, 20), spp=7, integrator="direct", seed=3)
    )
    assert (scene.film.width, scene.film.height) == (30, 20)
    assert (scene.spp, scene.integrator.kind, scene.seed) == (7, "direct", 3)
    assert changed(load(CORNELL), SceneChanges.of(max_depth=3)).integrator.max_depth == 3
    both = changed(load(CORNELL), SceneChanges.of(max_depth=3, light_paths=2)).integrator
    assert (both.max_depth, both.light_paths) == (3, 2)
    photons = changed(
        load(CORNELL), SceneChanges.of(integrator="vcm", light_paths=2, radius=0.5)
    ).integrator
    assert (photons.kind, photons.light_paths, photons.radius) == ("vcm", 2, 0.5)
    assert changed(load(CORNELL), SceneChanges.of(radius=0.5)).integrator.kind == "vcm"
    assert changed(load(CORNELL), SceneChanges.of(spp=3)).integrator.kind == "auto"
    auto = changed(load(CORNELL), SceneChanges.of(light_paths="auto"))
    assert auto.integrator.light_paths == "auto"
    assert (
        changed(auto, SceneChanges.of(integrator="vcm")).integrator.light_paths == 1
    )  # vcm has no "auto"
    assert (
        changed(load(CORNELL), SceneChanges.of(sampler="independent")).sampler.kind == "independent"
    )
    assert (
        changed(load(CORNELL), SceneChanges.of(integrator="whitted")).integrator.max_depth == 8
    )  # as it was


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--size", "0x5"], "1 to 65536"),
        (["--size", "100000x10"], "1 to 65536"),
        (["--size", "large"], "640x480"),
        (["--size", "65536x65536"], "64 Mi pixels"),
        (["--spp", "0"], "--spp"),
        (["--time", "soon"], "30s"),
        (["--time", "0s"], "no time"),
        (["--mode", "cmyk"], "spectral"),
        (["--integrator", "magic"], "whitted"),
        (["--integrator", "direct", "--max-depth", "3"], "no depth"),
        (["--integrator", "direct", "--light-paths", "1"], "no light paths"),
        (["--light-paths", "65"], "--light-paths"),
        (["--light-paths", "many"], "--light-paths"),
        (["--integrator", "vcm", "--light-paths", "auto"], "must be a whole number, not 'auto'"),
        (["--integrator", "path", "--radius", "0.1"], "no photons"),
        (["--integrator", "vcm", "--radius", "-1"], "--radius"),
        (["--device", "no such device"], "is not there"),
        (["-o", "picture.gif"], ".exr"),
        (["-o", "no/such/folder/a.png"], "folder"),
        (["--integrator", "aov"], '"layers"'),
        (["-D", "spp=3"], "only .xml"),
        (["--sensor", "no.csv"], "no.csv"),
        (["--sensor", "cie1964", "--mode", "rgb"], "film.sensor"),
        (["--bands", "4", "--mode", "rgb"], "film.bands"),
        (["--bands", "-3"], "--bands"),
        (["--white-balance", "D66"], "D66"),
        (["--white-balance", "1,1"], "chromaticity"),
        (["--output-space", "srgb"], "rec709"),
        (["--lambda-min", "900", "--quiet"], "lambda_m"),
    ],
)
def test_bad_input_is_one_line_before_anything_is_rendered(
    tmp_path, monkeypatch, capsys, arguments, words
):
    monkeypatch.chdir(tmp_path)
    assert run(["render", CORNELL, *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("clpt: error: ") and error.count("\n") == 1
    assert words in error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("given", "how"),
    [(["--tone", "agx"], {"tone": "agx"}), (["--view", "Un-tone-mapped"], {"view": ...})],
)
def test_a_tone_curve_or_a_view_of_the_png(given, how, tmp_path):
    if "view" in how:
        pytest.importorskip("PyOpenColorIO", reason="OpenColorIO is not installed")
        how = {"view": View("Un-tone-mapped")}
    png, npy = tmp_path / "a.png", tmp_path / "a.npy"
    outputs_ = ["-o", str(png), "-o", str(npy), "--size", "16x16", "--spp", "2"]
    assert run(["render", CORNELL, *outputs_, "--exposure", "3", *given]) == 0
    want = images.to_codes(images.read(npy), 3.0, **how)
    np.testing.assert_array_equal(images.read_stored(png).values, want)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["--view", "Un-tone-mapped", "--tone", "aces"], "a view has its own tone curve"),
        (["--ocio", "config.ocio"], "--ocio needs --view or --display"),
        (["--view", "none"], "unknown view of 'sRGB - Display' 'none'"),
    ],
)
def test_a_view_that_cannot_be_is_told(given, told, tmp_path, capsys):
    pytest.importorskip("PyOpenColorIO", reason="OpenColorIO is not installed")
    assert run(["render", CORNELL, "-o", str(tmp_path / "a.png"), *given]) == 2
    assert told in capsys.readouterr().err
