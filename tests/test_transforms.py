"""clpt.transforms: identities, conventions, and agreement with Mitsuba where it is installed."""

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.errors import SceneError


def test_order_is_right_to_left():
    matrix = tf.translate([1, 2, 3]) @ tf.scale([2, 3, 4])
    np.testing.assert_allclose(tf.transform_points(matrix, [[1, 1, 1]]), [[3, 5, 7]])
    np.testing.assert_allclose(tf.transform_vectors(matrix, [1, 1, 1]), [2, 3, 4])


def test_three_numbers_are_as_good_as_one_array():
    np.testing.assert_array_equal(tf.translate(1, 2, 3), tf.translate([1, 2, 3]))
    np.testing.assert_array_equal(tf.scale(1, 2, 3), tf.scale([1, 2, 3]))
    np.testing.assert_array_equal(tf.scale(2), tf.scale(2, 2, 2))
    for wrong in ((), (1, 2), (1, 2, 3, 4)):
        with pytest.raises(SceneError, match="three finite numbers"):
            tf.translate(*wrong)


def test_rotation_is_counter_clockwise_and_orthonormal():
    np.testing.assert_allclose(
        tf.transform_vectors(tf.rotate([0, 0, 2], 90), [1, 0, 0]), [0, 1, 0], atol=1e-15
    )
    r = tf.rotate([1, -2, 0.5], 73)[:3, :3]
    np.testing.assert_allclose(r @ r.T, np.eye(3), atol=1e-14)
    assert np.isclose(np.linalg.det(r), 1)


def test_look_at_maps_axes():
    m = tf.look_at([1, 2, 3], [1, 2, 8], [0, 1, 0])
    np.testing.assert_allclose(tf.transform_points(m, [0, 0, 0]), [1, 2, 3])
    np.testing.assert_allclose(tf.transform_vectors(m, [0, 0, 1]), [0, 0, 1])
    np.testing.assert_allclose(tf.transform_vectors(m, [1, 0, 0]), [1, 0, 0])
    assert not tf.flips_handedness(m)


def test_normals_stay_perpendicular_under_shear():
    rng = np.random.default_rng(1)
    m = np.eye(4)
    m[:3, :3] = rng.normal(size=(3, 3))
    tangent, normal = [1.0, 0, 0], [0, 0.6, 0.8]
    turned = tf.transform_normals(m, normal)
    assert abs(turned @ tf.transform_vectors(m, tangent)) < 1e-12
    assert np.isclose(np.linalg.norm(turned), 1)
    np.testing.assert_array_equal(tf.transform_normals(m, [0, 0, 0]), [0, 0, 0])


def test_perspective_spans_the_field_of_view():
    m = tf.perspective(90, 0.5, 10)
    np.testing.assert_allclose(tf.transform_points(m, [[2, -2, 2], [0, 0, 0.5]])[0][:2], [1, -1])
    np.testing.assert_allclose(
        tf.transform_points(m, [[0, 0, 0.5], [0, 0, 10]])[:, 2], [0, 1], atol=1e-15
    )
    np.testing.assert_allclose(
        tf.transform_points(tf.orthographic(1, 3), [[5, 6, 3]]), [[5, 6, 1]], atol=1e-15
    )


@pytest.mark.parametrize("factor", [1e-9, 1.0, 1e9])
def test_uniform_scales_are_regular(factor):
    assert not tf.is_singular(tf.scale(factor))


def test_singular_matrices_are_found():
    assert tf.is_singular(tf.scale([1, 0, 1]))
    assert tf.is_singular(np.full((4, 4), np.nan))
    assert tf.is_singular(np.zeros((4, 4)))
    flat = np.eye(4)
    flat[:3, :3] = [[1, 1, 0], [1, 1, 0], [0, 0, 1]]
    assert tf.is_singular(flat)
    with pytest.raises(SceneError, match="inverted"):
        tf.inverse(flat)
    assert tf.flips_handedness(tf.scale([-1, 1, 1]))


@pytest.mark.parametrize(
    "call",
    [
        lambda: tf.look_at([0, 0, 0], [0, 0, 0], [0, 1, 0]),
        lambda: tf.look_at([0, 0, 0], [0, 1, 0], [0, 2, 0]),
        lambda: tf.rotate([0, 0, 0], 10),
        lambda: tf.translate([1, 2]),
        lambda: tf.perspective(180, 1, 2),
        lambda: tf.perspective(60, 2, 1),
    ],
)
def test_bad_parameters_are_refused(call):
    with pytest.raises(SceneError):
        call()


def test_agrees_with_mitsuba():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    t = mi.ScalarTransform4f
    pairs = [
        (
            tf.look_at([1, 2, 3], [-2, 0.5, 1], [0, 1, 0.1]),
            t().look_at([1, 2, 3], [-2, 0.5, 1], [0, 1, 0.1]),
        ),
        (tf.rotate([0.6, 0, 0.8], 37), t().rotate([0.6, 0, 0.8], 37)),
        (tf.perspective(40, 0.1, 50), mi.ScalarProjectiveTransform4f().perspective(40, 0.1, 50)),
        (tf.orthographic(0.1, 50), mi.ScalarProjectiveTransform4f().orthographic(0.1, 50)),
    ]
    for ours, theirs in pairs:
        np.testing.assert_allclose(ours, np.array(theirs.matrix), atol=2e-5)
