"""`clpt compare`: figures of the difference of two images, and pictures of it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from clpt import images
from clpt.__main__ import run
from clpt.images import spectral_exr
from clpt.images.measures import EPSILON, differences
from clpt.images.spectral_exr import SpectralImage

RNG = np.random.default_rng(4)
B = RNG.random((6, 8, 3)).astype(np.float32)
A = B + RNG.normal(0.0, 0.1, B.shape).astype(np.float32)


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    images.write("a.exr", A, half=False)
    images.write("b.exr", B, half=False)
    return tmp_path


def test_figures(capsys):
    assert run(["compare", "a.exr", "b.exr", "--json"]) == 0
    told, apart = json.loads(capsys.readouterr().out), A.astype(float) - B
    expected = {
        "bias": apart.mean(), "absolute": np.abs(apart).mean(),
        "mean_square": (apart**2).mean(), "root_mean_square": np.sqrt((apart**2).mean()),
        "relative_square": (apart**2 / (B.astype(float) ** 2 + EPSILON)).mean(),
        "largest": np.abs(apart).max(), "lost": 0,
    }  # fmt: skip
    assert {name: told[name] for name in expected} == pytest.approx(expected)
    y, x, channel = np.unravel_index(np.abs(apart).argmax(), apart.shape)
    assert told["where"] == {"at": [x, y], "channel": "RGB"[channel]}


def test_a_table(capsys):
    assert run(["compare", "a.exr", "b.exr"]) == 0
    out = capsys.readouterr().out
    assert "root mean square error" in out and "relative square error" in out
    assert max(map(len, out.splitlines())) <= 80
    assert run(["compare", "a.exr", "a.exr"]) == 0
    assert "none: all values are the same" in capsys.readouterr().out


def test_the_difference_as_a_picture(capsys):
    assert run(["compare", "a.exr", "b.exr", "-o", "d.exr"]) == 0
    np.testing.assert_allclose(images.read("d.exr"), A - B, atol=1e-3)
    size = np.sqrt(((A - B) ** 2).mean(axis=2))
    assert run(["compare", "a.exr", "b.exr", "-o", "d.png", "--most", f"{size.max()}"]) == 0
    assert "black: no difference, bright yellow" in capsys.readouterr().err
    codes = images.read_stored("d.png").values.astype(int)
    brightest = np.unravel_index(size.argmax(), size.shape)
    assert codes[brightest].tolist() == [0xFC, 0xFF, 0xA4]  # the end of the scale
    order = np.argsort(size.ravel())
    assert codes.sum(axis=2).ravel()[order[-1]] > codes.sum(axis=2).ravel()[order[0]]


def test_what_is_not_finite_is_left_out():
    broken = A.copy()
    broken[0, 0, 0], broken[1, 1, 1] = np.nan, np.inf
    found = differences(broken, A)
    assert (found.lost, found.bias, found.largest) == (2, 0.0, 0.0)


def test_spectra_are_compared_by_their_values(capsys):
    nm = np.linspace(400.0, 700.0, 7)
    for name, value in (("s", 0.5), ("t", 0.25)):
        spectral_exr.write(f"{name}.exr", SpectralImage(np.full((2, 3, 7), value), nm))
    assert run(["compare", "s.exr", "t.exr", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["bias"] == 0.25 and told["where"]["channel"] == "400 nm"
    assert run(["compare", "s.exr", "t.exr", "-o", "d.exr"]) == 0
    np.testing.assert_allclose(images.read("d.exr"), 0.25)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["a.exr", "small.exr"], "is 2 x 1 pixels, and a.exr is 8 x 6"),
        (["a.exr", "none.exr"], "there is no such file"),
        (["a.exr", "b.exr", "-o", "no/a.png"], "its folder does not exist"),
        (["a.exr", "b.exr", "-o", "a.doc"], "unknown image suffix"),
        (["a.exr", "b.exr", "--most", "0"], "Invalid value for '--most'"),
    ],
)
def test_what_cannot_be_is_told(capsys, words, told):
    images.write("small.exr", A[:1, :2])
    assert run(["compare", *words]) == 2
    assert told in capsys.readouterr().err
