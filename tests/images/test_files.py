"""Image files: what is written comes back, what is not an image is told."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from clpt import images
from clpt.errors import SceneError
from clpt.images import checks, spectral_exr
from clpt.images.pillow import from_pillow
from clpt.spectra import spaces

rng = np.random.default_rng(1)


def picture(channels: int = 3, height: int = 9, width: int = 13) -> np.ndarray:
    return rng.uniform(0, 4, (height, width, channels)).astype(np.float32)


@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize(
    ("name", "options", "tolerance"),
    [
        ("a.exr", {"half": False}, 0),
        ("a.exr", {"half": True}, 2**-11),
        ("a.npy", {}, 0),
        ("a.pfm", {}, 0),
        ("A.EXR", {}, 2**-11),
    ],
)
def test_round_trip(tmp_path, name, options, tolerance, channels):
    if channels == 4 and name.endswith("pfm"):
        pytest.skip("PFM has no alpha")
    image = picture(channels)
    images.write(tmp_path / name, image, **options)
    back = images.read(tmp_path / name)
    assert back.dtype == np.float32
    assert back.shape == image.shape
    np.testing.assert_allclose(back, image, rtol=tolerance, atol=0)


@pytest.mark.parametrize("width", [3, 13, 300])
def test_hdr_round_trip(tmp_path, width):
    image = picture(width=width) * np.float32(10.0) ** rng.integers(-6, 6, (9, width, 1))
    image[0, 0] = 0
    images.write(tmp_path / "a.hdr", image)
    back = images.read(tmp_path / "a.hdr")
    error = np.abs(back - image).max(axis=2)
    assert (error <= image.max(axis=2) / 255).all()  # the largest one has 8 bits
    assert (back[0, 0] == 0).all()


def test_hdr_run_length(tmp_path):
    row = bytearray(b"\2\2\0\x10")
    for channel in range(4):
        row += bytes([128 + 10, 128 + channel, 6, *range(130, 136)])
    head = b"#?RADIANCE\n# a comment\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 16\n"
    (tmp_path / "a.hdr").write_bytes(head + bytes(row) * 2)
    back = images.read(tmp_path / "a.hdr")
    assert back.shape == (2, 16, 3)
    np.testing.assert_array_equal(back[1, 0], np.ldexp([128.0, 129, 130], 131 - 136))
    np.testing.assert_array_equal(back[1, 15], np.full(3, np.ldexp(135.0, 135 - 136)))


def test_png_is_srgb(tmp_path):
    image = np.array([[[0.0, 0.0031308, 1.0], [0.21404114, 9, -1]]], np.float32)
    images.write(tmp_path / "a.png", image)
    with Image.open(tmp_path / "a.png") as png:
        assert np.asarray(png).tolist() == [[[0, 10, 255], [128, 255, 0]]]
    back = images.read(tmp_path / "a.png")
    assert back[0, 1, 0] == pytest.approx(0.2158605, rel=1e-5)  # 128 / 255 decoded
    assert images.read(tmp_path / "a.png", linear=False)[0, 1, 0] == pytest.approx(128 / 255)


def test_png_all_levels_survive(tmp_path):
    levels = np.arange(256, dtype=np.uint8).reshape(16, 16)
    Image.fromarray(levels).save(tmp_path / "a.png")
    images.write(tmp_path / "b.png", images.read(tmp_path / "a.png"))
    with Image.open(tmp_path / "b.png") as png:
        np.testing.assert_array_equal(np.asarray(png), levels)


def test_png_rounds_the_transfer():
    """Codes are of the transfer in float64, to the last value before each of them."""
    steps = images.srgb8_steps()[1:-1]
    x = np.concatenate([np.nextafter(steps, np.float32(0)), steps]).reshape(1, -1, 1)
    exact = x.astype(np.float64)
    exact = np.where(exact <= 0.0031308, 12.92 * exact, 1.055 * exact ** (1 / 2.4) - 0.055)
    np.testing.assert_array_equal(images.to_srgb8(x), np.round(exact * 255))


def test_png_exposure_and_broken_values(tmp_path):
    image = np.array([[[np.nan, np.inf, -np.inf], [0.25, 0.5, 1]]], np.float32)
    images.write(tmp_path / "a.png", image, exposure=1)
    stored = images.read(tmp_path / "a.png")
    assert stored[0, 0].tolist() == [0, 1, 0]
    np.testing.assert_allclose(stored[0, 1], [0.5, 1, 1], atol=4e-3)


def test_alpha_is_not_decoded(tmp_path):
    Image.new("RGBA", (2, 2), (128, 128, 128, 128)).save(tmp_path / "a.png")
    pixel = images.read(tmp_path / "a.png")[0, 0]
    assert pixel[3] == pytest.approx(128 / 255)
    assert pixel[0] == pytest.approx(0.2158605, rel=1e-5)


@pytest.mark.parametrize("suffix", [".png", ".tga", ".bmp", ".webp", ".tif"])
def test_eight_bit_formats(tmp_path, suffix):
    stored = rng.integers(0, 256, (5, 7, 3)).astype(np.uint8)
    options = {"lossless": True} if suffix == ".webp" else {}
    Image.fromarray(stored).save(tmp_path / f"a{suffix}", **options)
    back = images.read(tmp_path / f"a{suffix}", linear=False)
    np.testing.assert_array_equal(np.round(back * 255), stored)


@pytest.mark.parametrize(("mode", "channels"), [("1", 1), ("L", 1), ("P", 3), ("LA", 4)])
def test_pillow_modes(mode, channels):
    image = from_pillow(Image.new("RGB", (3, 2), (255, 255, 255)).convert(mode)).decoded()
    assert image.shape == (2, 3, channels)
    assert (image == 1).all()


def test_sixteen_bit_grey(tmp_path):
    Image.fromarray(np.array([[0, 30000, 65535]], np.uint16)).save(tmp_path / "a.png")
    raw = images.read(tmp_path / "a.png", linear=False)
    np.testing.assert_allclose(raw[0, :, 0], [0, 30000 / 65535, 1], rtol=1e-6)


def test_exr_metadata_and_layers(tmp_path):
    import OpenEXR

    image, depth, normal = picture(), picture(1)[..., 0], picture()
    metadata = {"mode": "spectral", "spp": 64, "seconds": 1.5}
    path = tmp_path / "a.exr"
    images.write(
        path, image, half=False, metadata=metadata, layers={"depth.Z": depth, "normal": normal}
    )
    with OpenEXR.File(str(path)) as file:
        header = file.header()
        assert (header["mode"], header["spp"], header["seconds"]) == ("spectral", 64, 1.5)
    layers = images.read_layers(path)
    assert sorted(layers) == ["B", "G", "R", "depth.Z", "normal.B", "normal.G", "normal.R"]
    np.testing.assert_array_equal(layers["depth.Z"], depth)
    np.testing.assert_array_equal(layers["normal.G"], normal[..., 1])
    np.testing.assert_array_equal(images.read(path), image)


@pytest.mark.parametrize("space", spaces.SPACES)
def test_exr_states_its_space(tmp_path, space):
    """By its chromaticities, from which colour-science makes the same matrix to XYZ."""
    import OpenEXR

    images.write(tmp_path / "a.exr", picture(), space=space)
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        stated = np.reshape(file.header()["chromaticities"], (4, 2))
    np.testing.assert_allclose(stated.ravel(), spaces.chromaticities(space), atol=1e-6)
    colour = pytest.importorskip("colour")
    matrix = colour.normalised_primary_matrix(stated[:3], stated[3])
    np.testing.assert_allclose(matrix, spaces.to_xyz(space), atol=1e-4)


@pytest.mark.parametrize("space", spaces.SPACES)
def test_png_is_srgb_whatever_the_space(tmp_path, space):
    """The same colours in any space make the same file; alpha stays."""
    rgb = np.clip(picture(4) / 4, 0.05, 0.95)
    rgb[0, 0, :3] = 1.0
    other = rgb.copy()
    other[..., :3] = rgb[..., :3] @ spaces.between("rec709", space).T
    images.write(tmp_path / "a.png", rgb)
    images.write(tmp_path / "b.png", other, space=space)
    ours, theirs = (images.read(tmp_path / name, linear=False) for name in ("b.png", "a.png"))
    np.testing.assert_allclose(ours, theirs, atol=1.01 / 255)
    with pytest.raises(SceneError, match="rec709"):
        images.write(tmp_path / "a.png", rgb, space="srgb")


@pytest.mark.parametrize("value", [1e6, 1e-5, 1e-20, 1e13])
def test_an_exr_is_of_floats_where_half_does_not_reach(tmp_path, value):
    """Half numbers end at 65504 and lose their precision below 2^-14."""
    picture = np.full((2, 2, 3), value, np.float32)
    picture[0, 0] = 0.0
    images.write(tmp_path / "a.exr", picture)
    np.testing.assert_array_equal(images.read(tmp_path / "a.exr"), picture)


def test_an_exr_is_of_halves_where_they_reach(tmp_path):
    images.write(tmp_path / "a.exr", np.array([[[0.1, 65504.0, np.inf]]], np.float32))
    assert {c.dtype.name for c in images.read_channels(tmp_path / "a.exr").values()} == {"float16"}
    np.testing.assert_allclose(images.read(tmp_path / "a.exr"), [[[0.1, 65504, 65504]]], rtol=1e-3)


@pytest.mark.parametrize(
    ("names", "chosen"),
    [
        (["A", "B", "G", "R", "Z"], "RGBA"),
        (["Y", "Z"], "Y"),
        (["view.B", "view.G", "view.R"], ["view.R", "view.G", "view.B"]),
        (["b.X", "a.X"], ["a.X", "b.X"]),
    ],
)
def test_exr_channel_choice(tmp_path, names, chosen):
    import OpenEXR

    channels = {name: np.full((2, 3), i, np.float32) for i, name in enumerate(names)}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(str(tmp_path / "a.exr"))
    back = images.read(tmp_path / "a.exr")
    assert back[0, 0].tolist() == [names.index(name) for name in chosen]


@pytest.mark.parametrize("suffix", sorted(images.READERS))
@pytest.mark.parametrize("content", [b"", b"not an image at all, just text " * 9])
def test_what_is_not_an_image(tmp_path, suffix, content):
    path = tmp_path / f"broken{suffix}"
    path.write_bytes(content)
    with pytest.raises(SceneError, match="broken"):
        images.read(path)


@pytest.mark.parametrize("suffix", images.WRITABLE)
def test_truncated(tmp_path, suffix):
    path = tmp_path / f"short{suffix}"
    images.write(path, picture(height=64, width=64))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(SceneError, match="short"):
        images.read(path)


def test_missing_and_unknown(tmp_path):
    with pytest.raises(SceneError, match=r"nothing\.png: no such"):
        images.read(tmp_path / "nothing.png")
    with pytest.raises(SceneError, match=r"unknown image suffix '\.xyz'"):
        images.read(tmp_path / "a.xyz")
    with pytest.raises(SceneError, match=r"unknown image suffix '\.gif'"):
        images.write(tmp_path / "a.gif", picture())
    with pytest.raises(SceneError, match="folder does not exist"):
        images.write(tmp_path / "no" / "a.png", picture())
    with pytest.raises(SceneError, match=r"not \(2, 2, 5\); bands"):
        images.write(tmp_path / "a.png", np.zeros((2, 2, 5)))


def test_transfer_is_its_own_inverse():
    x = np.linspace(0, 1, 1001, dtype=np.float32)
    np.testing.assert_allclose(images.srgb_to_linear(images.linear_to_srgb(x)), x, atol=1e-6)


def test_images_of_too_many_pixels(tmp_path, monkeypatch):
    """By what the file's beginning says, before memory is taken."""
    whole = np.zeros((20, 30, 3), np.float32)
    paths = [tmp_path / f"a{suffix}" for suffix in images.WRITABLE]
    for path in paths:
        images.write(path, whole)
    spectral = tmp_path / "bands.exr"
    spectral_exr.write(spectral, spectral_exr.SpectralImage(whole, [400.0, 500.0, 600.0], True))
    monkeypatch.setattr(checks, "PIXELS", 600)
    assert all(images.read(path).shape == whole.shape for path in paths)
    monkeypatch.setattr(checks, "PIXELS", 599)
    for path in [*paths, spectral]:
        with pytest.raises(SceneError, match=r"has 30x20 pixels, more than the 599 that") as raised:
            (spectral_exr if path == spectral else images).read(path)
        assert str(raised.value).startswith(f"{path}: has")
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100)
    with pytest.raises(SceneError, match=r"more than the 200 pixels that are read of \.png"):
        images.read(tmp_path / "a.png")
