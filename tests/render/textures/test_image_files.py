"""The files of images: each part of a scene that names some, and files that change meanwhile."""

from __future__ import annotations

import gc
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.render.textures.texels import ImageFiles
from clpt.scene import Scene, cameras, lights, materials, media, shapes, textures
from clpt.scene.fingerprint import fingerprint
from clpt.scene.volumes import Volume
from tests.pictures.support import with_film


def scene_of(**parts: Any) -> Scene:
    return Scene(camera=cameras.Perspective(), **parts)


def surface(image: Any) -> Scene:
    bitmap = textures.Bitmap(image=image)
    mixed = textures.Mix(first=bitmap, second=(0.1, 0.2, 0.3))
    return scene_of(shapes=[shapes.Rectangle(material=materials.Diffuse(reflectance=mixed))])


def instanced(image: Any) -> Scene:
    group = shapes.Group(surface(image).shapes)
    return scene_of(shapes=[shapes.Instance(group=group)])


NAMING = {
    "bitmap": surface,
    "within an instance": instanced,
    "envmap": lambda image: scene_of(lights=[lights.Envmap(image=image)]),
    "cube_map": lambda image: scene_of(lights=[lights.CubeMap(image=[image] * 6)]),
    "projector": lambda image: scene_of(
        lights=[lights.Projector(image=textures.Bitmap(image=image))]
    ),
}


@pytest.mark.parametrize("part", NAMING)
def test_a_fingerprint_is_of_the_files_that_were_read(tmp_path: Path, part: str) -> None:
    path = tmp_path / "a.npy"
    clpt.write_image(path, np.ones((4, 4, 3), np.float32))
    scene = with_film(NAMING[part](path), width=4, height=3, mode="rgb")
    first = lower(scene)
    before = fingerprint(scene)
    for spoil in (lambda: clpt.write_image(path, np.zeros((4, 4, 3), np.float32)), path.unlink):
        spoil()
        assert not fingerprint(scene, first.files.digests).differences(before)
    clpt.write_image(path, np.full((4, 4, 3), 0.5, np.float32))
    second = lower(scene, former=first)
    assert fingerprint(scene, second.files.digests).differences(before)


def test_a_file_that_changes_while_it_is_read_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    clpt.write_image(path, np.ones((4, 4, 3), np.float32))
    files = ImageFiles.of([str(path)], ImageFiles())
    files.check()
    os.utime(path, ns=(1, 1))
    with pytest.raises(SceneError, match=r"a\.npy: changed while the scene was read"):
        files.check()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks /proc for maps")
def test_arrays_that_are_maps_of_files_are_copied(tmp_path: Path) -> None:
    def mapped(*shape: int, kind: type = np.float32) -> Any:
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}.npy"
        np.save(path, np.ones(shape, kind))
        return np.load(path, mmap_mode="r")

    eye = np.eye(4)
    held: list[Any] = [
        media.Grid(density=mapped(2, 3, 4), sigma_t=1.0).density,
        media.Grid(density=mapped(2, 3, 4)[:, ::-1].view(np.ndarray), sigma_t=1.0).density,
        Volume(mapped(2, 3, 4), eye).values,
        textures.Bitmap(image=mapped(4, 4, 3)).image,
        lights.CubeMap(image=[mapped(4, 4, 3)] * 6).image[0],
        shapes.Mesh(
            vertices=mapped(3, 3), faces=np.array([[0, 1, 2]]), attributes={"a": mapped(3, 1)}
        ).attributes["a"],
        clpt.SpectralImage(mapped(2, 2, 3), np.array([400.0, 500.0, 600.0])).values,
    ]
    gc.collect()
    assert str(tmp_path) not in Path("/proc/self/maps").read_text()
    for path in tmp_path.iterdir():
        os.truncate(path, 0)  # a map that is read now ends the process
    assert [float(np.sum(one)) for one in held] == [24.0, 24.0, 24.0, 48.0, 48.0, 3.0, 12.0]
