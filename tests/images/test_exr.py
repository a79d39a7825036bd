"""OpenEXR files of others: channels by name, windows, primaries, subsampling, parts."""

from __future__ import annotations

import logging
import struct

import numpy as np
import OpenEXR
import pytest

from clpt import images
from clpt.errors import SceneError
from clpt.images.exr import Choice, choose
from clpt.spectra import spaces
from tests.images import files

PLAIN = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}


def flat(value: float, height: int = 4, width: int = 6) -> np.ndarray:
    return np.full((height, width), value, np.float32)


def stored(path, channels, **header):
    OpenEXR.File({**PLAIN, **header}, channels).write(str(path))
    return path


@pytest.mark.parametrize(
    ("names", "chosen"),
    [
        ("RGB", "RGB"),
        ("rgb", "rgb"),
        ("rgba", "rgba"),
        (["B", "G", "R", "Z", "A"], "RGBA"),
        (["beauty.R", "beauty.G", "beauty.B", "Z"], ["beauty.R", "beauty.G", "beauty.B"]),
        (["beauty.r", "beauty.g", "beauty.b"], ["beauty.r", "beauty.g", "beauty.b"]),
        (["a.R", "a.G", "a.B", "b.R", "b.G", "b.B"], ["a.R", "a.G", "a.B"]),
        (["a.R", "a.G", "a.B", "x.beauty.R", "x.beauty.G", "x.beauty.B"],
         ["x.beauty.R", "x.beauty.G", "x.beauty.B"]),
        (["R", "G", "B", "a.R", "a.G", "a.B"], "RGB"),
        (["Y", "a.R", "a.G", "a.B"], "Y"),
        (["N.X", "N.Y", "N.Z"], ["N.X", "N.Y", "N.Z"]),
        (["Z"], "Z"),
        (["Z", "N.X", "N.Y", "N.Z"], ["N.X", "N.Y", "N.Z"]),
    ],
)  # fmt: skip
def test_channels_are_chosen_by_their_names(tmp_path, names, chosen):
    values = {name: 0.1 * (1 + i) for i, name in enumerate(names)}
    path = stored(tmp_path / "a.exr", {name: flat(v) for name, v in values.items()})
    np.testing.assert_allclose(images.read(path)[0, 0], [values[n] for n in chosen], rtol=1e-6)


def test_grey_with_alpha(tmp_path):
    path = stored(tmp_path / "a.exr", {"Y": flat(0.5), "A": flat(0.25)})
    assert images.read(path)[0, 0].tolist() == [0.5, 0.5, 0.5, 0.25]


def test_deep_parts_are_passed_over_where_there_are_others():
    assert choose([[], ["a.R", "a.G", "a.B"]]) == Choice(1, ("a.R", "a.G", "a.B"), "rgb")
    assert choose([[], ["u", "v"]]).names == ("u", "v")
    assert choose([["Z"], ["R", "G", "B"], ["Y"]]).part == 1
    assert choose([["x.R", "x.G", "x.B"], ["R", "G", "B"]]).part == 1


def test_layers_that_are_pictures_by_name_need_no_word():
    names = [f"V.{layer}.{letter}" for layer in ("Albedo", "Combined") for letter in "RGB"]
    assert choose([names]) == Choice(0, ("V.Combined.R", "V.Combined.G", "V.Combined.B"), "rgb")


def test_xyz_is_a_colour_without_a_layer(tmp_path):
    """As Mitsuba writes and reads it; in a layer it is a position, or a normal."""
    path = stored(tmp_path / "a.exr", {"X": flat(0.4), "Y": flat(0.2), "Z": flat(0.1)})
    expected = spaces.from_xyz("rec709") @ [0.4, 0.2, 0.1]
    np.testing.assert_allclose(images.read(path)[0, 0], expected, atol=1e-6)
    np.testing.assert_allclose(images.read(path, linear=False)[0, 0], [0.4, 0.2, 0.1], rtol=1e-6)


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.uint32])
def test_types_of_channels(tmp_path, kind):
    path = stored(tmp_path / "a.exr", {name: flat(3).astype(kind) for name in "RGBZ"})
    assert images.read(path)[0, 0].tolist() == [3, 3, 3]


def test_a_part_with_colours(tmp_path):
    parts = [
        OpenEXR.Part(dict(PLAIN), {"Z": flat(9)}, "depth"),
        OpenEXR.Part(dict(PLAIN), {name: flat(2) for name in "RGB"}, "beauty"),
    ]
    OpenEXR.File(parts).write(str(tmp_path / "a.exr"))
    assert images.read(tmp_path / "a.exr")[0, 0].tolist() == [2, 2, 2]


@pytest.mark.parametrize(
    ("data", "display"),
    [
        (((2, 1), (5, 2)), ((0, 0), (7, 3))),  # a crop
        (((-2, -1), (9, 4)), ((0, 0), (7, 3))),  # overscan
        (((-2, 1), (3, 7)), ((0, 0), (7, 3))),
        (((12, 11), (15, 14)), ((10, 10), (17, 13))),  # away from the origin
        (((20, 20), (23, 22)), ((0, 0), (7, 3))),  # apart
    ],
)
@pytest.mark.parametrize("names", ["RGB", "RGBZ"])  # all channels of the file, or some
def test_windows(tmp_path, data, display, names):
    """A pixel is the display window's; it is zero outside of the data window."""
    (x0, y0), (x1, y1) = data
    x, y = np.meshgrid(np.arange(x0, x1 + 1), np.arange(y0, y1 + 1))
    value = (100 + x + 10 * y).astype(np.float32)
    path = stored(
        tmp_path / "a.exr", dict.fromkeys(names, value), dataWindow=data, displayWindow=display
    )
    (x0, y0), (x1, y1) = display
    shown_x, shown_y = np.meshgrid(np.arange(x0, x1 + 1), np.arange(y0, y1 + 1))
    within = (shown_x >= data[0][0]) & (shown_x <= data[1][0])
    within &= (shown_y >= data[0][1]) & (shown_y <= data[1][1])
    expected = np.where(within, 100 + shown_x + 10 * shown_y, 0)
    np.testing.assert_array_equal(images.read(path)[..., 0], expected)


@pytest.mark.parametrize("space", spaces.SPACES)
@pytest.mark.parametrize("channels", [3, 4])
def test_chromaticities_are_heeded(tmp_path, space, channels):
    values = np.full((2, 2, channels), (0.8, 0.3, 0.1, 0.5)[:channels], np.float32)
    images.write(tmp_path / "a.exr", values, space=space, half=False)
    expected = spaces.between(space, "rec709") @ values[0, 0, :3]
    back = images.read(tmp_path / "a.exr")[0, 0]
    np.testing.assert_allclose(back[:3], expected, atol=1e-5)
    assert back[3:].tolist() == [0.5][: channels - 3]
    data = images.read(tmp_path / "a.exr", linear=False)  # normals, roughness
    np.testing.assert_array_equal(data, values)


def test_chromaticities_of_aces_and_of_others(tmp_path):
    """ACEScg by Bradford's transform, as colour-science has it; primaries that no name has."""
    images.write(tmp_path / "a.exr", np.full((2, 2, 3), (0.8, 0.3, 0.1)), space="acescg")
    np.testing.assert_allclose(
        images.read(tmp_path / "a.exr")[0, 0], [1.169, 0.237, 0.057], atol=1e-3
    )
    colour = pytest.importorskip("colour")
    own = colour.RGB_COLOURSPACES["ProPhoto RGB"]
    stated = (*own.primaries.reshape(-1), *own.whitepoint)
    path = stored(
        tmp_path / "b.exr", dict(zip("RGB", map(flat, (0.5, 0.3, 0.1)), strict=True)),
        chromaticities=tuple(map(float, stated)),
    )  # fmt: skip
    expected = colour.RGB_to_RGB([0.5, 0.3, 0.1], own, colour.RGB_COLOURSPACES["sRGB"], "Bradford")
    np.testing.assert_allclose(images.read(path)[0, 0], expected, atol=1e-3)


def test_chromaticities_without_colours_are_told(tmp_path, caplog):
    path = stored(tmp_path / "a.exr", dict.fromkeys("RGB", flat(1)), chromaticities=(0.5,) * 8)
    with caplog.at_level(logging.WARNING, "clpt"):
        assert images.read(path)[0, 0].tolist() == [1, 1, 1]
    assert "span no colours: left out" in caplog.text


def test_luminance_and_chroma(tmp_path):
    """Mitsuba's numbers for the same file; chroma is subsampled by 2 in both directions."""
    y = np.linspace(0.2, 0.9, 16, dtype="<f4").reshape(4, 4)
    half = np.full((2, 2), 1, "<f4")
    channels = {"Y": y, "RY": (0.1 * half, 2, 2), "BY": (-0.2 * half, 2, 2)}
    path = files.exr(tmp_path / "a.exr", channels, (4, 4))
    red, green, blue = np.moveaxis(images.read(path), 2, 0)
    np.testing.assert_allclose(red, 1.1 * y, rtol=1e-6)
    np.testing.assert_allclose(blue, 0.8 * y, rtol=1e-6)
    weights = spaces.to_xyz("rec709")[1]
    back = weights[0] * red + weights[1] * green + weights[2] * blue
    np.testing.assert_allclose(back, y, rtol=1e-5)
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    np.testing.assert_allclose(images.read(path), np.array(mi.Bitmap(str(path))), rtol=1e-4)


def test_subsampled_channels_are_interpolated(tmp_path):
    rows = np.array([[1, 3, 7]], "<f4").repeat(4, axis=0)
    channels = {"R": (rows, 2, 1), "G": np.ones((4, 6), "<f4"), "B": np.ones((4, 6), "<f4")}
    path = files.exr(tmp_path / "a.exr", channels, (6, 4))
    assert images.read(path)[0, :, 0].tolist() == [1, 2, 3, 5, 7, 7]


def test_what_is_left_out_is_told(tmp_path, caplog):
    extra = files.attribute("pixelAspectRatio", "float", struct.pack("<f", 2))
    extra += files.attribute("envmap", "envmap", b"\1")
    channels = dict.fromkeys("RGB", np.ones((4, 6), "<f4"))
    path = files.exr(tmp_path / "a.exr", channels, (6, 4), extra=extra)
    with caplog.at_level(logging.WARNING, "clpt"):
        images.read(path)
    assert "pixelAspectRatio of 2 is left out" in caplog.text
    assert "it is a cube" in caplog.text
    caplog.clear()
    layers = [f"{layer}.{letter}" for layer in "ab" for letter in "RGB"]
    with caplog.at_level(logging.WARNING, "clpt"):
        images.read(stored(tmp_path / "b.exr", dict.fromkeys(layers, flat(1))))
        images.read(stored(tmp_path / "c.exr", {"u": flat(1), "v": flat(2), "w": flat(3)}))
    assert "taken from the layer 'a'" in caplog.text
    assert "no channels R, G and B, nor Y: u, v, w are taken as they stand" in caplog.text


def test_deep_pixels_are_refused(tmp_path):
    """A header of deep scanlines; what its chunks hold does not matter."""
    extra = files.attribute("type", "string", b"deepscanline")
    extra += files.attribute("version", "int", struct.pack("<i", 1))
    extra += files.attribute("chunkCount", "int", struct.pack("<i", 4))
    extra += files.attribute("name", "string", b"deep")
    channels = dict.fromkeys("RGB", np.ones((4, 6), "<f4"))
    path = files.exr(tmp_path / "a.exr", channels, (6, 4), extra=extra, flags=2 | 0x800)
    with pytest.raises(SceneError, match=r"a\.exr: has deep pixels \(deepscanline\); flatten it"):
        images.read(path)


def test_tiles_and_levels(tmp_path):
    """Tiles of one level, by the library's writer."""
    tiles = OpenEXR.TileDescription()
    tiles.xSize = tiles.ySize = 2
    value = np.arange(24, dtype=np.float32).reshape(4, 6)
    header = {"type": OpenEXR.tiledimage, "tiles": tiles, "compression": OpenEXR.ZIP_COMPRESSION}
    OpenEXR.File(header, dict.fromkeys("RGBZ", value)).write(str(tmp_path / "a.exr"))
    np.testing.assert_array_equal(images.read(tmp_path / "a.exr")[..., 1], value)


@pytest.mark.parametrize("names", ["RGB", "RGBZ"])
def test_the_largest_of_mip_levels_is_the_picture(tmp_path, names):
    level = [np.full((n, n), n, "<f4") for n in (4, 2, 1)]
    tiles = files.attribute("tiles", "tiledesc", struct.pack("<IIB", 4, 4, 1))  # one a level
    path = files.exr(
        tmp_path / "a.exr", dict.fromkeys(names, level[0]), (4, 4), extra=tiles,
        flags=2 | 0x200, levels=dict.fromkeys(names, level),
    )  # fmt: skip
    assert images.read(path).tolist() == np.full((4, 4, 3), 4).tolist()
