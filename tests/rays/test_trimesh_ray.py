"""The intersector for trimesh beside trimesh's own, and on meshes that are odd."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

import clpt
from clpt.rays.trimesh_ray import RayMeshIntersector

COUNT = 50000


def knot() -> trimesh.Trimesh:
    return trimesh.creation.torus(1, 0.3, major_sections=120, minor_sections=60)


def rays_at(mesh: trimesh.Trimesh, count: int = COUNT) -> tuple[np.ndarray, np.ndarray]:
    """Rays (count, 3) from around a mesh into its box, of many lengths."""
    rng = np.random.default_rng(8)
    middle = mesh.bounds.mean(axis=0)
    o = middle + mesh.scale * rng.normal(size=(count, 3))
    d = middle + mesh.extents * (rng.random((count, 3)) - 0.5) - o
    return o, d * rng.uniform(0.1, 10, (count, 1))


def table(rays, triangles, locations):
    """Hits in one order."""
    order = np.lexsort((triangles, rays))
    return rays[order], triangles[order], locations[order]


@pytest.mark.peers
@pytest.mark.parametrize("place", [0, 1e5])
def test_answers_as_embree_does(place):
    """More than 99.99 % of the rays have the same hits, in the same places to 1e-8 of the scale."""
    embree = pytest.importorskip("trimesh.ray.ray_pyembree")
    mesh = knot().apply_translation([place, -place, 0])
    rays = rays_at(mesh)
    ours, theirs = RayMeshIntersector(mesh), embree.RayMeshIntersector(mesh)
    found, expected = ours.intersects_location(*rays), theirs.intersects_location(*rays)
    pairs = [set(zip(ray, tri, strict=True)) for _, ray, tri in (found, expected)]
    differ = {ray for ray, _ in pairs[0] ^ pairs[1]}
    assert len(differ) < 1e-4 * COUNT
    assert len(pairs[0]) == len(found[1]) > COUNT
    same = [table(ray, tri, at) for at, ray, tri in (found, expected)]
    kept = [~np.isin(ray, list(differ)) for ray, _, _ in same]
    tolerance = 1e-8 * mesh.scale + 1e-13 * place
    np.testing.assert_allclose(same[0][2][kept[0]], same[1][2][kept[1]], rtol=0, atol=tolerance)
    first = theirs.intersects_id(*rays, multiple_hits=False, return_locations=True)
    mine = ours.intersects_id(*rays, multiple_hits=False, return_locations=True)
    for a, b in zip(mine[:2], first[:2], strict=True):
        np.testing.assert_array_equal(a, b)
        assert a.dtype == np.int64
    np.testing.assert_allclose(mine[2], first[2], rtol=0, atol=tolerance)
    any_hit = ours.intersects_any(*rays)
    assert any_hit.dtype == bool
    np.testing.assert_array_equal(any_hit, np.isin(np.arange(COUNT), mine[1]))
    np.testing.assert_array_equal(ours.intersects_first(*rays)[mine[1]], mine[0])


def test_order_number_and_inside():
    mesh = knot()
    mesh.ray = RayMeshIntersector(mesh)
    o, d = rays_at(mesh, 2000)
    o = o / 4  # some of them inside
    at, ray, _ = mesh.ray.intersects_location(o, d)
    far = np.linalg.norm(at - o[ray], axis=1)
    assert ((np.diff(ray) > 0) | (np.diff(far) > 0)).all()
    odd = np.bincount(ray, minlength=len(o)) % 2 == 1
    np.testing.assert_array_equal(odd, mesh.contains(o))
    ring = (np.hypot(o[:, 0], o[:, 1]) - 1) ** 2 + o[:, 2] ** 2 < 0.09
    assert (odd == ring).mean() > 0.99  # its faces are flat
    assert odd.sum() > 10
    few, _ = mesh.ray.intersects_id(o, d, max_hits=2)
    assert len(few) == np.minimum(np.bincount(ray), 2).sum()


def test_an_edge_is_met_once():
    """A box through the diagonal of a side, through a corner's edge and along a side."""
    box = trimesh.creation.box()
    rays = np.array([[0, 0, -5], [0.25, 0.25, -5], [0.1, 0.2, -5]]), np.array([[0, 0, 1.0]] * 3)
    at, ray, _ = RayMeshIntersector(box).intersects_location(*rays)
    np.testing.assert_array_equal(ray, [0, 0, 1, 1, 2, 2])
    np.testing.assert_allclose(at[:, 2], [-0.5, 0.5] * 3)


def joined(*meshes):
    return RayMeshIntersector(trimesh.util.concatenate(list(meshes)))


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("gap", [1e-3, 5e-7, 1.5e-7])
def test_near_skins_are_met_each(scale, gap):
    """Two boxes, one inside of the other: through faces and through the edges within them."""
    boxes = [trimesh.creation.box(extents=[scale * (1 - 2 * g)] * 3) for g in (0, gap)]
    ray = joined(*boxes)
    o = scale * np.array([[-1.0, 0.1, 0.13], [-1, 0, 0], [-1, 0.25, 0.25], [-1, 0.25, -0.25]])
    at, index, _ = ray.intersects_location(o, np.tile([1.0, 0, 0], (4, 1)))
    assert np.bincount(index).tolist() == [4] * 4
    places = np.array([-0.5, -0.5 + gap, 0.5 - gap, 0.5])
    np.testing.assert_allclose(at[:, 0].reshape(4, 4), scale * np.tile(places, (4, 1)), rtol=1e-12)
    inside = ray.contains_points(scale * np.array([[0.01, 0.02, 0.03], [0, 0, 0]]))
    assert inside.tolist() == [False, False]  # the skins have one inside between them


def test_sheets_are_met_each():
    """Twenty squares of two triangles, 1e-7 of their size apart; also through their diagonals."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    sheets = [
        trimesh.Trimesh(np.add(square, [0, 0, 2.5e-7 * i]), [[0, 1, 2], [0, 2, 3]], process=False)
        for i in range(20)
    ]
    o = np.array([[0.3, 0.2, -1], [0.5, 0.5, -1], [0.7, 0.1, 1], [0.25, 0.25, 1]])
    d = np.array([[0, 0, 1.0]] * 2 + [[0, 0, -1.0]] * 2)
    index = joined(*sheets).intersects_id(o, d)[1]
    assert np.bincount(index).tolist() == [20] * 4


@pytest.mark.parametrize("merged", [True, False])
def test_corners_and_edges_are_met_once(merged):
    """Rays at every corner and the middle of every edge of a ball, from near and far."""
    mesh = trimesh.creation.icosphere(2)
    if not merged:
        mesh = trimesh.Trimesh(
            mesh.triangles.reshape(-1, 3), np.arange(960).reshape(-1, 3), process=False
        )
    ball = trimesh.creation.icosphere(2)
    aims = np.concatenate([ball.vertices, ball.vertices[ball.edges_unique].mean(axis=1)])
    for far in (2.0, 50.0):
        start = aims * far + np.random.default_rng(2).normal(size=aims.shape) * 0.1
        index = RayMeshIntersector(mesh).intersects_id(start, aims - start)[1]
        assert (np.bincount(index, minlength=len(aims)) == 2).all()


def test_an_edge_whose_corner_is_on_another_edge():
    """A triangle beside two others that meet in the middle of its edge."""
    vertices = [[0, 0, 0], [2, 0, 0], [1, 1, 0], [1, -1, 0], [1, 0, 0]]
    mesh = trimesh.Trimesh(vertices, [[0, 1, 2], [0, 3, 4], [4, 3, 1]], process=False)
    o = np.array([[0.5, 0, 3], [1, 0, 3], [1.25, 0, 3.0]])
    index = RayMeshIntersector(mesh).intersects_id(o, np.tile([0, 0, -1.0], (3, 1)))[1]
    assert index.tolist() == [0, 1, 2]


def test_what_is_no_mesh():
    box = trimesh.creation.box()
    with pytest.raises(clpt.SceneError, match=r"must be a trimesh\.Trimesh, not Scene; .*to_mesh"):
        RayMeshIntersector(trimesh.Scene(box))
    assert RayMeshIntersector(box, scale_to_box=False).intersects_any([[0, 0, -5]], [[0, 0, 1]])


def test_follows_the_mesh_and_is_copied():
    mesh = trimesh.creation.icosphere(1)
    intersector = RayMeshIntersector(mesh)
    ray = [[0, 0, -5]], [[0, 0, 3]]
    assert intersector.intersects_any(*ray)
    for other in (pickle.loads(pickle.dumps(intersector)), copy.deepcopy(intersector)):
        assert other.intersects_any(*ray)
    mesh.apply_translation([9, 0, 0])
    assert not intersector.intersects_any(*ray)


def test_no_rays_and_no_mesh():
    none = np.zeros((0, 3))
    intersector = RayMeshIntersector(trimesh.creation.box())
    assert [len(part) for part in intersector.intersects_location(none, none)] == [0, 0, 0]
    assert intersector.intersects_any(none, none).shape == (0,)
    empty = RayMeshIntersector(trimesh.Trimesh())
    assert empty.intersects_first([[0, 0, 0]], [[0, 0, 1]]).tolist() == [-1]
    assert empty.contains_points([[0, 0, 0]]).tolist() == [False]
    assert intersector.contains_points(none).shape == (0,)
    with pytest.raises(clpt.SceneError, match=r"points: \(n, 3\) is wanted, not \(3,\)"):
        intersector.contains_points([0, 0, 0])
    with pytest.raises(clpt.SceneError, match="rays: are not numbers"):
        intersector.intersects_any([[0, 0, 0], [1]], [[0, 0, 1]])
    with pytest.raises(clpt.SceneError, match=r"rays: .*\(1, 2\)"):
        intersector.intersects_any([[1, 2]], [[3, 4, 5]])


coordinate = st.sampled_from([-1.0, -0.5, 0.0, 1e-7, 0.5, 1.0])
corner = st.tuples(coordinate, coordinate, coordinate)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=12))
def test_odd_triangles(triangles):
    """Points, lines and overlapping faces: what is met lies on its ray and in its triangle."""
    corners = np.array(triangles)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), faces, process=False)
    rng = np.random.default_rng(1)
    o, d = rng.normal(size=(200, 3)) * 2, rng.normal(size=(200, 3))
    d[:100] = corners[rng.integers(len(corners), size=100)].mean(axis=1) - o[:100]
    at, ray, tri = RayMeshIntersector(mesh).intersects_location(o, d)
    assert np.isfinite(at).all()
    nearest = trimesh.triangles.closest_point(corners[tri], at)
    assert (np.linalg.norm(nearest - at, axis=1) < 1e-5).all()
    along = trimesh.util.unitize(d)[ray]
    np.testing.assert_allclose(np.cross(at - o[ray], along), 0, atol=1e-9)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    aimed = np.flatnonzero(area > 0.1)
    if len(aimed):  # through its middle
        middle = corners[aimed].mean(axis=1)
        start = middle + 3 * mesh.face_normals[aimed] + 0.1
        _, met = RayMeshIntersector(mesh).intersects_id(start, middle - start)
        assert set(met) == set(range(len(aimed)))
