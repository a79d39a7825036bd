"""Scenes that travel: the same scene at the other end, and nothing but it."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt.cluster.bundle import SCENE, Store, canonical, from_json, pack, to_json
from clpt.errors import ClusterError, SceneError
from clpt.scene import materials, textures

ROOT = Path(__file__).resolve().parents[2]
SCENES = ("bulb", "cornell_box", "pool", "poppy_field", "three_spheres")


def sent(scene, tmp_path):
    """The bundle of a scene, and a store that has its files."""
    (tmp_path / "packed").mkdir()
    bundle = pack(scene, tmp_path / "packed")
    store = Store(tmp_path / "cache" / "bundles")
    for name, digest in bundle.items():
        store.add(digest, (tmp_path / "packed" / name).read_bytes())
    return from_json(json.loads(canonical(to_json(bundle)))), store


def same(a, b):
    """Whether two things that scenes hold are equal, arrays to the bit."""
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.dtype == b.dtype and np.array_equal(a, b)
    if dataclasses.is_dataclass(a):
        names = [field.name for field in dataclasses.fields(a)]
        return type(a) is type(b) and all(same(getattr(a, n), getattr(b, n)) for n in names)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, (list, tuple)):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, Path) and isinstance(b, Path):  # of an image
        return a.read_bytes() == b.read_bytes()
    return a == b


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_arrives_as_it_was(name, tmp_path):
    scene = clpt.load(ROOT / "scenes" / name)
    bundle, store = sent(scene, tmp_path)
    with store.opened(bundle) as arrived:
        for field in ("camera", "film", "integrator", "sampler", "lights", "seed"):
            assert same(getattr(arrived, field), getattr(scene, field)), field
        assert len(arrived.shapes) == len(scene.shapes)
        for own, other in zip(scene.shapes, arrived.shapes, strict=True):
            assert same(own.material, other.material)
            assert np.allclose(own.to_world, other.to_world, rtol=0, atol=0)
    assert not list(store.folder.glob("opened-*"))


def test_images_are_copied(tmp_path):
    picture = tmp_path / "elsewhere" / "wood.png"
    picture.parent.mkdir()
    clpt.write_image(picture, np.full((2, 2, 3), 0.5, np.float32))
    scene = clpt.load(ROOT / "scenes/cornell_box")
    wood = materials.Diffuse(reflectance=textures.Bitmap(image=picture))
    scene.shapes[0] = dataclasses.replace(scene.shapes[0], material=wood)
    bundle, store = sent(scene, tmp_path)
    assert len([name for name in bundle if name.endswith(".png")]) == 1
    with store.opened(bundle) as arrived:
        found = arrived.shapes[0].material.reflectance.image
        assert found.parent != picture.parent
        assert found.read_bytes() == picture.read_bytes()


def test_a_file_that_is_there_is_not_asked_for_again(tmp_path):
    bundle, store = sent(clpt.load(ROOT / "scenes/three_spheres"), tmp_path)
    assert store.lacks(bundle) == []
    victim = store.folder / bundle[SCENE]
    victim.write_bytes(victim.read_bytes()[:-1])  # damaged on the disk
    assert store.lacks(bundle) == [bundle[SCENE]]
    with pytest.raises(ClusterError, match=r"scene\.json of the bundle is missing"):
        store.opened(bundle).__enter__()


def test_a_wrong_digest_is_refused(tmp_path):
    store = Store(tmp_path / "cache" / "bundles")
    with pytest.raises(ClusterError, match="damaged"):
        store.add(hashlib.sha256(b"right").hexdigest(), b"wrong")
    with pytest.raises(ClusterError, match="no digest"):
        store.add("../../etc/passwd", b"")
    assert not store.folder.exists()


@pytest.mark.parametrize("name", ["../x.ply", "/etc/passwd", "a/b.ply", ".hidden", "", "a\x00b"])
def test_a_path_that_leaves_the_folder_is_refused(name):
    files = {SCENE: "0" * 64, name: "1" * 64}
    with pytest.raises(ClusterError, match="outside of its folder"):
        from_json({"format": "clpt bundle", "version": 1, "files": files})


@pytest.mark.parametrize("named", ["../secret.ply", "/etc/secret.ply"])
def test_a_scene_cannot_name_files_elsewhere(named, tmp_path):
    """A link would be one way; a name in scene.json is another."""
    text = json.dumps({
        "camera": {"type": "perspective"},
        "shapes": [{"type": "mesh", "file": named}],
    })  # fmt: skip
    digest = hashlib.sha256(text.encode()).hexdigest()
    store = Store(tmp_path / "cache" / "bundles")
    store.add(digest, text.encode())
    with pytest.raises(SceneError, match="not in the folder of this file"):
        store.opened({SCENE: digest}).__enter__()


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"format": "clpt bundle", "version": 2, "files": {}}, "version 2"),
        ({"format": "other"}, "no bundle"),
        ([], "no bundle"),
        ({"format": "clpt bundle", "version": 1, "files": {}}, r"no scene\.json"),
        ({"format": "clpt bundle", "version": 1, "files": {SCENE: "abc"}}, "no digest"),
        ({"format": "clpt bundle", "version": 1, "files": {SCENE: None}}, "no digest"),
    ],
)
def test_what_is_no_bundle_is_refused(document, message):
    with pytest.raises(ClusterError, match=message):
        from_json(document)


def test_the_cache_is_bounded(tmp_path):
    store = Store(tmp_path / "cache" / "bundles", limit=2500)
    for i in range(5):
        content = bytes([i]) * 1000
        store.add(hashlib.sha256(content).hexdigest(), content)
    assert sum(path.stat().st_size for path in store.folder.iterdir()) <= 2500


class Mine(materials.Material):
    """A material of a user's own."""

    kind = "mine"


def test_materials_that_are_not_clpts_stay_here(tmp_path):
    scene = clpt.load(ROOT / "scenes/cornell_box")
    scene.shapes[0] = dataclasses.replace(scene.shapes[0], material=Mine())
    with pytest.raises(SceneError, match="not clpt's own"):
        pack(scene, tmp_path)
