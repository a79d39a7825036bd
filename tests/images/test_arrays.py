"""Arrays as pictures: one check for textures, surroundings and writers; alpha by the format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import clpt
from clpt import images
from clpt.errors import SceneError
from clpt.scene import cameras, lights, materials, shapes, textures

BYTES = np.linspace(0, 255, 4 * 8 * 3).reshape(4, 8, 3).astype(np.uint8)
LINEAR = images.Stored(BYTES, encoded=True).decoded()
COVERED = np.dstack([0.25 * LINEAR, np.full((4, 8), 0.25, np.float32)])
WRONG = {
    "uint16": np.uint16(BYTES) * 257, "int64": np.int64(BYTES), "bool": BYTES > 99,
    "int8": np.int8(BYTES // 2), "complex": LINEAR + 0j, "text": np.full((4, 8, 3), "1"),
    "object": np.full((4, 8, 3), None),
    "list": BYTES.astype(int).tolist(),
}  # fmt: skip


def sky(image: Any) -> clpt.Scene:
    return clpt.Scene(
        camera=cameras.Spherical(),
        lights=[lights.Envmap(image=image)],
        film=clpt.Film(size=(8, 4), mode="rgb"),
    )


def floor(material: materials.Material) -> clpt.Scene:
    scene = sky(LINEAR)
    return clpt.Scene(
        camera=scene.camera, lights=scene.lights, film=scene.film,
        shapes=[shapes.Rectangle(material=material)],
    )  # fmt: skip


TAKERS: dict[str, Callable[[Any, Path], object]] = {
    "write_image .png": lambda image, at: clpt.write_image(at / "a.png", image),
    "write_image .exr": lambda image, at: clpt.write_image(at / "a.exr", image),
    "write_image .npy": lambda image, at: clpt.write_image(at / "a.npy", image),
    "envmap": lambda image, _: clpt.Renderer(sky(image)),
    "cube map": lambda image, _: clpt.Renderer(
        clpt.Scene(camera=cameras.Spherical(), lights=[lights.CubeMap(image=[image] * 6)])
    ),
    "bitmap": lambda image, _: clpt.Renderer(
        floor(materials.Diffuse(reflectance=textures.Bitmap(image=image)))
    ),
    "raw bitmap": lambda image, _: clpt.Renderer(
        floor(materials.RoughConductor(alpha_u=textures.Bitmap(image=image, raw=True)))
    ),
    "glow": lambda image, _: clpt.Renderer(
        clpt.Scene(
            camera=cameras.Spherical(),
            shapes=[shapes.Rectangle(emission=lights.Area(radiance=textures.Bitmap(image=image)))],
        )
    ),
}


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("taker", TAKERS)
def test_other_numbers_are_refused(taker: str, kind: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"array of floats, .* or of bytes in sRGB, not of"):
        TAKERS[taker](WRONG[kind], tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".png", ".exr", ".npy", ".pfm"])
def test_bytes_are_srgb(tmp_path: Path, suffix: str) -> None:
    clpt.write_image(tmp_path / f"a{suffix}", BYTES)
    np.testing.assert_allclose(images.read(tmp_path / f"a{suffix}"), LINEAR, atol=5e-4)
    if suffix == ".png":
        assert (np.asarray(Image.open(tmp_path / "a.png")) == BYTES).all()


def test_bytes_with_alpha_are_not_multiplied(tmp_path: Path) -> None:
    """As Pillow has them of a .png: they come back as they were, where anything covers."""
    codes = np.dstack([BYTES, np.full((4, 8), 128, np.uint8)])
    clpt.write_image(tmp_path / "a.png", codes)
    assert (np.asarray(Image.open(tmp_path / "a.png")) == codes).all()
    clpt.write_image(tmp_path / "a.exr", codes, half=False)
    expected = LINEAR * np.float32(128 / 255)
    np.testing.assert_allclose(images.read(tmp_path / "a.exr")[..., :3], expected, atol=1e-6)


def test_bytes_of_a_film_for_screens(tmp_path: Path) -> None:
    with clpt.Renderer(sky(LINEAR)) as renderer:
        renderer.run(2)
        screen = renderer.resolve().get()
        clpt.write_image(tmp_path / "a.png", screen)
        assert (np.asarray(Image.open(tmp_path / "a.png")) == screen).all()


def test_a_sky_of_bytes_is_one_of_floats() -> None:
    shown = []
    for image in (BYTES, LINEAR, LINEAR.astype(np.float64), LINEAR.tolist()):
        with clpt.Renderer(sky(image)) as renderer:
            renderer.run(1)
            shown.append(renderer.image())
    for one in shown[1:]:
        np.testing.assert_allclose(one, shown[0], rtol=1e-5)


def test_files_of_arrays(tmp_path: Path) -> None:
    """Bytes are sRGB there too; other whole numbers stay, with a warning where they are colours."""
    np.save(tmp_path / "a.npy", BYTES)
    np.testing.assert_allclose(clpt.read_image(tmp_path / "a.npy"), LINEAR)
    np.testing.assert_allclose(clpt.read_image(tmp_path / "a.npy", linear=False), BYTES / 255.0)
    np.save(tmp_path / "a.npy", WRONG["uint16"])
    stored = images.read_stored(tmp_path / "a.npy")
    assert not stored.notes_of(raw=True) and "uint16" in stored.notes_of(raw=False)[0]
    assert (clpt.read_image(tmp_path / "a.npy", linear=False) == WRONG["uint16"]).all()


DIVIDED = {
    ".png": True, ".webp": True, ".jpg": False, ".exr": False, ".npy": False, ".hdr": False,
    ".pfm": False,
}  # fmt: skip


@pytest.mark.parametrize("suffix", DIVIDED)
def test_colours_by_the_format(tmp_path: Path, suffix: str) -> None:
    """What has alpha and is no light is divided by it; what has no alpha is black there."""
    clpt.write_image(tmp_path / f"a{suffix}", COVERED)
    found = images.read(tmp_path / f"a{suffix}")
    expected = LINEAR if DIVIDED[suffix] else COVERED[..., :3]
    lossy = suffix in (".jpg", ".webp")
    np.testing.assert_allclose(found[..., :3], expected, atol=0.05 if lossy else 6e-3)
    assert found.shape[2] == (4 if suffix in (".png", ".webp", ".exr", ".npy") else 3)


def test_where_nothing_covers(tmp_path: Path) -> None:
    """Light without cover, such as a glow, stays; so do colours of alpha 0 that are 0."""
    pixels = np.zeros((1, 2, 4), np.float32)
    pixels[0, 1, :3] = 0.5
    clpt.write_image(tmp_path / "a.png", pixels)
    assert np.asarray(Image.open(tmp_path / "a.png"))[0].tolist() == [[0] * 4, [188] * 3 + [0]]


LEAF = materials.Mask(opacity=0.25, material=materials.Diffuse(reflectance=0.5))


@pytest.mark.parametrize(
    "film", [{"mode": "rgb"}, {"bands": 4}, {"layers": ("depth",), "mode": "rgb"}]
)
@pytest.mark.parametrize("suffix", DIVIDED)
def test_a_transparent_film(tmp_path: Path, suffix: str, film: dict[str, Any]) -> None:
    """`Renderer.save` and `write_image` write the same: a leaf over a quarter shows its grey."""
    scene = clpt.Scene(
        camera=cameras.Perspective(origin=(0, 0, 2), target=(0, 0, 0)),
        shapes=[shapes.Rectangle(to_world=clpt.transforms.scale(9), material=LEAF)],
        lights=[lights.Constant(radiance=1.0)],
        film=clpt.Film(size=(16, 16), alpha=True, **film),
        integrator=clpt.scene.integrators.Path(light_paths=0),
    )
    with clpt.Renderer(scene) as renderer:
        renderer.run(64)
        renderer.save(tmp_path / f"a{suffix}")
        clpt.write_image(tmp_path / f"b{suffix}", renderer.picture())
        saved = clpt.read_image(tmp_path / f"a{suffix}")
    by_hand = clpt.read_image(tmp_path / f"b{suffix}")
    if "bands" not in film or suffix not in (".exr", ".npy"):  # which keep the bands
        np.testing.assert_allclose(saved[..., :3], by_hand[..., :3], atol=1e-3)
    grey = saved[..., :3].mean()
    assert grey == pytest.approx(0.5 if DIVIDED[suffix] else 0.125, rel=0.1)
