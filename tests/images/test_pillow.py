"""PNG, TIFF, JPEG and others: bits, transfer, primaries, transparency, and what is told."""

from __future__ import annotations

import logging
import struct
import subprocess
import sys
from io import BytesIO

import numpy as np
import pytest
from PIL import Image, ImageCms

from clpt import images
from clpt.errors import SceneError
from clpt.images import stored
from clpt.spectra import spaces
from tests.images import files

WIDE = np.array([[[0x1234, 0x8000, 0xFFFF, 0x8001]]], np.uint16).repeat(3, axis=0)


def chunk_gamma(value: float) -> tuple[bytes, bytes]:
    return b"gAMA", struct.pack(">I", round(100000 * value))


def chunk_primaries(space: str) -> tuple[bytes, bytes]:
    *others, x, y = (round(100000 * v) for v in spaces.chromaticities(space))
    return b"cHRM", struct.pack(">8I", x, y, *others)


@pytest.mark.parametrize("depth", [1, 2, 4, 8, 16])
def test_bits_of_grey(tmp_path, depth):
    codes = np.arange(2 ** min(depth, 8)).reshape(1, -1) * (257 if depth == 16 else 1)
    path = files.png(tmp_path / "a.png", codes, depth, 0)
    expected = codes / (2.0**depth - 1)
    np.testing.assert_allclose(images.read(path, linear=False)[..., 0], expected, atol=1e-6)


@pytest.mark.parametrize(("colour", "count"), [(2, 3), (6, 4), (4, 2)])
def test_sixteen_bits_of_colour_are_kept(tmp_path, colour, count):
    path = files.png(tmp_path / "a.png", WIDE[..., :count], 16, colour)
    expected = WIDE[0, 0, [0, 0, 0, 1] if colour == 4 else slice(count)] / 65535
    np.testing.assert_allclose(images.read(path, linear=False)[0, 0], expected, rtol=1e-6)
    colours = images.read(path)[0, 0]
    np.testing.assert_allclose(
        colours[:3], images.srgb_to_linear(expected[:3].astype(np.float32)), rtol=1e-5
    )
    np.testing.assert_allclose(colours[3:], expected[3:], rtol=1e-6)  # alpha


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize("filtered", [0, 1, 2])
@pytest.mark.parametrize(("colour", "count"), [(2, 3), (6, 4), (4, 2), (0, 1)])
def test_sixteen_bits_through_filters(tmp_path, colour, count, filtered, interlaced):
    codes = np.random.default_rng(8).integers(0, 1 << 16, (9, 11, count))
    path = files.png(tmp_path / "a.png", codes, 16, colour, (), filtered, interlaced)
    expected = codes[..., [0, 0, 0, 1]] if colour == 4 else codes
    back = images.read(path, linear=False)
    np.testing.assert_array_equal(np.round(back * 65535), expected)


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize(("count", "photometric"), [(3, 2), (4, 2), (1, 1), (1, 0)])
def test_sixteen_bits_of_tiff(tmp_path, order, count, photometric):
    path = files.tiff(tmp_path / "a.tif", WIDE[..., :count], photometric, order)
    if (order, photometric) == (">", 0):  # Pillow does not know it
        with pytest.raises(SceneError, match="of a kind that is read"):
            images.read(path)
        return
    expected = WIDE[0, 0, :count] / 65535
    expected = 1 - expected if photometric == 0 else expected
    np.testing.assert_allclose(images.read(path, linear=False)[0, 0], expected, rtol=1e-6)


@pytest.mark.parametrize("kind", [np.uint32, np.int16])
def test_whole_numbers_without_a_meaning(tmp_path, kind):
    path = files.tiff(tmp_path / "a.tif", np.full((2, 2, 1), 100, kind), 1)
    with pytest.raises(SceneError, match=r"a\.tif: its whole numbers of 32 bits, or with a sign"):
        images.read(path)


@pytest.mark.parametrize(
    ("depth", "colour", "key"),
    [(8, 0, (9,)), (16, 0, (900,)), (8, 2, (9, 8, 7)), (16, 2, (9, 8, 7))],
)
def test_a_transparent_colour(tmp_path, depth, colour, key):
    """tRNS: all pixels of one colour are transparent, by all bits of it."""
    rows = np.array([[key, [v + 1 for v in key]]])
    chunk = b"tRNS", struct.pack(f">{len(key)}H", *key)
    path = files.png(tmp_path / "a.png", rows, depth, colour, [chunk])
    image = images.read(path, linear=False)
    assert image[0, :, 3].tolist() == [0, 1]
    np.testing.assert_allclose(image[0, 1, :3], (rows[0, 1] / (2**depth - 1.0) * [1, 1, 1]), 1e-5)


def test_palettes(tmp_path):
    chunks = [(b"PLTE", bytes([255, 0, 0, 0, 128, 0])), (b"tRNS", bytes([64]))]
    path = files.png(tmp_path / "a.png", np.array([[0, 1, 0, 1, 1, 1, 1, 1]]), 1, 3, chunks)
    codes = np.round(255 * images.read(path, linear=False))
    assert codes[0, :2].tolist() == [[255, 0, 0, 64], [0, 128, 0, 255]]


ROWS = np.array([[[128, 64, 32], [255, 255, 255]]])


@pytest.mark.parametrize(
    ("chunks", "power"),
    [
        ([], None),
        ([chunk_gamma(1 / 2.2)], None),  # beside sRGB, by most writers
        ([chunk_gamma(1.0)], 1.0),
        ([chunk_gamma(0.5)], 2.0),
        ([(b"sRGB", b"\0"), chunk_gamma(1.0)], None),  # sRGB counts first
        ([chunk_gamma(0.0)], None),
        ([(b"sBIT", b"\5\5\5")], None),
        ([(b"cICP", b"\1\x0d\0\1"), chunk_gamma(1.0)], None),
    ],
)
@pytest.mark.parametrize("depth", [8, 16])
def test_transfer_of_png(tmp_path, chunks, power, depth):
    rows = ROWS * (257 if depth == 16 else 1)
    path = files.png(tmp_path / "a.png", rows, depth, 2, chunks)
    codes = (ROWS[0, 0] / 255).astype(np.float32)
    expected = images.srgb_to_linear(codes) if power is None else codes**power
    np.testing.assert_allclose(images.read(path)[0, 0], expected, rtol=1e-5)
    np.testing.assert_allclose(images.read(path, linear=False)[0, 0], codes, rtol=1e-6)


@pytest.mark.parametrize("space", ["rec709", "rec2020", "display_p3"])
def test_primaries_of_png(tmp_path, space):
    chunks = [chunk_gamma(1 / 2.2), chunk_primaries(space)]
    path = files.png(tmp_path / "a.png", ROWS, 8, 2, chunks)
    linear = images.srgb_to_linear((ROWS / 255).astype(np.float32))
    expected = linear @ spaces.between(space, "rec709").T
    np.testing.assert_allclose(images.read(path), expected, atol=1e-4)


def test_profiles_of_a_texture(tmp_path):
    """A bitmap is lowered as what the file means, and as stored where it is raw."""
    from clpt.render.records.tables import TableStore
    from clpt.render.textures.bitmaps import Images
    from clpt.scene.roles import EMISSION
    from clpt.scene.textures import Bitmap

    path = files.png(tmp_path / "a.png", ROWS, 8, 2, [chunk_gamma(1.0), chunk_primaries("rec2020")])
    for raw in (False, True):
        store, lowered = TableStore(), Images(spectral=False)
        names = ("kind", "width", "height", "decode", "first", "levels", "table")
        row = np.zeros((), [(name, np.uint32) for name in names])
        lowered.add(Bitmap(image=path, raw=raw), EMISSION, row)
        lowered.finish(store, set())
        words = store.arrays()["images"]
        if raw:
            assert words[row["first"]] == 128 | 64 << 8 | 32 << 16  # bytes stay bytes
        else:
            texel = words[row["first"] :][:3].view(np.float32)
            np.testing.assert_allclose(texel, np.maximum(images.read(path)[0, 0], 0), rtol=1e-5)


@pytest.mark.parametrize("block", [1, 7, 1 << 22])
@pytest.mark.parametrize("kind", [np.uint8, np.float32])
@pytest.mark.parametrize("gamma", [None, 0.5])
def test_decoding_by_blocks(monkeypatch, block, kind, gamma):
    monkeypatch.setattr(stored, "BLOCK", block)
    codes = np.random.default_rng(4).integers(0, 256, (5, 3, 4)).astype(np.uint8)
    matrix = spaces.between("rec2020", "rec709")
    numbers = codes / np.float32(255)
    image = images.Stored(codes if kind == np.uint8 else numbers, True, gamma, matrix)
    linear = images.srgb_to_linear(numbers) if gamma is None else numbers**2
    np.testing.assert_allclose(image.decoded()[..., :3], linear[..., :3] @ matrix.T, atol=1e-6)
    np.testing.assert_array_equal(image.decoded()[..., 3], numbers[..., 3])
    np.testing.assert_array_equal(image.decoded(linear=False), numbers)


def test_what_files_say_of_colours_and_is_left_out(tmp_path, caplog):
    pixels = Image.new("RGB", (4, 4), (128, 64, 32))
    other = ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB")).tobytes()
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    pixels.save(tmp_path / "srgb.jpg", icc_profile=srgb)
    pixels.save(tmp_path / "other.jpg", icc_profile=other)
    exif = Image.Exif()
    exif[0x0112] = 6
    pixels.save(tmp_path / "turned.jpg", exif=exif)
    pixels.convert("CMYK").save(tmp_path / "cmyk.jpg")
    pixels.save(tmp_path / "two.gif", save_all=True, append_images=[Image.new("RGB", (4, 4))])
    pixels.save(tmp_path / "srgb.png", icc_profile=srgb)
    pixels.save(tmp_path / "other.png", icc_profile=other)
    files.png(tmp_path / "pq.png", ROWS, 8, 2, [(b"cICP", b"\x09\x10\0\1")])
    told = {}
    for path in sorted(tmp_path.iterdir()):
        caplog.clear()
        with caplog.at_level(logging.WARNING, "clpt"):
            image = images.read(path, linear=False)
            told[path.name] = len(caplog.messages)
            images.read(path)
        told[path.name] = told[path.name], "; ".join(caplog.messages[told[path.name] :])
        if path.suffix == ".jpg":
            np.testing.assert_allclose(image[0, 0], [0.502, 0.251, 0.125], atol=0.02)
    assert told.pop("srgb.jpg") == told.pop("srgb.png") == (0, "")
    for name, (of_data, of_colours) in {
        "other.jpg": (0, "colour profile is left out"),
        "turned.jpg": (1, "its Exif orientation 6 is left out"),
        "cmyk.jpg": (0, "CMYK"),
        "two.gif": (1, "its first picture of several is taken"),
        "other.png": (0, "colour profile is left out"),
        "pq.png": (0, "cICP chunk is left out"),
    }.items():
        assert of_colours in told[name][1]
        assert told[name][0] == of_data, name


def test_cmyk_of_adobe(tmp_path):
    """Such files hold the complement of the inks: what Pillow writes has the marker."""
    Image.new("CMYK", (8, 8), (255, 0, 0, 0)).save(tmp_path / "a.jpg", quality=95)
    np.testing.assert_allclose(images.read(tmp_path / "a.jpg")[4, 4], [0, 1, 1], atol=0.02)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".tga", ".gif", ".bmp", ".webp"])
def test_only_named_formats_are_opened(tmp_path, suffix, monkeypatch):
    """PostScript is not handed to Ghostscript, nor are other formats that Pillow knows read."""
    from PIL import EpsImagePlugin

    def started(*arguments: object, **options: object) -> None:
        raise AssertionError("Ghostscript was asked for")

    monkeypatch.setattr(EpsImagePlugin, "Ghostscript", started)
    eps = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 8 8\n%%EndComments\nshowpage\n%%EOF\n"
    (tmp_path / f"a{suffix}").write_bytes(eps)
    file = BytesIO()
    Image.new("RGB", (4, 4)).save(file, "PPM")
    (tmp_path / f"b{suffix}").write_bytes(file.getvalue())
    for name in "ab":
        with pytest.raises(SceneError, match=r"is no PNG, JPEG, TGA, BMP, WebP, GIF or TIFF image"):
            images.read(tmp_path / f"{name}{suffix}")


def test_gltf_has_profiles_passed_over(tmp_path):
    """glTF 2.0, Images: gamma and profiles of images are ignored."""
    path = files.png(tmp_path / "a.png", ROWS, 8, 2, [chunk_gamma(1.0), chunk_primaries("rec2020")])
    image = images.decoded(path.read_bytes(), ("PNG",), profiled=False)
    assert (image.is_profiled, image.notes_of(False)) == (False, ())
    assert image.values[0, 0].tolist() == [128, 64, 32]


def test_modules_of_other_formats_are_not_imported(tmp_path):
    """Pillow imports all of its own for a format that it has not met."""
    path = tmp_path / "image.tga"
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(path)
    code = (
        "import sys; from pathlib import Path; from clpt.images import pillow; "
        "pillow.read(Path(sys.argv[1])); print('PIL.PdfImagePlugin' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "False"
