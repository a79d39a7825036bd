"""Radiance pictures by Radiance's filefmts: variables, orders of pixels, codings."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from clpt import images
from clpt.errors import SceneError
from clpt.spectra import spaces

ONE = bytes([128, 64, 32, 129])  # 1 .5 .25


def written(path, pixels: bytes, size: str, *lines: str):
    head = "\n".join(["#?RADIANCE", "a command that made it", *lines, "", size, ""])
    path.write_bytes(head.encode() + pixels)
    return path


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ((), (1, 0.5, 0.25)),
        (("EXPOSURE=4",), (0.25, 0.125, 0.0625)),
        (("EXPOSURE= 4.0", "EXPOSURE=.5"), (0.5, 0.25, 0.125)),  # they multiply together
        (("COLORCORR= 2 1 .5",), (0.5, 0.5, 0.5)),
        (("EXPOSURE=2", "COLORCORR=2 1 .5", "COLORCORR=2 1 1"), (0.125, 0.25, 0.25)),
        (("PRIMARIES= .64 .33 .30 .60 .15 .06 .3127 .3290",), (1, 0.5, 0.25)),
        (("PRIMARIES=0 0 0 0 0 0 0 0",), (1, 0.5, 0.25)),  # as Photoshop writes: none are stated
        (("# EXPOSURE=4", "\tEXPOSURE=4"), (1, 0.5, 0.25)),  # no variables
    ],
)
def test_variables(tmp_path, lines, expected):
    path = written(tmp_path / "a.hdr", ONE, "-Y 1 +X 1", *lines)
    np.testing.assert_allclose(images.read(path)[0, 0], expected, rtol=1e-5)


def test_primaries_and_xyz(tmp_path):
    stated = "PRIMARIES= .708 .292 .170 .797 .131 .046 .3127 .3290"
    path = written(tmp_path / "a.hdr", ONE, "-Y 1 +X 1", stated)
    expected = spaces.between("rec2020", "rec709") @ [1, 0.5, 0.25]
    np.testing.assert_allclose(images.read(path)[0, 0], expected, rtol=1e-4)
    assert images.read(path, linear=False)[0, 0].tolist() == [1, 0.5, 0.25]
    path = written(tmp_path / "b.hdr", ONE, "-Y 1 +X 1", "FORMAT=32-bit_rle_xyze")
    expected = spaces.from_xyz("rec709") @ [1, 0.5, 0.25]
    np.testing.assert_allclose(images.read(path)[0, 0], expected, rtol=1e-4)


@pytest.mark.parametrize("slow", ["-Y", "+Y", "-X", "+X"])
@pytest.mark.parametrize("fast", ["+X", "-X", "+Y", "-Y"])
def test_orders_of_pixels(tmp_path, slow, fast):
    """Y goes up, X to the right: the picture is 3 wide, 2 high, whatever is stored first."""
    if slow[1] == fast[1]:
        pytest.skip("one axis twice")
    shown = np.arange(11, 17).reshape(2, 3)  # as people see it
    stored = shown if slow[1] == "Y" else shown.T
    for axis, order in enumerate((slow, fast)):
        if order in ("+Y", "-X"):
            stored = np.flip(stored, axis)
    sizes = {"X": 3, "Y": 2}
    pixels = b"".join(bytes([v, v, v, 136]) for v in stored.ravel().tolist())
    size = f"{slow} {sizes[slow[1]]} {fast} {sizes[fast[1]]}"
    read = images.read(written(tmp_path / "a.hdr", pixels, size))
    np.testing.assert_array_equal(read[..., 1], shown)


def test_the_older_coding(tmp_path):
    """1 1 1 n repeats the pixel before; a count that follows one is 256 times as much."""
    other = bytes([200, 100, 50, 130])
    row = other + ONE + bytes([1, 1, 1, 3]) + other + bytes([1, 1, 1, 2, 1, 1, 1, 1]) + ONE
    width = 1 + 1 + 3 + 1 + 2 + 256 + 1
    path = written(tmp_path / "a.hdr", row * 2, f"-Y 2 +X {width}")
    expected = [200] + [128] * 4 + [200] * 259 + [128]
    scale = {200: 2.0**-6, 128: 2.0**-7}
    np.testing.assert_allclose(
        images.read(path)[1, :, 0], [v * scale[v] for v in expected], rtol=1e-6
    )


@pytest.mark.parametrize("row", [bytes([1, 1, 1, 3]), ONE + bytes([1, 1, 1, 9]), ONE * 2])
def test_broken_rows(tmp_path, row):
    path = written(tmp_path / "a.hdr", row, "-Y 1 +X 4")
    with pytest.raises(SceneError, match="broken in row 0 of 1"):
        images.read(path)


def test_exponents(tmp_path):
    """An exponent of 0 is black whatever stands beside it; the ends of the range are numbers."""
    pixels = bytes([255, 255, 255, 0, 255, 0, 1, 255, 128, 1, 1, 1])
    back = images.read(written(tmp_path / "a.hdr", pixels, "-Y 1 +X 3"))[0]
    assert back[0].tolist() == [0, 0, 0]
    np.testing.assert_allclose(back[1], [255 * 2.0**119, 0, 2.0**119], rtol=1e-6)
    assert back[2, 0] == 128 * 2.0**-135


def test_what_is_told_and_refused(tmp_path, caplog):
    path = written(tmp_path / "a.hdr", ONE, "-Y 1 +X 1", "PIXASPECT=2", "GAMMA=2.2")
    with caplog.at_level(logging.WARNING, "clpt"):
        images.read(path)
    assert "PIXASPECT of 2 is left out" in caplog.text
    assert "GAMMA of 2.2 is left out" in caplog.text
    for line, message in {
        "EXPOSURE=0": "EXPOSURE must be a number above 0",
        "EXPOSURE=bright": "EXPOSURE must be a number above 0",
        "COLORCORR=1 2": "COLORCORR must be 3 numbers",
        "PRIMARIES=.5 .5": "PRIMARIES must be 8 numbers",
        "PRIMARIES=.5 .5 .5 .5 .5 .5 .5 .5": "span no colours",
        "FORMAT=32-bit_rle_rgbb": "FORMAT must be",
    }.items():
        with pytest.raises(SceneError, match=message):
            images.read(written(tmp_path / "b.hdr", ONE, "-Y 1 +X 1", line))
    with pytest.raises(SceneError, match=r"no line like '-Y 480 \+X 640'"):
        images.read(written(tmp_path / "b.hdr", ONE, "-Y 1 +Y 1"))
