"""`clpt convert`: pictures, layers and films in other formats."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clpt import images
from clpt.__main__ import run
from clpt.images import spectral_exr
from clpt.images.spectral_exr import SpectralImage

COLOURS = np.random.default_rng(3).random((6, 8, 3)).astype(np.float32)
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_for_a_screen(capsys):
    images.write("a.exr", COLOURS, half=False)
    assert run(["convert", "a.exr", "a.png", "--tone", "agx", "--exposure", "1"]) == 0
    expected = images.to_codes(COLOURS, 1.0, "agx")
    np.testing.assert_array_equal(images.read_stored(Path("a.png")).values, expected)
    assert capsys.readouterr().err == "a.png\n"
    assert run(["convert", "a.exr", "b.webp", "--exposure", "auto"]) == 0
    assert f"exposure {images.auto_exposure(COLOURS):+.1f} stops" in capsys.readouterr().err


@pytest.mark.parametrize("suffix", [".exr", ".hdr", ".pfm", ".npy"])
def test_light_stays(suffix, capsys):
    images.write("a.npy", COLOURS)
    assert run(["convert", "a.npy", f"b{suffix}", "--tone", "agx"]) == 0
    np.testing.assert_allclose(images.read(f"b{suffix}"), COLOURS, atol=5e-3)
    assert "--tone ignored" in capsys.readouterr().err


def test_alpha_is_multiplied_where_it_should():
    """Colours of .exr are over nothing, those of .png are of what covers."""
    alpha = np.full((6, 8, 1), 0.5, np.float32)
    images.write("a.exr", np.concatenate([COLOURS * 0.5, alpha], axis=2), half=False)
    assert run(["convert", "a.exr", "a.png"]) == 0
    assert run(["convert", "a.png", "b.exr"]) == 0
    np.testing.assert_allclose(images.read("a.png")[..., :3], COLOURS, atol=5e-3)
    np.testing.assert_allclose(images.read("b.exr")[..., :3], COLOURS * 0.5, atol=5e-3)


def test_colours_of_another_space_are_converted():
    images.write("a.exr", COLOURS, half=False, space="acescg")
    assert run(["convert", "a.exr", "a.pfm"]) == 0
    expected = images.to_rec709(COLOURS, "acescg")
    np.testing.assert_allclose(images.read("a.pfm"), expected, atol=1e-4)


def test_layers(capsys):
    depth = np.linspace(1.0, 2.0, 48, dtype=np.float32).reshape(6, 8)
    images.write("a.exr", COLOURS, layers={"depth": depth, "albedo": COLOURS * 0.5})
    assert run(["convert", "a.exr", "d.pfm", "--layer", "depth"]) == 0
    np.testing.assert_allclose(images.read("d.pfm")[..., 0], depth)
    assert run(["convert", "a.exr", "d.pfm", "--layer", "albedo"]) == 0
    np.testing.assert_allclose(images.read("d.pfm"), COLOURS * 0.5, atol=1e-6)
    assert run(["convert", "a.exr", "d.pfm", "--layer", "dept"]) == 2
    assert "has no layer 'dept'; did you mean 'depth'?" in capsys.readouterr().err


def test_spectra_become_colours():
    nm = np.linspace(400.0, 700.0, 31)
    made = SpectralImage(np.full((2, 3, 31), 0.5, np.float32), nm)
    spectral_exr.write("a.exr", made)
    assert run(["convert", "a.exr", "a.png"]) == 0
    np.testing.assert_allclose(images.read("a.png"), 0.5, atol=0.03)


def test_a_film(capsys):
    common = ["--size", "8x6", "--mode", "rgb", "--samples", "0:2"]
    box = str(ROOT / "scenes" / "cornell_box")
    assert run(["render", box, *common, "-o", "a.film", "-o", "a.npy"]) == 0
    assert run(["convert", "a.film", "b.npy"]) == 0
    np.testing.assert_array_equal(images.read("b.npy"), images.read("a.npy"))


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["a.exr", "a.doc"], "unknown image suffix '.doc'"),
        (["none.exr", "a.png"], "there is no such file"),
        (["a.exr", "no/a.png"], "its folder does not exist"),
        (["a.exr"], "Missing argument 'TARGET'"),
    ],
)
def test_what_cannot_be_is_told(capsys, words, told):
    images.write("a.exr", COLOURS)
    assert run(["convert", *words]) == 2
    assert told in capsys.readouterr().err
