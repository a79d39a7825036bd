"""`clpt convert`: pictures, layers and films in other formats."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
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
        (["a.exr"], "give TARGET once"),
    ],
)
def test_what_cannot_be_is_told(capsys, words, told):
    images.write("a.exr", COLOURS)
    assert run(["convert", *words]) == 2
    assert told in capsys.readouterr().err


OLD_SCENES = {
    "old.xml": """<scene version="0.6.0">
        <sensor type="perspective"><float name="fov" value="40"/>
            <film type="ldrfilm"><integer name="width" value="8"/>
                <integer name="height" value="6"/></film></sensor>
        <shape type="sphere"><bsdf type="coating"><bsdf type="diffuse"/></bsdf></shape>
        <emitter type="point"><spectrum name="intensity" value="2"/></emitter>
    </scene>""",
    "old.pbrt": """Film "image" "integer xresolution" 8 "integer yresolution" 6
        Camera "perspective" "float fov" 40
        WorldBegin LightSource "point" "rgb I" [2 2 2]
        Material "plastic" "rgb Kd" [.5 .5 .5] Shape "sphere" WorldEnd""",
}  # fmt: skip


@pytest.mark.parametrize("name", OLD_SCENES)
@pytest.mark.parametrize("target", [["-o", "new/scene.json"], ["new"]])
def test_scenes_of_old_formats_become_json(here, name, target, capsys):
    """The new scene has the content of the old scene, without its format."""
    Path(name).write_text(OLD_SCENES[name])
    assert run(["convert", name, *target]) == 0
    assert capsys.readouterr().err.splitlines()[-1] == str(Path("new/scene.json"))
    old, new = clpt.load(name), clpt.load("new/scene.json")
    assert (new.film.width, new.film.height) == (8, 6)
    for category in ("camera", "film", "integrator"):
        assert type(getattr(new, category)) is type(getattr(old, category))
    assert [vars(light) for light in new.lights] == [vars(light) for light in old.lights]
    (before,), (after,) = old.shapes, new.shapes
    assert type(after) is type(before) and after.material.kind == before.material.kind
    Path("again").mkdir()
    clpt.save(new, "again/scene.json")
    assert Path("again/scene.json").read_text() == Path("new/scene.json").read_text()


def test_scenes_that_cannot_be_converted(capsys):
    """All blockers are listed; a picture is no target; the target is named once."""
    Path("a.xml").write_text(
        '<scene version="0.6.0"><shape type="sphere"><bsdf type="tree"/></shape>\n'
        '<shape type="sphere"><bsdf type="bush"/></shape></scene>'
    )
    assert run(["convert", "a.xml", "b.json"]) == 2
    told = capsys.readouterr().err
    assert "'tree'" in told and "'bush'" in told and not Path("b.json").exists()
    assert run(["convert", "a.xml", "b.json", "--missing-textures", "grey"]) == 0
    assert clpt.load("b.json").shapes[0].material.kind in ("twosided", "diffuse")
    assert run(["convert", "b.json", "c.png"]) == 2
    assert "a scene is saved as .json" in capsys.readouterr().err
    assert run(["convert", "b.json"]) == 2 and run(["convert", "b.json", "c", "-o", "d"]) == 2
