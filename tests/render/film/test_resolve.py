"""Pictures made on the device: the bytes of a .png, tone curves, and where they may go."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
import pytest
from pyopencl.array import Array
from pyopencl.tools import get_gl_sharing_context_properties

from clpt import device, images
from clpt.device import DeviceArray
from clpt.errors import DeviceError, UnknownKindError
from clpt.render.film.resolve import Resolve, Screen
from clpt.spectra import spaces

H, W = 65, 48
RGBA = cl.channel_order.RGBA


def colours() -> np.ndarray:
    """(h, w, 3) float32: every step of the sRGB codes and its neighbours, and broken values."""
    steps = images.srgb8_steps()[1:-1]
    edges = [np.nextafter(steps, np.float32(0)), steps, np.nextafter(steps, np.float32(2))]
    some = np.random.default_rng(5).gamma(0.7, 0.6, H * W * 3).astype(np.float32)
    odd = np.array([np.nan, np.inf, -np.inf, -1, 0, 1, 2, 1e38, 1e-30], np.float32)
    known = np.concatenate([odd, *edges])
    some[: len(known)] = known
    return some.reshape(H, W, 3)


LINEAR = colours()


@pytest.fixture(scope="module")
def opened():
    return device.choose()


@pytest.fixture(scope="module")
def film(opened):
    made = DeviceArray(opened.queue, (H, W, 4), np.float32)
    made.set(np.concatenate([LINEAR, np.full((H, W, 1), 16, np.float32)], axis=2))
    return made


@pytest.fixture(scope="module")
def resolve(opened):
    return Resolve(opened, device.Stream(opened.queue))


@pytest.mark.parametrize("exposure", [0.0, -1.5])
def test_bytes_are_those_of_a_png(resolve, film, exposure):
    made = resolve(film, screen=Screen(exposure=exposure)).get()
    assert made.dtype == np.uint8
    np.testing.assert_array_equal(made[..., :3], images.to_srgb8(LINEAR, exposure))
    assert (made[..., 3] == 255).all()


def test_floats_are_linear_or_encoded(resolve, film):
    plain = resolve(film, screen=Screen(exposure=1.0), dtype=np.float32).get()
    expected = np.where(np.isnan(LINEAR), 0.0, LINEAR * np.float32(2.0))
    np.testing.assert_array_equal(plain[..., :3], expected)
    assert (plain[..., 3] == 1.0).all()
    encoded = resolve(film, screen=Screen(srgb=True), dtype=np.float32).get()[..., :3]
    inside = (LINEAR >= 0.0) & (LINEAR <= 1.0)
    want = images.linear_to_srgb(LINEAR[inside])
    np.testing.assert_allclose(encoded[inside], want, atol=1e-6)
    linear8 = resolve(film, screen=Screen(srgb=False)).get()[..., :3]
    np.testing.assert_array_equal(linear8[inside], np.round(LINEAR[inside] * 255))


def test_tone_curves(resolve, film):
    """Reinhard 2002 eq. 3 and Narkowicz's fit, in float64; all stay in [0, 1] and are finite."""
    good = np.isfinite(LINEAR).all(axis=2) & (np.abs(LINEAR).max(axis=2) < 1e9)
    x = np.maximum(LINEAR[good].astype(np.float64), 0.0)
    expected = {
        "reinhard": x / (1.0 + x @ [0.2126, 0.7152, 0.0722])[:, None],
        "aces": np.clip(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0),
    }
    for tone, want in expected.items():
        made = resolve(film, screen=Screen(tone=tone), dtype=np.float32).get()
        np.testing.assert_allclose(made[good][:, :3], want, atol=2e-6, rtol=1e-5)
        assert np.isfinite(made).all()
    with pytest.raises(UnknownKindError, match=r"tone curve 'filmic'.*aces"):
        resolve(film, screen=Screen(tone="filmic"))


def test_other_spaces_become_rec709(resolve, film):
    good = np.isfinite(LINEAR).all(axis=2) & (np.abs(LINEAR).max(axis=2) < 1e9)
    want = LINEAR[good].astype(np.float64) @ spaces.between("rec2020", "rec709").T
    made = resolve(film, screen=Screen(space="rec2020"), dtype=np.float32).get()[good][:, :3]
    np.testing.assert_allclose(made, want, rtol=1e-5, atol=1e-5)


def test_into_memory_of_the_caller(opened, resolve, film):
    queue, expected = opened.queue, resolve(film).get()
    whole = Array(queue, (H + 1, W, 4), np.uint8)
    part = whole[1:]  # begins inside its buffer
    part.add_event(cl.enqueue_marker(queue))
    assert resolve(film, part) is part
    assert len(part.events) == 1
    np.testing.assert_array_equal(part.get(), expected)
    buffer = cl.Buffer(opened.context, cl.mem_flags.READ_WRITE, 4 * H * W)
    np.testing.assert_array_equal(resolve(film, buffer, flip=True).get(), expected[::-1])
    host = np.empty((H, W, 4), np.uint8)
    cl.enqueue_copy(queue, host, buffer)
    np.testing.assert_array_equal(host, expected[::-1])


@pytest.mark.parametrize("order", [RGBA, cl.channel_order.BGRA])
def test_into_an_image(opened, resolve, film, order):
    """As of a texture that OpenGL shares: the same bytes, in the image's own order."""
    if not opened.info.cl_device.image_support:
        pytest.skip("the device has no images")
    form = cl.ImageFormat(order, cl.channel_type.UNORM_INT8)
    image = cl.create_image(opened.context, cl.mem_flags.READ_WRITE, form, shape=(W, H))
    event = resolve(film, image)
    assert isinstance(event, cl.Event)
    host = np.empty((H, W, 4), np.uint8)
    cl.enqueue_copy(opened.queue, host, image, origin=(0, 0), region=(W, H), wait_for=[event])
    expected = resolve(film).get()
    if order != RGBA:
        expected = expected[..., [2, 1, 0, 3]]
    np.testing.assert_array_equal(host, expected)


def test_into_an_image_of_floats(opened, resolve, film):
    if not opened.info.cl_device.image_support:
        pytest.skip("the device has no images")
    form = cl.ImageFormat(RGBA, cl.channel_type.FLOAT)
    image = cl.create_image(opened.context, cl.mem_flags.READ_WRITE, form, shape=(W, H))
    event = resolve(film, image, Screen(tone="aces"))
    host = np.empty((H, W, 4), np.float32)
    cl.enqueue_copy(opened.queue, host, image, origin=(0, 0), region=(W, H), wait_for=[event])
    expected = resolve(film, screen=Screen(tone="aces"), dtype=np.float32).get()
    np.testing.assert_array_equal(host, expected)


def test_what_does_not_fit_is_told(opened, resolve, film):
    queue, flags = opened.queue, cl.mem_flags.READ_WRITE
    form = cl.ImageFormat(RGBA, cl.channel_type.UNSIGNED_INT8)
    stranger = cl.Context([opened.info.cl_device])
    wrong = [
        (Array(queue, (H, W, 3), np.uint8), r"shape \(65, 48, 4\).*\(65, 48, 3\)"),
        (Array(queue, (H, W, 4), np.int8), "int8"),
        (Array(queue, (H, W, 4), np.uint8, order="F"), "not contiguous"),
        (cl.Buffer(opened.context, flags, 4 * H * W - 4), "needs 12480 bytes.*12476"),
        (cl.create_image(opened.context, flags, form, shape=(W, H)), "UNORM_INT8.*UNSIGNED_INT8"),
        (cl.Buffer(stranger, flags, 4 * H * W), "another OpenCL context"),
        (np.empty((H, W, 4), np.uint8), "not ndarray"),
    ]
    for into, message in wrong:
        with pytest.raises(DeviceError, match=message):
            resolve(film, into)
    with pytest.raises(DeviceError, match="does not go into"):
        resolve(film, Array(queue, (H, W, 4), np.uint8), dtype=np.float32)
    with pytest.raises(DeviceError, match="not float64"):
        resolve(film, dtype=np.float64)
    resolve(film).get()  # the queue is as good as before


def test_events_are_honoured_out_of_order(opened, film):
    """On a queue without order a picture waits for the caller's event, and its reader for it."""
    mode = cl.command_queue_properties.OUT_OF_ORDER_EXEC_MODE_ENABLE
    queue = cl.CommandQueue(opened.context, properties=mode)
    gate = cl.UserEvent(opened.context)
    resolve = Resolve(opened, device.Stream(queue))
    made = resolve(film, wait_for=[gate])
    host, event = made.get_async()
    queue.flush()
    done = cl.command_execution_status.COMPLETE
    assert made.events[0].command_execution_status != done
    gate.set_status(done)
    event.wait()
    np.testing.assert_array_equal(host[..., :3], images.to_srgb8(LINEAR))


def test_into_a_texture_of_opengl(opened):
    """What OpenGL reads back of its own texture is what the host would have written."""
    if not cl.have_gl():
        pytest.skip("PyOpenCL is built without OpenGL")
    if "cl_khr_gl_sharing" not in opened.info.cl_device.extensions:
        pytest.skip("the device does not share with OpenGL")
    glfw, gl = pytest.importorskip("glfw"), pytest.importorskip("OpenGL.GL")
    if not glfw.init():
        pytest.skip("there is no display")
    glfw.window_hint(glfw.VISIBLE, False)
    glfw.make_context_current(glfw.create_window(W, H, "clpt", None, None))
    platform = (cl.context_properties.PLATFORM, opened.info.cl_device.platform)
    shared = [platform, *get_gl_sharing_context_properties()]
    queue = cl.CommandQueue(cl.Context([opened.info.cl_device], properties=shared))
    name = gl.glGenTextures(1)
    gl.glBindTexture(gl.GL_TEXTURE_2D, name)
    kind = gl.GL_RGBA, gl.GL_UNSIGNED_BYTE
    gl.glTexImage2D(gl.GL_TEXTURE_2D, 0, gl.GL_RGBA8, W, H, 0, *kind, None)
    gl.glFinish()
    flags = cl.mem_flags.WRITE_ONLY
    texture = cl.GLTexture(queue.context, flags, gl.GL_TEXTURE_2D, 0, int(name), 2)
    made = DeviceArray(queue, (H, W, 4), np.float32)
    made.set(np.concatenate([LINEAR, np.ones((H, W, 1), np.float32)], axis=2))
    ours = cl.enqueue_acquire_gl_objects(queue, [texture])
    done = Resolve(device.Device.adopt(queue), device.Stream(queue))(made, texture, wait_for=[ours])
    cl.enqueue_release_gl_objects(queue, [texture], wait_for=[done]).wait()
    back = np.frombuffer(gl.glGetTexImage(gl.GL_TEXTURE_2D, 0, *kind), np.uint8)
    np.testing.assert_array_equal(back.reshape(H, W, 4)[..., :3], images.to_srgb8(LINEAR))
