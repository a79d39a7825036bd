"""The server of the page, as an attacker meets it."""

from __future__ import annotations

import contextlib
import json
import random
import socket
import time
from collections.abc import Iterator

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from clpt.errors import ClptError
from clpt.view import server as serving
from clpt.view.access import Access, is_loopback
from clpt.view.messages import LARGEST_MESSAGE
from clpt.view.server import MOST_FRAMES, MOST_VIEWERS, SAFETY, Server
from tests.view.attacker import Recorder, answer_to, ask, cookie, do, frame, message, opened

ELSEWHERE = "http://evil.example"


@pytest.fixture
def server() -> Iterator[Server]:
    """A server with a session that only notes requests."""
    made = Server()
    made.show(Recorder())  # type: ignore[arg-type]
    yield made
    made.close()


@pytest.fixture
def key(server: Server) -> str:
    """The cookie of a viewer."""
    return cookie(server)


def wait_for(true: object) -> None:
    """Wait until a function returns something true."""
    end = time.monotonic() + 10
    while not true():  # type: ignore[operator]
        assert time.monotonic() < end
        time.sleep(0.01)


def test_it_listens_on_this_machine_alone(server: Server) -> None:
    addresses = {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None)}
    for address in {one for one in addresses if not is_loopback(one)}:
        with pytest.raises(OSError):
            socket.create_connection((address, server.port), timeout=2).close()


def test_a_port_that_is_taken_is_one_line(server: Server) -> None:
    with pytest.raises(ClptError, match=f"cannot listen at 127.0.0.1:{server.port}"):
        Server(port=server.port)


@pytest.mark.parametrize(
    "path", ["/", "/index.html", "/main.js", "/socket", "/?token=", "/?token=x"]
)
def test_without_a_cookie_there_is_nothing(server: Server, path: str) -> None:
    status, headers, content = ask(server, path, f"Cookie: {server.access.cookie_name}=x; other=y")
    assert status == 403 and b"<" not in content and "set-cookie" not in headers


def test_a_token_opens_the_page_once(server: Server) -> None:
    path = server.address.split(str(server.port), 1)[1]
    status, headers, content = ask(server, path)
    assert status == 200 and b"<!doctype html>" in content
    name, *attributes = headers["set-cookie"].split("; ")
    assert {"HttpOnly", "SameSite=Strict", f"Path={server.access.room}"} == set(attributes)
    assert ask(server, "/", f"Cookie: {name}")[0] == 200
    assert path.split("=", 1)[1] not in name
    again = ask(server, path)
    assert again[0] == 403 and "set-cookie" not in again[1]


def test_tokens_and_cookies_are_long_and_few() -> None:
    access = Access(1)
    tokens = [access.new_token() for _ in range(100)]
    assert len(set(tokens)) == 100 and min(map(len, tokens)) >= 43  # 256 bits in base 64
    assert access.exchange(tokens[0]) is None  # the oldest are dropped: nothing grows
    made = access.exchange(tokens[-1])
    assert made and access.allows(f"a=b; clpt-1={made}") and not access.allows(f"clpt-2={made}")
    assert tokens[-2] not in repr(vars(access)) and made not in repr(vars(access))


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:{}", "127.0.0.1", "localhost:1", None]
)
def test_another_host_name_is_refused(server: Server, key: str, host: str | None) -> None:
    """A page elsewhere that lets its own name mean 127.0.0.1 sends that name."""
    named = None if host is None else host.format(server.port)
    status, _, content = ask(server, "/", f"Cookie: {key}", host=named)
    assert status in (0, 400, 403) and b"<!doctype" not in content


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_a_server_for_all_interfaces_has_the_names_that_it_announces(host: str) -> None:
    """And the address at which a request has come, but no stranger's."""
    if host == "::" and not socket.has_ipv6:
        pytest.skip("there is no IPv6")
    with contextlib.closing(Server(host)) as server:
        key = cookie(server)
        announced = server.address.removeprefix("http://").partition("/")[0]
        came = "127.0.0.1" if host == "0.0.0.0" else "[::1]"
        machine = socket.gethostname()
        for named in (announced, *(f"{one}:{server.port}" for one in (came, "localhost", machine))):
            assert ask(server, "/", f"Cookie: {key}", host=named)[0] == 200, named
        assert announced.rpartition(":")[0].strip("[]") != host
        for named in ("evil.example", f"evil.example:{server.port}", f"192.0.2.7:{server.port}"):
            assert ask(server, "/", f"Cookie: {key}", host=named)[0] == 403, named


def test_confirmations_of_frames_are_not_counted(server: Server, key: str) -> None:
    """As many frames as a fast device makes; other messages keep to their rate."""
    with opened(server, key) as client:
        for number in range(1, 301):
            server.picture({"frame": number}, b"")
            assert frame(client) == number
            do(client, "shown", frame=number)
        server.picture({"frame": 301}, b"")
        assert frame(client) == 301


def test_two_hosts_are_refused(server: Server, key: str) -> None:
    status, _, content = ask(server, "/", "Host: evil.example", f"Cookie: {key}")
    assert status == 400 and b"<!doctype" not in content


@pytest.mark.parametrize(
    "origin", [None, ELSEWHERE, "null", "https://127.0.0.1:{}", "http://localhost:{}"]
)
def test_a_socket_of_another_page_is_refused(server: Server, key: str, origin: str | None) -> None:
    given = None if origin is None else origin.format(server.port)
    with pytest.raises(InvalidStatus) as refused, opened(server, key, origin=given):
        pass
    assert refused.value.response.status_code == 403


def test_a_socket_needs_a_cookie(server: Server, key: str) -> None:
    for wrong in ("", f"{server.access.cookie_name}=", key[:-1], key.replace("=", "=x")):
        with pytest.raises(InvalidStatus), opened(server, wrong):
            pass
    with opened(server, key) as client:
        assert message(client, "wheel")["steers"]


def test_every_answer_is_safe(server: Server, key: str) -> None:
    for path in ("/", "/main.js", "/nothing", "/?token=x"):
        for sent in (key, ""):
            _, headers, _ = ask(server, path, f"Cookie: {sent}")
            for name, value in SAFETY.items():
                assert headers[name.lower()] == value
            assert not any(name.startswith("access-control") for name in headers)
    policy = SAFETY["Content-Security-Policy"]
    assert "default-src 'self'" in policy and "unsafe" not in policy and "http" not in policy


@pytest.mark.parametrize(
    "path",
    ["/../session.py", "/..%2fserver.py", "/%2e%2e/server.py", "//etc/passwd", "/etc/passwd",
     "/static/main.js", "/main.js/", "/main.js%00", "/.", "/\\..\\server.py"],
)  # fmt: skip
def test_no_path_leads_elsewhere(server: Server, key: str, path: str) -> None:
    status, _, content = ask(server, path, f"Cookie: {key}")
    assert status in (400, 404) and b"import" not in content and b"root:" not in content


@pytest.mark.parametrize("verb", ["POST", "PUT", "DELETE", "OPTIONS", "CONNECT", "TRACE", "get"])
def test_only_get_is_answered(server: Server, key: str, verb: str) -> None:
    assert ask(server, "/", f"Cookie: {key}", verb=verb)[0] in (0, 400, 405)


def test_noise_on_the_port(server: Server, key: str) -> None:
    """Bytes that are no HTTP, and requests without an end, are dropped; the server goes on."""
    chance = random.Random(1)
    for size in (1, 10, 1000, 100_000):
        assert answer_to(server, chance.randbytes(size) + b"\r\n\r\n")[0] in (0, 400)
    assert answer_to(server, b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n")[0] in (0, 400, 414)
    many = b"".join(b"A%d: b\r\n" % i for i in range(10_000))
    assert answer_to(server, b"GET / HTTP/1.1\r\n" + many + b"\r\n")[0] in (0, 400, 431)
    assert ask(server, "/", f"Cookie: {key}")[0] == 200


def test_a_long_message_ends_the_socket(server: Server, key: str) -> None:
    with opened(server, key) as client:
        do(client, "pause", paused=True)
        client.send(json.dumps({"do": "x" * (LARGEST_MESSAGE - 20)}))
        assert "there is no command" in message(client, "error")["text"]
        with pytest.raises(ConnectionClosed) as closed:
            client.send("x" * (LARGEST_MESSAGE + 1))
            message(client, "never")
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 1009


def test_a_message_of_a_gigabyte_is_not_read(server: Server, key: str) -> None:
    """Its head says how long it is: the socket ends before anything is kept."""
    with opened(server, key) as client:
        client.socket.sendall(b"\x81\xff" + (1 << 30).to_bytes(8, "big") + b"mask" + b"x" * 1000)
        with pytest.raises(ConnectionClosed) as closed:
            message(client, "never")
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 1009


def test_a_flood_ends_the_socket(server: Server, key: str) -> None:
    with opened(server, key) as client, pytest.raises(ConnectionClosed) as closed:
        for _ in range(1000):
            do(client, "pause", paused=True)
        message(client, "never")
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 1008
    most = serving.BURST + 10 * serving.RATE
    assert 0 < len(server.session.requests) <= most  # type: ignore[union-attr]


def test_sixty_a_second_are_let_through(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = 0.0
    monkeypatch.setattr(serving.time, "monotonic", lambda: clock)
    viewer = serving.Viewer(None)  # type: ignore[arg-type]
    for _ in range(600):
        clock += 1 / serving.RATE
        assert viewer.rate.allows()
    allowed = sum(viewer.rate.allows() for _ in range(1000))
    assert serving.BURST - 2 < allowed <= serving.BURST


def test_there_is_room_for_eight(server: Server, key: str) -> None:
    with contextlib.ExitStack() as all_viewers:
        for _ in range(MOST_VIEWERS):
            message(all_viewers.enter_context(opened(server, key)), "wheel")
        with pytest.raises(InvalidStatus) as refused, opened(server, key):
            pass
        assert refused.value.response.status_code == 503
    wait_for(lambda: server.session.viewers == 0)  # type: ignore[union-attr]
    with opened(server, key) as client:
        assert message(client, "wheel")["viewers"] == 1


def test_who_does_not_steer_invites_nobody(server: Server, key: str) -> None:
    with opened(server, key) as first, opened(server, key) as second:
        message(second, "wheel")
        do(second, "invite")
        assert "another viewer steers" in message(second, "error")["text"]
        do(first, "invite")
        assert server.access.room in message(first, "invitation")["address"]


def raw_frame(opcode: int, payload: bytes = b"", fin: bool = True) -> bytes:
    """A frame of a client, of at most 125 bytes; its mask is zero."""
    return bytes([fin << 7 | opcode, 0x80 | len(payload)]) + bytes(4) + payload


def closed_with(client: object) -> int | None:
    """The code with which the server ends a socket; None if it just does."""
    with pytest.raises(ConnectionClosed) as closed:
        message(client, "never")  # type: ignore[arg-type]
    return None if closed.value.rcvd is None else closed.value.rcvd.code


def test_a_message_in_parts_is_taken(server: Server, key: str) -> None:
    with opened(server, key) as client:
        first, *middle, last = (raw_frame(0, part, False) for part in (b'{"do":', b" ", b'"x"}'))
        client.socket.sendall(bytes([first[0] | 1]) + first[1:] + b"".join(middle))
        client.socket.sendall(bytes([last[0] | 0x80]) + last[1:])
        assert "there is no command" in message(client, "error")["text"]


def test_parts_without_an_end_are_refused(server: Server, key: str) -> None:
    """Empty parts of a message cost nothing to send, and each would take memory."""
    with opened(server, key) as client:
        client.socket.sendall(raw_frame(1, b"{", False) + raw_frame(0, b"", False) * 100)
        assert closed_with(client) == 1008
    wait_for(lambda: not server._viewers)


def test_pings_whose_answers_nobody_reads_are_refused(server: Server, key: str) -> None:
    with opened(server, key) as client:
        message(client, "wheel")
        with contextlib.suppress(OSError):
            for _ in range(100):
                client.socket.sendall(raw_frame(9, b"x" * 125) * 1000)
        assert closed_with(client) in (1008, None)
    wait_for(lambda: not server._viewers)


def test_text_that_is_no_utf_8_ends_the_socket(server: Server, key: str) -> None:
    with opened(server, key) as client:
        client.socket.sendall(raw_frame(1, b"\xff\xfe{}"))
        assert closed_with(client) == 1007
    assert ask(server, "/", f"Cookie: {key}")[0] == 200


@pytest.mark.parametrize(
    "sent",
    [
        b"\xf1\x80" + bytes(4),  # reserved bits
        b"\x83\x80" + bytes(4),  # a reserved opcode
        raw_frame(0, b"x"),  # a part of nothing
        b"\x81\x01x",  # no mask
        b"\x89\xfe\x00\x80" + bytes(4 + 128),  # a ping that is too long
    ],
)
def test_what_breaks_the_protocol_ends_the_socket(server: Server, key: str, sent: bytes) -> None:
    with opened(server, key) as client:
        client.socket.sendall(sent)
        assert closed_with(client) == 1002
    assert ask(server, "/", f"Cookie: {key}")[0] == 200


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    """A server that waits less than a second for anybody."""
    monkeypatch.setattr(serving, "HELLO_SECONDS", 0.4)
    monkeypatch.setattr(serving, "PING_SECONDS", 0.3)
    made = Server()
    made.show(Recorder())  # type: ignore[arg-type]
    yield made
    made.close()


def test_who_says_nothing_is_left(hasty: Server) -> None:
    with socket.create_connection((hasty.host, hasty.port), timeout=10) as silent:
        with socket.create_connection((hasty.host, hasty.port), timeout=10) as slow:
            slow.sendall(b"GET / HTTP/1.1\r\nHost:")
            assert slow.recv(1) == b""
        assert silent.recv(1) == b""
    wait_for(lambda: not hasty._strangers)


def test_who_answers_no_ping_is_left(hasty: Server) -> None:
    """A socket whose other end is gone without a word, as a phone's out of reach."""
    key = cookie(hasty)
    head = (
        f"GET {hasty.access.room}socket HTTP/1.1\r\nHost: 127.0.0.1:{hasty.port}\r\n"
        f"Origin: http://127.0.0.1:{hasty.port}\r\nCookie: {key}\r\nConnection: Upgrade\r\n"
        "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
    with socket.create_connection((hasty.host, hasty.port), timeout=10) as gone:
        gone.sendall(head.encode())
        assert gone.recv(65536).startswith(b"HTTP/1.1 101")
        wait_for(lambda: hasty._viewers)
        wait_for(lambda: not hasty._viewers)


def test_many_strangers_keep_nobody_out(server: Server, key: str) -> None:
    """The one that waits for longest is dropped; viewers are no strangers."""
    with contextlib.ExitStack() as all_of_them, opened(server, key) as viewer:
        message(viewer, "wheel")
        for _ in range(3 * serving.MOST_STRANGERS):
            all_of_them.enter_context(
                socket.create_connection((server.host, server.port), timeout=10)
            )
            assert len(server._strangers) <= serving.MOST_STRANGERS
        assert ask(server, "/", f"Cookie: {key}")[0] == 200
        with opened(server, key) as another:
            assert message(another, "wheel")["viewers"] == 2
        do(viewer, "invite")
        message(viewer, "invitation")


def test_what_goes_wrong_in_the_server_is_an_answer(
    server: Server, key: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("a fault\nof two lines in /home/somebody/secret.py")

    with opened(server, key) as client:
        monkeypatch.setattr(server.session, "post", broken)
        do(client, "pause", paused=True)
        assert message(client, "error")["text"] == "a fault of clpt (RuntimeError)"
        monkeypatch.undo()
        do(client, "pause", paused=True)
        wait_for(lambda: server.session.requests)  # type: ignore[union-attr]
    monkeypatch.setattr(server.session, "state", broken)
    for _ in range(MOST_VIEWERS + 1):  # a viewer that could not be welcomed takes no place
        with opened(server, key) as client:
            assert closed_with(client) == 1011
    wait_for(lambda: not server._viewers)


def test_one_steers(server: Server, key: str) -> None:
    with opened(server, key) as first:
        assert message(first, "wheel")["steers"]
        with opened(server, key) as second:
            assert not message(second, "wheel")["steers"]
            do(second, "orbit", dx=1.0, dy=0.0)
            assert "another viewer steers" in message(second, "error")["text"]
            assert server.session.requests == []  # type: ignore[union-attr]
            do(second, "steer")
            assert message(second, "wheel")["steers"]
            do(first, "orbit", dx=1.0, dy=0.0)
            assert "another viewer steers" in message(first, "error")["text"]
        while not message(first, "wheel")["steers"]:  # the second has left
            pass


def test_a_slow_viewer_gets_the_newest_of_few_frames(server: Server, key: str) -> None:
    with opened(server, key) as slow, opened(server, key) as quick:
        message(slow, "wheel"), message(quick, "wheel")
        for number in range(1, 101):
            server.picture({"frame": number}, b"x" * 100_000)
            if number % 10 == 0:
                got = frame(quick)
                while got < number:  # what it has not confirmed in time is left out
                    do(quick, "shown", frame=got)
                    got = frame(quick)
                do(quick, "shown", frame=got)
        first, *rest = [frame(slow) for _ in range(MOST_FRAMES)]
        with pytest.raises(TimeoutError):
            frame(slow, timeout=0.3)
        do(slow, "shown", frame=max([first, *rest]))
        assert frame(slow) == 100


def test_a_viewer_who_reads_nothing_is_left(
    server: Server, key: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of what is true only now one message waits, and one frame; after a while it is left."""
    monkeypatch.setattr(serving, "SEND_SECONDS", 0.5)
    with opened(server, key) as client:
        message(client, "wheel")
        most, viewer = 0, server._viewers[0]
        for number in range(1, 1000):  # more than any buffer on the way holds
            server.picture({"frame": number}, b"x" * 1_000_000)
            for kind in serving.PRESENT:
                server.message({"type": kind, "text": "x" * 100_000})
            most = max(most, len(viewer.messages))
            if not server._viewers:
                break
            time.sleep(0.005)
        wait_for(lambda: not server._viewers)
        assert most <= len(serving.PRESENT) + 1


def test_a_viewer_who_reads_no_answers_is_left(server: Server, key: str) -> None:
    with opened(server, key) as client:
        message(client, "wheel")
        for _ in range(1000):
            server.message({"type": "note", "text": "x" * 100_000})
        wait_for(lambda: not server._viewers)


def test_ten_thousand_random_messages(
    server: Server, key: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each gets a refusal or is a command; the server lives, and the last one is served."""
    for name in ("RATE", "BURST", "FRAME_RATE", "FRAME_BURST"):
        monkeypatch.setattr(serving, name, 1e9)
    monkeypatch.setattr(serving, "MOST_MESSAGES", 1 << 30)
    chance = random.Random(2)
    with opened(server, key) as client:
        refused = 0
        for i in range(10_000):
            client.send(random_message(chance))
            if i % 100 == 99:
                do(client, "nothing", last=i)
                while "nothing" not in message(client, "error")["text"]:
                    refused += 1
        do(client, "pause", paused=True)
        wait_for(lambda: server.session.requests)  # type: ignore[union-attr]
        assert refused > 5000


NAMES = [
    "orbit",
    "pan",
    "display",
    "pause",
    "shown",
    "steer",
    "edit",
    "save",
    "__class__",
    "",
    "do",
]
KEYS = [
    "dx",
    "dy",
    "by",
    "exposure",
    "tone",
    "paused",
    "frame",
    "value",
    "name",
    "__init__",
    "file",
]


def random_value(chance: random.Random, levels: int = 3) -> object:
    kinds = ["number", "text", "none", "flag", "whole"] + ["list", "object"] * (levels > 0)
    kind = chance.choice(kinds)
    if kind == "number":
        return chance.choice([chance.uniform(-30, 30), float("nan"), float("inf"), 1e308, -0.0])
    if kind == "text":
        return "".join(map(chr, chance.choices(range(1, 0xD800), k=chance.randrange(20))))
    if kind == "whole":
        return chance.choice([0, -1, 2**31, 2**64, 10**400, chance.randrange(100)])
    if kind == "list":
        return [random_value(chance, levels - 1) for _ in range(chance.randrange(4))]
    if kind == "object":
        return {
            chance.choice(KEYS): random_value(chance, levels - 1)
            for _ in range(chance.randrange(4))
        }
    return {"none": None, "flag": chance.random() < 0.5}[kind]


def random_message(chance: random.Random) -> str | bytes:
    """Bytes, broken text, JSON of any shape, or commands with wrong values."""
    kind = chance.randrange(8)
    if kind == 0:
        return chance.randbytes(chance.randrange(200))
    if kind == 1:
        return "".join(map(chr, chance.choices(range(1, 0xD800), k=chance.randrange(100))))
    if kind == 2:
        return chance.choice(["[" * 30_000, "{" * 30_000, '{"do":' * 9_000, "1" * 60_000])
    if kind == 3:
        return json.dumps(random_value(chance))
    pairs = {chance.choice(KEYS): random_value(chance) for _ in range(chance.randrange(4))}
    return json.dumps({"do": chance.choice(NAMES), **pairs})
