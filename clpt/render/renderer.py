"""A renderer: a scene on a device, exposed step by step."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING

import pyopencl as cl

from clpt import device as dev
from clpt.render.film_renderer import OnProgress, next_range
from clpt.render.makers.contents import synchronized
from clpt.render.makers.device_film import DeviceFilm, open_device
from clpt.render.makers.maker import Call, DeviceMaker
from clpt.render.options import RenderOptions, check_options, check_scene
from clpt.render.progress import Progress
from clpt.render.resumable import ResumableRenderer
from clpt.scene import Scene

if TYPE_CHECKING:
    from typing_extensions import Unpack

log = logging.getLogger(__name__)


class Renderer(ResumableRenderer):
    """Renders a scene; its picture so far is available at any time.

    device: where to render, a name or index (see clpt.device.choose), or a clpt.device.Device.
    progress: called when a step has ended, in a thread of the driver. beside: another renderer, of
    a similar scene, such as the same in another size: shared parts are prepared once, so an array
    that both scenes have must hold the same values. in_turn: many scenes follow each other, so
    memory is kept for kinds of paths that come again; `beside` then gets the same shapes before
    each `update` of this renderer, which renders by its trees. options: see `RenderOptions`.

    It may be used from several threads, whose calls exclude each other. With `with`, `close`, or
    when it is dropped, it gives the device's memory back.

    Raises TypeError for a wrong type of scene, queue or option; SceneError for an invalid scene or
    option; DeviceError, MemoryBudgetError, KernelBuildError.
    """

    _maker: DeviceMaker

    def __init__(
        self,
        scene: Scene,
        device: dev.Device | str | int | None = None,
        *,
        progress: OnProgress | None = None,
        beside: Renderer | None = None,
        in_turn: bool = False,
        **options: Unpack[RenderOptions],
    ):
        check_scene(scene)
        check_options(scene, options)
        near = None if beside is None else beside._maker.home
        former = None if near is None else near.wavefront.scene.lowered
        on = open_device(device, options)
        home = DeviceFilm(scene, on, options, former=former, beside=near, in_turn=in_turn)
        super().__init__(DeviceMaker(home), home.denoise, options.get("first_sample", 0))
        self._progress_of_steps = progress

    @synchronized
    def step(self, samples: int = 1, wait_for: dev.Events = None) -> cl.Event:
        """Enqueue `samples` more of every pixel; `self.samples` is then the number of the next.

        Nothing is waited for or read: when the event that is returned has ended, `film` holds the
        picture. wait_for: events of the caller that come first. On an in-order queue whatever the
        caller enqueues next finds the picture.

        Raises SceneError for a number that is none, DeviceError if the driver refuses.
        """
        first, end = next_range(self.samples, samples)
        stream, call = self._wavefront.stream, Call(first, end)
        stream.after(wait_for)
        change, settle = self._adding("step", call)
        with change:
            self._maker.enqueue(call, self._known.adaptive)
            self._contents = settle(None)
        event = stream.last
        if self._progress_of_steps is not None:
            self._report_later(event, self._progress_of_steps)
        return event

    def _report_later(self, event: cl.Event, progress: OnProgress) -> None:
        """Call `progress` once the event has ended.

        An error of the caller is logged: nobody could catch it in a thread of the driver.
        """
        samples, start = self.samples, self._maker.start
        pixels = self._wavefront.paths.pixels

        def report(_: int) -> None:
            seconds = time.perf_counter() - start
            try:
                progress(Progress(samples, samples, samples * pixels, 0, seconds))
            except Exception:
                log.exception("the progress callback failed at %d samples", samples)

        event.set_callback(cl.command_execution_status.COMPLETE, report)
