"""Surfaces of signed distances: against the distance itself, and beside Mitsuba's rays."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from clpt.errors import SceneError
from clpt.formats import load
from clpt.geometry import distance_grids, triangles
from clpt.scene.shapes import SdfGrid

RNG = np.random.default_rng(4)


def waves(shape: tuple[int, int, int]) -> np.ndarray:
    """Distances of bumps within the grid, which are positive on all of its border."""
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, n) for n in shape], indexing="ij")
    bumps = 0.1 * np.sin(5 * x) * np.cos(4 * y + 1) * np.sin(6 * z + 2)
    return (np.sqrt(x * x + 1.3 * y * y + z * z) - 0.65 + bumps).astype(np.float32)


@pytest.mark.parametrize(("smooth", "pieces"), [(True, 1), (False, 3)])
def test_closed_and_where_the_distance_is_zero(smooth, pieces):
    values = waves((9, 12, 7))
    shape = SdfGrid(values=values, smooth=smooth, pieces=pieces)
    vertices, faces, normals, uvs = triangles.triangulate(shape)
    assert uvs.shape == (len(vertices), 2) and not uvs.any()  # no texture shows the triangles
    assert (normals is not None) == smooth
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    counts = np.unique(edges, axis=0, return_counts=True)[1]
    assert (counts % 2 == 0).all() and counts.max() == 2  # watertight
    at = vertices.astype(np.float64) * (np.array(values.shape) - 1)
    cells = np.minimum(at.astype(int), np.array(values.shape) - 2)
    distance = distance_grids._distance(values.astype(float), cells, at - cells)
    assert np.abs(distance).max() < 2e-4
    a, b, c = (vertices[faces[:, i]].astype(np.float64) for i in range(3))
    across = np.cross(b - a, c - a)
    inner = (a + b + c) / 3 - 5e-3 * across / np.linalg.norm(across, axis=1, keepdims=True)
    at = inner * (np.array(values.shape) - 1)
    cells = np.clip(at.astype(int), 0, np.array(values.shape) - 2)
    assert (distance_grids._distance(values.astype(float), cells, at - cells) < 0).mean() > 0.95
    if normals is not None:
        assert (np.einsum("ij,ij->i", across, normals[faces[:, 0]]) > 0).mean() > 0.999


def points_where_zero(values: np.ndarray, n: int) -> np.ndarray:
    """Points (m, 3) [cells] of the trilinear surface: it is linear along an axis in a cell."""
    rng, values = np.random.default_rng(7), values.astype(np.float64)
    cells = distance_grids._crossed(values)
    cells = cells[rng.integers(0, len(cells), n)]
    begin, axis = rng.random((n, 3)), rng.integers(0, 3, n)
    begin[np.arange(n), axis] = 0.0
    end = begin + np.eye(3)[axis]
    at_begin, at_end = (distance_grids._distance(values, cells, at) for at in (begin, end))
    crossed = (at_begin < 0.0) != (at_end < 0.0)
    cells, begin, end, at_begin, at_end = (
        each[crossed] for each in (cells, begin, end, at_begin, at_end)
    )
    return cells + begin + (end - begin) * (at_begin / (at_begin - at_end))[:, None]


def from_triangles(p: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Distance (n,) of points (n, 3) from triangles (n, 3) each."""
    normal = np.cross(b - a, c - a)
    above, nearest = np.ones(len(p), bool), np.full(len(p), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        length2 = np.maximum((side * side).sum(1), 1e-300)
        share = np.clip(((p - start) * side).sum(1) / length2, 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(start + side * share[:, None] - p, axis=1))
        above &= (np.cross(side, p - start) * normal).sum(1) >= 0.0
    size = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    return np.where(above, np.abs(((p - a) * normal).sum(1)) / size, nearest)


def ball(p: np.ndarray) -> np.ndarray:
    return np.linalg.norm(p, axis=0) - 0.35


def box(p: np.ndarray) -> np.ndarray:
    beyond = np.abs(p) - np.array([0.31, 0.27, 0.22])[:, None, None, None]
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=0) + np.minimum(beyond.max(axis=0), 0.0)


@pytest.mark.parametrize(
    ("distance", "size", "most", "mean"), [(ball, 17, 0.02, 0.0033), (box, 33, 0.36, 0.012)]
)
def test_how_far_triangles_are_off(distance, size, most, mean):
    """In cells, times the square of `pieces`: from points of the surface, in float64."""
    values = distance(np.array(np.meshgrid(*[np.linspace(-0.5, 0.5, size)] * 3, indexing="ij")))
    values = values.astype(np.float32)
    points = points_where_zero(values, 6000)
    assert len(points) > 2000
    for pieces in (1, 2, 4):
        shape = SdfGrid(values=values, pieces=pieces, smooth=False)
        vertices, faces, _, _ = triangles.triangulate(shape)
        corners = vertices.astype(np.float64)[faces] * (size - 1)
        near = cKDTree(corners.mean(axis=1)).query(points, k=24)[1]
        off = [from_triangles(points, *corners[near[:, k]].swapaxes(0, 1)) for k in range(24)]
        off = np.min(off, axis=0) * pieces**2
        assert 0.2 * most < off.max() < most and 0.4 * mean < off.mean() < mean


def test_default_is_a_ball():
    vertices, _, normals, _ = triangles.triangulate(SdfGrid())
    out = vertices - 0.5
    radius = np.linalg.norm(out, axis=1)
    assert radius.min() > 0.33 and radius.max() < 0.3501
    assert np.einsum("ij,ij->i", normals, out / radius[:, None]).min() > 0.99


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"values": np.ones((4, 4, 4))}, "all of one sign"),
        ({"values": np.ones((4, 4))}, r"values must be \(nx, ny, nz\)"),
        ({"values": np.ones((1, 4, 4))}, "each 2 or more"),
        ({"values": np.full((4, 4, 4), np.nan)}, "not finite"),
        ({"values": "grid"}, "not numbers"),
        ({"pieces": 0}, "pieces must be 1 to 16"),
        ({"values": RNG.normal(size=(30, 30, 30)), "pieces": 16}, "too many"),
    ],
)
def test_refused(more, message):
    with pytest.raises(SceneError, match=message):
        triangles.triangulate(SdfGrid(**more))


def test_in_files(tmp_path):
    values = waves((5, 6, 7))
    np.save(tmp_path / "a.npy", values)
    text = '{"camera": {"type": "perspective"}, "shapes": [{"type": "sdf_grid", "file": "a.npy"}]}'
    (tmp_path / "a.json").write_text(text)
    np.testing.assert_array_equal(load(tmp_path / "a.json").shapes[0].values, values)
    np.save(tmp_path / "a.npy", values[0])
    with pytest.raises(SceneError, match=r"a\.npy.*array \(nx, ny, nz\)"):
        load(tmp_path / "a.json")


@pytest.mark.peers
def test_beside_mitsuba(tmp_path):
    """Its rays meet the same surface, with its normals within 3 degrees.

    Of a cube: in grids of unequal sides Mitsuba 3.9.1 misses most of the surface.
    """
    mi = pytest.importorskip("mitsuba", reason="the renderer that we compare with")
    mi.set_variant("scalar_rgb")
    values = waves((9, 9, 9))
    grid = mi.VolumeGrid(np.ascontiguousarray(values.transpose(2, 1, 0)[..., None]))
    grid.write(str(tmp_path / "a.vol"))
    body = '<shape type="sdfgrid"><string name="filename" value="a.vol"/></shape>'
    path = tmp_path / "a.xml"
    path.write_text(f'<scene version="3.0.0">{body}</scene>')
    shape = load(path).shapes[0]
    np.testing.assert_array_equal(shape.values, values)
    vertices, _, normals, _ = triangles.triangulate(shape)
    theirs = mi.load_file(str(path))
    near = 0
    for i in RNG.choice(len(vertices), 200, replace=False):
        p, n = vertices[i].astype(float), normals[i].astype(float)
        hit = theirs.ray_intersect(mi.Ray3f(mi.Point3f(*(p + 0.01 * n)), mi.Vector3f(*-n)))
        if abs(hit.t - 0.01) < 1e-5:
            near += 1
            assert np.dot(n, np.array(hit.sh_frame.n)) > np.cos(np.radians(3.0))
    assert near >= 196
