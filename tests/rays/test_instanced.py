"""Instances against the same triangles placed one by one, before and after they move."""

from __future__ import annotations

import numpy as np
import pytest
from pyopencl.array import to_device

import clpt
from clpt.bvh import TREES

COUNT = 40


@pytest.fixture(scope="module")
def transforms() -> np.ndarray:
    """(40, 4, 4) float32: turned, stretched, mirrored, in a cube."""
    rng = np.random.default_rng(11)
    made = np.zeros((COUNT, 4, 4), np.float32)
    made[:, :3, :3] = 0.1 * (rng.normal(size=(COUNT, 3, 3)) + np.eye(3))
    made[:, :3, 3] = rng.random((COUNT, 3))
    made[:, 3, 3] = 1
    return made


@pytest.fixture(scope="module")
def small(soup) -> tuple[np.ndarray, np.ndarray]:
    """vertices and faces of a second mesh: 20 of the triangles."""
    vertices, faces = soup
    return vertices, faces[:20]


def placed(meshes, prototypes, transforms):
    """All triangles in the world, and of each its row and its instance."""
    vertices, faces, primitive, instance, first = [], [], [], [], 0
    for i, (which, matrix) in enumerate(zip(prototypes, transforms, strict=True)):
        points, corners = meshes[which]
        vertices.append(points @ matrix[:3, :3].T + matrix[:3, 3])
        faces.append(corners + first)
        first += len(points)
        primitive.append(np.arange(len(corners)))
        instance.append(np.full(len(corners), i))
    return [np.concatenate(a) for a in (vertices, faces, primitive, instance)]


def check(hits, met, fresh: clpt.Accel, rays, primitive, instance) -> None:
    """Hits agree with those of triangles placed one by one, but at edges."""
    expected = fresh.intersect(*rays)
    same = np.where(expected.primitive < 0, -1, primitive[expected.primitive]) == hits.primitive
    same &= np.where(expected.primitive < 0, -1, instance[expected.primitive]) == hits.instance
    assert same.mean() > 0.995
    there = same & (hits.primitive >= 0)
    assert there.sum() > 200
    np.testing.assert_allclose(hits.t[there], expected.t[there], rtol=2e-4)
    np.testing.assert_array_equal(met, hits.primitive >= 0)


@pytest.mark.parametrize("layout", TREES)
def test_as_if_placed_one_by_one(queue, soup, small, rays, transforms, layout):
    meshes = [clpt.Accel(queue, *mesh, layout=layout) for mesh in (soup, small)]
    prototypes = np.arange(COUNT) % 2
    accel = clpt.InstancedAccel(queue, meshes, prototypes, transforms)
    vertices, faces, primitive, instance = placed([soup, small], prototypes, transforms)
    fresh = clpt.Accel(queue, vertices, faces)
    check(accel.intersect(*rays), accel.occluded(*rays), fresh, rays, primitive, instance)
    near = np.full(len(rays[0]), 0.5, np.float32) * fresh.intersect(*rays).t
    assert not accel.occluded(*rays, t_max=near).any()


def test_moves_on_the_device(queue, soup, small, rays, transforms):
    """Other transforms from the device, then another form of a mesh."""
    meshes = [clpt.Accel(queue, *mesh) for mesh in (soup, small)]
    prototypes = np.arange(COUNT) % 2
    accel = clpt.InstancedAccel(queue, meshes, prototypes, transforms)
    moved = np.ascontiguousarray(transforms[::-1])
    accel.update(to_device(queue, moved))
    squeezed = soup[0] * np.float32([1, 0.5, 2])
    meshes[0].update(squeezed)
    event = accel.update()
    there = [to_device(queue, part) for part in rays]
    hits = accel.intersect(*there, wait_for=[event])
    found = clpt.Hits(
        *(a.get() for a in (hits.t, hits.primitive, hits.barycentrics, hits.instance)), event
    )
    vertices, faces, primitive, instance = placed([(squeezed, soup[1]), small], prototypes, moved)
    fresh = clpt.Accel(queue, vertices, faces)
    check(found, accel.occluded(*rays), fresh, rays, primitive, instance)


def test_what_is_refused(queue, small, transforms):
    mesh = clpt.Accel(queue, *small)
    which = np.zeros(COUNT, int)
    flat = transforms.copy()
    flat[3, :3, :3] = 1
    for arguments, message in (
        ((which + 1, transforms), "prototypes: 1 is none of 1 meshes"),
        (([], transforms[:0]), "prototypes: whole numbers .k,. with k > 0"),
        ((which, transforms[:3]), "transforms: 40 instances have 3"),
        ((which, transforms[:, :3]), r"transforms: .*\(40, 3, 4\)"),
        ((which, flat), "transforms: instance 3 is singular"),
    ):
        with pytest.raises(clpt.SceneError, match=message):
            clpt.InstancedAccel(queue, [mesh], *arguments)
    other = clpt.Accel(queue, *small, layout="binary" if mesh.layout == "wide8" else "wide8")
    with pytest.raises(clpt.SceneError, match=r"accels\[1\]: it has another layout"):
        clpt.InstancedAccel(queue, [mesh, other], which, transforms)


def test_a_singular_instance_goes_away(queue, small, rays, transforms):
    accel = clpt.InstancedAccel(
        queue, [clpt.Accel(queue, *small)], np.zeros(COUNT, int), transforms
    )
    before = accel.intersect(*rays)
    flat = transforms.copy()
    flat[::2, :3, :3] = 0
    accel.update(flat)
    hits = accel.intersect(*rays)
    assert (hits.instance[hits.primitive >= 0] % 2 == 1).all()
    kept = before.instance % 2 == 1
    np.testing.assert_array_equal(hits.primitive[kept], before.primitive[kept])
    accel.close()
    with pytest.raises(clpt.DeviceError, match="InstancedAccel is closed"):
        accel.occluded(*rays)
