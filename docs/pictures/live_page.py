"""Films the live page for README.md and docs/viewing.md: `python -m docs.pictures.live_page`.

It needs Playwright and Chromium. A frame is taken when the page has its picture, so the film is the
same on a slow machine. What it shows: the first samples, an orbit, other colours, the denoised one.
"""

from __future__ import annotations

import io
import time
from pathlib import Path
from typing import Any

from PIL import Image

from clpt import device
from clpt.scene import Scene
from clpt.scene.materials import Conductor, Dielectric, RoughPlastic
from clpt.view.server import Server
from clpt.view.session import Session
from tests.view.browsers import launched

from .studio import knob, studio

FILE = Path(__file__).parent / "live_page.webp"
PAGE = {"width": 960, "height": 600}  # [pixels]
LONGEST = 600.0  # until a picture comes, on a busy machine [s]
ORBIT, COLOURS = 16, ("#c8961e", "#2f9e44", "#7b2fbf")

Frame = tuple[Image.Image, int]  # and for how long it is shown [ms]


def main() -> None:
    server = Server()
    session = Session(scene(), device.choose(), server)
    server.show(session)
    session.start()
    try:
        with launched() as browser:
            page = browser.new_page(viewport=PAGE)
            page.goto(server.address)
            frames = [*first(page), *orbit(page), *colours(page), *denoised(page)]
    finally:
        session.close()
        server.close()
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


def scene() -> Scene:
    things = [
        knob(
            RoughPlastic(name="paint", diffuse_reflectance=(0.6, 0.1, 0.06), roughness=0.3), -1.42
        ),
        knob(Conductor(name="silver", metal="silver")),
        knob(Dielectric(name="glass"), 1.42),
    ]
    made = studio(things, size=(480, 336))
    made.name, made.spp = "three knobs", 16
    return made


def first(page: Any) -> list[Frame]:
    """The first samples, and the picture at rest."""
    wait(page, "window.clpt && clpt.picture.latest > 0")
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
    page.select_option("select[aria-label='show']", '"denoised"')
    page.wait_for_timeout(1000)
    rest(page)
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
    main()
