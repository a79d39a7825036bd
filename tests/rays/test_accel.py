"""Queries against a float64 reference, on the host and on the device, and what is refused."""

from __future__ import annotations

import threading

import numpy as np
import pyopencl as cl
import pytest
from pyopencl.array import to_device

import clpt
from clpt.bvh import TREES

COMPLETE = cl.command_execution_status.COMPLETE


@pytest.mark.parametrize("layout", TREES)
def test_agrees_with_reference(queue, soup, rays, reference, layout):
    """Every ray, but for the few in a thousand that meet a triangle where it ends."""
    t, bary = reference(*soup, *rays)
    best, each = t.argmin(1), np.arange(len(t))
    nearest = t[each, best]
    with clpt.Accel(queue, *soup, layout=layout) as accel:
        hits, met = accel.intersect(*rays), accel.occluded(*rays)
    assert (hits.t.dtype, hits.primitive.dtype, met.dtype) == (np.float32, np.int32, np.uint8)
    assert hits.instance is None
    expected = np.where(np.isinf(nearest), -1, best)
    same = hits.primitive == expected
    assert same.mean() > 0.995
    assert (met == (hits.primitive >= 0)).all()
    there = same & (expected >= 0)
    assert 100 < there.sum() < 900
    np.testing.assert_allclose(hits.t[there], nearest[there], rtol=1e-4)
    np.testing.assert_allclose(hits.barycentrics[there], bary[each, best][there], atol=1e-4)
    nothing = hits.primitive < 0
    assert np.isinf(hits.t[nothing]).all()
    assert not hits.barycentrics[nothing].any()


def test_limits_per_ray(accel, rays):
    whole = accel.intersect(*rays)
    near = np.where(whole.primitive >= 0, whole.t, 1).astype(np.float32)
    assert not accel.occluded(*rays, t_max=near * np.float32(1 - 1e-6)).any()
    behind = accel.intersect(*rays, t_min=near * np.float32(1 + 1e-6))
    assert (behind.t > whole.t)[whole.primitive >= 0].all()
    assert not accel.occluded(*rays, t_min=np.nan).any()
    assert (accel.intersect(*rays, t_max=-1.0).primitive == -1).all()


def test_arrays_on_the_device(queue, accel, rays):
    """The same hits to the bit; slices, buffers, events, and arrays that are written again."""
    whole = accel.intersect(*rays)
    o, d = (to_device(queue, part) for part in rays)
    hits = accel.intersect(o, d)
    again = accel.intersect(o.data, d.data, out=hits)
    assert again.t is hits.t
    part = accel.intersect(o[100:300], d[100:300], t_max=to_device(queue, whole.t[100:300]) * 2)
    met = accel.occluded(o, d, 0.0, np.full(len(rays[0]), np.inf, np.float32))
    again.event.wait()
    for name in ("t", "primitive", "barycentrics"):
        expected = getattr(whole, name)
        np.testing.assert_array_equal(getattr(again, name).get(), expected)
        np.testing.assert_array_equal(getattr(part, name).get(), expected[100:300])
    np.testing.assert_array_equal(met.get(), whole.primitive >= 0)


def test_waits_for_events_of_any_order(accel, soup, rays):
    """On an out-of-order queue nothing starts before the caller's event is complete."""
    context, expected = accel.queue.context, accel.intersect(*rays)
    order = cl.command_queue_properties.OUT_OF_ORDER_EXEC_MODE_ENABLE
    queue, gate = cl.CommandQueue(context, properties=order), cl.UserEvent(context)
    there = clpt.Accel(queue, *soup)
    o, d = to_device(queue, np.zeros_like(rays[0])), to_device(queue, rays[1])
    kept = cl.enqueue_copy(queue, o.data, rays[0], is_blocking=False, wait_for=[gate])
    hits = there.intersect(o, d, wait_for=[kept])
    second = there.intersect(o, d)
    early = hits.event.command_execution_status
    gate.set_status(COMPLETE)
    second.event.wait()
    assert early != COMPLETE
    np.testing.assert_array_equal(hits.t.get(), expected.t)
    np.testing.assert_array_equal(second.t.get(), expected.t)


def test_updates_only_enqueue(accel, soup, rays):
    """Of meshes and instances, while an event that they wait for is not there."""
    context, (vertices, faces) = accel.queue.context, soup
    queue = cl.CommandQueue(context)
    mesh = clpt.Accel(queue, vertices, faces)
    town = clpt.InstancedAccel(queue, [mesh], [0], np.eye(4)[None])
    before = town.intersect(*rays).t
    gate, there = cl.UserEvent(context), [to_device(queue, part) for part in rays]
    mesh.update(to_device(queue, vertices + np.float32(9)), wait_for=[gate])
    mesh.update(vertices)
    town.update(np.eye(4)[None])
    hits = town.intersect(*there)
    early = hits.event.command_execution_status
    gate.set_status(COMPLETE)
    hits.event.wait()
    assert early != COMPLETE
    np.testing.assert_allclose(hits.t.get(), before, rtol=1e-5)


def test_update_moves_the_triangles(queue, soup, rays):
    vertices, faces = soup
    accel = clpt.Accel(queue, to_device(queue, vertices), to_device(queue, faces))
    moved = to_device(queue, np.ascontiguousarray(vertices[:, [1, 2, 0]] * np.float32(1.5)))
    o, d = (to_device(queue, part) for part in rays)
    event = accel.update(moved)
    hits = accel.intersect(o, d, wait_for=[event])
    fresh = clpt.Accel(queue, moved, faces).intersect(o, d)
    np.testing.assert_array_equal(hits.primitive.get(), fresh.primitive.get())
    np.testing.assert_allclose(hits.t.get(), fresh.t.get(), rtol=1e-6)


@pytest.mark.parametrize("count", [0, 1, 63, 65])
def test_any_number_of_rays(queue, accel, rays, count):
    o, d = rays[0][:count], rays[1][:count]
    hits = accel.intersect(o, d)
    assert hits.t.shape == (count,)
    assert hits.barycentrics.shape == (count, 2)
    there = accel.intersect(to_device(queue, o), to_device(queue, d))
    there.event.wait()
    if count:
        np.testing.assert_array_equal(there.t.get(), hits.t)
    assert accel.occluded(o, d).shape == (count,)


def test_one_origin_for_all_rays_and_other_types(accel, rays):
    d = rays[1]
    one = accel.intersect([0.5, 0.5, 0.5], d.astype(np.float64)[:, ::-1])
    many = accel.intersect(np.full_like(d, 0.5), np.ascontiguousarray(d[:, ::-1]))
    np.testing.assert_array_equal(one.t, many.t)
    fixed = np.ascontiguousarray(d[:, ::-1])
    fixed.flags.writeable = False
    np.testing.assert_array_equal(accel.intersect([[0.5, 0.5, 0.5]], fixed).t, many.t)


def test_directions_of_any_length(accel, rays):
    o, d = rays[0], rays[1] / np.linalg.norm(rays[1], axis=1, keepdims=True)
    unit = accel.intersect(o, d)
    for power in (-50, 50):  # of two, so that nothing is rounded
        hits = accel.intersect(o, d * np.float32(2.0**power))
        np.testing.assert_array_equal(hits.primitive, unit.primitive)
        np.testing.assert_allclose(hits.t, unit.t * np.float32(2.0**-power), rtol=1e-5)


def test_odd_rays_meet_nothing(accel):
    odd = [0.0, np.nan, np.inf, -np.inf, 1e-45]
    d = np.array([(x, y, 0.0) for x in odd for y in odd], np.float32)
    hits = accel.intersect(np.full_like(d, 0.5), d)
    assert (hits.primitive[(~np.isfinite(d)).any(1) | ~d.any(1)] == -1).all()
    assert (accel.intersect(d, np.ones_like(d)).t > 0).all()


@pytest.mark.parametrize("layout", TREES)
def test_odd_meshes(queue, layout):
    """None, one, points and lines, and a face many times: what has no area is not met."""
    o, d = np.array([[0.25, 0.25, -1]]), np.array([[0, 0, 1]])
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.25, 0.25, -0.5]])
    for faces, met in (
        (np.zeros((0, 3), np.uint32), [-1]),
        ([[0, 1, 2]], [0]),
        ([[3, 3, 3], [0, 1, 2], [3, 3, 1]], [1]),
        ([[0, 1, 2]] * 40, range(40)),
    ):
        hit = clpt.Accel(queue, vertices, faces, layout=layout).intersect(o, d)
        assert hit.primitive[0] in met


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("dtype", [np.float16, np.float64, np.int8, np.int64])
def test_numbers_of_other_types(queue, dtype):
    vertices = np.array([[0, 0, 0], [100, 0, 0], [0, 100, -128]], dtype)
    ray = np.array([[1.0, 1, 9]]), np.array([[0, 0, -1.0]])
    assert clpt.Accel(queue, vertices, [[0, 1, 2]]).intersect(*ray).primitive[0] == 0
    if np.dtype(dtype).kind == "f":
        vertices[1, 1] = np.inf
        with pytest.raises(clpt.SceneError, match="not finite"):
            clpt.Accel(queue, vertices, [[0, 1, 2]])


def test_what_is_refused(queue, soup, rays):
    vertices, faces = soup
    o, d = rays
    other = cl.CommandQueue(cl.Context([queue.device]))
    for arguments, message in (
        ((vertices[:, :2], faces), r"vertices: .*\(900, 2\)"),
        ((vertices, faces + 1), r"face \d+ names vertex 900 of 900"),
        ((vertices, faces.astype(int) - 1), r"face \d+ names vertex -1 of 900"),
        ((vertices, faces + 0.5), r"faces: \(n, 3\) uint32 is wanted, not \(300, 3\) float64"),
        ((vertices, to_device(queue, faces.astype(np.uint64))), "faces: .*uint64"),
        ((to_device(other, vertices), faces), "vertices: .*another context"),
    ):
        with pytest.raises(clpt.SceneError, match=message):
            clpt.Accel(queue, *arguments)
    with pytest.raises(clpt.SceneError, match=r"layout: .*brute"):
        clpt.Accel(queue, vertices, faces, layout="brute")
    accel, there = clpt.Accel(queue, vertices, faces), to_device(queue, d)
    for arguments, message in (
        ((o[:, :2], d), r"origins: .*\(1000, 2\)"),
        ((o[:3], d), "3 origins have 1000 directions"),
        ((o, to_device(queue, d.astype(np.float64))), "directions: .*float32 is wanted.*float64"),
        ((o, there[:, :2]), r"directions: .*\(1000, 2\)"),
        ((o, d, 0.0, [1.0, 2.0]), "t_max: 1000 rays have 2"),
    ):
        with pytest.raises(clpt.SceneError, match=message):
            accel.intersect(*arguments)
    with pytest.raises(clpt.SceneError, match="out: 1000 rays have 10 t"):
        accel.intersect(there, there, out=accel.intersect(there[:10], there[:10]))
    with pytest.raises(clpt.SceneError, match="out: it is for rays that are on the device"):
        accel.occluded(o, d, out=accel.occluded(there, there))
    accel.close()
    with pytest.raises(clpt.DeviceError, match="closed"):
        accel.intersect(o, d)
    assert clpt.Accel(queue, vertices, faces).occluded(o, d).any()  # the queue is as it was


def test_threads(accel, rays):
    expected, found = accel.intersect(*rays).t, {}

    def ask(number: int) -> None:
        found[number] = [accel.intersect(*rays).t for _ in range(5)]

    threads = [threading.Thread(target=ask, args=(i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((t == expected).all() for each in found.values() for t in each)


@pytest.mark.parametrize("layout", TREES)
def test_all_hits(queue, soup, rays, reference, layout):
    """None is lost, none comes twice, and they are in order."""
    t, _ = reference(*soup, *rays)
    expected = {(i, j) for i, j in zip(*np.nonzero(np.isfinite(t)), strict=True)}
    o, d = rays
    hits = clpt.Accel(queue, *soup, layout=layout).intersect_all(to_device(queue, o), d)
    found = set(zip(hits.ray, hits.primitive, strict=True))
    assert len(found) == len(hits.ray)
    assert len(expected) > 2000
    assert len(found ^ expected) < 0.005 * len(expected)
    np.testing.assert_allclose(
        *np.array(
            [
                (hit, t[i, j])
                for hit, i, j in zip(hits.t, hits.ray, hits.primitive, strict=True)
                if (i, j) in expected
            ]
        ).T,
        rtol=1e-4,
    )
    assert ((np.diff(hits.ray) > 0) | ((np.diff(hits.ray) == 0) & (np.diff(hits.t) >= 0))).all()


def test_all_hits_of_none(accel, rays):
    o, d = rays
    assert len(accel.intersect_all(o[:0], d[:0]).t) == 0
    assert len(accel.intersect_all(o, d, t_max=0.0).t) == 0
