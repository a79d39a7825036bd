"""`--camera`, `--crop`, `--env`: what the scene becomes, and that bad values are told."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import click
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clpt import images, transforms
from clpt.__main__ import run
from clpt.cli.options.applied import changed, composed
from clpt.cli.options.changes import CameraType, CropType, SceneChanges
from clpt.errors import SceneError
from clpt.formats import brought, load
from clpt.scene import Film, Scene, cameras, lights, shapes, studio
from clpt.scene.viewpoint import pose, up_of

CORNELL = str(Path(__file__).resolve().parents[2] / "scenes" / "cornell_box")


def seen_from(scene: Scene, *orbit: float) -> cameras.Camera:
    return composed(scene, SceneChanges(camera=(*orbit, 1.0)[:3])).camera


@pytest.fixture
def sky(tmp_path) -> Path:
    """An image of four quarters of grey, each brighter than the last, from the left."""
    path = tmp_path / "sky.exr"
    quarters = np.repeat([0.1, 0.2, 0.4, 0.8], 8)[None, :, None]
    images.write(path, quarters * np.ones((16, 32, 3)))
    return path


def test_an_orbit_stands_where_it_says(scenes):
    """In front is +z, on the right +x, above +y; the distance is a factor on what frames all."""
    scene = load(scenes / "bowl.obj")
    centre = np.array([0.0, 0.5, 0.0])
    for angles, direction in (
        ((0, 0), (0, 0, 1)), ((90, 0), (1, 0, 0)), ((180, 0), (0, 0, -1)), ((33, 90), (0, 1, 0)),
        ((0, -90), (0, -1, 0)), ((-45, 0), (-math.sqrt(0.5), 0, math.sqrt(0.5))),
    ):  # fmt: skip
        near, far = (pose(seen_from(scene, *angles, distance)) for distance in (1.0, 2.5))
        assert np.allclose((near.origin - centre) / np.linalg.norm(near.origin - centre), direction)
        assert np.allclose(near.forward, -np.array(direction), atol=1e-12)
        assert np.allclose(far.origin - centre, 2.5 * (near.origin - centre))
    above = pose(seen_from(scene, 90.0, 90.0))
    assert np.allclose(above.up, (-1, 0, 0), atol=1e-12)  # the right of the front is below


def test_the_studio_frames_as_an_orbit_does(scenes):
    scene = load(scenes / "bowl.obj")
    x, y, z = studio.FROM
    angles = math.degrees(math.atan2(x, z)), math.degrees(math.atan2(y, math.hypot(x, z)))
    assert np.allclose(seen_from(scene, *angles).to_world, scene.camera.to_world)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_up_is_the_axis_nearest_to_the_camera(axis, sign):
    up = sign * np.eye(3)[axis]
    aside = np.roll(up, 1)
    camera = cameras.Perspective(to_world=transforms.look_at(4 * aside + up, [0, 0, 0], up))
    scene = Scene(camera=camera, shapes=[shapes.Sphere()])
    found = up_of(scene)
    assert np.allclose(found[:3, 1], up) and np.isclose(np.linalg.det(found[:3, :3]), 1.0)
    assert np.allclose(pose(seen_from(scene, 70.0, 10.0)).up @ up, math.cos(math.radians(10.0)))


def test_an_stl_stands_upright(tmp_path):
    text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 2\n"
    (tmp_path / "a.stl").write_text(f"{text}endloop\nendfacet\nendsolid a\n")
    scene = load(tmp_path / "a.stl")
    assert np.allclose(pose(seen_from(scene, 0.0, 0.0)).forward, (0, 1, 0), atol=1e-12)
    assert np.allclose(pose(seen_from(scene, 0.0, 90.0)).forward, (0, 0, -1), atol=1e-12)


def test_an_image_takes_the_place_of_sky_and_studio(scenes, sky):
    studio = load(scenes / "bowl.obj")
    made = composed(studio, SceneChanges(env=sky))
    assert [light.kind for light in made.lights] == ["envmap"]
    assert [shape.kind for shape in made.shapes] == ["mesh"] and len(studio.shapes) == 3
    own = dataclasses.replace(studio, extra={}, lights=[lights.Constant(), lights.Point()])
    made = composed(own, SceneChanges(env=sky, env_rotation=90.0))
    assert [light.kind for light in made.lights] == ["point", "envmap"] and len(made.shapes) == 3
    ahead = np.asarray(made.lights[1].to_world) @ (0, 0, 1, 0)  # the middle of the image
    assert np.allclose(ahead, (1, 0, 0, 0))  # where azimuth 90 is


def test_pictures_of_turned_images_and_of_parts(sky, tmp_path):
    """A camera at an azimuth sees the same sky as one before an image that is turned by it.

    A crop has the bits of the whole, also where a sample serves several pixels.
    """
    scene = tmp_path / "sphere.json"
    scene.write_text(
        '{"camera": {"type": "perspective"}, "shapes": [{"type": "sphere"}],'
        ' "film": {"filter": {"type": "gaussian"}}}'
    )
    pictures = []
    for number, options in enumerate((
        ["--camera", "0,0,3"],
        ["--camera", "90,0,3", "--env-rotation", "90"],
        ["--camera", "0,0,3", "--crop", "25%:75%,2:"],
    )):  # fmt: skip
        path = tmp_path / f"{number}.npy"
        common = ["--size", "8x6", "--spp", "2", "--mode", "rgb", "--quiet", "--env", str(sky)]
        assert run(["render", str(scene), "-o", str(path), *common, *options]) == 0
        pictures.append(np.load(path))
    whole, turned, part = pictures
    assert np.array_equal(part, whole[2:, 2:6])
    assert np.allclose(turned[0], whole[0], atol=1e-3) and whole[0].std() > 0.1


def test_a_crop_replaces_that_of_the_file():
    scene = load(CORNELL)
    film = Film(width=100, height=50, crop=(90, 40, 10, 10))
    scene = dataclasses.replace(scene, film=film)
    crop = CropType()("0:50%,10:20")
    assert changed(scene, SceneChanges.of(crop=crop)).film.crop == (0, 10, 50, 10)
    assert changed(scene, SceneChanges.of(crop=crop, size=(30, 20))).film.crop == (0, 10, 15, 10)


def test_a_camera_by_its_name(tmp_path, capsys):
    sensor = '<sensor type="perspective" id="{}"><film type="hdrfilm"><integer name="width" '
    sensor += 'value="{}"/></film></sensor>'
    scene = tmp_path / "a.xml"
    text = f'<scene version="3.0.0">{sensor.format("left", 11)}{sensor.format("right", 12)}</scene>'
    scene.write_text(text)
    widths = [load(scene, camera=name).film.width for name in ("left", "1", "right", 0)]
    assert widths == [11, 12, 12, 11]
    assert "there are: left, right" in " ".join(load(scene).warnings)
    assert not load(scene, camera="1").warnings
    assert run(["render", str(scene), "--camera", "above"]) == 2
    assert "has no camera 'above'; it has: left, right" in capsys.readouterr().err
    scene.write_text(text.replace('value="11"', 'value="$camera"'))
    assert load(scene, camera="5").film.width == 5  # a variable of the file's own


def test_surroundings_that_clpt_brings_are_found_in_any_folder(tmp_path, monkeypatch):
    scene, sky = load(CORNELL), Path("scenes/poppy_field/sky.exr")
    monkeypatch.chdir(tmp_path)
    assert brought(sky) != sky and brought(Path("none.hdr")) == Path("none.hdr")
    made = composed(scene, SceneChanges(env=sky))
    assert made.lights[-1].kind == "envmap"
    with pytest.raises(SceneError):  # a name that no file system takes
        composed(scene, SceneChanges(env=Path("scenes/poppy_field/" + 300 * "x" + ".hdr")))
    sky.parent.mkdir(parents=True)
    sky.touch()
    assert brought(sky) == sky  # the user's own file comes first


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--camera", "10,100"], "the elevation is -90 to 90 degrees, not 100"),
        (["--camera", "10,20,0"], "the distance is 0.001 to 1e+06, not 0; 1 frames all"),
        (["--camera", "1,2,3,4"], "does not look like 45,20"),
        (["--camera", "front"], "only .xml, glTF and USD have cameras to choose from, no 'front'"),
        (["--camera", "front", "-D", "camera=a"], "-D camera= says it already"),
        (["--crop", "1:2"], "does not look like 100:200,50:150"),
        (["--crop", "1.5:2,0:1"], "pixels are whole numbers"),
        (["--size", "20x10", "--crop", "0:21,0:5"], "0:21 is no part of the picture's 20 pixels"),
        (["--size", "20x10", "--crop", "0:20,5:5"], "5:5 is no part of the picture's 10 pixels"),
        (["--env", "none.hdr"], "none.hdr: no such image file"),
        (["--env", "scene.json"], "unknown image suffix '.json'"),
        (["--env-rotation", "9"], "there is no --env to turn"),
    ],
)
def test_bad_values_are_one_line(capsys, options, told):
    assert run(["render", CORNELL, "--quiet", *options]) == 2
    error = capsys.readouterr().err
    assert told in error and error.count("\n") == 1


@given(st.text(max_size=30) | st.text("0123456789.,:%-+einfa ", max_size=20))
def test_any_text_is_a_value_or_is_refused(text):
    for kind in (CameraType(), CropType()):
        try:
            made = kind(text)
        except click.BadParameter as error:
            assert error.format_message()
            continue
        if isinstance(kind, CameraType):
            azimuth, elevation, _ = made if isinstance(made, tuple) else (0.0, 0.0, 1.0)
            assert math.isfinite(azimuth) and abs(elevation) <= 90.0
        else:
            try:
                first, count = made[0].of(100)
            except click.BadParameter:
                continue
            assert 0 <= first < first + count <= 100


def test_a_camera_that_flattens_space_has_no_up():
    """It matters only to who asks for it."""
    scene = Scene(camera=cameras.Matrix(view=np.zeros((4, 4))), shapes=[shapes.Sphere()])
    assert composed(scene, SceneChanges()) is scene
    with pytest.raises(SceneError, match="its up is not known"):
        seen_from(scene, 0.0, 0.0)


def test_nothing_can_be_framed_of_what_is_endless():
    corners = np.array([[-1.5e308, 0, 0], [1.5e308, 0, 0], [0, 1, 0]])
    far = shapes.Mesh(vertices=corners, faces=np.array([[0, 1, 2]]))
    scene = Scene(camera=cameras.Perspective(), shapes=[far])
    with pytest.raises(SceneError, match="too large to be framed"):
        seen_from(scene, 0.0, 0.0)
