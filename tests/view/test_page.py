"""The page in a browser: Chromium by Playwright, without WebGL. Skipped where either is missing."""

from __future__ import annotations

import base64
import contextlib
import dataclasses
import http.server
import io
import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from clpt import device, load, spectra
from clpt.errors import ClptError
from clpt.render.renderer import Renderer
from clpt.scene import KINDS, Scene, materials, shapes
from clpt.scene.lights import ON_SHAPES
from clpt.view import panels
from clpt.view.saving import Folder
from clpt.view.server import Server
from clpt.view.session import Session
from tests.view.browsers import launched

CORNELL = Path(__file__).resolve().parents[2] / "scenes" / "cornell_box"
WAIT = 60_000  # [ms] at most, for kernels that are compiled on a busy machine
PIXELS = "() => clpt.picture.now.toDataURL('image/png')"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with launched() as opened:
        yield opened


def small() -> Scene:
    scene = load(CORNELL)
    film = dataclasses.replace(scene.film, width=64, height=48, mode="rgb")
    return dataclasses.replace(scene, film=film, spp=4)


@pytest.fixture(scope="module")
def on() -> device.Device:
    return device.choose()


def wait(page: Any, expression: str) -> None:
    """Wait until an expression is true; the page's policy forbids to evaluate text inside it."""
    end = time.monotonic() + WAIT / 1000
    while not page.evaluate(f"() => ({expression})"):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(20)


class Shown:
    """A session, its server, and a page that shows it."""

    def __init__(self, browser: Any, on: device.Device, scene: Scene | None = None, **how: Any):
        self.browser, self.server = browser, Server()
        self.session = Session(scene or small(), on, self.server, **how)
        self.server.show(self.session)
        self.session.start()
        self.contexts: list[Any] = []
        self.requests: list[str] = []
        self.errors: list[str] = []
        self.page = self.open(self.server.address)
        self.rest()

    def open(self, address: str, **how: Any) -> Any:
        context = self.browser.new_context(viewport={"width": 1000, "height": 640}, **how)
        self.contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(WAIT)
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", self.note)
        page.goto(address)
        wait(page, "window.clpt && clpt.picture.latest > 0")
        return page

    def note(self, line: Any) -> None:
        """Keep what the page complains of."""
        if line.type == "error":
            self.errors.append(line.text)

    def rest(self, after: int = 0) -> int:
        """Wait for a final picture after a frame; return its number."""
        wait(self.page, f"clpt.picture.header.rest && clpt.picture.latest > {after}")
        return self.page.evaluate("clpt.picture.latest")

    def pixels(self) -> np.ndarray:
        """What the page's canvas holds, (h, w, 3) uint8."""
        png = base64.b64decode(self.page.evaluate(PIXELS).split(",")[1])
        return np.asarray(Image.open(io.BytesIO(png)))[..., :3]

    def close(self) -> None:
        for context in self.contexts:
            context.close()
        self.session.close()
        self.server.close()


@pytest.fixture
def shown(browser: Any, on: device.Device) -> Iterator[Shown]:
    made = Shown(browser, on)
    yield made
    made.close()
    check(made)


def check(made: Shown) -> None:
    """Assert that a page complained of nothing, and asked its own server alone."""
    assert made.errors == []
    assert all(url.startswith(("http://127.0.0.1:", "ws://127.0.0.1:")) for url in made.requests)


def picture(session: Session, on: device.Device) -> np.ndarray:
    """What a new renderer makes of the session's scene."""
    with Renderer(session.scene, on) as renderer:
        renderer.run(session.scene.spp)
        return renderer.resolve().get()[..., :3]


def drag(page: Any, dx: float, dy: float, **how: Any) -> None:
    box = page.locator("#picture").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down(**how)
    for i in range(1, 5):
        page.mouse.move(x + dx * i / 4, y + dy * i / 4)
    page.mouse.up(**how)


def test_what_is_seen_equals_resolve(shown: Shown, on: device.Device) -> None:
    """At rest the canvas has the bytes of `resolve`, before and after a drag and a key."""
    assert np.array_equal(shown.pixels(), picture(shown.session, on))
    before = shown.page.evaluate("clpt.picture.latest")
    camera = shown.session.scene.camera
    drag(shown.page, 120, 30)
    shown.rest(before)
    assert shown.session.scene.camera is not camera
    shown.page.wait_for_timeout(300)
    shown.rest()
    assert np.array_equal(shown.pixels(), picture(shown.session, on))
    shown.page.keyboard.press("h")
    wait(shown.page, "!clpt.state.edited && clpt.picture.header.rest")
    assert shown.page.evaluate("document.location.search") == ""


def test_panels_change_the_scene(shown: Shown, on: device.Device) -> None:
    page = shown.page
    page.click("#tab-scene")
    page.click("summary:has-text('red')")
    field = page.locator("input[type=color][aria-label=reflectance]")
    before = page.evaluate("clpt.picture.latest")
    field.evaluate("(e) => { e.value = '#2040c0'; e.dispatchEvent(new Event('input')); }")
    shown.rest(before)
    materials = {shape.material.name: shape.material for shape in shown.session.scene.shapes}
    red = materials["red"].reflectance
    assert red.b > 0.5 > 0.1 > red.r
    assert np.array_equal(shown.pixels(), picture(shown.session, on))
    before = page.evaluate("clpt.picture.latest")
    page.click("summary:has-text('Objects')")
    page.click("label:has-text('large box')")
    shown.rest(before)
    assert len(shown.session.look.hidden) == 1
    page.click("#tab-view")
    page.select_option("select[aria-label='tone curve']", '"aces"')
    wait(page, "clpt.picture.header.rest")
    page.click("#tab-render")
    page.wait_for_selector("text=rays/s")


def of_all_kinds() -> Scene:
    """A scene of every kind of material and light that its defaults make."""
    scene, made = small(), {}
    for category in ("material", "light"):
        for cls in KINDS[category]:
            with contextlib.suppress(ClptError, TypeError):
                made.setdefault(category, []).append(cls())
    table = spectra.Tabulated(tuple(range(400, 701, 2)), (0.5,) * 151)
    made["material"] += [materials.Diffuse(reflectance=value) for value in (0.5, table, (1, 0, 0))]
    cubes = [shapes.Cube(material=material) for material in made["material"]]
    placed = [light for light in made["light"] if not isinstance(light, ON_SHAPES)]
    return dataclasses.replace(scene, shapes=cubes, lights=placed)


def test_every_kind_has_a_panel(shown: Shown) -> None:
    """All panels of a scene of all kinds open without an error; each parameter has its row."""
    page, scene = shown.page, of_all_kinds()
    described = panels.panels(scene)
    assert {one["kind"] for one in described} >= {"principled", "point", "rough_conductor"}
    shown.server.message({**shown.session.state(), "panels": described, "name": "all kinds"})
    wait(page, "document.title.startsWith('all kinds')")
    page.click("#tab-scene")
    page.evaluate(
        "document.querySelectorAll('#pane-scene details').forEach((one) => { one.open = true; })"
    )
    page.wait_for_timeout(200)
    rows = page.evaluate("document.querySelectorAll('#pane-scene .row').length")
    wanted = [one for one in described if one["target"] not in ("film",)]
    assert rows >= sum(len(one["parameters"]) for one in wanted)


def test_the_inspector_shows_the_values_of_the_picture(shown: Shown) -> None:
    page = shown.page
    box = page.locator("#picture").bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 0.8 * box["height"])
    page.wait_for_selector("#pane-pixel dt:has-text('material')")
    at = page.evaluate("clpt.inspector.at")
    told = page.evaluate("clpt.inspector.found.value")
    film = shown.session._loop.film
    assert film is not None
    assert told["rgb"] == pytest.approx(film[at["y"], at["x"], :3].tolist(), rel=1e-6)
    assert str(told["samples"]) in page.inner_text("#pane-pixel")
    name = page.inner_text("#pane-pixel .link")
    page.click("#pane-pixel .link")  # leads to the panel of the material
    page.wait_for_selector(f"#pane-scene details.inner[open] summary:has-text('{name}')")


def test_maps_are_chosen_and_have_a_legend(shown: Shown) -> None:
    page = shown.page
    page.click("#tab-view")
    page.select_option("select[aria-label='show']", '"samples"')
    page.wait_for_selector("#legend:not([hidden]) >> text=4 samples")
    page.keyboard.press("Tab")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("m")
    page.wait_for_selector("#legend >> text=100 % error")
    page.select_option("select[aria-label='show']", '"picture"')
    page.wait_for_selector("#legend", state="hidden")


def test_buttons_undo_size_and_files(shown: Shown, on: device.Device, tmp_path: Path) -> None:
    """Undo by the key that people know, another size, a picture for the browser."""
    page = shown.page
    page.click("#tools >> text=Hide")
    page.wait_for_selector("#hint >> text=click what to hide")
    before = page.evaluate("clpt.picture.latest")
    page.mouse.click(*_middle(page))
    before = shown.rest(before)
    assert page.evaluate("clpt.state.look.hidden.length") == 1
    page.keyboard.press("Control+z")
    shown.rest(before)
    wait(page, "clpt.state.look.hidden.length === 0")
    page.click("#tab-render")
    page.fill("input[aria-label='size 1']", "40")
    page.keyboard.press("Enter")
    wait(page, "clpt.picture.header.rest && clpt.picture.film[0] === 40")
    assert np.array_equal(shown.pixels(), picture(shown.session, on))
    shown.session.folder = Folder(tmp_path, "room", lambda *_: None)
    page.keyboard.press("Tab")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("g")
    page.wait_for_selector("#notes >> text=saving .png")
    with page.expect_download() as download:
        page.click("#notes >> text=download it")
    assert download.value.suggested_filename == "room-001.png"
    ours, theirs = (np.asarray(Image.open(path))[..., :3] for path in
                    (tmp_path / "room-001.png", download.value.path()))  # fmt: skip
    assert np.array_equal(ours, theirs)


def _middle(page: Any) -> tuple[float, float]:
    box = page.locator("#picture").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_a_view_that_is_pasted_opens(shown: Shown, on: device.Device) -> None:
    page = shown.page
    camera = panels.written(small().camera) | {"fov": 80.0}
    text = json.dumps({"camera": camera, "display": {"exposure": 0.5, "tone": "aces"}})
    before = page.evaluate("clpt.picture.latest")
    paste = """(text) => {
        const data = new DataTransfer();
        data.setData("text", text);
        document.body.dispatchEvent(
            new ClipboardEvent("paste", { clipboardData: data, bubbles: true }));
    }"""
    page.evaluate(paste, text)
    shown.rest(before)
    assert shown.session.scene.camera.fov == 80.0
    assert page.evaluate("clpt.state.display.tone") == "aces"
    page.evaluate(paste, "no view")
    page.wait_for_selector("text=That is no view.")


def test_keys_are_told_and_the_phone_fits(shown: Shown) -> None:
    page = shown.page
    page.keyboard.press("?")
    page.wait_for_selector("dialog[open] >> text=orbit about the pivot")
    page.keyboard.press("Escape")
    phone = shown.open(shown.server.address, has_touch=True)
    phone.set_viewport_size({"width": 360, "height": 640})
    phone.wait_for_timeout(100)
    assert phone.evaluate("document.documentElement.scrollWidth") <= 360
    for selector in ("#picture", "#side", "header"):
        box = phone.locator(selector).bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= 360
        assert box["y"] >= 0 and box["y"] + box["height"] <= 640


def test_two_viewers_and_a_lost_socket(shown: Shown) -> None:
    other = shown.open(shown.server.address)
    other.wait_for_selector("#steer")
    other.click("#steer")
    shown.page.wait_for_selector("#steer")
    shown.errors.clear()
    before = other.evaluate("clpt.picture.latest")
    drag(other, 60, 0)
    number = shown.rest(before)
    wait(other, f"clpt.picture.header.rest && clpt.picture.latest >= {number}")
    last = other.evaluate("clpt.picture.latest")  # each viewer gets a picture in its own time
    wait(shown.page, f"clpt.picture.header.rest && clpt.picture.latest >= {last}")
    assert np.array_equal(shown.pixels(), np.asarray(_decoded(other.evaluate(PIXELS))))
    shown.page.evaluate("clpt.connection.socket.close()")  # it comes back by itself
    wait(shown.page, "clpt.connection.socket.readyState === 1")
    for context in shown.contexts:
        context.close()
    end = time.monotonic() + 1.0
    while shown.session._viewers and time.monotonic() < end:
        time.sleep(0.02)
    assert shown.session._viewers == 0
    shown.contexts.clear()


def _decoded(address: str) -> Any:
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(address.split(",")[1]))))[..., :3]


def test_a_page_elsewhere_reaches_nothing(shown: Shown) -> None:
    """In the same browser, with the cookie there: no socket, no frame, no reading."""
    page = shown.contexts[0].new_page()
    own = f"127.0.0.1:{shown.server.port}"
    html = {"body": "<p>", "content_type": "text/html"}
    page.route("http://evil.test/**", lambda route: route.fulfill(**html))
    page.goto("http://evil.test/")
    socket = """(address) => new Promise((done) => {
        const socket = new WebSocket(address);
        socket.onopen = () => done('open');
        socket.onerror = () => done('refused');
    })"""
    own += shown.server.access.room  # let it be known
    assert page.evaluate(socket, f"ws://{own}socket") == "refused"
    read = """(address) => fetch(address, {credentials: 'include'})
        .then(() => 'read', () => 'refused')"""
    assert page.evaluate(read, f"http://{own}") == "refused"
    inside = """(address) => {
        const frame = document.createElement('iframe');
        frame.src = address;
        document.body.append(frame);
    }"""
    page.evaluate(inside, f"http://{own}")
    page.wait_for_timeout(300)
    assert all("clpt" not in (frame.title() or "") for frame in page.frames)
    shown.errors.clear()
    page.close()


EVIL = (
    "<img src=x onerror=window.hacked=1>",
    "</script><script>window.hacked=1</script>",
    '"><svg onload=window.hacked=1>',
    "'\"`;window.hacked=1;//${window.hacked=1}",
    "javascript:window.hacked=1",
    "<iframe srcdoc='<script>parent.hacked=1</script>'>",
    "<style>*{display:none}</style><b>",
    "\u202eexe.\u2066gnp\u200f<b>",
    "a\0b\x1b[2J<b>\n<b>",
    "<b>" * 30_000,
)


def with_names(scene: Scene, names: tuple[str, ...]) -> Scene:
    """Return a scene whose shapes and materials have these names in turn, and their sum itself."""
    made: dict[int, Any] = {}
    named = []
    for i, shape in enumerate([*scene.shapes, *scene.shapes]):
        material = shape.material
        name = names[len(made) % len(names)]
        material = made.setdefault(id(material), dataclasses.replace(material, name=name))
        named.append(dataclasses.replace(shape, name=names[i % len(names)], material=material))
    return dataclasses.replace(scene, shapes=named, name=" ".join(names))


def test_names_are_text_and_nothing_else(browser: Any, on: device.Device, tmp_path: Path) -> None:
    """Of scenes, shapes, materials and files, in all tabs, notes and titles: no markup is made."""
    scene = with_names(small(), EVIL)
    folder = Folder(tmp_path, EVIL[0], lambda *_: None)
    shown = Shown(browser, on, scene, folder=folder)
    page = shown.page
    try:
        elements = "() => ['img', 'iframe', 'script', 'b', 'style', 'svg'].map("
        elements += "(one) => document.querySelectorAll(one).length)"
        assert page.evaluate(elements) == [0, 0, 1, 0, 0, 0]
        assert page.title().startswith("<img src=x onerror=") and len(page.title()) < 100
        page.click("#tab-scene")
        page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
        page.wait_for_timeout(200)
        text = page.inner_text("#pane-scene")
        for name in (*EVIL[:7], "?exe.?gnp?<b>", "a?b?[2J<b>?<b>", "<b>" * 25 + "<b..."):
            assert name in text, name
        assert max(map(len, text.splitlines())) < 400
        page.click("#tab-pixel")
        box = page.locator("#picture").bounding_box()
        for share in (0.1, 0.5, 0.9):
            page.mouse.click(box["x"] + box["width"] / 2, box["y"] + share * box["height"])
            page.wait_for_selector("#pane-pixel dt:has-text('material')")
        page.click("#tab-render")
        page.click("button:has-text('.png')")
        page.wait_for_selector("#notes >> text=saved img_src_x_onerror_window_hacked_1-001.png")
        for name in EVIL[:6]:
            page.evaluate("(name) => clpt.connection.send(name)", name)
            page.evaluate("(name) => clpt.connection.send('shows', {name})", name)
            page.wait_for_selector("#notes li.error")
        shown.server.message({"type": "error", "text": EVIL[0]})
        shown.server.message({"type": "note", "text": EVIL[1]})
        page.wait_for_selector("#notes >> text=<img src=x")
        page.wait_for_timeout(300)
        assert page.evaluate("window.hacked === undefined")
        assert page.evaluate(elements)[:5] == [0, 0, 1, shown_bold(page), 0]
        assert str(tmp_path) not in page.content()
    finally:
        shown.close()
    check(shown)


def shown_bold(page: Any) -> int:
    """How many elements `b` the inspector itself makes, for the pixel's place."""
    return page.evaluate("document.querySelectorAll('#pane-pixel .at b').length")


def test_text_cannot_become_markup(shown: Shown) -> None:
    """The page's policy refuses what would make markup of text, and scripts but its own."""
    tries = """() => [
        () => { document.body.innerHTML = '<i>x</i>'; },
        () => { document.write('<i>x</i>'); },
        () => { new DOMParser().parseFromString('<i>x</i>', 'text/html'); },
        () => { document.createElement('script').src = 'x.js'; },
        () => { setTimeout('window.hacked = 1'); },
        () => { trustedTypes.createPolicy('mine', {}); },
    ].map((one) => { try { one(); return 'done'; } catch { return 'refused'; } })"""
    assert shown.page.evaluate(tries) == ["refused"] * 6
    inline = """() => {
        const element = document.createElement('a');
        element.setAttribute('onclick', 'window.hacked = 1');
        document.body.append(element);
        element.click();
        element.remove();
        return window.hacked === undefined;
    }"""
    with contextlib.suppress(Exception):  # it may be refused already
        assert shown.page.evaluate(inline)
    assert shown.page.evaluate("window.hacked === undefined")
    shown.errors.clear()  # the browser tells of each


def test_a_stranger_on_another_port_gets_no_cookie(shown: Shown) -> None:
    """Browsers send cookies to all ports of a host; those of the page are of its folder alone."""
    heard: list[Any] = []

    class Stranger(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            heard.append(dict(self.headers.items()))
            self.send_response(200)
            self.end_headers()
            self.wfile.write(b"<p>")

        def log_message(self, *_: Any) -> None:
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Stranger) as stranger:
        threading.Thread(target=stranger.serve_forever, daemon=True).start()
        page = shown.contexts[0].new_page()
        page.goto(f"http://127.0.0.1:{stranger.server_port}/")
        page.evaluate("() => fetch('/x', {credentials: 'include'})")
        page.close()
        shown.page.evaluate(
            "(url) => { window.open(url); }", f"http://127.0.0.1:{stranger.server_port}/y"
        )
        end = time.monotonic() + 20
        while len(heard) < 3 and time.monotonic() < end:
            shown.page.wait_for_timeout(50)
        stranger.shutdown()
    assert len(heard) >= 3
    told = json.dumps(heard)
    assert "Cookie" not in told and shown.server.access.room not in told
    assert str(shown.server.port) not in told
    assert shown.page.evaluate("clpt.connection.socket.readyState") == 1
    shown.requests[:] = [url for url in shown.requests if "/y" not in url]


def test_the_page_is_loaded_again(shown: Shown) -> None:
    """By its address without the token, in the same browser; the token stands nowhere then."""
    page = shown.page
    assert "token" not in page.url and page.evaluate("document.referrer") == ""
    page.reload()
    wait(page, "window.clpt && clpt.picture.latest > 0")
    assert "token" not in page.url
    page.wait_for_selector("#phase >> text=done")  # nothing happens any more that would tell it
