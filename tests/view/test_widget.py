"""The widget of notebooks: by itself, in a notebook that runs, and its module in a browser."""

from __future__ import annotations

import base64
import dataclasses
import io
import queue
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from clpt import Renderer, device, load
from clpt.errors import ClptError
from clpt.scene import Scene

pytest.importorskip("anywidget", reason="the extra clpt[notebook] is not installed")

from clpt.view.widget import Widget, joined

CORNELL = Path(__file__).resolve().parents[2] / "scenes" / "cornell_box"
WAIT = 120.0  # [s] at most, for kernels that are compiled on a busy machine
CELLS = (
    f"""
import dataclasses
import clpt
scene = clpt.load({str(CORNELL)!r})
film = dataclasses.replace(scene.film, width=32, height=24, mode="rgb")
renderer = clpt.Renderer(dataclasses.replace(scene, film=film, spp=4))
widget = renderer.widget()
widget""",
    "widget.snapshot()",
    "widget.stop()\nwidget.scene.camera == scene.camera",
)


def small() -> Scene:
    scene = load(CORNELL)
    film = dataclasses.replace(scene.film, width=32, height=24, mode="rgb")
    return dataclasses.replace(scene, film=film, spp=4)


@pytest.fixture(scope="module")
def on() -> device.Device:
    return device.choose()


@pytest.fixture
def widget(on: device.Device) -> Iterator[Widget]:
    """A widget whose messages to the notebook are in `widget.sent`."""
    sent: queue.Queue[tuple[dict[str, Any], list[bytes]]] = queue.Queue()

    class Recorded(Widget):
        def send(self, content: Any, buffers: Any = None) -> None:
            sent.put((content, buffers or []))

    made = Recorded(small(), on)
    made.sent = sent  # type: ignore[attr-defined]
    yield made
    made.stop()


def picture(scene: Scene, on: device.Device) -> np.ndarray:
    with Renderer(scene, on) as renderer:
        renderer.run(scene.spp)
        return renderer.resolve().get()[..., :3]


def decoded(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def until(widget: Any, true: Callable[[dict[str, Any]], Any]) -> tuple[dict[str, Any], Any]:
    """The next message of which something is true; frames are confirmed."""
    while True:
        content, buffers = widget.sent.get(timeout=WAIT)
        if content["type"] == "frame":
            do(widget, "shown", frame=content["header"]["frame"])
        if true(content):
            return content, buffers


def at_rest(content: dict[str, Any]) -> bool:
    return content["type"] == "frame" and content["header"]["rest"]


def do(widget: Widget, name: str, **values: Any) -> None:
    """Ask as a view in a notebook does."""
    widget._handle_custom_msg({"do": name, **values}, [])


def test_it_is_steered_and_keeps_its_picture(widget: Any, on: device.Device) -> None:
    do(widget, "watch", watching=True)
    _, (png,) = until(widget, at_rest)
    assert np.array_equal(decoded(png), picture(small(), on))
    do(widget, "orbit", dx=0.1, dy=0.0)
    _, (png,) = until(widget, at_rest)
    assert widget.scene.camera != small().camera
    turned = picture(widget.scene, on)
    assert np.array_equal(decoded(png), turned)
    data = widget._repr_mimebundle_()[0]
    assert "application/vnd.jupyter.widget-view+json" in data
    kept = data["image/png"]
    kept = kept if isinstance(kept, bytes) else base64.b64decode(kept)
    assert np.array_equal(decoded(kept), turned)
    do(widget, "stop")
    until(widget, lambda content: content["type"] == "stopped")
    assert np.array_equal(decoded(widget.snapshot().data), turned)


def test_what_is_no_command_is_told(widget: Any) -> None:
    for wrong in ({"do": "open", "path": "/"}, {"do": "orbit", "dx": 1e9, "dy": 0.0}, {}, 3):
        widget._handle_custom_msg(wrong, [])
        until(widget, lambda content: content["type"] == "error")


def test_any_content_is_answered(widget: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """JSON of any shape, and faults of any sort: one line; then it is steered as before."""
    deep: Any = 0.0
    for _ in range(900):
        deep = [deep]
    where = {"do": "edit", "target": "material", "index": 0, "key": "reflectance"}
    view = {"do": "open_view", "exposure": 0, "tone": "none"}
    for wrong in (
        None, [], "x", 3, {"do": {}}, {"do": ["orbit"]},
        {"do": "orbit", "dx": float("nan"), "dy": 0},
        {**where, "value": deep}, {**where, "value": {"file": "/etc/passwd"}},
        {**where, "value": {"type": "bitmap", "image": "/etc/passwd"}},
        {**where, "value": [0] * 9999},
        {**view, "camera": {"type": "lens", "lens": "/etc/passwd"}},
        {**view, "camera": {"type": "perspective", "medium": "x"}}, {"do": "save", "what": "png"},
        {"do": "invite"}, {"do": "steer"},
    ):  # fmt: skip
        widget._handle_custom_msg(wrong, [])
        content, _ = until(widget, lambda content: content["type"] == "error")
        assert len(content["text"]) <= 300 and content["text"].isprintable()
        assert "/etc" not in content["text"] and "fault" not in content["text"]

    def broken(*_: Any) -> None:
        raise AttributeError("two\nlines")

    monkeypatch.setattr(widget, "_watch", broken)
    do(widget, "watch", watching=True)
    content, _ = until(widget, lambda content: content["type"] == "error")
    assert content["text"] == "a fault of clpt (AttributeError)"
    monkeypatch.undo()
    do(widget, "watch", watching=True)
    until(widget, at_rest)


def test_two_frames_at_most_wait_to_be_confirmed(widget: Any) -> None:
    do(widget, "watch", watching=True)
    for _ in range(6):
        do(widget, "orbit", dx=0.05, dy=0.0)
        time.sleep(0.2)
    frames = [one for one in list(widget.sent.queue) if one[0]["type"] == "frame"]
    assert 1 <= len(frames) <= 2
    until(widget, at_rest)


def test_without_the_extra_it_is_told(monkeypatch: pytest.MonkeyPatch, on: device.Device) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "anywidget", None)
    monkeypatch.delitem(sys.modules, "clpt.view.widget")
    with Renderer(small(), on) as renderer, pytest.raises(ClptError, match=r"clpt\[notebook\]"):
        renderer.widget()


@pytest.mark.slow
def test_a_notebook_keeps_the_picture(on: device.Device) -> None:
    pytest.importorskip("ipykernel", reason="there is no kernel of notebooks")
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed")
    import nbformat

    cells = [nbformat.v4.new_code_cell(cell) for cell in CELLS]
    notebook = nbformat.v4.new_notebook(cells=cells)
    client = nbclient.NotebookClient(notebook, timeout=WAIT, kernel_name="python3")
    client.execute()
    outputs = [cell["outputs"][-1]["data"] for cell in notebook.cells]
    assert "application/vnd.jupyter.widget-view+json" in outputs[0]
    for output in outputs[:2]:
        pixels = decoded(base64.b64decode(output["image/png"]))
        assert pixels.std() > 10.0  # a picture, no empty frame
    assert outputs[2]["text/plain"] == "True"


MODEL = """
() => {
  const heard = new Set();
  window.sent = [];
  window.model = {
    send: (content) => window.sent.push(content),
    on: (_, callback) => heard.add(callback),
    off: (_, callback) => heard.delete(callback),
  };
  window.tell = (content, base64) => {
    const bytes = base64 && Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    for (const callback of heard) callback(content, bytes ? [new DataView(bytes.buffer)] : []);
  };
}
"""
OPEN = """
async (text) => {
  const url = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  const module = await import(url);
  const el = document.body.appendChild(document.createElement("div"));
  window.leave = module.default.render({ model: window.model, el });
  window.view = el.clpt;
}
"""
PIXELS = "() => view.picture.now.toDataURL('image/png')"


def test_names_are_text_in_a_notebook_too() -> None:
    """What messages hold becomes no markup; a notebook has no policy that would stop it."""
    from tests.view.browsers import launched
    from tests.view.test_page import EVIL

    with launched() as browser:
        page = browser.new_page()
        page.goto("about:blank")
        page.evaluate(MODEL)
        page.evaluate(OPEN, joined())
        page.evaluate("() => { view.inspector.at = {x: 1, y: 1}; }")
        numbers = {"position": [0, 0, 0], "shading_normal": [0, 0, 1], "uv": [0, 0]}
        hit = {
            "type": "hit",
            "shape": 0,
            "primitive": 0,
            "depth": 1.0,
            "albedo": [1, 1, 1],
            **numbers,
        }
        for name in EVIL:
            named = {"object": {"name": name, "made_of": name, "material": None}}
            for content in (
                {"type": "error", "text": name},
                {"type": "value", "x": 1, "y": 1, "rgb": [1, 1, 1], "samples": 1},
                {**hit, "x": 1, "y": 1, **named},
                {"type": "status", "phase": name, "samples": 1, "spp": 1, "seconds": 1},
            ):
                page.evaluate("(content) => window.tell(content)", content)
        page.wait_for_timeout(200)
        assert page.evaluate("window.hacked === undefined")
        assert page.evaluate("document.querySelectorAll('img, iframe, script, style').length") == 0
        page.evaluate("(content) => window.tell(content)", {"type": "error", "text": EVIL[0]})
        assert EVIL[0] in page.evaluate("document.body.textContent")


def test_the_module_shows_and_steers_in_a_browser(widget: Any, on: device.Device) -> None:
    """The messages between the widget and its module in Chromium are carried by the test."""
    from tests.view.browsers import launched

    with launched() as browser:
        page = browser.new_page()
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto("about:blank")
        page.evaluate(MODEL)
        page.add_style_tag(content=widget._css)
        page.evaluate(OPEN, joined())

        def carry(until: str) -> None:
            end = time.monotonic() + WAIT
            while not page.evaluate(f"() => Boolean({until})"):
                assert time.monotonic() < end, until
                for content in page.evaluate("() => window.sent.splice(0)"):
                    widget._handle_custom_msg(content, [])
                while not widget.sent.empty():
                    content, buffers = widget.sent.get()
                    file = base64.b64encode(bytes(buffers[0])).decode() if buffers else None
                    page.evaluate(
                        "([content, file]) => window.tell(content, file)", [content, file]
                    )
                page.wait_for_timeout(10)

        rest = "view.picture.header?.rest && view.picture.latest > {}"
        carry(rest.format(0))
        shown = decoded(base64.b64decode(page.evaluate(PIXELS).split(",")[1]))
        assert np.array_equal(shown, picture(small(), on))
        before = page.evaluate("view.picture.latest")
        box = page.locator("canvas.picture").bounding_box()
        page.mouse.move(box["x"] + 10, box["y"] + 10)
        page.mouse.down()
        page.mouse.move(box["x"] + 20, box["y"] + 10, steps=4)
        page.mouse.up()
        page.wait_for_timeout(100)
        carry(rest.format(before))
        shown = decoded(base64.b64decode(page.evaluate(PIXELS).split(",")[1]))
        assert np.array_equal(shown, picture(widget.scene, on))
        assert not np.array_equal(shown, picture(small(), on))
        page.click("text=pixel")
        page.mouse.click(box["x"] + 16, box["y"] + 12)
        carry("view.inspector.found.value")
        page.evaluate("() => leave()")
        carry("true")
        assert {"do": "watch", "watching": False} in page.evaluate("() => window.sent")
        assert errors == []
