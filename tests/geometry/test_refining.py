"""Subdivided and displaced meshes against formulas."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.formats import load
from clpt.geometry import refining, triangles
from clpt.scene import subdivision
from clpt.scene.shapes import Mesh
from clpt.scene.textures import Bitmap

CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
CUBE = np.array(
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
     (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)], np.uint32,
)  # fmt: skip
SQUARE = {
    "vertices": np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)], np.float32),
    "faces": np.array([(0, 1, 2), (0, 2, 3)], np.uint32),
    "uvs": np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32),
}
RAMP = np.float32([[1.0, 3.0], [1.0, 3.0]])  # rises with u


def edges_used(faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How often each edge between two places is used."""
    _, own = np.unique(points, axis=0, return_inverse=True)
    faces = own.reshape(-1)[faces]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return np.unique(edges, axis=0, return_counts=True)[1]


def test_subdivision_is_loops_limit_also_across_seams():
    """A cube whose sides have vertices of their own is the same surface, and has no gap."""
    whole = Mesh(vertices=CORNERS, faces=CUBE, subdivision=3)
    apart = Mesh(
        vertices=CORNERS[CUBE.reshape(-1)],
        faces=np.arange(36, dtype=np.uint32).reshape(-1, 3),
        uvs=np.tile(np.float32([(0, 0), (1, 0), (0, 1)]), (12, 1)),
        subdivision=3,
    )
    limit, finer, normals = subdivision.loop(CORNERS.astype(float), CUBE.astype(int), 3)
    vertices, faces, own, uvs = triangles.triangulate(whole)
    np.testing.assert_allclose(vertices[faces], limit[finer], atol=1e-6)
    np.testing.assert_allclose(own[faces], normals[finer], atol=1e-6)
    split, split_faces, _, uvs = triangles.triangulate(apart)
    np.testing.assert_allclose(split[split_faces], vertices[faces], atol=1e-6)
    assert (edges_used(split_faces, split) == 2).all()
    at = uvs[split_faces].reshape(12, -1, 2)  # linear on each side: the same mean on all of them
    np.testing.assert_allclose(at.mean(axis=1), 1 / 3, atol=1e-6)


def test_displacement_follows_its_image():
    """Vertices rise by the bilinear image along the normal; edges are short in the world."""
    ramp = Bitmap(image=RAMP, raw=True, wrap="clamp")
    more = {"displacement": ramp, "displacement_scale": 0.5, "displacement_edge": 0.3}
    scaled = np.diag([2.0, 2.0, 1.0, 1.0])
    vertices, faces, normals, uvs = triangles.triangulate(Mesh(**SQUARE, **more, to_world=scaled))
    np.testing.assert_allclose(vertices[:, :2], 4.0 * uvs, atol=1e-6)
    height = 0.5 * np.interp(uvs[:, 0] * 2 - 0.5, [0, 1], [1, 3])
    np.testing.assert_allclose(vertices[:, 2], height, atol=1e-6)
    flat = vertices[faces][..., :2]
    assert np.linalg.norm(flat - np.roll(flat, 1, axis=1), axis=2).max() <= 0.3
    middle = np.abs(uvs[:, 0] - 0.5) < 0.15
    np.testing.assert_allclose(
        normals[middle], np.tile([-0.4472, 0, 0.8944], (middle.sum(), 1)), atol=0.01
    )


def test_images_are_read_as_on_the_device():
    image = np.arange(6, dtype=np.float32).reshape(2, 3)
    at = np.array([(1 / 6, 0.25), (0.5, 0.75), (5 / 6, 0.5), (-0.5, 0.25), (1.5, 0.25)])

    def found(**more):
        return refining.heights(Bitmap(image=image, raw=True, **more), at)

    np.testing.assert_allclose(found(wrap="repeat"), [3, 1, 3.5, 4, 4])
    np.testing.assert_allclose(found(wrap="clamp"), [3, 1, 3.5, 3, 5])
    np.testing.assert_allclose(found(wrap="zero"), [3, 1, 3.5, 0, 0])
    np.testing.assert_allclose(found(wrap="mirror"), [3, 1, 3.5, 4, 4])
    np.testing.assert_allclose(found(filter="nearest")[:2], [3, 1])


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"subdivision": 11}, "0 to 10"),
        ({"subdivision": 1, "attributes": {"vertex_a": np.ones((4, 1))}}, "no attributes"),
        ({"displacement": Bitmap(image=RAMP), "uvs": None}, "needs uvs"),
        ({"displacement": Bitmap(image=RAMP), "displacement_edge": 0.0}, "above 0"),
        (
            {"displacement": Bitmap(image=RAMP), "displacement_edge": 1e-5},
            "raise displacement_edge",
        ),
        ({"subdivision": 1, "faces": np.array([(0, 1, 2), (0, 1, 3), (1, 0, 2)])}, "more than two"),
    ],
)
def test_refused(more, message):
    mesh = Mesh(**{**SQUARE, **more})
    with pytest.raises(SceneError, match=message):
        refining.check(mesh)
        triangles.triangulate(mesh)


def test_of_pbrt(tmp_path):
    from PIL import Image

    Image.fromarray(np.full((2, 2), 255, np.uint8)).save(tmp_path / "white.png")
    rows = ["0 0 0 0 0", "2 0 0 1 0", "2 2 0 1 1", "0 2 0 0 1"]
    head = "ply\nformat ascii 1.0\nelement vertex 4\n" + "".join(
        f"property float {name}\n" for name in ("x", "y", "z", "u", "v")
    )
    head += "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    (tmp_path / "a.ply").write_text(head + "\n".join(rows) + "\n4 0 1 2 3\n")
    shape = (
        'Shape "plymesh" "string filename" "a.ply" "texture displacement" "h" "float edgelength" .5'
    )
    for texture, count in (('"imagemap" "string filename" "white.png"', 128), ('"fbm"', 2)):
        text = f'WorldBegin\nTexture "h" "float" {texture}\n{shape}'
        (tmp_path / "a.pbrt").write_text(text)
        scene = load(tmp_path / "a.pbrt")
        vertices, faces, _, _ = triangles.triangulate(scene.shapes[0])
        assert len(faces) == count
        displaced = count > 2
        np.testing.assert_allclose(vertices[:, 2], 1.0 if displaced else 0.0, atol=1e-6)
        assert any("a.pbrt:3" in one and "no image" in one for one in scene.warnings) != displaced
