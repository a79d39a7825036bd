"""What each format reads from where: regular files alone, and those that it may name."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import images
from clpt.errors import SceneError
from clpt.files import input_files
from clpt.images import exr_files
from clpt.render.film import film_file

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no pipes, and links need rights")
SCENE = {"camera": {"type": "perspective"}, "film": {"width": 8, "height": 8}}
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
PLY = (
    "ply\nformat ascii 1.0\ncomment TextureFile {}\nelement vertex 3\nproperty float x\n"
    "property float y\nproperty float z\nproperty float u\nproperty float v\nelement face 1\n"
    "property list uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n"
)
GLTF = {
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 0}, "material": 0}]}],
    "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    "textures": [{"source": 0}], "buffers": [{"byteLength": 36, "uri": "data:;base64," + "A" * 48}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
}  # fmt: skip


def of_json(folder: Path, name: str) -> Path:
    texture = {"type": "bitmap", "image": name}
    shape = {"type": "rectangle", "material": {"type": "diffuse", "reflectance": texture}}
    return write(folder / "a.json", json.dumps({**SCENE, "shapes": [shape]}))


def of_json_shape(folder: Path, name: str) -> Path:
    shape = {"type": "mesh", "file": name}
    return write(folder / "a.json", json.dumps({**SCENE, "shapes": [shape]}))


def of_xml(folder: Path, name: str) -> Path:
    texture = f'<texture type="bitmap" name="reflectance"><string name="filename" value="{name}"/>'
    shape = f'<shape type="rectangle"><bsdf type="diffuse">{texture}</texture></bsdf></shape>'
    return write(folder / "a.xml", f'<scene version="3.0.0">{shape}</scene>')


def of_xml_include(folder: Path, name: str) -> Path:
    return write(folder / "a.xml", f'<scene version="3.0.0"><include filename="{name}"/></scene>')


def of_pbrt(folder: Path, name: str) -> Path:
    texture = f'Texture "t" "spectrum" "imagemap" "string filename" "{name}"\n'
    material = 'Material "diffuse" "texture reflectance" "t"\nShape "sphere"\n'
    return write(folder / "a.pbrt", f"WorldBegin\n{texture}{material}")


def of_pbrt_include(folder: Path, name: str) -> Path:
    return write(folder / "a.pbrt", f'WorldBegin\nInclude "{name}"\n')


def of_obj(folder: Path, name: str) -> Path:
    write(folder / "a.mtl", f"newmtl m\nmap_Kd {name}\n")
    return write(folder / "a.obj", f"mtllib a.mtl\nusemtl m\n{TRIANGLE}")


def of_ply(folder: Path, name: str) -> Path:
    return write(folder / "a.ply", PLY.format(name))


def of_gltf(folder: Path, name: str) -> Path:
    scene = json.loads(json.dumps(GLTF))
    scene["accessors"].append({**scene["accessors"][0], "type": "VEC2"})
    scene["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 1
    return write(folder / "a.gltf", json.dumps({**scene, "images": [{"uri": name}]}))


def write(path: Path, content: str) -> Path:
    path.write_text(content)
    return path


NAMING = {  # by format: what names an image in its file
    "json": of_json, "mitsuba": of_xml, "pbrt": of_pbrt, "obj": of_obj, "ply": of_ply,
    "gltf": of_gltf,
}  # fmt: skip
ANY_FILE = {"a shape": of_json_shape, "xml": of_xml_include, "pbrt": of_pbrt_include}
REACH = {name: input_files.REACH.get(name, input_files.ANYWHERE) for name in NAMING}
BELOW = [name for name in NAMING if REACH[name] == input_files.BELOW]


@pytest.fixture
def folder(tmp_path) -> Path:
    """A folder with an image, beside another one with a secret."""
    for name in ("scene", "secret"):
        (tmp_path / name / "inner").mkdir(parents=True)
        images.write(tmp_path / name / "wood.png", np.ones((2, 2, 3)))
        images.write(tmp_path / name / "inner" / "wood.png", np.ones((2, 2, 3)))
    return tmp_path / "scene"


@contextlib.contextmanager
def within(seconds: int) -> Iterator[None]:
    """End a test that waits for ever."""

    def end(*_: object) -> None:
        pytest.fail("it waits for ever")

    former = signal.signal(signal.SIGALRM, end)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, former)


def shows_image(scene: clpt.Scene) -> bool:
    """Whether a scene has the image that its file names, and no warning of it."""
    return not any("wood" in warning for warning in scene.warnings)


@pytest.mark.parametrize("form", NAMING)
@pytest.mark.parametrize("name", ["wood.png", "inner/wood.png", "link.png"])
def test_what_lies_below_is_read_by_all(folder, form, name):
    (folder / "link.png").symlink_to("inner/wood.png")
    assert shows_image(clpt.load(NAMING[form](folder, name)))


OUTSIDE = {
    "up": lambda folder: "../secret/wood.png",
    "absolute": lambda folder: str(folder.parent / "secret" / "wood.png"),
    "a link": lambda folder: "linked.png",
    "a link to a folder": lambda folder: "linked/wood.png",
}


@pytest.mark.parametrize("form", NAMING)
@pytest.mark.parametrize("way", OUTSIDE)
def test_what_lies_elsewhere_is_read_by_those_that_may(folder, form, way):
    (folder / "linked.png").symlink_to("../secret/wood.png")
    (folder / "linked").symlink_to("../secret")
    path = NAMING[form](folder, OUTSIDE[way](folder))
    if form in BELOW:
        with pytest.raises(SceneError, match=r"so it is not read") as raised:
            clpt.load(path)
        assert str(raised.value).startswith(f"{path}: images[0].uri: ")
    else:
        assert shows_image(clpt.load(path))


def test_gltf_alone_keeps_to_its_folder():
    """docs/limits.md has this table."""
    assert BELOW == ["gltf"]


@pytest.mark.parametrize("form", NAMING)
@pytest.mark.parametrize("scheme", ["http", "file"])
def test_no_address_is_followed(folder, form, scheme):
    where = f"{scheme}://localhost{folder}/wood.png"
    try:
        scene = clpt.load(NAMING[form](folder, where))
    except SceneError as error:
        assert "there is no" in str(error) or form in BELOW
    else:  # a mesh is shown without its image, or with the one of that name in its own folder
        assert form in ("obj", "ply")
        assert scene.shapes


@pytest.mark.parametrize("form", [*NAMING, *ANY_FILE])
@pytest.mark.parametrize("kind", ["pipe", "device", "link to a device"])
def test_pipes_and_devices_are_refused(folder, form, kind):
    suffix = {"a shape": "ply", "xml": "xml", "pbrt": "pbrt"} if form in ANY_FILE else {}
    name = f"odd.{suffix.get(form, 'png')}"
    if kind == "pipe":
        os.mkfifo(folder / name)
    else:
        (folder / name).symlink_to("/dev/zero")
    make = ANY_FILE[form] if form in ANY_FILE else NAMING[form]
    with within(20):
        try:
            scene = clpt.load(make(folder, name))
        except SceneError as error:
            assert "there is no file" in str(error)
        else:  # an image of a mesh is left out
            assert form in ("obj", "ply") and any(name in one for one in scene.warnings)


@pytest.mark.parametrize("suffix", [".json", ".xml", ".pbrt", ".gltf", ".obj", ".ply", ".vdb"])
def test_a_pipe_is_no_scene(tmp_path, suffix):
    os.mkfifo(tmp_path / f"a{suffix}")
    with within(20), pytest.raises(SceneError, match="there is no such file"):
        clpt.load(tmp_path / f"a{suffix}")


def test_what_is_no_file_is_told(tmp_path):
    os.mkfifo(tmp_path / "a.png")
    (tmp_path / "zero.png").symlink_to("/dev/zero")
    (tmp_path / "b.png").mkdir()
    for name, said in (("a.png", "a pipe"), ("zero.png", "a device"), ("b.png", "a folder")):
        for read in (images.read, input_files.read_bytes, input_files.checked):
            with within(20), pytest.raises(SceneError, match=f"is {said}, not a file"):
                read(tmp_path / name)


def test_files_of_the_system_without_an_end_end():
    """They tell a size of 0."""
    path = Path("/proc/self/pagemap")
    if not path.exists():
        pytest.skip("no such file here")
    assert input_files.read_bytes(path) == b""


POINTER = (
    "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a214614ab2935c943f9e0ff69d"
    "22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 12345\n"
)


@pytest.mark.parametrize("suffix", [
    ".json", ".xml", ".pbrt", ".gltf", ".glb", ".obj", ".ply", ".stl", ".off", ".vol", ".vdb",
    ".nvdb",
])  # fmt: skip
def test_a_pointer_of_git_lfs_says_so(tmp_path, suffix):
    path = write(tmp_path / f"a{suffix}", POINTER)
    with pytest.raises(SceneError, match=r"is a Git LFS pointer .* `git lfs pull`"):
        clpt.load(path)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".exr", ".hdr", ".pfm", ".npy"])
def test_a_pointer_of_git_lfs_in_place_of_an_image(tmp_path, suffix):
    with pytest.raises(SceneError, match=r"is a Git LFS pointer"):
        images.read(write(tmp_path / f"a{suffix}", POINTER))


def test_a_pointer_of_git_lfs_in_a_scene(tmp_path):
    write(tmp_path / "a.serialized", POINTER)
    shape = '<shape type="serialized"><string name="filename" value="a.serialized"/></shape>'
    with pytest.raises(SceneError, match=r"is a Git LFS pointer"):
        clpt.load(write(tmp_path / "a.xml", f'<scene version="3.0.0">{shape}</scene>'))


READ_ELSEWHERE = {  # by what is read outside of a load
    "film": film_file.read,
    "header of a film": film_file.read_header,
    "headers of .exr": exr_files.headers,
    "channels of .exr": exr_files.read_channels,
}


@pytest.mark.parametrize("what", READ_ELSEWHERE)
def test_films_and_checkpoints_are_files(tmp_path, what):
    os.mkfifo(tmp_path / "a.resume.exr")
    (tmp_path / "b.resume.exr").symlink_to("/dev/zero")
    (tmp_path / "c.resume.exr").mkdir()
    for name, said in (("a", "a pipe"), ("b", "a device"), ("c", "a folder")):
        with within(20), pytest.raises(SceneError, match=f"is {said}, not a file"):
            READ_ELSEWHERE[what](tmp_path / f"{name}.resume.exr")
