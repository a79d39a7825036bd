"""`clpt inspect`: the values of pixels as they stand in the file, and a plot that shows them."""

from __future__ import annotations

import json
import sys

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from clpt import images
from clpt.__main__ import run
from clpt.cli.plots import strip
from clpt.images import spectral_exr
from clpt.images.spectral_exr import SpectralImage
from clpt.render.renderer import Renderer
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.shapes import Sphere

NM = np.linspace(400.0, 700.0, 7)
VALUES = np.random.default_rng(2).random((4, 6, 7)).astype(np.float32)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def shows(path) -> bool:
    """Whether a plot is a picture of more than paper and ink."""
    with Image.open(path) as image:
        return image.width > 600 and len(image.convert("RGB").getcolors(1 << 20)) > 100


@pytest.mark.parametrize("emissive", [False, True])
def test_spectra(here, capsys, emissive):
    made = SpectralImage(VALUES, NM, emissive, exposure=1.0)
    spectral_exr.write("a.exr", made)
    assert run(["inspect", "a.exr", "--at", "5,3", "--at", "0, 1", "--json", "--plot"]) == 0
    out, err = capsys.readouterr()
    told = json.loads(out)
    assert told["wavelengths"] == NM.tolist()
    assert told["size"] == "6 x 4"
    assert told["holds"] == ("light" if emissive else "reflectances")
    assert [p["at"] for p in told["pixels"]] == [[5, 3], [0, 1]]
    np.testing.assert_array_equal(told["pixels"][0]["values"], VALUES[3, 5])
    assert err.strip() == "a.spectrum.png"
    assert shows("a.spectrum.png")


def test_a_table(here, capsys):
    spectral_exr.write("a.exr", SpectralImage(VALUES, NM, True))
    assert run(["inspect", "a.exr", "--at", "2,1", "-o", "b.svg"]) == 0
    out = capsys.readouterr().out
    assert "radiance [W.m^-2.sr^-1.nm^-1]" in out
    assert "7, 400 to 700 nm" in out
    row = next(line for line in out.splitlines() if "450 nm" in line)
    assert f"{VALUES[1, 2, 1]:.5g}" in row
    assert (here / "b.svg").read_text().startswith("<?xml")


def test_it_writes_nothing_unasked(here):
    spectral_exr.write("a.exr", SpectralImage(VALUES, NM))
    assert run(["inspect", "a.exr", "--at", "2,1"]) == 0
    assert [p.name for p in here.iterdir()] == ["a.exr"]


def test_without_a_pixel_it_tells_of_the_file(here, capsys):
    spectral_exr.write("a.exr", SpectralImage(VALUES, NM))
    assert run(["inspect", "a.exr"]) == 0
    assert "reflectances" in capsys.readouterr().out
    assert sorted(p.name for p in here.iterdir()) == ["a.exr"]


@pytest.mark.parametrize("name", ["a.png", "a.exr", "a.hdr", "a.npy"])
def test_other_images(here, capsys, name):
    images.write(name, np.full((2, 3, 3), [0.25, 0.5, 1.0]), half=False)
    assert run(["inspect", name, "--at", "2,1", "--json", "--plot"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["channels"] == ["R", "G", "B"]
    np.testing.assert_allclose(told["pixels"][0]["values"], [0.25, 0.5, 1.0], atol=5e-3)
    assert shows("a.spectrum.png")


def test_layers_and_values_that_are_not_finite(here, capsys):
    picture = np.full((2, 3, 3), np.nan)
    images.write("a.exr", picture, half=False, layers={"depth": np.full((2, 3), np.inf)})
    assert run(["inspect", "a.exr", "--at", "0,0"]) == 0
    out = capsys.readouterr().out
    assert "depth" in out
    assert "inf" in out
    broken = SpectralImage(np.full((1, 1, 3), np.nan), [400.0, 500.0, 600.0])
    spectral_exr.write("b.exr", broken)
    assert run(["inspect", "b.exr", "--at", "0,0"]) == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["a.exr", "--at", "6,0"], "6,0 is outside of the image of 6 x 4 pixels"),
        (["a.exr", "--at", "0,4"], "whose last one is 5,3"),
        (["a.exr", "--at", "1;2"], "'1;2' does not look like 120,80"),
        (["a.exr", "--at", "0,0", "-o", "a.jpg"], "a plot is written to .png"),
        (["a.exr", "--at", "0,0", "-o", "none/a.png"], "cannot be written"),
        (["a.exr", "--plot"], "name one by --at X,Y"),
        (["none.exr"], "no such file"),
        (["text.exr"], "not a readable image"),
        (["text.doc"], "unknown image suffix"),
    ],
)
def test_what_cannot_be_is_told(here, capsys, arguments, words):
    spectral_exr.write("a.exr", SpectralImage(VALUES, NM))
    for name in ("text.exr", "text.doc"):
        (here / name).write_text("no image")
    assert run(["inspect", *arguments]) == 2
    assert words in capsys.readouterr().err


def test_the_strip_is_a_rainbow():
    """Dark at the ends of sight, blue at 450 nm, green at 530, red at 640."""
    colours = strip(np.array([360.0, 450.0, 530.0, 640.0, 800.0]))[0].astype(int)
    assert colours[[0, 4]].max() < 30
    assert [int(np.argmax(c)) for c in colours[1:4]] == [2, 1, 0]


def test_without_matplotlib_the_extra_is_named(here, capsys, monkeypatch):
    """The values are printed all the same."""
    spectral_exr.write("a.exr", SpectralImage(VALUES, NM))
    monkeypatch.delitem(sys.modules, "clpt.cli.plots")
    monkeypatch.delattr("clpt.cli.plots")
    monkeypatch.setitem(sys.modules, "matplotlib.axes", None)
    assert run(["inspect", "a.exr", "--at", "0,0"]) == 0
    assert capsys.readouterr().err == ""
    assert run(["inspect", "a.exr", "--at", "0,0", "--plot"]) == 2
    out, err = capsys.readouterr()
    assert "400 nm" in out
    assert 'a plot needs matplotlib: install it by pip install "clpt[plot]"' in err


@pytest.mark.parametrize("spectral", [False, True])
def test_channels_and_how_it_was_made(here, capsys, spectral):
    metadata = {"software": "clpt 1", "scene": "box.xml", "spp": 21.5, "seed": 7}
    if spectral:
        spectral_exr.write("a.exr", SpectralImage(VALUES, NM, True), metadata=metadata)
    else:
        images.write(
            "a.exr", VALUES[..., :3], metadata=metadata, layers={"samples": VALUES[..., 0]}
        )
    assert run(["inspect", "a.exr"]) == 0
    told = capsys.readouterr().out
    words = {"clpt 1", "box.xml", "21.5", "seed", "700 nm" if spectral else "R, G, B, samples"}
    assert all(word in told for word in words)
    for word in ("pixelAspectRatio", "spectralLayoutVersion", "chunkCount"):
        assert word not in told


def test_each_layer_has_a_line(here, capsys):
    """Its channels, how they are stored, their values; and how the picture is stored."""
    picture = np.full((2, 3, 4), [0.25, 0.5, 1.0, 1.0])
    depth = np.array([[1.0, 2.0, 3.0], [4.0, np.inf, np.nan]])
    layers = {"albedo": picture[..., :3] / 2, "depth.Z": depth, "samples": np.full((2, 3), 16.0)}
    images.write("a.exr", picture, layers=layers, space="acescg")
    assert run(["inspect", "a.exr", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["layers"].splitlines() == [
        "picture R G B A: half, 0.25 to 1",
        "albedo R G B: float, 0.125 to 0.5",
        "depth Z: float, 1 to 4, 2 not finite",
        "samples: float, 16 to 16",
    ]
    assert (told["colours"], told["compression"]) == ("acescg", "zip")


def test_parts_are_named(here, capsys):
    header = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.NO_COMPRESSION}
    parts = [
        OpenEXR.Part({**header, "name": name}, {letter: np.zeros((2, 3), np.float32)}, name)
        for name, letter in (("beauty", "Y"), ("deep", "Z"))
    ]
    OpenEXR.File(parts).write("a.exr")
    assert run(["info", "a.exr", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["parts"] == "beauty, deep; the first one is shown"
    assert (told["layers"], told["compression"]) == ("picture Y: float, 0 to 0", "no")


def test_a_png_tells_how_it_was_made(here, capsys):
    images.write("a.png", np.zeros((2, 3, 3)), metadata={"spp": 21.5, "scene": "box.xml"})
    for command in ("inspect", "info"):
        assert run([command, "a.png"]) == 0
        out = capsys.readouterr().out
        assert "21.5" in out and "box.xml" in out and "3 x 2" in out


def test_texts_of_a_file_neither_style_nor_control(here, capsys):
    images.write("a.exr", np.zeros((2, 3, 3)), metadata={"note": "[red]x[/green]\x1b[2J"})
    for command in ("inspect", "info"):
        assert run([command, "a.exr"]) == 0
        out = capsys.readouterr().out
        assert "[red]x[/green]\ufffd[2J" in out and "\x1b[2J" not in out


@pytest.mark.parametrize(
    ("name", "film"),
    [
        ("a.film", {"alpha": True, "mode": "rgb"}),
        pytest.param("a.resume.exr", {"bands": 4, "crop": (1, 0, 2, 2)}, marks=pytest.mark.slow),
    ],
)
def test_a_film_is_an_image_too(here, capsys, name, film):
    film = Film(width=4, height=2, layers=("depth",), **film)
    scene = Scene(camera=Perspective(), shapes=[Sphere(center=(0, 0, 3))], film=film)
    with Renderer(scene) as renderer:
        renderer.run(2)
        renderer.save_state(name)
        picture = renderer.image()
    assert run(["inspect", name, "--at", "1,1", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    values = told["pixels"][0]["values"]
    assert told["samples"] == "0 to 1" and told["sessions"]
    assert "depth" in told["holds"].splitlines()
    np.testing.assert_allclose(values[: picture.shape[2]], picture[1, 1], rtol=1e-6)
    if film.bands:
        assert len(told["wavelengths"]) == 4 and "crop: 1 0 2 2" in told["film"]
    else:
        labels = [*"RGBA"[: picture.shape[2]], "depth.Z"]
        assert told["channels"] == labels and len(values) == len(labels)
    assert run(["info", name]) == 0
    assert "depth" in capsys.readouterr().out


def test_colours_are_those_of_the_file_s_space(tmp_path):
    """The same colour in two spaces is shown alike; a space of no colours is passed over."""
    from clpt.cli.files.image_contents import read_contents
    from clpt.spectra import spaces

    rgb = np.array([0.5, 0.3, 0.2])
    images.write(tmp_path / "a.exr", np.full((2, 2, 3), rgb))
    other = spaces.between("rec709", "acescg") @ rgb
    images.write(tmp_path / "b.exr", np.full((2, 2, 3), other), space="acescg")
    shown = {read_contents(tmp_path / f"{name}.exr").hex_colour((0, 0)) for name in "ab"}
    assert shown == {"#bc957c"}
    none = {"chromaticities": (0.5,) * 8}
    images.write(tmp_path / "c.exr", np.full((2, 2, 3), rgb), metadata=none)
    assert read_contents(tmp_path / "c.exr").hex_colour((0, 0)) == "#bc957c"
