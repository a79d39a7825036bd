"""Textures of PBRT files as textures of ours."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

import clpt
from clpt import transforms
from clpt.errors import SceneError
from clpt.formats.pbrt.textures import map_values, textured
from clpt.scene.roles import REAL, REFLECTANCE
from clpt.scene.textures import Bitmap, Checkerboard, Checkers, Dots, Mix, Noise, Product
from tests.formats.pbrt.directives import define, params, state

STORED = np.array([[0, 255], [128, 64]], np.uint8)


def make(kind, values="spectrum", folder=None, **given):
    at = state() if folder is None else state(folder)
    define(at, values, "t", kind, **given)
    role = REAL if values == "float" else REFLECTANCE
    made = textured(params(x=("texture", "t")), "x", role, at)
    return made, at.shared.warnings


@pytest.fixture
def images(tmp_path):
    for name in ("a.png", "a.tga"):
        Image.fromarray(np.stack([STORED] * 3, axis=-1)).save(tmp_path / name)
    return tmp_path


def srgb(x):
    """The transfer of sRGB taken back (IEC 61966-2-1)."""
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def test_constants_are_values():
    assert make("constant", "float", value=("float", 0.3))[0] == 0.3
    assert make("constant", value=("rgb", 0.3, 0.2, 0.1))[0] == (0.3, 0.2, 0.1)
    assert make("scale", tex=("rgb", 0.3, 0.2, 0.1), scale=("float", 2.0))[0] == (0.6, 0.4, 0.2)


def test_checkerboard():
    """pbrt's first texture fills [0, 1)^2 of its uv; ours has a period of two such squares."""
    made, warnings = make(
        "checkerboard", tex1=("rgb", 1, 0, 0), tex2=("rgb", 0, 0, 1),
        uscale=("float", 20), vscale=("float", 10), udelta=("float", 1),
    )  # fmt: skip
    assert isinstance(made, Checkerboard) and not warnings
    assert made.color0.to_rgb() == pytest.approx([1, 0, 0])
    own = made.to_uv @ [0.01, 0.02, 1.0]
    assert own == pytest.approx([(20 * 0.01 + 1) / 2, 10 * 0.02 / 2, 1.0])


def test_mix_and_scale_nest():
    at = state()
    define(at, "float", "amount", "checkerboard")
    define(at, "spectrum", "mix", "mix", tex1=("rgb", 1, 0, 0), amount=("texture", "amount"))
    define(at, "spectrum", "t", "scale", tex=("texture", "mix"), scale=("float", 0.5))
    made = textured(params(x=("texture", "t")), "x", REFLECTANCE, at)
    again = textured(params(x=("texture", "t")), "x", REFLECTANCE, at)
    assert made is again
    assert isinstance(made, Product) and made.second.value == 0.5
    assert isinstance(made.first, Mix) and isinstance(made.first.amount, Checkerboard)


def test_bilerp():
    made, _ = make("bilerp", "float", v00=("float", 1), v10=("float", 2), v01=("float", 3))
    assert made.image[..., 0].tolist() == [[3.0, 1.0], [1.0, 2.0]]
    # The texels' centres lie in the corners of pbrt's square; v = 0 is the bottom row.
    assert made.to_uv @ [0.0, 0.0, 1.0] == pytest.approx([0.25, 0.25, 1.0])
    assert made.to_uv @ [1.0, 1.0, 1.0] == pytest.approx([0.75, 0.75, 1.0])
    assert made.wrap == "clamp"


def test_images(images):
    made, warnings = make(
        "imagemap", folder=images, filename=("string", "a.tga"), wrap=("string", "black"),
        filter=("string", "point"), encoding=("string", "linear"),
    )  # fmt: skip
    assert isinstance(made, Bitmap) and not warnings
    assert made.image == images / "a.tga" and not made.raw  # the encoding is for PNG only
    assert (made.wrap, made.filter) == ("zero", "nearest")
    assert make("imagemap", "float", images, filename=("string", "a.tga"))[0].channel == "r"
    levels = {
        None: "bilinear",
        "bilinear": "bilinear",
        "trilinear": "trilinear",
        "ewa": "trilinear",
    }
    for given, expected in levels.items():
        filter = {} if given is None else {"filter": ("string", given)}
        made, warnings = make("imagemap", folder=images, filename=("string", "a.tga"), **filter)
        assert made.filter == expected and not warnings


def test_numbers_between_texels_are_alpha_or_a_mean(tmp_path):
    """pbrt-v4's MIPMap: Bilerp<Float> takes alpha, or the mean; Texel<Float>, of others, red."""

    def number(pixel, suffix=".png", **given):
        path = tmp_path / f"a{suffix}"
        if suffix == ".png":
            Image.fromarray(np.full((2, 2, len(pixel)), pixel, np.uint8)).save(path)
        else:
            clpt.write_image(path, np.full((2, 2, len(pixel)), pixel), half=False, space="acescg")
        given = {name: ("string", value) for name, value in given.items()}
        made, warnings = make(
            "imagemap", "float", tmp_path, filename=("string", path.name), **given
        )
        assert not warnings
        return float(made.pixels(REAL)[0, 0, 0])

    linear = srgb(np.array([200, 100, 50, 128]) / 255.0)
    for filter in ("bilinear", "trilinear"):
        assert number((200, 100, 50, 128), filter=filter) == pytest.approx(linear[3])
        assert number((200, 100, 50, 0), filter=filter) == 0.0
        assert number((200, 100, 50, 255), filter=filter) == pytest.approx(linear[:3].mean())
        assert number((200, 100, 50), filter=filter) == pytest.approx(linear[:3].mean())
    for filter in ("point", "ewa"):
        assert number((200, 100, 50, 128), filter=filter) == pytest.approx(linear[0])
    assert number((100, 100, 100)) == pytest.approx(linear[1])
    assert number((200, 100, 50, 128), encoding="linear") == pytest.approx(128 / 255)
    assert number((200, 100, 50), encoding="linear") == pytest.approx(350 / 3 / 255)
    of_gamma = (np.array([200, 100, 50]) / 255) ** 2.0
    assert number((200, 100, 50), encoding="gamma 2") == pytest.approx(of_gamma.mean())
    assert number((0.2, 0.5, 1.1, 0.25), ".exr") == pytest.approx(0.25)
    assert number((0.2, 0.5, 1.1), ".exr") == pytest.approx(0.6)  # whatever its chromaticities
    assert number((0.2, 0.5, 1.1), ".exr", filter="point") == pytest.approx(0.2)


def test_encodings_scale_and_invert(images):
    def texels(**given):
        made, _ = make("imagemap", folder=images, filename=("string", "a.png"), **given)
        return made.image[..., 0] if isinstance(made.image, np.ndarray) else made

    stored = STORED / 255.0
    linear = srgb(stored)
    assert not texels().raw and texels(encoding=("string", "linear")).raw
    assert texels(encoding=("string", "gamma 2.2")) == pytest.approx(stored**2.2, abs=1e-6)
    assert texels(invert=("bool", True)) == pytest.approx(1.0 - linear, abs=1e-6)
    assert texels(scale=("float", 0.5)) == pytest.approx(0.5 * linear, abs=1e-6)


def test_functions_of_textures(images):
    bitmap = Bitmap(image=images / "a.png", raw=True)
    assert map_values(bitmap, np.sqrt).image[..., 0] == pytest.approx(np.sqrt(STORED / 255.0))
    coded = map_values(Bitmap(image=images / "a.png"), lambda v: 0.9 * v, bytes_stay=True)
    assert coded.image.dtype == np.uint8 and coded.image.shape == (2, 2, 3) and not coded.raw
    levels = [srgb(image / 255.0) for image in (coded.image[..., 0], STORED)]
    assert levels[0] == pytest.approx(0.9 * levels[1], abs=5e-3)
    board = Checkerboard(color0=0.25, color1=(0.25, 0.16, 0.04))
    made = map_values(Product(first=board, second=0.5), np.sqrt)
    assert made.first.color0.value == pytest.approx(0.5)
    assert made.first.color1.to_rgb() == pytest.approx([0.5, 0.4, 0.2])
    assert map_values(0.25, np.sqrt) == 0.5
    assert map_values((0.25, 0.0, 1.0), np.sqrt) == (0.5, 0.0, 1.0)


def test_patterns_are_placed_by_the_texture_space():
    """Where the transform was when the texture was named, not where the shape is."""
    at = state()
    at.ctm = transforms.translate([1.0, 2.0, 3.0]) @ transforms.scale([2.0, 2.0, 2.0])
    given = {"octaves": ("integer", 3), "roughness": ("float", 0.7)}
    define(at, "float", "t", "wrinkled", **given)
    made = textured(params(x=("texture", "t")), "x", REAL, at)
    assert (made.pattern, made.octaves, made.roughness) == ("wrinkled", 3, 0.7)
    assert made.to_texture @ [3.0, 2.0, 3.0, 1.0] == pytest.approx([1.0, 0.0, 0.0, 1.0])
    assert not at.shared.warnings
    for kind in ("fbm", "windy"):
        assert make(kind, "float")[0].pattern == kind
    assert make("marble", scale=("float", 4.0))[0].scale == 4.0
    solid, warnings = make("checkerboard", dimension=("integer", 3), tex1=("rgb", 1, 0, 0))
    assert isinstance(solid.amount, Checkers) and not warnings
    dots, warnings = make("dots", "float", inside=("float", 0.3))
    assert dots.first.value == 0.3 and isinstance(dots.amount, Dots) and not warnings


def test_mappings():
    made, warnings = make("dots", "float", mapping=("string", "cylindrical"))
    assert made.amount.mapping == "cylindrical" and not warnings
    v1, v2 = ("vector3", 0, 0, 2), ("vector3", 0, 3, 0)
    given = {"mapping": ("string", "planar"), "v1": v1, "v2": v2, "udelta": ("float", 0.5)}
    board = make("checkerboard", **given)[0]
    place = board.to_texture @ [1.0, 1.0, 1.0, 1.0]
    assert board.to_uv @ [*place[:2], 1.0] == pytest.approx([(2 + 0.5) / 2, 1.5, 1.0])


def test_functions_of_patterns_run_between_their_ends():
    made = map_values(Noise(), lambda v: 1.0 - v / 2.0)
    assert (made.first.value, made.second.value) == (1.0, 0.5) and isinstance(made.amount, Noise)


def test_what_is_approximated_is_told():
    assert "even mixture" in make("directionmix", "float")[1][0]
    assert "'extra'" in make("mix", "float", extra=("float", 1.0))[1][0]


@pytest.mark.parametrize(
    "kind, given, message",
    [
        ("ptex", {"filename": ("string", "a.ptx")}, "Ptex.*a.ptx"),
        ("imagemap", {"filename": ("string", "none.png")}, "none.png"),
        ("imagemap", {}, "no name of a file"),
        ("imagmap", {}, "imagemap"),
        ("mix", {"tex1": ("texture", "other")}, "other"),
        ("mix", {"tex1": ("texture", "t")}, "itself"),
    ],
)
def test_what_cannot_be_made_is_told(kind, given, message):
    with pytest.raises(SceneError, match=message) as caught:
        make(kind, **given)
    assert caught.value.line == 1


def test_a_texture_of_the_other_kind_is_not_found():
    at = state()
    define(at, "float", "t", "constant")
    with pytest.raises(SceneError, match="no spectrum texture 't'"):
        textured(params(x=("texture", "t")), "x", REFLECTANCE, at)
