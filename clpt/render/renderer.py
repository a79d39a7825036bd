"""A renderer: a scene on a device, exposed step by step."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pyopencl as cl

from clpt import device as dev
from clpt.render.film_renderer import next_range
from clpt.render.makers.contents import synchronized
from clpt.render.makers.device_film import DeviceFilm, open_device
from clpt.render.makers.device_maker import DeviceMaker
from clpt.render.makers.maker import Call
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
    a scene that has much in common with this one, such as the same in another size: what both need
    is prepared once, so an array that both have is to hold the same. options: see `RenderOptions`.

    It may be used from several threads: one method runs at a time. With `with`, `close`, or when it
    is dropped, it gives the device's memory back.

    Raises TypeError for what is no scene, queue or option; SceneError for a scene or an option that
    makes no sense; DeviceError, MemoryBudgetError, KernelBuildError.
    """

    _maker: DeviceMaker

    def __init__(
        self,
        scene: Scene,
        device: dev.Device | str | int | None = None,
        *,
        progress: Callable[[Progress], Any] | None = None,
        beside: Renderer | None = None,
        **options: Unpack[RenderOptions],
    ):
        check_scene(scene)
        check_options(scene, options)
        former = None if beside is None else beside._maker.home.wavefront.scene.lowered
        home = DeviceFilm(scene, open_device(device, options), options, former=former)
        super().__init__(DeviceMaker(home), home.denoise, options.get("first_sample", 0))
        self._progress_of_steps = progress

    @synchronized
    def step(self, samples: int = 1, wait_for: dev.Events = None) -> cl.Event:
        """Enqueue `samples` more of every pixel; `self.samples` is then the next one's number.

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

    def _report_later(self, event: cl.Event, progress: Callable[[Progress], Any]) -> None:
        """Call `progress` once the event has ended.

        What the caller then raises is logged: in a thread of the driver nobody could catch it.
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
