"""Bad input: one clear line that names the place, or a defined picture; never NaN or a crash."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import __main__ as entry
from clpt import transforms as tf
from clpt.scene import Film, Scene, cameras, integrators, lights, shapes, textures
from clpt.scene import materials as m

NAN, INF = float("nan"), float("inf")
CORNERS = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0)], np.float32)
FACE = np.array([(0, 1, 2)], np.uint32)
FLAT = np.diag([1.0, 1.0, 0.0, 1.0])
VIEW = tf.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])


def scene(*given: object, **changes: object) -> Scene:
    """A small scene of these shapes, under an even sky."""
    made = {
        "camera": cameras.Perspective(to_world=VIEW),
        "shapes": list(given),
        "lights": [lights.Constant()],
        "film": Film(width=6, height=5, mode="rgb"),
    }
    return Scene(**{**made, **changes})


def mesh(**changes: object) -> shapes.Mesh:
    return shapes.Mesh(**{"vertices": CORNERS, "faces": FACE, "name": "bunny", **changes})


def textured(image: object) -> m.Diffuse:
    return m.Diffuse(reflectance=textures.Bitmap(image=image))


def vertex(value: float) -> np.ndarray:
    changed = CORNERS.copy()
    changed[1, 2] = value
    return changed


# name: (what is made and rendered, words of the message)
REFUSED: dict[str, tuple[Callable[[], Scene], str]] = {
    "nan vertex": (lambda: scene(mesh(vertices=vertex(NAN))), r"bunny.*vertices\[1\].*finite"),
    "inf vertex": (lambda: scene(mesh(vertices=vertex(INF))), r"bunny.*vertices\[1\].*finite"),
    "no vertices": (lambda: scene(mesh(vertices=np.zeros((0, 3)))), r"bunny.*empty"),
    "no faces": (lambda: scene(mesh(faces=np.zeros((0, 3), np.uint32))), r"bunny.*empty"),
    "no arrays": (lambda: scene(shapes.Mesh(name="bunny")), r"bunny.*vertices and faces"),
    "vertex that is not there": (lambda: scene(mesh(faces=FACE + 7)), r"bunny.*vertex 9"),
    "nan normals": (lambda: scene(mesh(normals=vertex(NAN))), r"bunny.*normals\[1\]"),
    "wrong count of uvs": (lambda: scene(mesh(uvs=np.zeros((2, 2)))), r"bunny.*uvs"),
    "flattening transform": (lambda: scene(mesh(to_world=FLAT)), r"bunny.*singular"),
    "nan transform": (lambda: scene(mesh(to_world=np.eye(4) * NAN)), r"bunny.*singular"),
    "text for a transform": (lambda: scene(mesh(to_world="up")), r"bunny.*matrix"),
    "radius of zero": (lambda: scene(shapes.Sphere(radius=0.0)), r"sphere.*radius"),
    "nan radius": (lambda: scene(shapes.Sphere(radius=NAN)), r"sphere.*radius"),
    "stretched sphere": (
        lambda: scene(shapes.Sphere(to_world=tf.scale([1, 2, 1]))), r"sphere.*mesh",
    ),
    "no shape": (lambda: scene("teapot"), r"teapot"),
    "no material": (lambda: scene(mesh(material=None)), r"bunny.*material"),
    "no light": (lambda: scene(lights=["sun"]), r"sun"),
    "area light without a shape": (lambda: scene(lights=[lights.Area()]), r"area"),
    "emission that is no light": (lambda: scene(mesh(emission=3.0)), r"bunny.*emission.*Area"),
    "no camera": (lambda: scene(camera=None), r"camera"),
    "flattening camera": (
        lambda: scene(camera=cameras.Perspective(to_world=FLAT)), r"perspective.*to_world",
    ),
    "singular projection": (
        lambda: scene(camera=cameras.Matrix(projection=FLAT)), r"matrix\.projection",
    ),
    "fov of zero": (lambda: scene(camera=cameras.Perspective(fov=0.0)), r"perspective\.fov"),
    "nan emission": (lambda: scene(lights=[lights.Constant(radiance=NAN)]), r"constant\.radiance"),
    "nan in a colour": (
        lambda: scene(lights=[lights.Constant(radiance=(0, NAN, 0))]), r"constant\.radiance",
    ),
    "negative emission": (lambda: scene(lights=[lights.Point(intensity=-1)]), r"point\.intensity"),
    "nan position": (
        lambda: scene(lights=[lights.Point(position=(0, NAN, 0))]), r"point.*position",
    ),
    "no direction": (
        lambda: scene(lights=[lights.Directional(direction=(0, 0, 0))]), r"directional.*direction",
    ),
    "singular spot": (lambda: scene(lights=[lights.Spot(to_world=FLAT)]), r"spot.*to_world"),
    "missing sky": (lambda: scene(lights=[lights.Envmap(image="no.exr")]), r"no\.exr"),
    "sky of nothing": (lambda: scene(lights=[lights.Envmap()]), r"envmap.*image"),
    "nan sky": (
        lambda: scene(lights=[lights.Envmap(image=np.full((4, 8, 3), NAN))]), r"envmap.*finite",
    ),
    "missing texture": (lambda: scene(mesh(material=textured("no.png"))), r"no\.png"),
    "texture that is no image": (
        lambda: scene(mesh(material=textured(__file__))), r"test_bad_input",
    ),
    "albedo above one": (
        lambda: scene(mesh(material=m.Diffuse(reflectance=2.0))), r"diffuse\.refl",
    ),
    "unknown glass": (lambda: scene(mesh(material=m.Dielectric(int_ior="jelly"))), r"jelly"),
    "width of zero": (lambda: scene(film=Film(width=0)), r"film\.width"),
    "height of 100,000": (lambda: scene(film=Film(height=100_000)), r"film\.height"),
    "text for a width": (lambda: scene(film=Film(width="wide")), r"film\.width"),
    "unknown mode": (lambda: scene(film=Film(mode="xyz")), r"film\.mode"),
    "empty range of wavelengths": (
        lambda: scene(film=Film(lambda_min=700.0, lambda_max=400.0)), r"film\.lambda_min",
    ),
    "filter that is none": (lambda: scene(film=Film(filter="box")), r"filter"),
    "spp of zero": (lambda: scene(spp=0), r"spp"),
    "depth of text": (lambda: scene(integrator=integrators.Path(max_depth="deep")), r"max_depth"),
    "no integrator": (lambda: scene(integrator="path"), r"integrator"),
    "no sampler": (lambda: scene(sampler=None), r"sampler"),
    "seed of text": (lambda: scene(seed="dice"), r"seed"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    make, words = REFUSED[name]
    with pytest.raises(clpt.ClptError, match=words) as caught:
        clpt.render(make(), 1)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("spp", [0, -3, 1.5, True, "many", NAN])
def test_samples(spp: object) -> None:
    with pytest.raises(clpt.SceneError, match="samples per pixel"):
        clpt.render(scene(), spp)


def coarse() -> m.Diffuse:
    return m.Diffuse(reflectance=1.0)


INSIDE = cameras.Perspective(to_world=tf.look_at([0, 0, 0], [0, 0, 1], [0, 1, 0]))
SOME_FLAT = mesh(faces=np.array([(0, 1, 2), (0, 1, 1), (2, 2, 2)], np.uint32))
DEFINED: dict[str, Callable[[], Scene]] = {
    "no shapes": lambda: scene(),
    "no lights": lambda: scene(mesh(), lights=[]),
    "nothing at all": lambda: scene(lights=[]),
    "camera inside a ball": lambda: scene(shapes.Sphere(material=coarse()), camera=INSIDE),
    "camera inside glass": lambda: scene(shapes.Sphere(material=m.Dielectric()), camera=INSIDE),
    "camera on a surface": lambda: scene(shapes.Rectangle(material=coarse()), camera=INSIDE),
    "some triangles without area": lambda: scene(SOME_FLAT),
    "a mesh without area": lambda: scene(mesh(), mesh(vertices=np.ones((3, 3)))),
    "dark lights only": lambda: scene(mesh(), lights=[lights.Constant(radiance=0.0)]),
    "lamp on a surface": lambda: scene(mesh(), lights=[lights.Point(position=(0.2, -0.2, 0.0))]),
    "far away": lambda: scene(mesh(to_world=tf.translate([0, 0, -1e6]) @ tf.scale(1e6))),
    "tiny": lambda: scene(mesh(to_world=tf.scale(1e-6))),
    "huge": lambda: scene(mesh(to_world=tf.scale(1e8))),
    "two surfaces in one place": lambda: scene(mesh(), mesh(material=coarse())),
    "zero normals": lambda: scene(mesh(normals=np.zeros((3, 3), np.float32))),
    "normals turned away": lambda: scene(mesh(normals=np.tile([0.0, 0.1, -1.0], (3, 1)))),
    "bright": lambda: scene(mesh(), lights=[lights.Constant(radiance=1e12)]),
    "nan texture": lambda: scene(mesh(material=textured(np.full((2, 2, 3), NAN)))),
    "mirrored": lambda: scene(mesh(to_world=np.diag([-1.0, 1.0, 1.0, 1.0]))),
}


@pytest.mark.parametrize("name", DEFINED)
def test_defined_pictures(name: str) -> None:
    """Odd, but a picture: finite, not negative, and dark where no light is."""
    renderer = clpt.Renderer(DEFINED[name]())
    renderer.run(4)
    image = renderer.image()
    assert image.shape == (5, 6, 3)
    assert np.isfinite(image).all() and image.min() >= 0.0
    if name in ("no lights", "nothing at all", "dark lights only", "camera inside a ball"):
        assert image.max() == 0.0
    elif name != "lamp on a surface":  # whose light grazes it
        assert image.max() > 0.0
    if name in ("some triangles without area", "a mesh without area"):
        assert any("no area" in warning for warning in renderer.warnings)


def written(folder: Path, **changes: object) -> str:
    """A scene.json with these entries beside a sky; its path."""
    path = folder / "scene.json"
    base = {"camera": {"type": "perspective"}, "lights": [{"type": "constant"}]}
    path.write_text(json.dumps({**base, **changes}), encoding="utf-8")
    return str(path)


def broken(folder: Path) -> str:
    path = folder / "broken.json"
    path.write_text('{"camera": ', encoding="utf-8")
    return str(path)


def no_image(folder: Path) -> str:
    (folder / "noise.png").write_bytes(b"this is no image")
    ball = {
        "type": "sphere",
        "material": {"type": "diffuse", "reflectance": {"type": "bitmap", "image": "noise.png"}},
    }
    return written(folder, shapes=[ball])


def no_mesh(folder: Path) -> str:
    (folder / "noise.ply").write_bytes(b"ply\nformat nothing\n")
    return str(folder / "noise.ply")


SMALL = ["--size", "4x4", "--spp", "1", "--quiet"]
# name: (arguments after a folder is given, words of the line)
COMMANDS: dict[str, tuple[Callable[[Path], list[str]], str]] = {
    "missing file": (lambda f: ["render", str(f / "no.json")], r"no\.json"),
    "missing folder": (lambda f: ["render", str(f / "no")], r"no"),
    "folder without a scene": (lambda f: ["render", str(f)], r"scene"),
    "unknown suffix": (lambda f: ["render", __file__], r"\.py"),
    "broken json": (lambda f: ["render", broken(f)], r"broken\.json:1"),
    "mesh that is none": (lambda f: ["render", no_mesh(f)], r"noise\.ply"),
    "texture that is no image": (lambda f: ["render", no_image(f)], r"noise\.png"),
    "unknown kind": (
        lambda f: ["render", written(f, shapes=[{"type": "spere"}])], r"scene\.json.*spere.*sphere",
    ),
    "unused parameter": (
        lambda f: ["render", written(f, shapes=[{"type": "sphere", "raduis": 2}])],
        r"scene\.json.*raduis.*radius",
    ),
    "wrong type": (
        lambda f: ["render", written(f, shapes=[{"type": "sphere", "radius": "big"}])],
        r"scene\.json.*radius",
    ),
    "size of zero": (lambda f: ["render", written(f), "--size", "0x4"], r"0x4"),
    "size of 100,000": (lambda f: ["render", written(f), "--size", "100000x100000"], r"100000"),
    "largest size": (lambda f: ["render", written(f), "--size", "65536x65536"], r"film.*pixels"),
    "no samples": (lambda f: ["render", written(f), "--spp", "0"], r"spp"),
    "unknown device": (lambda f: ["render", written(f), "--device", "abacus"], r"abacus"),
    "unknown integrator": (lambda f: ["render", written(f), "--integrator", "guess"], r"guess"),
    "unknown command": (lambda f: ["rendre"], r"rendre"),
    "unknown option": (lambda f: ["render", written(f), "--sppp", "3"], r"sppp"),
    "unknown suffix of a picture": (
        lambda f: ["render", written(f), "-o", str(f / "a.tiff")], r"\.tiff",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_commands_tell_one_line(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Status 2, one line on stderr, no traceback."""
    monkeypatch.chdir(tmp_path)
    make, words = COMMANDS[name]
    arguments = make(tmp_path)
    status = entry.run([*arguments, "--quiet"] if arguments[0] == "render" else arguments)
    lines = [line for line in capsys.readouterr().err.splitlines() if "warning" not in line]
    assert status == 2, lines
    assert len(lines) == 1 and lines[0].startswith("clpt: error: "), lines
    assert re.search(words, lines[0]), lines[0]


def test_a_command_that_works(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    out = tmp_path / "a.npy"
    assert entry.run(["render", written(tmp_path), *SMALL, "-o", str(out)]) == 0
    assert np.load(out).shape == (4, 4, 3)
