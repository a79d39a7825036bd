"""Views of OpenColorIO: written files have its own codes, devices a table that is near them."""

import numpy as np
import pytest

import clpt
from clpt import device, images
from clpt.choices import OCIO_CONFIG
from clpt.device import DeviceArray
from clpt.errors import DeviceError, SceneError, UnknownKindError
from clpt.images import colour as views
from clpt.images.colour import View
from clpt.render.film.resolve import Resolve, Screen

ocio = pytest.importorskip("PyOpenColorIO", reason="OpenColorIO is not installed")

RNG = np.random.default_rng(3)
SHAPE = (128, 96)
# of Rec. 709, dark to seven times the white, any saturation
COLOURS = (2.0 ** RNG.uniform(-9, 5, (*SHAPE, 1)) * RNG.dirichlet([1, 1, 1], SHAPE) * 3).astype(
    np.float32
)
PLAIN = "Un-tone-mapped"


@pytest.fixture(scope="module")
def aces():
    return View()


def own_codes(view, colours):
    """The codes by OpenColorIO's config alone, from its own linear Rec. 709."""
    config = ocio.Config.CreateFromFile(view.config)
    shown = ocio.DisplayViewTransform(src=views.REC709, display=view.display, view=view.name)
    pixels = np.ascontiguousarray(colours, np.float32).copy()
    config.getProcessor(shown).getDefaultCPUProcessor().applyRGB(pixels.reshape(-1))
    return np.clip(pixels, 0, 1)


def test_the_default_is_the_configs_own(aces):
    assert aces.display == "sRGB - Display" and aces.name.startswith("ACES ")
    assert aces.name in views.views()[aces.display]
    assert "ACES " in repr(aces)


@pytest.mark.parametrize("name", [None, PLAIN])
def test_codes_are_those_of_opencolorio(name):
    view = View(name)
    np.testing.assert_allclose(view.codes(COLOURS), own_codes(view, COLOURS), atol=2e-4)


def test_without_a_tone_curve_a_view_is_srgb():
    inside = np.clip(COLOURS, 0, 1)
    made = images.to_codes(inside, view=View(PLAIN)).astype(int)
    assert np.abs(made - images.to_srgb8(inside)).max() <= 1


@pytest.fixture(scope="module")
def on_device():
    opened = device.choose()
    film = DeviceArray(opened.queue, (*SHAPE, 4), np.float32)
    film.set(np.concatenate([COLOURS, np.ones((*SHAPE, 1), np.float32)], axis=2))
    resolve = Resolve(opened, device.Stream(opened.queue))
    return lambda dtype=None, **how: resolve(film, screen=Screen(**how), dtype=dtype).get()[..., :3]


@pytest.mark.parametrize(("name", "share"), [(None, 0.98), (PLAIN, 1.0)])
def test_the_table_of_a_device_is_within_a_512th(on_device, name, share):
    """For ACES 2.0, whose gamut has creases, 98 of 100 random colours; a plain view all."""
    view = View(name)
    made = on_device(dtype=np.float32, view=view, exposure=0.5)
    error = np.abs(made - view.codes(COLOURS * np.float32(2.0**0.5))).max(axis=2)
    assert (error < 1 / 512).mean() >= share
    assert error.mean() < 0.25 / 512
    codes = on_device(view=view, exposure=0.5).astype(int)
    written = images.to_codes(COLOURS, 0.5, view=view).astype(int)
    assert (np.abs(codes - written).max(axis=2) <= 1).mean() >= share


def test_a_curve_follows_a_view_again(on_device, aces):
    plain = on_device()
    assert (on_device(view=aces) != plain).any()
    np.testing.assert_array_equal(on_device(), plain)
    with pytest.raises(DeviceError, match="a view has its own tone curve"):
        on_device(view=aces, tone="agx")


def test_a_config_in_a_file(tmp_path, aces):
    """A config of one's own, with a look."""
    path = tmp_path / "config.ocio"
    config = ocio.Config.CreateFromFile(OCIO_CONFIG)
    darker = ocio.CDLTransform(slope=[0.5] * 3)
    config.addLook(ocio.Look(name="half", processSpace="ACEScg", transform=darker))
    path.write_text(config.serialize())
    dark = View(PLAIN, config=str(path), look="half").codes(COLOURS)
    np.testing.assert_allclose(dark, View(PLAIN).codes(COLOURS * 0.5), atol=1e-4)


def test_what_is_wrong_is_told(tmp_path, monkeypatch):
    with pytest.raises(UnknownKindError, match=r"view of 'sRGB - Display' 'ACES'.*ACES [12].0"):
        View("ACES")
    with pytest.raises(UnknownKindError, match=r"display 'sRGB'.*sRGB - Display"):
        View(display="sRGB")
    with pytest.raises(UnknownKindError, match="look 'warm'"):
        View(look="warm")
    bad = tmp_path / "bad.ocio"
    bad.write_text("no config")
    with pytest.raises(SceneError, match=r"bad.ocio: OpenColorIO cannot read it"):
        View(config=str(bad))
    with pytest.raises(SceneError, match="cannot read it"):
        View(config=str(tmp_path / "none.ocio"))
    monkeypatch.delenv("OCIO", raising=False)
    with pytest.raises(SceneError, match="the environment has no OCIO"):
        View(config="$OCIO")


def test_a_png_by_a_view(tmp_path, aces):
    path = tmp_path / "a.png"
    clpt.write_image(path, COLOURS, view=aces)
    stored = clpt.read_image(path, linear=False)
    np.testing.assert_allclose(stored, aces.codes(COLOURS), atol=0.5 / 255 + 1e-6)
