"""Pictures for tev: the bytes of its protocol, and viewers that go away."""

import socket
import struct
import threading
from pathlib import Path

import numpy as np
import pytest

from clpt import images
from clpt.__main__ import run
from clpt.images import tev

ROOT = Path(__file__).resolve().parents[2]
RNG = np.random.default_rng(2)


class Listener:
    """A viewer: takes connections, and reads packets as the protocol says, one after another."""

    def __init__(self):
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.socket.settimeout(10)
        self.port = self.socket.getsockname()[1]

    def accept(self):
        connection = self.socket.accept()[0]
        connection.settimeout(10)
        return connection

    def close(self):
        self.socket.close()


@pytest.fixture
def listener():
    made = Listener()
    yield made
    made.close()


def packets(connection):
    data = b""
    while more := connection.recv(1 << 16):
        data += more
    while data:
        length, kind = struct.unpack_from("<IB", data)
        yield kind, data[5:length]
        data = data[length:]


class Reader:
    """Takes members out of a payload, in the order of tev's own reader."""

    def __init__(self, payload):
        self.rest = payload

    def number(self, form, size):
        value = struct.unpack_from(f"<{form}", self.rest)[0]
        self.rest = self.rest[size:]
        return value

    def flag(self):
        return self.number("?", 1)

    def integer(self):
        return self.number("i", 4)

    def text(self):
        text, _, self.rest = self.rest.partition(b"\0")
        return text.decode()

    def array(self, dtype, count):
        size = np.dtype(dtype).itemsize * count
        values, self.rest = np.frombuffer(self.rest[:size], dtype), self.rest[size:]
        return values


def image_of(found, named="a picture"):
    """The image that packets make: by channel (h, w) float32."""
    image = {}
    for kind, payload in found:
        reader = Reader(payload)
        reader.flag()
        assert reader.text() == named
        if kind == 4:
            width, height, count = (reader.integer() for _ in range(3))
            image = {reader.text(): np.zeros((height, width), np.float32) for _ in range(count)}
        else:
            assert kind == 6
            names = [reader.text() for _ in range(reader.integer())]
            x, y, width, height = (reader.integer() for _ in range(4))
            offsets, strides = (reader.array("<i8", len(names)) for _ in range(2))
            data = reader.array("<f4", len(reader.rest) // 4)
            for name, offset, stride in zip(names, offsets, strides, strict=True):
                plane = data[offset::stride][: width * height].reshape(height, width)
                image[name][y : y + height, x : x + width] = plane
        assert not reader.rest
    return image


def test_a_packet_as_recorded():
    """Byte by byte, as tev's documentation of its packets has it."""
    made = tev.create("a", 2, 1, ["R", "depth.Z"])
    assert made == bytes.fromhex(
        "1e000000 04 01 6100 02000000 01000000 02000000 5200 64657074682e5a00"
    )
    rows = np.array([[[1.0, 0.5]]], np.float32)
    assert tev.update("a", ["R", "G"], 3, rows) == bytes.fromhex(
        "48000000 06 00 6100 02000000 5200 4700 00000000 03000000 01000000 01000000"
        "0000000000000000 0100000000000000 0200000000000000 0200000000000000 0000803f 0000003f"
    )


@pytest.mark.parametrize("most", [tev.PACKET, 3 * 40 * 4])
def test_the_viewer_gets_every_channel(listener, monkeypatch, most):
    monkeypatch.setattr(tev, "PACKET", most)  # in one packet, or a row in each
    layers = {name: RNG.random((7, 40)).astype(np.float32) for name in ("R", "G", "depth.Z")}
    viewer = tev.Viewer("a picture", port=listener.port)
    viewer.show(layers)
    viewer.close()
    image = image_of(packets(listener.accept()))
    assert list(image) == list(layers)
    for name, values in layers.items():
        np.testing.assert_array_equal(image[name], values)


def test_channels_that_change_make_the_image_anew(listener):
    viewer = tev.Viewer("a picture", port=listener.port)
    connection = listener.accept()
    viewer.show({"R": np.zeros((2, 2))})
    assert [packet_of(connection)[0] for _ in range(2)] == [4, 6]
    viewer.show({"R": np.ones((2, 2))})
    assert packet_of(connection)[0] == 6
    viewer.show({"G": np.ones((2, 2))})
    viewer.close()
    rest = list(packets(connection))
    assert [kind for kind, _ in rest] == [4, 6] and b"G\0" in rest[0][1]


def packet_of(connection):
    """The next packet of a connection, read exactly."""
    head = b""
    while len(head) < 5:
        head += connection.recv(5 - len(head))
    length, kind = struct.unpack("<IB", head)
    payload = b""
    while len(payload) < length - 5:
        payload += connection.recv(length - 5 - len(payload))
    return kind, payload


def test_a_lost_viewer_is_told_once_and_found_again(listener, monkeypatch):
    monkeypatch.setattr(tev, "RETRY", 0.0)
    told, heard = [], threading.Event()

    def tell(line):
        told.append(line)
        heard.set()

    viewer = tev.Viewer("a picture", port=listener.port, tell=tell)
    connection = listener.accept()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    connection.close()  # as a program that is killed
    picture = {"R": np.ones((64, 64), np.float32)}
    for _ in range(100):
        viewer.show(picture)
        if heard.wait(0.05):
            break
    assert "is lost" in told[0]
    viewer.show(picture)
    again = listener.accept()
    viewer.close()
    assert image_of(packets(again))["R"].min() == 1.0
    assert sum("is lost" in line for line in told) == 1 and "is there again" in told[-1]


def test_the_command_line_shows_its_passes(listener, tmp_path):
    path = tmp_path / "a.npy"
    scene = ROOT / "scenes" / "cornell_box"
    given = ["--size", "16x12", "--spp", "4", "--layers", "depth", "-o", str(path)]
    assert run(["render", str(scene), "--tev", f":{listener.port}", *given]) == 0
    image = image_of(packets(listener.accept()), "cornell_box")
    assert list(image) == ["R", "G", "B", "depth.Z"]
    picture = images.read(path)
    for i, letter in enumerate("RGB"):
        np.testing.assert_array_equal(image[letter], picture[..., i])


def test_the_command_line_tells_that_no_viewer_is_there(capsys, tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    scene = str(ROOT / "scenes" / "cornell_box")
    given = ["render", scene, "--tev", f":{port}", "--size", "8x8", "-o", str(tmp_path / "a.npy")]
    assert run(given) == 2
    assert "there is no viewer at" in capsys.readouterr().err


def test_where_no_viewer_is():
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with pytest.raises(tev.TevError, match=f"no viewer at 127.0.0.1:{port}.*start tev"):
        tev.Viewer("a picture", port=port)


@pytest.mark.parametrize(
    ("text", "found"),
    [("", (tev.HOST, tev.PORT)), ("desk", ("desk", tev.PORT)), (":9", (tev.HOST, 9)),
     ("desk:80", ("desk", 80))],
)  # fmt: skip
def test_addresses(text, found):
    assert tev.address(text) == found


@pytest.mark.parametrize("text", ["desk:x", "desk:0", "desk:65536"])
def test_addresses_that_are_none(text):
    with pytest.raises(ValueError, match=r"port|invalid"):
        tev.address(text)
