"""The two renderers behind a page, of the whole picture and of smaller pictures, and their output.

While something moves, there is a smaller picture at every step. Then the whole picture
begins, in passes that grow, so that few ends of passes cost time; it is offered as often as
`Budget` lets it.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Bytes, Image
from clpt.device import Device
from clpt.render.film_renderer import maker_of
from clpt.render.progress import Progress
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.view import pictures
from clpt.view.beginning import Beginning
from clpt.view.messages import PREPARING
from clpt.view.pictures import Display
from clpt.view.target import Change, Make, Target, smaller

PREVIEW_PIXELS = 64_000  # about, of the picture while it moves
PREVIEW_SAMPLES = 4  # of it, before the whole picture begins
SLOW = 0.06  # [s] of two previews: slower previews become smaller
FAST_PREVIEWS = 4  # after them the next previews are finer, if these would be fast too
MUCH_FASTER = 0.5  # of SLOW: so that they do not become coarser at once
CANCEL_SECONDS = 0.1  # a pass ends within them when something moves
DIVIDERS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 128, 256)
PASS_SECONDS = 2.0  # of a pass; and more when the render has lasted, since ends of passes are dear
PASS_SHARE, LONGEST_PASS = 0.5, 10.0  # of the time so far, and [s]
STATUS_SECONDS = 0.25  # between messages of progress
BEGINNING_SECONDS = 0.02  # between looks at requests while kernels are compiled


class Outlet(Protocol):
    """Where pictures and messages go: to all viewers."""

    def picture(self, header: dict[str, Any], data: bytes) -> None:
        """Offer a picture; whoever is slow does without it."""

    def message(self, message: dict[str, Any]) -> None:
        """Tell all viewers something."""


class RenderLoop:
    """Renders a scene step by step.

    make: of the whole picture's renderer, called with the scene and options; by default it is a
    `Renderer` on the device, as that of smaller pictures always is. options: of renderers.

    A single thread calls its methods; any thread may call `cancel` and `close`.
    """

    def __init__(
        self,
        scene: Scene,
        device: Device,
        outlet: Outlet,
        display: Display,
        make: Make | None = None,
        **options: Any,
    ):
        self.scene, self.device, self.outlet = scene, device, outlet
        self.display = display
        self.shows = pictures.PICTURE  # or a map, or a layer of the film
        self.meanwhile: Callable[[], None] = lambda: None  # called while samples are taken
        self.paused = False
        self.watched = True
        self.has_shown = False  # the whole picture of the present scene
        self.kept: Image | None = None  # a picture to compare with
        self.seconds = 0.0  # of rendering the whole picture
        self._film: Image | None = None
        self._errors = pictures.ErrorMap()
        self._options = {"cancel_seconds": CANCEL_SECONDS, **options}
        self._divider = first_divider(scene)
        self._whole = self._make if make is None else partial(make, **self._options)
        self._limits: str | None = None  # the denoiser after which the limit of noise holds
        self._full = Target(self._make_whole, lambda scene: scene)
        self._preview = Target(self._make, smaller(self._divider))
        self._beginning: Beginning | None = None
        self._previews_left, self._begins = PREVIEW_SAMPLES, True
        self._stale = self._offered = False
        self._budget = pictures.Budget()
        self._frame = self._changes = 0
        self._solid_changes = -1  # of the last picture in plain colours
        self._asked: float | None = None  # when something was that restarts
        self._waited = self._samples = 0.0
        self._slow_previews = self._fast_previews = 0
        self._told = 0.0
        self.status: dict[str, Any] = PREPARING  # what viewers were told last
        self._rates = 0.0, 0.0
        self._closing = False

    def begin_solid(self) -> None:
        """Show the scene in plain colours while kernels of the first picture are compiled."""
        self._beginning = Beginning(self.device, self._make, self._preview.variant, self.scene)
        self._tell(PREPARING)

    def begin(self, scene: Scene, change: Change, denoise: str | None = None) -> None:
        """Render another scene from now on.

        denoise: the denoiser of the picture: a limit of noise is for the denoised picture.
        """
        limits = None if scene.noise is None else denoise
        if limits != self._limits:
            self._full.close()  # what a renderer keeps for it is decided when it is made
            self._limits = limits
        if (scene.film.width, scene.film.height) != (self.scene.film.width, self.scene.film.height):
            self._resize_preview(first_divider(scene))
        self.scene = scene
        self._full.note(change)
        self._preview.note(change)
        if self._beginning is not None:
            self._beginning.note(change)
        self._previews_left, self._begins = PREVIEW_SAMPLES, True
        self._film, self.has_shown = None, False
        self._errors = pictures.ErrorMap()
        self._changes += 1
        asked, self._asked = self._asked, None
        self._waited = 0.0 if asked is None else time.perf_counter() - asked

    @property
    def film(self) -> Image | None:
        """The whole picture so far, (h, w, 4) float32 as `Renderer.film`; None if there is none."""
        if self._film is None and self.has_shown:
            self._film = self.renderer().film.get()
        return self._film

    def show(self, display: Display, shows: str) -> None:
        """Show the picture in another way, or a map in its place."""
        self.display, self.shows, self._stale = display, shows, True

    def pixels(self) -> NDArray[np.uint8]:
        """Return the whole picture as it is shown, (h, w, 3 or 4) uint8."""
        return self._shown(self.renderer(), whole=True)[0]

    def advance(self) -> bool:
        """Do the next piece of work; return whether there was any.

        Raises what `Renderer` raises for a scene that it cannot render.
        """
        if self._beginning is not None:
            self._go_on_beginning(self._beginning)
        elif self._previews_left:
            self._previews_left -= 1
            self._render_preview()
        elif self._wants_samples():
            self._render_pass()
            discarded = self._begins
            if not discarded and (self._budget.due() or self._stale):
                self._offer(self._full.follow(self.scene), 1)
        elif self._stale or not self._offered:
            self._offer(self._full.follow(self.scene), 1, at_rest=True)
        else:
            return False
        return True

    def renderer(self) -> Renderer:
        """Return the renderer of the whole picture, of the present scene."""
        if self._beginning is not None:
            self._end_beginning(self._beginning)
        return self._full.follow(self.scene)

    def wants_more(self) -> None:
        """Note that the end of the render has moved."""
        self._offered = False

    def cancel(self, discard: bool = False) -> None:
        """Let a pass end soon; discard: the picture so far is of no use."""
        if self._asked is None:
            self._asked = time.perf_counter()
        self._full.cancel(discard)

    def forget_request(self) -> None:
        """Note that what was asked for restarts nothing."""
        self._asked = None

    def stop(self) -> None:
        """Let all work end soon, for good."""
        self._closing = True
        self._full.cancel()
        self._preview.cancel()

    def close(self) -> None:
        """Give the device's memory back."""
        if self._beginning is not None:
            self._beginning.close()
        self._full.close()
        self._preview.close()

    @property
    def done(self) -> bool:
        """Whether the whole picture has all the samples that it is to get."""
        renderer = self._full.renderer
        if renderer is None or self._begins:
            return False
        return renderer.samples >= self.scene.spp or renderer.active == 0.0

    def _wants_samples(self) -> bool:
        if not self.watched or self._closing:
            return False
        return self._begins or not (self.paused or self.done)

    def _go_on_beginning(self, beginning: Beginning) -> None:
        beginning.wait(BEGINNING_SECONDS)
        if beginning.is_over:
            self._end_beginning(beginning)
        elif self._solid_changes != self._changes:
            beginning.show(self.scene, self._offer_solid)

    def _end_beginning(self, beginning: Beginning) -> None:
        """Take over the renderer that was made beside. Raises what making it has raised."""
        self._beginning = None
        renderer = beginning.renderer()
        if beginning.variant is self._preview.variant:
            self._preview.renderer = renderer
        else:
            renderer.close()

    def _offer_solid(self, pixels: Bytes) -> None:
        self._solid_changes = self._changes
        self._send(pixels, self._divider, solid=True)

    def _render_preview(self) -> None:
        began = time.perf_counter()
        built = self._preview.is_slow
        renderer = self._follow(self._preview)
        if not renderer.run(1) and renderer.samples == 0:  # it was cancelled
            return
        self._offer(renderer, self._divider, rendered=time.perf_counter() - began)
        took = time.perf_counter() - began
        if built:
            return
        self._slow_previews = self._slow_previews + 1 if took > SLOW else 0
        if self._slow_previews == 2 and self._divider < DIVIDERS[-1]:
            fitting = self._divider * math.sqrt(took / SLOW)
            coarser = next((n for n in DIVIDERS if n >= fitting), DIVIDERS[-1])
            self._resize_preview(coarser, now=True)
            self._previews_left = 0
            return
        finer = finer_divider(self._divider, first_divider(self.scene))
        would_take = took * (self._divider / finer) ** 2
        fast = finer < self._divider and would_take < MUCH_FASTER * SLOW
        self._fast_previews = self._fast_previews + 1 if fast else 0
        if self._fast_previews >= FAST_PREVIEWS and not self._previews_left:  # not in a drag
            self._resize_preview(finer, now=True)

    def _make(self, scene: Scene, beside: Renderer | None = None, **more: Any) -> Renderer:
        """Return a renderer on the device, beside a former renderer."""
        others = beside, self._full.renderer, self._preview.renderer
        beside = next((renderer for renderer in others if isinstance(renderer, Renderer)), None)
        return Renderer(scene, self.device, beside=beside, **self._options, **more)

    def _make_whole(self, scene: Scene) -> Renderer:
        return self._whole(scene, denoise=self._limits)

    def _follow(self, target: Target) -> Renderer:
        """Return a target's renderer, of the present scene; tell viewers that it may take long."""
        if target.is_slow:
            self._tell(PREPARING)
        return target.follow(self.scene)

    def _resize_preview(self, divider: int, *, now: bool = False) -> None:
        """Let previews be of another size; now: not in a drag, by the kernels that there are."""
        former = self._preview
        self._divider, self._slow_previews, self._fast_previews = divider, 0, 0
        self._preview = preview = Target(self._make, smaller(divider))
        try:
            if now:
                small = preview.variant(self.scene)
                preview.renderer = self._make(small, beside=former.renderer)
        finally:
            former.close()

    def _render_pass(self) -> None:
        renderer = self._follow(self._full)
        if self._begins:
            self._begins, self.seconds, self._samples = False, 0.0, 0.0
            self._budget.restart()
        size = 1
        if self.seconds > 0.0:
            limit = max(PASS_SECONDS, min(PASS_SHARE * self.seconds, LONGEST_PASS))
            in_time = int(renderer.samples / self.seconds * limit)
            size = max(1, min(in_time, renderer.samples))
        size = min(size, max(1, self.scene.spp - renderer.samples))
        before = self.seconds

        def tell(progress: Progress) -> bool:
            self.seconds, self._samples = before + progress.seconds, progress.samples
            if self.seconds > 0.0:
                self._rates = progress.paths / self.seconds, progress.rays / self.seconds
            if time.perf_counter() - self._told > STATUS_SECONDS:
                self.tell(renderer)
            if self.has_shown and maker_of(renderer).shows_meanwhile:
                self.meanwhile()
                if self._stale:
                    self._offer(renderer, 1)
            return not self._closing

        finished = renderer.run(size, tell, noise=self.scene.noise)
        self._offered = False
        if not finished and renderer.samples == 0:  # it was discarded: this picture begins again
            self._begins = True
            return
        if self._errors.wants(self._samples):
            self._errors.note(renderer.film.get())

    def _offer(
        self, renderer: Renderer, divider: int, at_rest: bool = False, rendered: float = 0.0
    ) -> None:
        """Offer the picture as it is; rest: equal to `Renderer.resolve` to the byte.

        rendered: what a preview took [s].
        """
        began = time.perf_counter()
        pixels, legend = self._shown(renderer, whole=divider == 1)
        if divider == 1 and renderer is self._full.renderer:
            self.has_shown, self._film = True, None
        shown = None if legend is None else dataclasses.asdict(legend)
        took = {"samples": renderer.samples, "rendered": rendered}
        self._send(pixels, divider, at_rest=at_rest, legend=shown, **took)
        self._stale, self._offered = False, at_rest
        self._budget.spend(time.perf_counter() - began)
        self.tell(renderer)

    def _send(self, pixels: Bytes, divider: int, *, at_rest: bool = False, **facts: object) -> None:
        """Send a picture, with a header of its size and further `facts`."""
        data = pictures.png(pixels) if at_rest else pictures.jpeg(pixels)
        self._frame += 1
        film = self.scene.film
        header = {
            "frame": self._frame,
            "format": "png" if at_rest else "jpeg",
            "size": [pixels.shape[1], pixels.shape[0]],
            "film": [film.width, film.height],
            "crop": film.crop,
            "divider": divider,
            "samples": 0,
            "rest": at_rest,
            "solid": False,
            "difference": self._difference(),
            "changes": self._changes,
            "waited": self._waited,
            "rendered": 0.0,
            "shows": self.shows,
            "legend": None,
        }
        self.outlet.picture(header | facts, data)

    def _shown(self, renderer: Renderer, whole: bool) -> tuple[NDArray[np.uint8], Any]:
        """Return what a renderer has for the screen, and the legend of its colours or None."""
        if self.shows in renderer.scene.film.layers:
            return pictures.layer(self.shows, renderer.layers()[self.shows]), None
        if whole and self.shows == pictures.DENOISED:
            return pictures.denoised(renderer, self.display), None
        if whole and self.shows == pictures.SAMPLES:
            return pictures.samples(renderer.film.get())
        error_map = (
            self._errors.shown(renderer.film.get()) if self.shows == pictures.ERROR else None
        )
        if error_map is not None and whole:
            return error_map
        return pictures.shown(renderer, self.display), None

    def _difference(self) -> dict[str, float] | None:
        """Return the difference of the picture from the kept picture, if they are as large."""
        film = None if self.kept is None else self.film
        if self.kept is None or film is None or self.kept.shape != film.shape:
            return None
        kept, now = (picture[..., :3].astype(np.float64) for picture in (self.kept, film))
        error, mean = np.abs(now - kept), max(float(kept.mean()), 1e-30)
        return {
            "relative_mean": float(error.mean()) / mean,
            "relative_rms": float(np.sqrt((error**2).mean())) / mean,
            "bias": float((now - kept).mean()) / mean,
        }

    def tell(self, renderer: Renderer) -> None:
        """Tell all viewers how far the render is."""
        self._told = time.perf_counter()
        phase = "done" if self.done else "paused" if self.paused else "rendering"
        self._tell(
            {
                "type": "status",
                "phase": "moving" if self._previews_left else phase,
                "samples": 0 if self._begins else self._samples,
                "spp": self.scene.spp,
                "noise": self.scene.noise,
                "active": renderer.active,
                "seconds": round(self.seconds, 2),
                "samples_per_second": self._rates[0],
                "rays_per_second": self._rates[1],
            }
        )

    def _tell(self, status: dict[str, Any]) -> None:
        self.status = status
        self.outlet.message(status)


def first_divider(scene: Scene) -> int:
    """Return by how much the first preview of a scene is smaller."""
    width, height = scene.film.size
    fitting = (n for n in DIVIDERS if width * height / n**2 <= PREVIEW_PIXELS)
    return next(fitting, DIVIDERS[-1])


def finer_divider(divider: int, finest: int) -> int:
    """Return the next smaller divider, or `finest` where there is none above it."""
    return max([finest, *(n for n in DIVIDERS if n < divider)])
