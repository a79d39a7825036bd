"""Films the live page, and takes its pictures, for README.md and docs/viewing.md.

`python -m docs.pictures.live_page` makes all; `film`, `checker` or `caustics` after it one part. It
needs Playwright and Chromium. A frame is taken when the page has its picture, so the film is the
same on a slow machine. What it shows: the first samples, an orbit, other colours, the denoised one.
"""

from __future__ import annotations

import io
import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image

import clpt
from clpt import device
from clpt.scene import Scene
from clpt.scene.materials import Conductor, Dielectric, RoughPlastic
from clpt.view import render_loop
from clpt.view.server import Server
from clpt.view.session import Session
from tests.view.browsers import launched

from .studio import knob, studio

FILE = Path(__file__).parent / "live_page.webp"
PAGE = {"width": 1120, "height": 640}  # [pixels]
SCENES = Path(__file__).parents[2] / "scenes"
DESKTOP = {"width": 1280, "height": 760}
SAMPLES = 16  # of a picture beside panels
LONGEST = 600.0  # until a picture comes, on a busy machine [s]
ORBIT, COLOURS = 16, ("#c8961e", "#2f9e44", "#7b2fbf")

Frame = tuple[Image.Image, int]  # and for how long it is shown [ms]


def main(names: list[str]) -> None:
    for name, part in (("film", film), ("checker", checker), ("caustics", caustics)):
        if not names or name in names:
            part()


@contextmanager
def shown(scene: Scene) -> Iterator[Callable[..., Any]]:
    """Yield what opens a page that shows the scene; it takes what a context of Playwright takes."""
    server = Server()
    session = Session(scene, device.choose(), server)
    server.show(session)
    session.start()
    try:
        with launched() as browser:

            def open_page(**how: Any) -> Any:
                page = browser.new_context(**how).new_page()
                page.set_default_timeout(1000.0 * LONGEST)
                page.goto(server.address)
                wait(page, "window.clpt && clpt.picture.latest > 0")
                return page

            yield open_page
    finally:
        session.close()
        server.close()


def film() -> None:
    render_loop.SLOW = math.inf  # previews as fine as on a machine that is free
    with shown(scene()) as open_page:
        page = open_page(viewport=PAGE)
        frames = [*first(page), *orbit(page), *colours(page), *denoised(page)]
    pictures, lengths = zip(*frames, strict=True)
    pictures[0].save(
        FILE,
        save_all=True,
        append_images=pictures[1:],
        duration=list(lengths),
        loop=0,
        quality=62,
        method=4,
    )
    print(f"{FILE.name}: {len(frames)} frames, {FILE.stat().st_size / 1e3:.0f} kB")


def checker() -> None:
    """A held pixel of the colour checker and its spectrum, on a desktop and on a phone."""
    phone = {"viewport": {"width": 390, "height": 800}, "is_mobile": True, "has_touch": True}
    with shown(clpt.load(SCENES / "color_checker")) as open_page:
        for name, how in (("view_pixel", {"viewport": DESKTOP}), ("view_phone", phone)):
            page = open_page(**how)
            box = page.locator("#picture").bounding_box()
            page.mouse.click(box["x"] + 0.43 * box["width"], box["y"] + 0.45 * box["height"])
            page.wait_for_selector("#pane-pixel dt:has-text('exact')")
            sampled(page)
            still(page, name)
            page.context.close()


def caustics() -> None:
    """The panel of a material, and the error that is left."""
    with shown(clpt.load(SCENES / "glass_caustics")) as open_page:
        page = open_page(viewport=DESKTOP)
        page.click("#tab-scene")
        page.click("summary:has-text('Camera')")
        page.click("summary:has-text('gold')")
        sampled(page)
        still(page, "view_scene")
        page.click("#tab-view")
        page.select_option("select[aria-label='show']", '"error"')
        page.wait_for_selector("#legend >> text=100 % error")
        still(page, "view_error")


def sampled(page: Any) -> None:
    """Wait until the picture is no longer grainy."""
    wait(page, f"clpt.picture.header.divider === 1 && clpt.picture.header.samples >= {SAMPLES}")


def still(page: Any, name: str) -> None:
    file = FILE.with_name(f"{name}.jpg")
    shot(page, 0)[0].save(file, quality=88)
    print(f"{file.name}: {file.stat().st_size / 1e3:.0f} kB", flush=True)


def scene() -> Scene:
    things = [
        knob(
            RoughPlastic(name="paint", diffuse_reflectance=(0.6, 0.1, 0.06), roughness=0.3), -1.42
        ),
        knob(Conductor(name="silver", metal="silver")),
        knob(Dielectric(name="glass"), 1.42),
    ]
    made = studio(things, size=(600, 400))
    made.name, made.spp = "three knobs", 16
    return made


def first(page: Any) -> list[Frame]:
    """The first samples, and the picture at rest."""
    frames = [shot(page, 500)]
    rest(page)
    return [*frames, shot(page, 900)]


def orbit(page: Any) -> list[Frame]:
    """Drag to the left and back, a new picture at each step."""
    box = page.locator("#picture").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    frames = []
    for step in range(1, ORBIT + 1):
        away = 14 * min(step, ORBIT - step)
        before = latest(page)
        page.mouse.move(x - away, y - away / 6)
        wait(page, f"clpt.picture.latest > {before}")
        frames.append(shot(page, 90))
    page.mouse.up()
    rest(page)
    return [*frames, shot(page, 700)]


def colours(page: Any) -> list[Frame]:
    """Open the panel of the paint, and give it other colours."""
    page.click("#tab-scene")
    page.click("summary:has-text('paint')")
    field = page.locator("input[type=color][aria-label='diffuse_reflectance']").first
    frames = [shot(page, 900)]
    for colour in COLOURS:
        before = latest(page)
        change = "(e, c) => { e.value = c; e.dispatchEvent(new Event('input')); }"
        field.evaluate(change, colour)
        wait(page, f"clpt.picture.latest > {before}")
        frames.append(shot(page, 300))
        rest(page, before)
        frames.append(shot(page, 600))
    return frames


def denoised(page: Any) -> list[Frame]:
    """Show the denoised picture."""
    page.click("#tab-view")
    frames = [shot(page, 700)]
    before = latest(page)
    page.select_option("select[aria-label='show']", '"denoised"')
    rest(page, before)
    return [*frames, shot(page, 2200)]


def shot(page: Any, shown: int) -> Frame:
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB"), shown


def latest(page: Any) -> int:
    return int(page.evaluate("clpt.picture.latest"))


def rest(page: Any, after: int = 0) -> None:
    """Wait for a final picture after a frame."""
    wait(page, f"clpt.picture.header.rest && clpt.picture.latest > {after}")


def wait(page: Any, expression: str) -> None:
    end = time.monotonic() + LONGEST
    while not page.evaluate(f"() => ({expression})"):
        if time.monotonic() > end:
            raise TimeoutError(expression)
        page.wait_for_timeout(20)


if __name__ == "__main__":
    main(sys.argv[1:])
